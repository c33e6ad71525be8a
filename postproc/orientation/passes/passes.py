"""Passes of a toolpath as the choice of orientations sees them: one tool axis each, or fixed and why."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.options import Options
from postproc.feedrate.feed import StepFeed
from postproc.orientation.passes.contact import Contact, contact_of
from postproc.orientation.passes.drilling_time import Drilled, drilled_of
from postproc.orientation.passes.surface import Surface, surface_of
from postproc.path.links import SafeSpace, safe_space
from postproc.planning.geometry_sites import sites
from postproc.planning.pass_geometry import chains, stops_of
from postproc.reference.cutter import ball_radius
from postproc.reference.events import tool_changes
from postproc.reference.largest_feed import limited_feeds
from postproc.reference.moves import Moves, build_moves
from postproc.reference.tool_numbers import numbered
from postproc.setup.model import Placement, SetupFile, part_placement
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, Severity, error, has_errors
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all
from toolpaths.toolpath import Kind, Role, Toolpath
from toolpaths.units import DEG

SPINS = (0.0, *(sign * angle * DEG for angle in (20.0, 40.0, 60.0) for sign in (1.0, -1.0)))
"""rad, turns of the tool about itself that are tried where the set-up leaves them open"""
TURNS = 1e-6
"""rad: axes that differ by less are one"""


@dataclass(frozen=True)
@arrays(s="N", tip="N 3", axis="N 3")
class CuttingStretch:
    """Cutting motion from stop to stop: sites s (N,), the smoothed tip and axis (N, 3) there, and the feed along s."""

    s: Floats
    tip: Floats
    axis: Floats
    feed: StepFeed

    @property
    def length(self) -> float:
        """mm"""
        return float(self.s[-1] - self.s[0])

    def directions(self) -> dict[str, Floats]:
        """Unit feed directions (3,): that of the chord ("mean"), and where the stretch begins and ends (section IV.D)."""
        travels = {"mean": self.tip[-1] - self.tip[0], "initial": self.tip[1] - self.tip[0],
                   "final": self.tip[-1] - self.tip[-2]}
        return {name: travel / size for name, travel in travels.items() if (size := float(np.linalg.norm(travel))) > 0.0}


@dataclass(frozen=True)
@arrays(tip="n 3", axes="n 3", rapid="n", axis="3")
class Pass:
    """Motion that is turned as a whole: rapids, then cuts with one tool axis, in the table frame.

    Attributes:
        number: 0, 1, ... in the order of the file
        rows: [first, last) of Moves
        tip, axes (n, 3): end poses of these rows
        rapid (n,): rows that are rapids
        axis (3,): the tool axis of the CL file
        contact: where the surface normal is known
        radius: of the ball, mm
        fixed: why the axis cannot be turned, "" where it can
        spins: the pass may be turned about its tool axis, whatever the cutter
        by_home: the tool comes from home (first pass, tool change, GOHOME)
        tool: index into Toolpath.tools
        drilled: what is cut in holes
        cutting_force: N at the tip, as the set-up has it of the tool
        operation: name of that of its first cut
    """

    number: int
    rows: tuple[int, int]
    tip: Floats
    axes: Floats
    rapid: Bools
    axis: Floats
    contact: Contact
    radius: float
    fixed: str
    spins: bool
    by_home: bool
    tool: int
    kin: Kinematics
    stretches: tuple[CuttingStretch, ...]
    line: int
    drilled: Drilled
    cutting_force: float = 0.0
    operation: str = ""

    def shift(self, axis: Floats) -> Floats:
        """(3,) by which the tip moves so that the ball stays where it is: tip' = tip + R (axis - axis')."""
        return np.asarray(self.radius * (self.axis - axis))

    @property
    def normal(self) -> Floats:
        """Surface normals (K, 3) that are known in this pass."""
        return self.contact.normal

    @property
    def turns(self) -> bool:
        """True where the tool axis turns within the pass."""
        return bool((angle_between(self.axes, self.axis[None]) > TURNS).any())

    @property
    def longest(self) -> CuttingStretch | None:
        """The stretch that decides about directions."""
        return max(self.stretches, key=lambda one: one.length, default=None)


@dataclass(frozen=True)
class PassContext:
    """A toolpath on a machine, cut into passes; `moves` and the part as a mesh, `surface`, in the table frame."""

    toolpath: Toolpath
    machine: Machine
    setup: SetupFile
    placement: Placement
    moves: Moves
    space: SafeSpace
    passes: tuple[Pass, ...]
    surface: Surface | None = None


def work_of(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options,
            turning: bool = True) -> tuple[PassContext | None, list[Diagnostic]]:
    """The passes of a toolpath on a machine; errors where a pass could be turned but its cutter is not known.

    Where none will be turned (`turning` False) the form of the cutter does not matter. A machine that can turn the tool
    about itself is seen with branches for the spins that the set-up allows (`[joints] spin`).
    """
    machine = _with_spins(machine, setup)
    placement, found = part_placement(setup, options.setup)
    if placement is None:
        return None, found
    if not bool((toolpath.role != Role.START).any()):
        return None, [error("orient.no_motion", "the file commands no motion", file=toolpath.file,
                            hint="it needs GOTO records")]
    toolpath, more = numbered(toolpath, setup, options.setup)
    found += [d for d in more if d.severity is Severity.ERROR]
    moves, more = build_moves(toolpath, setup, options.axis_tolerance * DEG)
    if has_errors([*found, *more]):
        return None, [*found, *more]
    moves = limited_feeds(moves, toolpath, machine.largest_feed)[0].placed(placement)
    normals = None if toolpath.normal is None else placement.directions(toolpath.normal)[moves.row]
    surface, faults = surface_of(setup, placement, options.tolerance, options.setup) if turning else (None, [])
    if has_errors(faults):
        return None, [*found, *more, *faults]
    by_home = [e.index for e in toolpath.events if e.word == "GOHOME"] + [c.index for c in tool_changes(toolpath)]
    cutting = _Cutting(toolpath, moves, moves.curves(), normals, surface, machine, setup,
                       frozenset({0, *np.searchsorted(moves.row, by_home).tolist()}),
                       _stretches(toolpath, moves, Tolerance(options.tolerance, options.axis_tolerance * DEG)))
    passes = [_pass(number, rows, cutting)
              for number, rows in enumerate(pairwise([*_beginnings(toolpath, moves).tolist(), len(moves)]))]
    unknown = _unknown_cutters(toolpath, passes) if turning else []
    work = PassContext(toolpath, machine, setup, placement, moves, safe_space(moves, setup, placement),
                       tuple(passes), surface)
    return (None if unknown else work), [*found, *more, *faults, *unknown]


def _with_spins(machine: Machine, setup: SetupFile) -> Machine:
    asked = setup.joints.spin
    spins = SPINS if asked in ("needed", "planned") else () if asked == "zero" else (float(asked) * DEG,)
    spun = machine.kinematics.with_spins(spins) if spins else machine.kinematics
    return machine if spun is machine.kinematics else replace(machine, kinematics=spun)


@dataclass(frozen=True)
@arrays(normals="M 3")
class _Cutting:
    """What all passes are cut from: moves in the table frame, normals (M, 3) of the file at their ends, NaN for none.

    Attributes:
        homes: rows that the tool comes to from home
        stretches: by the first row of their cut
    """

    toolpath: Toolpath
    moves: Moves
    curves: Curves
    normals: Floats | None
    surface: Surface | None
    machine: Machine
    setup: SetupFile
    homes: frozenset[int]
    stretches: dict[int, list[CuttingStretch]]

    def contact(self, cuts: Ints, radius: float) -> Contact:
        """Where the surface is known along the moves `cuts` of a ball: from the file, else from the part; 0 for no ball."""
        if self.normals is not None and bool(np.isfinite(self.normals[cuts]).any()):
            ends = np.stack((np.maximum(cuts - 1, 0), cuts), axis=1)
            return contact_of(self.curves.take(cuts), self.normals[ends], self.moves.line[ends])
        if self.surface is None or radius == 0.0 or not len(cuts):
            return Contact.none()
        return self.surface.contact(self.curves.take(cuts), self.moves.line[cuts], radius)


def _beginnings(toolpath: Toolpath, moves: Moves) -> Ints:
    """First rows of Moves of the passes: the first, and each rapid behind a cut that a cut follows; others go on.

    Rapids that still have another axis than the cuts they lead to belong to the pass before.
    """
    rapid = (moves.kind == Kind.RAPID) & (moves.hole < 0)
    again = rapid & np.append(False, np.diff(toolpath.pass_[moves.row]) != 0)
    cut = np.flatnonzero(~rapid)
    first = np.flatnonzero(again)
    first = first[(first > cut[:1].min(initial=len(moves))) & (first < cut[-1:].max(initial=0))]
    leads = cut[np.searchsorted(cut, first)]
    rows = np.arange(len(moves))
    ahead = cut[np.minimum(np.searchsorted(cut, rows), len(cut) - 1)] if len(cut) else rows
    other = np.maximum.accumulate(np.where(angle_between(moves.axis, moves.axis[ahead]) > TURNS, rows, -1))
    return np.append(0, np.clip(other[leads] + 1, first, leads))


def _stretches(toolpath: Toolpath, moves: Moves, tolerance: Tolerance) -> dict[int, list[CuttingStretch]]:
    """Stretches of each unbroken cut, by its first row of Moves."""
    found = chains(moves, stops_of(toolpath, moves))
    if not found:
        return {}
    rows = np.concatenate([np.arange(first, last) for first, last in found])
    begin = np.concatenate(([0], np.cumsum([last - first for first, last in found])))
    smoothed = smooth_all(moves.curves().take(rows), begin, tolerance)
    return {first: _cut(one, moves, np.arange(first, last)) for (first, last), one in zip(found, smoothed, strict=True)
            if one is not None}


def _cut(path: Smooth, moves: Moves, rows: Ints) -> list[CuttingStretch]:
    """A smoothed chain from stop to stop."""
    travel = np.diff(path.s)
    moving = travel > 0.0
    feed = np.where(np.isnan(moves.feed[rows]), travel / moves.seconds[rows], moves.feed[rows])[moving]
    edges = np.append(path.s[0], path.s[1:][moving])
    result = []
    for low, high in pairwise(np.unique(np.concatenate((path.s[:1], path.stops, path.s[-1:]))).tolist()):
        s = sites(path, low, high)
        tip, axis = path.at(s)
        result.append(CuttingStretch(s, tip, axis, StepFeed(edges, feed)))
    return result


def _pass(number: int, rows: tuple[int, int], of: _Cutting) -> Pass:
    here, moves = slice(*rows), of.moves
    cuts = rows[0] + np.flatnonzero(moves.kind[here] != Kind.RAPID)
    lead = int(cuts[0]) if len(cuts) else rows[0]
    axis, tool = moves.axis[lead], int(moves.tool[lead])
    known = of.toolpath.tools[tool] if tool >= 0 else None
    radius = ball_radius(known)
    length = of.setup.tools.get(str(known.number if known else 0))
    kin = of.machine.kinematics.with_tool(length.length if length else 0.0)
    inside = [one for first in range(*rows) for one in of.stretches.get(first, ())]
    stays = _kept(of, cuts) or _fixed(moves, rows, cuts - rows[0], axis)
    fixed = stays or _by_cutter(radius)
    contact = of.contact(cuts, 0.0 if fixed else radius or 0.0)
    return Pass(number, rows, moves.tip[here], moves.axis[here], moves.kind[here] == Kind.RAPID, axis, contact,
                radius or 0.0, fixed, not stays, not of.homes.isdisjoint(range(*rows)), tool, kin, tuple(inside),
                int(moves.line[lead]), drilled_of(of.toolpath, moves, rows), length.cutting_force if length else 0.0,
                of.toolpath.operations[int(of.toolpath.operation[moves.row[lead]])].name)


def _kept(of: _Cutting, cuts: Ints) -> str:
    """Why the set-up keeps the axis of a pass, "" where it does not."""
    operations = of.toolpath.operations
    inside = [operations[k].name for k in np.unique(of.toolpath.operation[of.moves.row[cuts]]).tolist()]
    kept = next((name for name in inside if name in of.setup.orientation.fixed_operations), None)
    return "" if kept is None else f"the set-up keeps the axis of operation {kept!r}"


def _fixed(moves: Moves, rows: tuple[int, int], cuts: Ints, axis: Floats) -> str:
    """Why a pass stays as it is, whatever its cutter; "" where it need not."""
    here = slice(*rows)
    if not len(cuts):
        return "nothing is cut"
    if bool((moves.hole[here] >= 0).any()):
        return "drilling: the axis is that of the hole"
    if bool((angle_between(moves.axis[here], axis[None]) > TURNS).any()):
        return TURNING
    if bool((moves.tool[here][cuts] != moves.tool[here][cuts[0]]).any()) or moves.kind[rows[0]] != Kind.RAPID:
        return "no rapid leads to it on which the tool could turn"
    if rows[1] < len(moves) and moves.kind[rows[1]] != Kind.RAPID:
        return "the cut after it begins where it ends, without a rapid"
    return ""


def _by_cutter(radius: float | None) -> str:
    """Why the axis of a pass is fixed by its cutter; "" where it may be turned."""
    if radius is None:
        return UNKNOWN
    return "the cutter is not a ball: turned, it would touch elsewhere" if radius == 0.0 else ""


TURNING = "the tool axis turns within the pass"
UNKNOWN = "the form of the cutter is not known"


def _unknown_cutters(toolpath: Toolpath, passes: list[Pass]) -> list[Diagnostic]:
    """A pass whose cutter the file does not describe is no guess."""
    bad = [one for one in passes if one.fixed == UNKNOWN]
    if not bad:
        return []
    tools = sorted({toolpath.tools[one.tool].number if one.tool >= 0 else 0 for one in bad})
    names = ", ".join(f"T{n}" for n in tools)
    return [error("orient.cutter", f"diameter or corner radius of {names} is not in the CL file: re-orienting "
                  "keeps the contact of a ball of known radius", file=toolpath.file,
                  lines=[one.line for one in bad][:6], count=len(bad),
                  hint="state the cutter (CUTTER/16,8 or TLDATA), or keep the orientation (--orient keep)")]
