"""The motion that the CL file asks for, spelt out: feeds resolved, cycles expanded, linking moves marked.

This is the reference that output is made from and that read-back compares with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from postproc.events import spindle_speed, tool_changes
from postproc.setup import Placement, SetupFile
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.toolpath import Arcs, Cycle, FeedMode, Kind, Role, Toolpath
from toolpaths.units import DEG


class Phase(IntEnum):
    """What a move of a drilling cycle does."""

    NONE = 0
    POSITION = 1
    """to above the hole"""
    APPROACH = 2
    """down to the clearance plane"""
    DRILL = 3
    """to the bottom at feed, in pecks where the cycle says so"""
    PECK = 4
    """chip breaking on the way to the bottom: out or up, back, and the depths between"""
    RETRACT = 5


@dataclass(frozen=True)
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
        link (M,): True where the way from the row before is a linking move (retract, index, approach), free of form
        tool (M,): index into Toolpath.tools or -1
        line (M,): CL line
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
    arcs: Arcs

    def __len__(self) -> int:
        return len(self.tip)

    def placed(self, placement: Placement) -> Moves:
        """The same moves in the outer frame of `placement`."""
        if placement.is_identity:
            return self
        arcs = Arcs(placement.points(self.arcs.center), placement.directions(self.arcs.normal), self.arcs.radius,
                    self.arcs.sweep)
        return replace(self, tip=placement.points(self.tip), axis=placement.directions(self.axis), arcs=arcs)

    def without_pecks(self) -> Moves:
        """The rows but those of pecks: a hole is then one straight way to its bottom."""
        keep = self.phase != Phase.PECK
        if bool(keep.all()):
            return self
        columns = {name: getattr(self, name)[keep] for name in self.__dataclass_fields__ if name != "arcs"}
        return replace(self, **columns)

    def curves(self) -> Curves:
        """The reference motion of every row; linked rows stand still at their end."""
        first = np.maximum(np.arange(len(self)) - 1, 0)
        first = np.where(self.link, np.arange(len(self)), first)
        is_arc = (self.arc >= 0) & ~self.link
        if len(self.arcs):
            index = np.maximum(self.arc, 0)
            center, normal, sweep = self.arcs.center[index], self.arcs.normal[index], self.arcs.sweep[index]
        else:
            center, normal, sweep = np.zeros_like(self.tip), np.zeros_like(self.tip), np.zeros(len(self))
        return Curves(self.tip[first], self.tip, self.axis[first], self.axis, is_arc, center, normal, sweep)


def link_rows(toolpath: Toolpath, setup: SetupFile, axis_tolerance: float) -> Bools:
    """Rows (N,) that are reached by a linking move.

    The first motion, the first after a tool change or a bare GOHOME, the first of an operation whose tool axis differs
    from the last one's by more than `axis_tolerance` (rad), and rapids that turn the axis by more than the set-up's
    link_angle. A cutting move that turns the axis is never replaced by a linking move.
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
    linked[0] = True
    stops = [e.index for e in toolpath.events if e.word == "GOHOME"] + [c.index for c in tool_changes(toolpath)]
    for index in stops:
        at = int(np.searchsorted(moving, index))
        if at < len(moving):
            linked[at] = True
    link[moving] = linked
    return link


