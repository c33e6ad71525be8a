"""Smoothing of CL points within a tolerance of tip and axis."""
