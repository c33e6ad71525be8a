"""Tool axes of one pass, timed and ranked."""
