"""What of a cutter matters when its axis is turned: a ball keeps its contact, any other form does not."""

from __future__ import annotations

from toolpaths.toolpath import Tool

_SAME = 1e-6
"""relative difference of corner radius and half the diameter that still is a ball"""
_APT = 7
"""parameters of CUTTER; fewer follow other conventions"""


def ball_radius(tool: Tool | None) -> float | None:
    """Radius of a ball-end mill in mm; 0 for cutters that are known to be of another form, None where the file does not say.

    A cutter with corner radius D/2 is a ball; one with a smaller corner radius has a flat end, and turning it
    moves the contact. Where the file gives all seven parameters of APT (CUTTER/d, r, e, f, a, b, h), e and f
    decide, the place of the corner's centre next to the axis and above the tip: the diameter of a tapered
    ball is not twice its radius.
    """
    if tool is None or tool.diameter is None:
        return None
    if "DRILL" in tool.shape.upper() or "TAP" in tool.shape.upper():
        return 0.0
    if tool.corner_radius is None:
        return None
    radius, half = tool.corner_radius, 0.5 * tool.diameter
    adjacent, above = tool.cutter[2:4] if len(tool.cutter) == _APT else (0.0, 0.0)
    off = max(abs(adjacent), abs(above - radius)) if adjacent or above else abs(radius - half)
    return radius if half > 0.0 and radius > 0.0 and off <= _SAME * radius else 0.0
