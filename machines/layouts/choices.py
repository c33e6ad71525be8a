"""Closed words of the search for dimensions."""

from __future__ import annotations

from typing import Literal

SlideLayout = Literal["parallel-z", "cone", "star"]
"""three slides 120 degrees apart: along z, 30 degrees outwards from it, square to it (annex C of Company 2000)"""
Goal = Literal["condition", "bulk", "speed", "rod"]
"""condition number, largest extent across z of what moves, drive speed per speed of the platform, length of the rods"""
