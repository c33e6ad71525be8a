"""The form of a tool: pieces of revolution from the tip to the spindle, from the CL file and the set-up together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.collision.mesh import load_mesh
from postproc.collision.spun import spun
from postproc.orientation.cutter import ball_radius
from postproc.setup import ToolSetup
from postproc.setup_bodies import Section
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.toolpath import Tool
from toolpaths.units import DEG

CUTTER, SHANK, HOLDER = 0, 1, 2
PARTS = ("cutter", "shank", "holder")
_DIFFERS = 1e-3
"""mm: more is another cutter, or a gap"""
_ROUNDED = 0.01
"""share of the radius that a corner may be too large by: sizes of tapered balls are rounded"""
_APT = 7
"""parameters of CUTTER; fewer follow other conventions"""
_ANY = ToolSetup(gauge_length=1.0)


@dataclass(frozen=True)
class Form:
    """A tool's pieces (P, 5), see `revolution`, and which of PARTS each belongs to (P,)."""

    number: int
    pieces: Floats
    part: Ints

    def of(self, part: int) -> Floats:
        """The pieces of cutter, shank or holder."""
        return np.asarray(self.pieces[self.part == part])


@dataclass(frozen=True)
class _Cutter:
    """mm, rad; None where nobody says."""

    diameter: float | None
    corner: float | None
    taper: float
    tip_angle: float | None
    flutes: float | None
    drill: bool
    ball: bool

    @property
    def centre(self) -> float:
        """From the axis to the centre of the corner, mm; NaN where the corner does not fit the diameter.

        A side that is inclined by the taper meets the plane of the tip at half the diameter; the corner touches both
        (APT, CUTTER/d, r with e, f as they follow from the others). A tapered ball may be given by the diameter of its ball.
        """
        if self.ball or self.diameter is None:
            return 0.0
        radius, corner = 0.5 * self.diameter, self.corner or 0.0
        centre = radius - corner * (1.0 - float(np.sin(self.taper))) / float(np.cos(self.taper))
        return max(centre, 0.0) if centre >= -_ROUNDED * radius else np.nan

    @property
    def fits(self) -> bool:
        """Whether there is such a cutter."""
        return bool(np.isfinite(self.centre))


def tool_form(number: int, tool: Tool | None, setup: ToolSetup | None, file: str) -> tuple[Form, list[Diagnostic]]:
    """What is known of a tool's form; what is not is told, for it is not checked.

    Args:
        tool: as the CL file describes it
        setup: as the set-up does, which goes before it
        file: the set-up file
    """
    given = setup or _ANY
    found = _differing(number, tool, given)
    cutter = _cutter(tool, given)
    pieces = {CUTTER: _cutting(cutter)}
    placed = cutter.flutes is not None
    pieces[SHANK], at = _sections(given.shank if placed else [], cutter.flutes or 0.0)
    pieces[HOLDER], top = _sections(given.holder if placed else [], at)
    if given.holder_mesh is not None:
        mesh, more = load_mesh(Path(file).parent / given.holder_mesh, given.holder_units, f"tools.{number}.holder_mesh")
        found += more
        if mesh is not None:
            pieces[HOLDER] = spun(np.asarray(mesh.vertices), np.asarray(mesh.edges_unique))
            top = float(pieces[HOLDER][:, 3].max())
    found += _unknown(number, cutter, setup, pieces, top)
    found = [replace(d, file=d.file or file) for d in found]
    rows = np.concatenate(list(pieces.values()))
    return Form(number, rows, np.repeat(list(pieces), [len(rows) for rows in pieces.values()])), found


def _cutter(tool: Tool | None, given: ToolSetup) -> _Cutter:
    tool = _as_given(tool or Tool(0), given)
    drill = "DRILL" in tool.shape.upper() or given.tip_angle is not None
    tip = given.tip_angle * DEG if given.tip_angle is not None else tool.tip_angle if drill else None
    return _Cutter(tool.diameter, tool.corner_radius, 0.0 if drill and given.taper is None else tool.taper or 0.0, tip,
                   tool.flute_length, drill, (ball_radius(tool) or 0.0) > 0.0)


def _as_given(tool: Tool, given: ToolSetup) -> Tool:
    """The tool with what the set-up says of its cutter, else the taper of all seven parameters of CUTTER."""
    own = given.diameter is not None or given.corner_radius is not None
    params = () if own or len(tool.cutter) < _APT else tool.cutter
    taper = given.taper * DEG if given.taper is not None else _first(tool.taper, params[5] * DEG if params else None)
    return replace(tool, diameter=_first(given.diameter, tool.diameter), taper=taper, cutter=params,
                   corner_radius=_first(given.corner_radius, tool.corner_radius),
                   flute_length=_first(given.flute_length, tool.flute_length))


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)


