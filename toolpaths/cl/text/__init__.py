"""Characters and lines of CL files to statements, dialects, subprograms."""
