"""Which blocks run each move of the CL file."""
