"""Curves and tables of errors, their files."""
