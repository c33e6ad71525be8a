"""A second witness of every program: its own reading of CL file and machine file, nothing of the project's own."""
