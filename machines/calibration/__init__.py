"""Calibration: from measurements to an error model with its uncertainty."""
