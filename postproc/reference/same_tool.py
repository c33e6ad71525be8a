"""Whether two tools of a CL file can be the same one."""

from __future__ import annotations

from toolpaths.toolpath import Tool

_SAME = 1e-6
"""mm or rad that sizes may differ by"""


def differ(a: Tool, b: Tool) -> bool:
    """True where a text or size of the cutting edge that both state is not the same."""
    pairs = ((a.diameter, b.diameter), (a.corner_radius, b.corner_radius), (a.tip_angle, b.tip_angle),
             (a.taper, b.taper))
    stated = [abs(x - y) > _SAME for x, y in pairs if x is not None and y is not None]
    names = a.name and b.name and a.name.upper() != b.name.upper() and not stated
    shapes = a.shape and b.shape and a.shape != b.shape
    return bool(names or shapes or any(stated))


def differ_in_length(a: Tool, b: Tool) -> bool:
    """True where a height that both state is not the same: of the cutter, of its flutes or its length register."""
    pairs = ((a.length, b.length), (a.flute_length, b.flute_length), (a.length_register, b.length_register))
    heights = [(a.cutter[6], b.cutter[6])] if len(a.cutter) > 6 and len(b.cutter) > 6 else []
    return any(abs(x - y) > _SAME for x, y in (*pairs, *heights) if x is not None and y is not None)
