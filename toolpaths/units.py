"""Conversion at the border: inside the program lengths are mm, angles rad, times s."""

from __future__ import annotations

import math

MM_PER_INCH = 25.4
MM_PER_FOOT = 304.8
DEG = math.pi / 180.0
"""Radians per degree."""
PER_MINUTE = 1.0 / 60.0
"""mm/s per mm/min, rev/s per rev/min."""
