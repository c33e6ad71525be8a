"""Characters to canonical words, modal state."""
