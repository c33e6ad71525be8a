"""A page for each code of a diagnostic."""
