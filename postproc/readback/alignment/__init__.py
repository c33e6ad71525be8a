"""Motion against the CL file, bounds, checks."""
