"""The machine with errors, corrected commands."""
