"""Closed words of the analysis."""

from __future__ import annotations

from typing import Literal

MapMeasure = Literal["condition", "conditioning", "manipulability", "speed", "force"]
"""measures of which there are maps and curves"""
MapNumber = Literal["x", "y", "z", "tilt"]
"""numbers of a place of the platform"""
