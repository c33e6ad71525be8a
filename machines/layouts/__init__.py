"""Dimensions of a new machine on legs: the best of a layout for a box, and its machine file."""
