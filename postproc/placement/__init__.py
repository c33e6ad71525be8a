"""Where the part stands on the table, and how it is turned, for the least planned time."""
