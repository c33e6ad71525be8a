"""Plans over all passes, the choice."""
