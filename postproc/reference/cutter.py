"""What of a cutter matters when its axis is turned: where the tool ends in a ball, or in a corner round a flat, it can touch
the surface at the same point along another axis."""

from __future__ import annotations

from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Tool

_SAME = 1e-6
"""relative difference of corner radius and half the diameter that still is a ball"""
_APT = 7
"""parameters of CUTTER; fewer follow other conventions"""


@dataclass(frozen=True)
class CutterEnd:
    """The end of a mill: `flat`, mm from its axis to the centre of its corner, and `corner`, mm, the radius of that; a ball
    has no flat, a flat end no corner, a toroid both."""

    flat: float
    corner: float


def cutter_end(tool: Tool | None) -> CutterEnd | None:
    """The end of a mill; None of drills and taps, of ends that are no flat within a corner, and where the file does not say.

    CUTTER/d, r, e, f, a, b, h: the corner's centre is e from the axis and f above the tip; a is 0 where the end is flat.
    Of CUTTER/d, r the centre is d/2 - r from the axis, and r above the tip.
    """
    if tool is None or tool.diameter is None or tool.corner_radius is None or tool.diameter <= 0.0:
        return None
    radius, half = tool.corner_radius, 0.5 * tool.diameter
    flat, above, slope = _corner(tool, radius, half)
    if _makes_holes(tool) or slope or radius < 0.0 or flat < -_SAME * half or abs(above - radius) > _SAME * half:
        return None
    return CutterEnd(flat if flat > _SAME * half else 0.0, radius)


def _makes_holes(tool: Tool) -> bool:
    return "DRILL" in tool.shape.upper() or "TAP" in tool.shape.upper()


def _corner(tool: Tool, radius: float, half: float) -> tuple[float, float, float]:
    """(mm from the axis to the centre of the corner, mm above the tip, degrees that the end slopes by)."""
    if len(tool.cutter) == _APT and (tool.cutter[2] or tool.cutter[3]):
        return tool.cutter[2], tool.cutter[3], tool.cutter[4]
    return half - radius, radius, 0.0


def ball_radius(tool: Tool | None) -> float | None:
    """Radius of a ball-end mill in mm; 0 for cutters that are known to be of another form, None where the file does not say.

    A cutter with corner radius D/2 is a ball; one with a smaller corner radius has a flat end, and turning it
    moves the contact. Where the file gives all seven parameters of APT (CUTTER/d, r, e, f, a, b, h), e and f
    decide, the place of the corner's centre next to the axis and above the tip: the diameter of a tapered
    ball is not twice its radius.
    """
    if tool is None or tool.diameter is None:
        return None
    if _makes_holes(tool):
        return 0.0
    if tool.corner_radius is None:
        return None
    radius, half = tool.corner_radius, 0.5 * tool.diameter
    flat, above, _ = _corner(tool, radius, half)
    off = max(abs(flat), abs(above - radius))
    return radius if half > 0.0 and radius > 0.0 and off <= _SAME * radius else 0.0
