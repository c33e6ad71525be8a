"""3+2 passes, their limits and poses."""
