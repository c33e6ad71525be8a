"""A new set-up file: what the CL file and the machine state, what is asked, a place of the part that fits."""
