"""A part that is not where it was meant: measured, placed again, and what that does to its program."""