def build_moves(toolpath: Toolpath, setup: SetupFile, axis_tolerance: float) -> tuple[Moves, list[Diagnostic]]:
    """The reference moves of a Toolpath, in the part frame."""
    link = link_rows(toolpath, setup, axis_tolerance)
    feed, seconds, diagnostics = _feeds(toolpath)
    counts = np.where(toolpath.role == Role.START, 0, 1)
    holes = np.flatnonzero(toolpath.role == Role.HOLE)
    legs = _hole_legs(toolpath, link, holes)
    counts[holes] = [len(leg) for leg in legs]
    row = np.repeat(np.arange(len(toolpath)), counts)
    first = np.zeros(len(row), dtype=bool)
    first[np.cumsum(counts)[counts > 0] - counts[counts > 0]] = True
    tip, kind = toolpath.tip[row], toolpath.kind[row].copy()
    hole, phase = np.full(len(row), -1), np.zeros(len(row), dtype=np.int8)
    feed, seconds = feed[row], seconds[row]
    if len(holes):
        where = np.flatnonzero(toolpath.role[row] == Role.HOLE)
        flat = [leg for hole_legs in legs for leg in hole_legs]
        tip[where] = [point for point, _, _ in flat]
        phase[where] = [p for _, p, _ in flat]
        kind[where] = [k for _, _, k in flat]
        hole[where] = np.repeat(np.arange(len(holes)), counts[holes])
        feed[where] = np.where(kind[where] == Kind.FEED, feed[where], np.nan)
    moves = Moves(tip, toolpath.axis[row], kind, feed, seconds, toolpath.arc[row], row, hole, phase,
                  toolpath.cycle[row], link[row] & first, toolpath.tool[row], toolpath.line[row], toolpath.arcs)
    return moves, diagnostics + _missing_feeds(toolpath, moves) + _opposite_axes(toolpath, moves)


def _feeds(toolpath: Toolpath) -> tuple[Floats, Floats, list[Diagnostic]]:
    """(mm/s, seconds of inverse-time rows, diagnostics) per row; holes take the feed of their cycle."""
    feed, mode = toolpath.feed.copy(), toolpath.feed_mode.copy()
    holes = np.flatnonzero(toolpath.role == Role.HOLE)
    if len(holes):
        cycle_feed = np.array([c.feed for c in toolpath.cycles])
        cycle_mode = np.array([int(c.feed_mode) for c in toolpath.cycles])
        feed[holes] = cycle_feed[toolpath.cycle[holes]]
        mode[holes] = cycle_mode[toolpath.cycle[holes]]
    cutting = (toolpath.kind != Kind.RAPID) | (toolpath.role == Role.HOLE)
    feed[~cutting] = np.nan
    diagnostics: list[Diagnostic] = []
    turning = cutting & (mode == FeedMode.PER_REVOLUTION)
    if turning.any():
        rev_per_s = spindle_speed(toolpath)
        feed[turning] *= rev_per_s[turning]
        bad = np.flatnonzero(turning & ~(rev_per_s > 0.0))
        if len(bad):
            diagnostics.append(error("feed.no_speed", "feed per revolution while the spindle speed is not known",
                                     file=toolpath.file, lines=toolpath.line[bad][:6].tolist(), count=len(bad),
                                     hint="state SPINDL/RPM,... before, or a feed per minute"))
    inverse = cutting & (mode == FeedMode.INVERSE_TIME)
    seconds = np.where(inverse, 1.0 / np.where(inverse & (feed > 0.0), feed, np.nan), np.nan)
    feed[inverse] = np.nan
    return feed, seconds, diagnostics


