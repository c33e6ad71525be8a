"""Tool orientation of positioned (3+2) passes, chosen for the least planned time."""
