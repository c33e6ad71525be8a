"""The form of a tool: pieces of revolution from the tip to the spindle, from the CL file and the set-up together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.collision.cutter_form import Cutter, cutter_pieces, stated_cutter
from postproc.collision.holder_hull import spun
from postproc.collision.mesh import load_mesh
from postproc.setup.bodies import HolderSection
from postproc.setup.model import ToolSetup
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, info, warning
from toolpaths.shapes import arrays
from toolpaths.toolpath import Tool
from toolpaths.units import DEG

CUTTER, SHANK, HOLDER = 0, 1, 2
PARTS = ("cutter", "shank", "holder")
_DIFFERS = 1e-3
"""mm: more is another cutter, or a gap"""
_ANY = ToolSetup(gauge_length=1.0)


@dataclass(frozen=True)
@arrays(pieces="P 5", part="P")
class ToolForm:
    """A tool's pieces (P, 5), see `revolution`, and which of PARTS each belongs to (P,).

    `exact` is False where the cutter's pieces are only round it: they determine nothing of how far it cuts into the part.
    """

    number: int
    pieces: Floats
    part: Ints
    exact: bool = True

    def of(self, part: int) -> Floats:
        """The pieces of cutter, shank or holder."""
        return np.asarray(self.pieces[self.part == part])


def tool_form(number: int, tool: Tool | None, setup: ToolSetup | None,
              file: str) -> tuple[ToolForm, list[Diagnostic]]:
    """What is known of a tool's form; what is not is reported, for it is not checked.

    Args:
        tool: as the CL file describes it
        setup: as the set-up does, which takes precedence
        file: the set-up file
    """
    given = setup or _ANY
    found = _differing(number, tool, given)
    cutter = stated_cutter(tool, given)
    pieces = {CUTTER: cutter_pieces(cutter)}
    placed = cutter.flutes is not None
    pieces[SHANK], at = _sections(given.shank if placed else [], cutter.flutes or 0.0)
    pieces[HOLDER], top = _sections(given.holder if placed else [], at)
    if given.holder_mesh is not None:
        mesh, more = load_mesh(Path(file).parent / given.holder_mesh, given.holder_units,
                               f"tools.{number}.holder_mesh")
        found += more
        if mesh is not None:
            pieces[HOLDER] = spun(np.asarray(mesh.vertices), np.asarray(mesh.edges_unique))
            top = float(pieces[HOLDER][:, 3].max())
    found += _unformed(number, cutter) + _unknown(number, cutter, setup, pieces, (at, top))
    found += stacked(number, setup, cutter.flutes) if setup is not None else []
    found = [replace(d, file=d.file or file) for d in found]
    rows = np.concatenate(list(pieces.values()))
    part = np.repeat(list(pieces), [len(rows) for rows in pieces.values()])
    return ToolForm(number, rows, part, cutter.centre is not None), found


def _sections(sections: list[HolderSection], at: float) -> tuple[Floats, float]:
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
                    "set-up counts",
                    hint=f"write {name} = {other:g} to [tools.{number}] where the CL file is right, else leave it")
            for name, own, other in said if own is not None and other is not None and abs(own - other) > _DIFFERS]


def _unformed(number: int, cutter: Cutter) -> list[Diagnostic]:
    """Where a cutter counts as another form than its own."""
    if cutter.diameter is None:
        return []
    found, key = [], f"to [tools.{number}]"
    if cutter.centre is None:
        found.append(warning("collision.corner", f"T{number}: a corner radius of {cutter.corner or 0.0:g} mm does not fit "
                             f"a diameter of {cutter.diameter:g} mm with a taper of {cutter.taper / DEG:g} degrees: the "
                             "cutter is not checked against the part, and counts as a cylinder or cone elsewhere",
                             hint=f"add diameter, corner_radius and taper of a cutter form that encloses it {key}"))
    if cutter.corner is None:
        found.append(warning("collision.corner", f"T{number}: its corner radius is not known, it is checked as sharp",
                             hint=f"add corner_radius = ... {key}"))
    if cutter.flattened:
        found.append(info("collision.point", f"T{number}: its point is taken as flat, which is larger than it is",
                          hint=f"add tip_angle = ... {key}"))
    return found


def _unknown(number: int, cutter: Cutter, setup: ToolSetup | None, pieces: dict[int, Floats],
             ends: tuple[float, float]) -> list[Diagnostic]:
    """What is not checked because nobody describes it; `ends` of shank and holder, mm over the tip."""
    missing, (at, top) = [], ends
    if cutter.diameter is None:
        missing.append(("the cutter", "diameter = ... and corner_radius = ..."))
    holder = float(pieces[HOLDER][:, 1].min()) if len(pieces[HOLDER]) else None
    if cutter.flutes is None:
        side = "the cutter's corner" if cutter.drawn is None else f"{cutter.height:g} mm over the tip"
        below = "" if holder is None else f" and below the holder at {holder:g} mm"
        missing.append((f"what stands above {side}{below}", "flute_length = ..." + (" and shank = [...]" if below else "")))
    elif holder is None:
        both = ("shank and holder", "shank = [{diameter = ..., length = ...}] and holder = [...]")
        one = ("the holder", "holder = [{lower = ..., upper = ..., length = ...}] or holder_mesh = \"...\"")
        missing.append(one if len(pieces[SHANK]) else both)
    elif holder > at + _DIFFERS:
        missing.append((f"what is between {at:g} mm over the tip and the holder, which begins at {holder:g} mm,",
                        "more sections of shank"))
    if holder is not None and setup is not None and top < setup.length - _DIFFERS:
        missing.append((f"what is between the holder, which ends {top:g} mm over the tip, and the gauge point at "
                        f"{setup.gauge_length:g} mm,", "more sections of holder"))
    return [warning("collision.unchecked", f"T{number}: {what} is not known and not checked", hint=f"state {key} in "
                    f"[tools.{number}]") for what, key in missing]


def stacked(number: int | str, given: ToolSetup, flutes: float | None) -> list[Diagnostic]:
    """Where flutes, shank and holder of a set-up do not fit its gauge length; a holder may go on beyond the gauge point."""
    found, holder = [], [one.length for one in given.holder]
    at = (flutes or 0.0) + sum(one.length for one in given.shank)
    last = at + sum(holder[:-1])
    if given.gauge_length is not None and last > given.gauge_length + _DIFFERS:
        found.append(warning("collision.stack", f"T{number}: the last section of {'its holder' if holder else 'its tool'} "
                             f"{'begins' if holder else 'ends'} {last:g} mm over the tip, above the gauge point at "
                             f"{given.gauge_length:g} mm: flutes, shank and holder are {at + sum(holder):g} mm long",
                             hint=f"lengths of tools.{number} are along its axis from the tip; or correct gauge_length"))
    if flutes is not None and holder and not given.shank:
        found.append(info("collision.shank", f"T{number}: no shank is stated: the holder begins at {flutes:g} mm, where the "
                          "flutes end", hint=f"state shank = [...] in [tools.{number}] where there is one"))
    return found


def lever_of(form: ToolForm) -> float:
    """mm from the tip to the farthest point of the tool."""
    r0, z0, r1, z1, c = form.pieces.T
    return float((np.maximum(np.hypot(r0, z0), np.hypot(r1, z1)) + c).max())
