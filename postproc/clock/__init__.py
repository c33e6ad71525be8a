"""A control as an executable model: commanded path in, motion by time out."""
