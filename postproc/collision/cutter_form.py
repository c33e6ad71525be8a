"""The form of a cutter as CL file and set-up say it: point, corner and side, as pieces of revolution.

Its lower line rises from the tip at an angle to the tip plane, its side leans by the taper against the axis;
both meet at half the diameter, and the corner touches both (APT, CUTTER/d, r, e, f, a, b, h: centre of the
corner e next to the axis and f over the tip, angles a and b, height h; ISO 4343).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.reference.cutter import ball_radius
from postproc.setup.bodies import ToolBody
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Tool
from toolpaths.units import DEG

_APT = 7
"""parameters of CUTTER; fewer follow other conventions"""
_ROUGH = 0.01
"""mm by which rounded sizes of one form may differ"""
_STEEP = 89.0 * DEG
"""an angle from which on a line is no side or point"""
_LEAST = 0.1
"""of the diameter: height of a side whose end nobody states"""


@dataclass(frozen=True)
class Cutter:
    """mm, rad; None where nobody says."""

    diameter: float | None
    corner: float | None
    point: float
    """between the lower line and the tip plane"""
    taper: float
    centre: tuple[float, float] | None
    """of the corner, next to the axis and over the tip; None where the sizes fit no form"""
    flutes: float | None
    drawn: float | None
    """height as CAM draws it"""
    drill: bool
    flattened: bool
    """has a point that counts as flat"""

    @property
    def height(self) -> float:
        """To the end of the side, over the tip."""
        low = 0.0 if self.centre is None else self.centre[1] - (self.corner or 0.0) * float(np.sin(self.taper))
        stated = self.flutes if self.flutes is not None else self.drawn
        return max(low, stated) if stated is not None else low + _LEAST * (self.diameter or 0.0)


def stated_cutter(tool: Tool | None, given: ToolBody) -> Cutter:
    """What is known of a cutter; what the set-up states, `given`, takes precedence over the CL file."""
    tool = tool or Tool(0)
    drill = "DRILL" in tool.shape.upper() or given.tip_angle is not None
    seven = tool.cutter if len(tool.cutter) == _APT else (0.0,) * _APT
    whole = replace(tool, diameter=_first(given.diameter, tool.diameter), cutter=tool.cutter if _same(tool, given) else (),
                    corner_radius=_first(given.corner_radius, tool.corner_radius))
    corner = 0.0 if drill and given.corner_radius is None else whole.corner_radius
    taper = given.taper * DEG if given.taper is not None else _first(None if drill else tool.taper, seven[5] * DEG)
    point = _point(tool, given, drill, seven[4] * DEG)
    ball = not drill and (ball_radius(whole) or 0.0) > 0.0
    made = Cutter(whole.diameter, corner, 0.0 if ball else point, taper or 0.0, None,
                  _first(given.flute_length, tool.flute_length), _first(seven[6] or None, tool.length or None), drill,
                  not drill and not point and (tool.tip_angle or 0.0) > 0.0)
    return replace(made, centre=_centre(made, whole.cutter, ball))


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)


def _same(tool: Tool, given: ToolBody) -> bool:
    """True where the place of the corner's centre in the CL file is that of the cutter of the set-up too."""
    said = ((given.diameter, tool.diameter), (given.corner_radius, tool.corner_radius))
    params = len(tool.cutter) == _APT and all(
        own is not None and abs(own - other) <= _ROUGH
        for own, other in zip((tool.diameter, tool.corner_radius), tool.cutter, strict=False))
    return (params and given.taper is None and given.tip_angle is None
            and all(own is None or (other is not None and abs(own - other) <= _ROUGH) for own, other in said))


def _point(tool: Tool, given: ToolBody, drill: bool, stated: float) -> float:
    """Angle (rad) of the lower line over the tip plane; flat, which holds every point, where it is none."""
    tip = given.tip_angle * DEG if given.tip_angle is not None else tool.tip_angle if drill else None
    angle = stated if tip is None else 0.5 * (np.pi - tip)
    return float(angle) if 0.0 < angle < _STEEP else 0.0


def _centre(cutter: Cutter, params: tuple[float, ...], ball: bool) -> tuple[float, float] | None:
    """Of the corner, mm; None where the sizes fit no form, as those of barrels and lenses.

    e = d/2 - r (cos a - sin b) / cos(a + b), f = (r + e sin a) / cos a. A file may state e and f itself, and
    count the diameter of a tapered cutter next to the centre: e = d/2 - r.
    """
    if cutter.diameter is None or abs(cutter.taper) >= _STEEP or cutter.point + cutter.taper >= _STEEP:
        return None
    half, r, a, b = 0.5 * cutter.diameter, cutter.corner or 0.0, cutter.point, cutter.taper
    plain, own = half - r, half - r * float((np.cos(a) - np.sin(b)) / np.cos(a + b))
    stated = (0.0, r) if ball else params[2:4] if any(params[2:4]) else (own, float((r + own * np.sin(a)) / np.cos(a)))
    e, f = stated
    if abs(f * np.cos(a) - e * np.sin(a) - r) > _ROUGH:
        if max(abs(e - plain), abs(f - r)) > _ROUGH:
            return None
        e, f = own, float((r + own * np.sin(a)) / np.cos(a))
    fits = min(plain, own) - _ROUGH <= e <= max(plain, own) + _ROUGH and e >= -_ROUGH
    made = replace(cutter, centre=(max(e, 0.0), f))
    return made.centre if fits and e + r * np.cos(b) + np.tan(b) * (made.height - f + r * np.sin(b)) >= 0.0 else None


def cutter_pieces(cutter: Cutter) -> Floats:
    """Pieces (P, 5) of the cutter, see `revolution`: its point, its corner, and the side above; a cylinder or
    cone round it where its sizes fit no form."""
    if cutter.diameter is None:
        return np.zeros((0, 5))
    slope = float(np.tan(cutter.taper)) if abs(cutter.taper) < _STEEP else 0.0
    if cutter.centre is None:
        half = 0.5 * cutter.diameter
        return np.array([(half, 0.0, half + max(slope, 0.0) * cutter.height, cutter.height, 0.0)])
    (e, f), r, a, b = cutter.centre, cutter.corner or 0.0, cutter.point, cutter.taper
    start, low = e + r * np.cos(b), f - r * np.sin(b)
    rows = [(0.0, 0.0, e + r * np.sin(a), f - r * np.cos(a), 0.0)] if a > 0.0 else []
    rows += [(e, f, e, f, r)] if r > 0.0 else []
    return np.array([*rows, (start, low, start + slope * (cutter.height - low), cutter.height, 0.0)])
