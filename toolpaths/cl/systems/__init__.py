"""Toolpaths of systems that write no APT text: each form as the statements of a CL file, with the lines of its own file."""
