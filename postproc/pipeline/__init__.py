"""The table of stages; convert, verify, choose_axes."""
