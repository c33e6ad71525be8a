"""What of a cutter matters when its axis is turned: a ball keeps its contact, any other form does not."""

from __future__ import annotations

from toolpaths.toolpath import Tool

_SAME = 1e-6
"""relative difference of corner radius and half the diameter that still is a ball"""


def ball_radius(tool: Tool | None) -> float | None:
    """Radius of a ball-end mill in mm; 0 for cutters that are known to be of another form, None where the file does not say.

    A cutter with corner radius D/2 is a ball; one with a smaller corner radius has a flat end, and turning it moves the
    contact.
    """
    if tool is None or tool.diameter is None:
        return None
    if "DRILL" in tool.shape.upper() or "TAP" in tool.shape.upper():
        return 0.0
    if tool.corner_radius is None:
        return None
    half = 0.5 * tool.diameter
    return half if half > 0.0 and abs(tool.corner_radius - half) <= _SAME * half else 0.0
