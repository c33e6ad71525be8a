"""Decides and writes: CL file in, proved G-code out."""
