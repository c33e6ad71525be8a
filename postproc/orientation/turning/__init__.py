"""Tool axes that turn along a pass, chosen for the least time."""