def _missing_feeds(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    cutting = moves.kind != Kind.RAPID
    bad = np.flatnonzero(cutting & ~(moves.feed > 0.0) & ~(moves.seconds > 0.0))
    if not len(bad):
        return []
    return [error("feed.missing", "cutting motion before any feed is stated, or at feed 0", file=toolpath.file,
                  lines=moves.line[bad][:6].tolist(), count=len(bad), hint="put FEDRAT before the first cut")]


def _opposite_axes(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    turn = np.zeros(len(moves))
    turn[1:] = angle_between(moves.axis[1:], moves.axis[:-1])
    bad = np.flatnonzero((turn > np.pi - 1e-6) & ~moves.link)
    if not len(bad):
        return []
    return [error("axis.opposite", "the tool axis turns by 180 degrees between two points: no great circle leads there",
                  file=toolpath.file, lines=moves.line[bad][:6].tolist(), count=len(bad),
                  hint="put a point between, or retract with RAPID")]


Leg = tuple[Floats, Phase, Kind]


def _hole_legs(toolpath: Toolpath, link: Bools, holes: Ints) -> list[list[Leg]]:
    """The legs of each hole. The level is the height along the tool axis the tool comes from."""
    result: list[list[Leg]] = []
    before: Floats | None = None
    initial = 0.0
    for k, row in enumerate(holes):
        chained = k > 0 and holes[k - 1] == row - 1 and not link[row]
        if not chained:
            before = toolpath.tip[row - 1] if row > 0 and not link[row] else None
        axis = toolpath.axis[row]
        if not chained and before is not None:
            initial = float(axis @ before)
        legs = _legs(toolpath.tip[row], axis, toolpath.cycles[toolpath.cycle[row]], before, initial)
        before = legs[-1][0]
        result.append(legs)
    return result


def _legs(top: Floats, axis: Floats, cycle: Cycle, before: Floats | None, initial: float) -> list[Leg]:
    """Above the hole at the level the tool is at (never below the clearance plane), down, drill, out.

    Without a known level (`before` None: a linking move leads here) the tool comes straight to the clearance plane
    and AUTO retracts to it.
    """
    height = float(axis @ top)
    plane = height + cycle.clearance
    legs: list[Leg] = []
    level = plane
    if before is not None:
        level = max(float(axis @ before), plane)
        if float(axis @ before) < plane - 1e-9:
            legs.append((before + (plane - float(axis @ before)) * axis, Phase.POSITION, Kind.RAPID))
    legs.append((top + (level - height) * axis, Phase.POSITION, Kind.RAPID))
    if level > plane + 1e-9:
        legs.append((top + cycle.clearance * axis, Phase.APPROACH, Kind.RAPID))
    legs += _pecks(top, axis, cycle)
    legs.append((top - cycle.depth * axis, Phase.DRILL, Kind.FEED))
    out = cycle.retract if cycle.retract is not None else (initial - height if before is not None else -np.inf)
    kind = Kind.FEED if cycle.kind in FEED_OUT else Kind.RAPID
    if kind is Kind.FEED:
        legs.append((top + cycle.clearance * axis, Phase.RETRACT, Kind.FEED))
        if out > cycle.clearance + 1e-9:
            legs.append((top + out * axis, Phase.RETRACT, Kind.RAPID))
    else:
        legs.append((top + max(cycle.clearance, out) * axis, Phase.RETRACT, Kind.RAPID))
    return legs


def _pecks(top: Floats, axis: Floats, cycle: Cycle) -> list[Leg]:
    """Depths between of DEEP (out to the clearance plane each time) and BRKCHP (a little up each time)."""
    if cycle.kind not in PECKING or not cycle.steps or not cycle.steps[-1] > 0.0:
        return []
    legs: list[Leg] = []
    total = cycle.depth + cycle.clearance
    done, k = cycle.steps[0], 1
    while done < total - 1e-9:
        at = top + (cycle.clearance - done) * axis
        legs.append((at, Phase.PECK, Kind.FEED))
        if cycle.kind == "DEEP":
            legs.append((top + cycle.clearance * axis, Phase.PECK, Kind.RAPID))
            legs.append((at + min(PECK_RELIEF, done) * axis, Phase.PECK, Kind.RAPID))
        else:
            legs.append((at + min(PECK_RELIEF, done) * axis, Phase.PECK, Kind.RAPID))
        done += cycle.steps[min(k, len(cycle.steps) - 1)]
        k += 1
    return legs


PECKING = frozenset({"DEEP", "BRKCHP"})
PECK_RELIEF = 0.254
"""mm short of the last depth where the next peck begins (LinuxCNC G83, G73: 0.010 inch)"""
FEED_OUT = frozenset({"BORE", "REAM", "TAP"})
"""Cycles that leave the hole at feed, up to the clearance plane."""
