"""Geometric errors corrected."""
