"""One CL file on one machine, ready to be solved or compared with."""
