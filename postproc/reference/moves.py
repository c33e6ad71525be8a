"""The motion that the CL file asks for, spelt out: feeds resolved, cycles expanded, linking moves marked.

This is the reference that output is made from and that read-back compares with.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics.frames import spin_about, tool_x
from postproc.controllers.cycles import Cycles
from postproc.reference.events import tool_changes
from postproc.reference.holes import HoleLeg, hole_legs
from postproc.reference.holes import Phase as Phase
from postproc.reference.repeated import Repeated
from postproc.reference.stated_feeds import feeds_of, follows_speed, slow_feeds
from postproc.setup.model import Placement, SetupFile
from toolpaths.arrays import Array, Bools, Floats, Ints, as_slice, repeated, shared, taken
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays, rows_of
from toolpaths.toolpath import Arcs, Kind, Role, Toolpath
from toolpaths.units import DEG

_PART = 50_000
"""rows that are looked at together"""


@dataclass(frozen=True)
@arrays(tip="M 3", axis="M 3", kind="int8: M", feed="M", seconds="M", arc="int32: M", row="M", hole="M",
        phase="int8: M", cycle="int32: M", link="M", tool="int32: M", line="M", spin="M")
class Moves:
    """Elementary moves, one row each; the start of a row is the end of the row before.

    Attributes (M rows):
        tip, axis (M, 3): end pose
        kind (M,): Kind
        feed (M,): mm/s at the tip, NaN for rapids and where `seconds` counts
        seconds (M,): duration asked for by inverse time, else NaN
        arc (M,): index into arcs or -1
        row (M,): row of the Toolpath
        hole (M,): running number of the hole, -1 elsewhere; `phase` (M,) its Phase
        cycle (M,): index into Toolpath.cycles or -1
        link (M,): True where the path from the row before is a linking move (retract, index, approach), free of form
        tool (M,): index into Toolpath.tools or -1
        line (M,): CL line
        spin (M,): rad about the tool axis as in Toolpath, NaN where any will do
    """

    tip: Floats
    axis: Floats
    kind: Array
    feed: Floats
    seconds: Floats
    arc: Array
    row: Ints
    hole: Ints
    phase: Array
    cycle: Array
    link: Bools
    tool: Array
    line: Ints
    spin: Floats
    arcs: Arcs

    def __len__(self) -> int:
        return len(self.tip)

    def placed(self, placement: Placement) -> Moves:
        """The same moves in the outer frame of `placement`."""
        if placement.is_identity:
            return self
        arcs = Arcs(placement.points(self.arcs.center), placement.directions(self.arcs.normal), self.arcs.radius,
                    self.arcs.sweep)
        return replace(self, tip=placement.points(self.tip), axis=shared(placement.directions(self.axis)), arcs=arcs,
                       spin=shared(_spin_in(placement, self.axis, self.spin)))

    def without_pecks(self) -> Moves:
        """The rows but those of pecks: a hole is then one straight path to its bottom."""
        keep = self.phase != Phase.PECK
        return self if bool(keep.all()) else self.take(keep)

    def take(self, rows: Ints | Bools) -> Moves:
        """Some of the rows, or rows several times."""
        return rows_of(self, "M", rows)

    def run_by(self, owner: Ints) -> Bools:
        """(E,) True for blocks that run a move of the CL file itself, by the move that each serves: not those of
        links that lead to it, nor what stands behind the last one."""
        return np.asarray((owner < len(self)) & ~self.link[np.minimum(owner, len(self) - 1)])

    def curves(self, rows: Ints | slice = slice(None)) -> Curves:
        """The reference motion of every row, or of some; linked rows stand still at their end."""
        ends = np.arange(len(self))[rows] if isinstance(rows, slice) else rows
        first = np.where(self.link[rows], ends, np.maximum(ends - 1, 0))
        return Curves(self.tip[first], self.tip[rows], taken(self.axis, first), taken(self.axis, rows),
                      *self._arcs_of(rows))

    def lengths(self) -> Floats:
        """(M,) mm that the tip goes in every row."""
        parts = [slice(at, at + _PART) for at in range(0, len(self), _PART)]
        return np.concatenate([np.zeros(0), *(self.curves(part).length() for part in parts)])

    def sweeps(self) -> Floats:
        """(M,) rad of the rows that are arcs, 0 for others."""
        return np.asarray(np.where((self.arc >= 0) & ~self.link, self._arcs_of(slice(None))[3], 0.0))

    def run(self, first: int, last: int) -> Curves:
        """Those of the rows behind `first` to before `last`, none of them linked, without a copy of tips and axes."""
        ends, starts = slice(first + 1, last), slice(first, last - 1)
        return Curves(self.tip[starts], self.tip[ends], self.axis[starts], self.axis[ends],
                      *self._arcs_of(ends))

    def _arcs_of(self, rows: Ints | slice) -> tuple[Bools, Floats, Floats, Floats]:
        """(is_arc, center, normal, sweep) of `Curves`."""
        arc = self.arc[rows]
        is_arc = np.asarray((arc >= 0) & ~self.link[rows])
        if not is_arc.any():
            return is_arc, repeated(np.zeros(3), len(arc)), repeated(np.zeros(3), len(arc)), repeated(0.0, len(arc))
        index = np.maximum(arc, 0)
        return is_arc, self.arcs.center[index], self.arcs.normal[index], self.arcs.sweep[index]


def _spin_in(placement: Placement, axis: Floats, spin: Floats) -> Floats:
    """Spins (M,) about axes (M, 3) in the outer frame."""
    result, known = spin.copy(), np.flatnonzero(np.isfinite(spin))
    if len(known):
        side = placement.directions(tool_x(axis[known], spin[known]))
        result[known] = spin_about(placement.directions(axis[known]), side)
    return result


def link_rows(toolpath: Toolpath, setup: SetupFile, axis_tolerance: float, places: Repeated | None = None) -> Bools:
    """Rows (N,) that are reached by a linking move.

    The first motion, the first after a tool change, a bare GOHOME or a FROM elsewhere, the first of an
    operation whose tool axis differs from the last one's by more than `axis_tolerance` (rad), rapids that
    turn the axis by more than the set-up's link_angle, rapids from or to where the tool is held about its
    axis, the first at another place, and the first of an operation that begins again (`begins_again`). Where
    such a row cuts, `build_moves` puts a linked row before it.
    """
    n = len(toolpath)
    link = np.zeros(n, dtype=bool)
    moving = np.flatnonzero(toolpath.role != Role.START)
    if not len(moving):
        return link
    axis = toolpath.axis[moving]
    turn = np.zeros(len(moving))
    turn[1:] = angle_between(axis[1:], axis[:-1])
    boundary = np.zeros(len(moving), dtype=bool)
    boundary[1:] = np.diff(toolpath.operation[moving]) != 0
    rapid = toolpath.kind[moving] == Kind.RAPID
    linked = rapid & ((boundary & (turn > axis_tolerance)) | (turn > setup.clearance.link_angle * DEG))
    linked |= rapid & _spins_again(toolpath, moving)
    linked[0] = True
    linked |= boundary & begins_again(toolpath, setup)[toolpath.operation[moving]]
    stops = [e.index for e in toolpath.events if e.word == "GOHOME"] + [c.index for c in tool_changes(toolpath)]
    for index in [*stops, *_starts_elsewhere(toolpath), *([] if places is None else places.begins.tolist())]:
        at = int(np.searchsorted(moving, index))
        if at < len(moving):
            linked[at] = True
    link[moving] = linked
    return link


def _spins_again(toolpath: Toolpath, moving: Ints) -> Bools:
    """Rows of `moving` whose tool is held otherwise about its axis than in the row before."""
    result = np.zeros(len(moving), dtype=bool)
    if toolpath.spin is not None:
        spin = toolpath.spin[moving]
        result[1:] = (spin[1:] != spin[:-1]) & ~(np.isnan(spin[1:]) & np.isnan(spin[:-1]))
    return result


def begins_again(toolpath: Toolpath, setup: SetupFile) -> Bools:
    """(operations,) True where an operation is reached from the safe planes, whatever its axis: where it can
    be a restart point, and where the set-up gives it, or the one before it, an output mode of its own."""
    own = np.array([op.name in setup.output.operations for op in toolpath.operations])
    return np.asarray(own | np.concatenate([[False], own[:-1]]) | setup.output.apart)


def _starts_elsewhere(toolpath: Toolpath) -> list[int]:
    """FROM rows that are not where the tool stands already."""
    rows = np.flatnonzero(toolpath.role == Role.START)
    return [int(k) for k in rows if k == 0 or (toolpath.tip[k] != toolpath.tip[k - 1]).any()
            or (toolpath.axis[k] != toolpath.axis[k - 1]).any()]


def _begins(toolpath: Toolpath, link: Bools, places: Repeated | None) -> Ints:
    """(N,) for linked rows that cut: the row whose pose the cut begins at (FROM, or the last position there), else -1.

    The link then leads to that pose. A file whose very first record cuts has none: the tool comes down at its feed.
    """
    result = np.full(len(toolpath), -1)
    cutting = (toolpath.kind != Kind.RAPID) & (toolpath.role != Role.HOLE)
    rows = np.flatnonzero(link & cutting)
    result[rows] = rows - 1 if places is None else places.previous[rows]
    return result


def build_moves(toolpath: Toolpath, setup: SetupFile, axis_tolerance: float,
                places: Repeated | None = None, cycles: Cycles | None = None) -> tuple[Moves, list[Diagnostic]]:
    """The reference moves of a Toolpath, in the part frame; `places` where it is repeated at several, `cycles` the canned
    cycles of the control that they are written for."""
    link = link_rows(toolpath, setup, axis_tolerance, places)
    feed, seconds, diagnostics = feeds_of(toolpath, setup.output.feed)
    begin = _begins(toolpath, link, places)
    counts = np.where(toolpath.role == Role.START, 0, 1 + (begin >= 0))
    holes = np.flatnonzero(toolpath.role == Role.HOLE)
    legs = hole_legs(toolpath, link, holes, cycles)
    counts[holes] = [len(leg) for leg in legs]
    row = np.repeat(np.arange(len(toolpath)), counts)
    first = np.zeros(len(row), dtype=bool)
    first[np.cumsum(counts)[counts > 0] - counts[counts > 0]] = True
    back = first & (begin[row] >= 0)
    pose = np.where(back, begin[row], row)
    # A position to return to may be in the material: the approach to it is made at the feed of the cut.
    again = back & (toolpath.role[pose] != Role.START)
    kind = np.where(back, np.where(again, Kind.FEED, Kind.RAPID), toolpath.kind[row]).astype(np.int8)
    there = as_slice(pose)
    tip = _left_to(toolpath, holes, legs)[there]
    arc = np.where(back, -1, toolpath.arc[row])
    hole, phase = np.full(len(row), -1), np.zeros(len(row), dtype=np.int8)
    feed, seconds = np.where(back & ~again, np.nan, feed[row]), np.where(back & ~again, np.nan, seconds[row])
    if len(holes):
        where = np.flatnonzero(toolpath.role[row] == Role.HOLE)
        flat = [leg for of_hole in legs for leg in of_hole]
        tip[where] = [point for point, _, _ in flat]
        phase[where] = [p for _, p, _ in flat]
        kind[where] = [k for _, _, k in flat]
        hole[where] = np.repeat(np.arange(len(holes)), counts[holes])
        feed[where] = np.where(kind[where] == Kind.FEED, feed[where], np.nan)
    moves = Moves(tip, taken(toolpath.axis, there), kind, feed, shared(seconds), shared(arc), row, shared(hole),
                  shared(phase), taken(toolpath.cycle, row), link[row] & first, taken(toolpath.tool, row),
                  toolpath.line[as_slice(row)],
                  repeated(np.nan, len(row)) if toolpath.spin is None else toolpath.spin[pose], toolpath.arcs)
    return moves, [*diagnostics, *_missing_feeds(toolpath, moves), *slow_feeds(toolpath, moves.row, moves.kind),
                   *_opposite_axes(toolpath, moves), *_lone_arcs(toolpath, moves), *_arcs_behind_holes(toolpath, moves)]


def _left_to(toolpath: Toolpath, holes: Ints, legs: list[list[HoleLeg]]) -> Floats:
    """(N, 3) where the tool stands behind each row: at the end of its retract out of a hole, else at the tip."""
    if not len(holes):
        return toolpath.tip
    tip = toolpath.tip.copy()
    tip[holes] = [leg[-1][0] for leg in legs]
    return tip


def _lone_arcs(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    """Arcs without a point to begin at."""
    bad = np.flatnonzero(moves.link & (moves.arc >= 0))
    if not len(bad):
        return []
    return [error("arc.no_start", "an arc before any position is known", file=toolpath.file,
                  lines=moves.line[bad][:6].tolist(), count=len(bad), hint="put FROM or a GOTO before CIRCLE")]


def _arcs_behind_holes(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    """Arcs that begin at the top of a hole, which the tool has left to another level."""
    bad = np.flatnonzero((moves.arc[1:] >= 0) & (moves.row[1:] > 0)) + 1
    bad = bad[toolpath.role[moves.row[bad] - 1] == Role.HOLE]
    off = lengths(moves.tip[bad - 1] - toolpath.tip[moves.row[bad] - 1])
    bad, off = bad[off > 1e-6], off[off > 1e-6]
    if not len(bad):
        return []
    return [error("arc.behind_hole", f"an arc straight behind a hole: the tool has left the hole to {off[0]:g} mm above the "
                  "start of the arc", file=toolpath.file, lines=moves.line[bad][:6].tolist(), count=len(bad),
                  hint="put a GOTO to the start of the arc between CYCLE/OFF and the arc")]


def _missing_feeds(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    cutting = moves.kind != Kind.RAPID
    bad = np.flatnonzero(cutting & ~(moves.feed > 0.0) & ~(moves.seconds > 0.0))
    bad = bad[~follows_speed(toolpath)[moves.row[bad]]] if len(bad) else bad
    if not len(bad):
        return []
    return [error("feed.missing", "cutting motion before any feed is stated, or at feed 0", file=toolpath.file,
                  lines=moves.line[bad][:6].tolist(), count=len(bad),
                  hint="put FEDRAT before the first cut, or state [output] feed = MM_PER_MIN in the set-up for such cuts")]


def _opposite_axes(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    turn = np.zeros(len(moves))
    turn[1:] = angle_between(moves.axis[1:], moves.axis[:-1])
    bad = np.flatnonzero((turn > np.pi - 1e-6) & ~moves.link)
    if not len(bad):
        return []
    return [error("axis.opposite", "the tool axis turns by 180 degrees between two points: no great circle leads there",
                  file=toolpath.file, lines=moves.line[bad][:6].tolist(), count=len(bad),
                  hint="put a point between, or retract with RAPID")]