def _cutting(cutter: _Cutter) -> Floats:
    """Pieces (P, 5) of the cutter: its corner, and the side above it up to the end of the flutes; sharp where the corner
    does not fit."""
    if cutter.diameter is None:
        return np.zeros((0, 5))
    radius, corner = 0.5 * cutter.diameter, (cutter.corner or 0.0) if cutter.fits else 0.0
    if cutter.tip_angle is not None:
        high = radius / np.tan(0.5 * cutter.tip_angle) if cutter.tip_angle < np.pi else 0.0
        rows = [(0.0, 0.0, radius, high, 0.0)] if high > 0.0 else []
        return np.array([*rows, _side(radius, high, 0.0, cutter.flutes)])
    sin, cos = np.sin(cutter.taper), np.cos(cutter.taper)
    centre = cutter.centre if corner > 0.0 else radius
    rows = [(centre, corner, centre, corner, corner)] if corner > 0.0 else []
    low, start = corner * (1.0 - sin), centre + corner * cos
    return np.array([*rows, _side(start, low, np.tan(cutter.taper), cutter.flutes)])


def _side(radius: float, low: float, slope: float, flutes: float | None) -> tuple[float, float, float, float, float]:
    """A cone from height `low` to the end of the flutes; a disc where nobody knows their length."""
    high = max(flutes or low, low)
    return (radius, low, radius + slope * (high - low), high, 0.0)


def _sections(sections: list[Section], at: float) -> tuple[Floats, float]:
    """Pieces (P, 5) of cylinders and cones from height `at` upwards, and the height where they end."""
    rows = []
    for one in sections:
        rows.append((one.radii[0], at, one.radii[1], at + one.length, 0.0))
        at += one.length
    return np.array(rows).reshape(-1, 5), at


def _differing(number: int, tool: Tool | None, given: ToolSetup) -> list[Diagnostic]:
    """Where set-up and CL file do not say the same of a cutter."""
    if tool is None:
        return []
    said = [(name, getattr(given, name), getattr(tool, name)) for name in ("diameter", "corner_radius", "flute_length")]
    return [warning("collision.cutter", f"T{number}: {name} is {own:g} mm in the set-up, {other:g} mm in the CL file; the "
                    "set-up counts", hint=f"tools.{number}.{name}")
            for name, own, other in said if own is not None and other is not None and abs(own - other) > _DIFFERS]


def _unknown(number: int, cutter: _Cutter, setup: ToolSetup | None, pieces: dict[int, Floats],
             top: float) -> list[Diagnostic]:
    """What is not checked because nobody describes it."""
    missing = []
    if cutter.diameter is None:
        missing.append(("the cutter", "diameter = ... and corner_radius = ..."))
    if cutter.flutes is None:
        missing.append(("what stands above the cutter's corner", "flute_length = ..."))
    elif not len(pieces[SHANK]) and not len(pieces[HOLDER]):
        missing.append(("shank and holder", "shank = [{diameter = ..., length = ...}] and holder = [...]"))
    elif not len(pieces[HOLDER]):
        missing.append(("the holder", "holder = [{lower = ..., upper = ..., length = ...}] or holder_mesh = \"...\""))
    elif setup is not None and top < setup.gauge_length - _DIFFERS:
        missing.append((f"what is between the holder, which ends {top:g} mm over the tip, and the gauge point at "
                        f"{setup.gauge_length:g} mm,", "more sections to holder"))
    found = [warning("collision.unchecked", f"T{number}: {what} is not known and not checked", hint=f"add {key} to "
                     f"[tools.{number}]") for what, key in missing]
    if cutter.diameter is not None and not cutter.drill and (cutter.corner is None or not cutter.fits):
        why = "its corner radius is not known" if cutter.corner is None else (
            f"a corner radius of {cutter.corner:g} mm does not fit a diameter of {cutter.diameter:g} mm")
        found.append(warning("collision.corner", f"T{number}: {why}, it is checked as sharp",
                             hint=f"add diameter and corner_radius = ... to [tools.{number}]"))
    return found


def lever_of(form: Form) -> float:
    """mm from the tip to the farthest point of the tool."""
    r0, z0, r1, z1, c = form.pieces.T
    return float((np.maximum(np.hypot(r0, z0), np.hypot(r1, z1)) + c).max())
