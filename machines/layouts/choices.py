"""Closed words of the search for dimensions."""

from __future__ import annotations

from typing import Literal

SlideLayout = Literal["parallel-x", "parallel-z", "coplanar", "star", "perpendicular", "hybrid", "cone", "rotary-delta"]
"""of annex C of Company 2000: three slides along x (C.1.1), along z (C.1.2), along x in one plane (C.2.1), square to z
through one point (C.2.2), along x, y and z (C.3), two along x and one along z (C.4), 30 degrees outwards from z (C.5);
three cranks (V.6.2.1)"""
Goal = Literal["condition", "bulk", "width", "speed", "rod"]
"""condition number, larger and smaller extent across z of what moves, drive speed per speed of the platform, length of the
rods"""
