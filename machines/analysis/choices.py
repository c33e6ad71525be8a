"""Closed words of the analysis."""

from __future__ import annotations

from typing import Literal

MapMeasure = Literal["condition", "conditioning", "manipulability", "speed", "force", "acceleration", "rod-force",
                     "rod-moment", "rod-inertia"]
"""measures of which there are maps and curves"""
MapNumber = Literal["x", "y", "z", "tilt"]
"""numbers of a place of the platform"""
SizeNumber = Literal["rod", "radius", "offset"]
"""sizes that a curve may be drawn against, mm: length of all rods, distance of all drives from the z axis, height of the
centre of mass above the platform's reference point"""
