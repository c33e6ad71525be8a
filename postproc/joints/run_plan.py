"""The joints of all runs of a program before any block is made: axes moved and led, branches, windings, rewinds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.group_rows import groups
from postproc.joints.direct import joints_inside
from postproc.joints.joint_path import reachable_axes
from postproc.joints.lattice import PoseRun
from postproc.joints.plan import JointPreferences, RunSolution, plan_runs
from postproc.joints.refined_moves import Refined, cut, with_rewinds
from postproc.joints.singular_detours import Led, SingularPassage, lead_past, whole
from postproc.joints.spin import held_joints
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, distinct, repeated, shared, taken
from toolpaths.dataclass import dataclass
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.joints.run_roads import ParameterCurve, RunRoad

AXIS_SHARE = 0.2
"""share of the axis tolerance that may go into moving an axis onto the set the machine can reach"""
LEAD_SHARE = 0.5
"""share of what is left then that leading past singular directions may take"""
_COARSE = 10.0 * DEG
"""turn of a rotary axis in one move above which a run that leaves travel is looked at more finely"""


@dataclass(frozen=True)
class RunOptions:
    """How runs are planned.

    Attributes:
        preferences: of the set-up
        may_rewind: False where the set-up forbids it
        feed: mm/s of the return into the cut; None: that of the cut
        away: (tips (N, 3), axes (N, 3)) -> s (N,) that drawing back and coming down takes
        tolerance: rad, of the axis
        spin: rad, the turn of the tool about itself that is asked for where the machine leaves it open; None: planned
        singular_distance: that is kept
        split: False where the platform rests on carriers that do all
        drawn: (tips (N, 3), axes (N, 3)) -> tips (N, 3) where linking moves draw the tool back to at least; None: nowhere
    """

    preferences: JointPreferences
    may_rewind: bool
    feed: float | None
    away: Callable[[Floats, Floats], Floats]
    tolerance: float
    spin: float | None = None
    singular_distance: float = 0.0
    split: bool = True
    drawn: Callable[[Floats, Floats], Floats] | None = None


@dataclass(frozen=True)
@arrays(q="R J", singular="R", moved="R", left="R", parameters="R F")
class RunPlan:
    """All runs: parts of moves, and at each part's end joints (R, J), family (R,), what the axis was moved by (R,).

    Attributes:
        left: (R,) rad of the axis tolerance that linearising may use
        events: passages by singular directions, with the moves (first, last) of each
        solutions: of the runs of the CL file, in order, without their joints, which are in `q`
        parameters: (R, F) what the machine leaves open, as it was planned
        split_seconds: see `ParameterCurve.seconds`
    """

    refined: Refined
    q: Floats
    singular: Bools
    moved: Floats
    left: Floats
    events: tuple[tuple[int, int, SingularPassage], ...]
    solutions: tuple[RunSolution, ...]
    parameters: Floats
    split_seconds: tuple[float, ...] = ()


@dataclass(frozen=True)
@arrays(rows="N", axis="N 3", moved="N", _tip="N 3", places="*_")
class _Part:
    """One run while it is planned: its rows of Moves, the axes they are given, the curves after its first pose.

    `opened` are the curves of what the machine leaves open, `places` where the poses are in the measure of each.
    """

    kin: Kinematics
    rows: Ints
    axis: Floats
    moved: Floats
    led: Led

    def poses(self) -> tuple[Floats, Floats]:
        """Tips and axes (N, 3) that the run goes through."""
        if self.led.is_whole:
            return self._tip, self.axis
        return (np.concatenate([self.first[:, :3], self.led.curves.end]),
                np.concatenate([self.first[:, 3:], self.led.curves.axis1]))

    @property
    def first(self) -> Floats:
        """(1, 6) the pose that the run begins at."""
        return np.concatenate([self._tip[:1], self.axis[:1]], axis=1)

    _tip: Floats
    """(N, 3) as given"""
    opened: tuple[ParameterCurve, ...] = ()
    places: tuple[Floats, ...] = ()

    @property
    def parameters(self) -> Floats | None:
        """(N, F) at the poses; None where the machine leaves nothing open."""
        if not self.opened:
            return None
        from postproc.joints.run_roads import together

        return together(self.opened, len(self.kin.open_parameters), self.places)


def plan_moves(machine: Machine, kinematics: Callable[[int], Kinematics], moves: Moves, run_options: RunOptions,
               progress: Callable[[int], None] | None = None) -> RunPlan:
    """The joints of all moves (in the table frame), run by run as `moves.link` divides them."""
    starts, parts = np.flatnonzero(moves.link), []
    tools = {k: kinematics(k) for k in distinct(moves.tool[starts]).tolist()}
    given = _reached(tools, moves, starts, AXIS_SHARE * run_options.tolerance)
    if (plan := _without_choice(machine, tools, moves, starts, given, run_options.tolerance)) is not None:
        return plan
    for first, last in zip(starts.tolist(), [*starts[1:].tolist(), len(moves)], strict=True):
        parts.append(_part(machine, tools[int(moves.tool[first])], moves, first, last, given, run_options))
    if parts and parts[0].kin.open_parameters:
        parts = _opened(machine, parts, moves, run_options)
    runs = [_run(part, moves, run_options, machine.home) for part in parts]
    found = plan_runs(runs, machine.limits, machine.home, run_options.preferences,
                      run_options.may_rewind, progress)
    if run_options.may_rewind and any(s.outside for s in found):
        parts = [_finer(part, s) if s.outside else part for part, s in zip(parts, found, strict=True)]
        runs = [_run(part, moves, run_options, machine.home) for part in parts]
        found = plan_runs(runs, machine.limits, machine.home, run_options.preferences,
                          run_options.may_rewind, progress)
    return _together(moves, parts, found, run_options)


def _without_choice(machine: Machine, tools: dict[int, Kinematics], moves: Moves, starts: Ints,
                    given: tuple[Floats, Floats], tolerance: float) -> RunPlan | None:
    """The same where `direct` has all runs, so that there may be a great many of them: of each tool at once."""
    if not len(starts) or starts[0] or any(any(kin.rotary) or kin.branches != 1 or kin.open_parameters
                                           for kin in tools.values()):
        return None
    axis, moved = given
    lengths = np.diff(np.append(starts, len(moves)))
    of_tool: Iterable[slice | Ints] = (slice(None),) if len(tools) == 1 else groups(np.repeat(moves.tool[starts], lengths))
    q = np.empty((len(moves), len(machine.home)))
    for rows in of_tool:
        kin = tools[int(moves.tool[starts[0] if isinstance(rows, slice) else rows[0]])]
        found = joints_inside(kin, moves.tip[rows], taken(axis, rows), machine.limits)
        if found is None:
            return None
        q[rows] = found
    n, singular = len(moves), np.zeros(len(moves), dtype=np.bool_)
    refined = cut(moves, np.arange(n), repeated(0.0, n), repeated(1.0, n), moves.tip,
                  shared(axis) if moved.any() else moves.axis)
    left = np.repeat(tolerance - np.maximum.reduceat(moved, starts), lengths)
    return RunPlan(refined, q, singular, shared(moved), shared(left), (),
                   (RunSolution(q[:0], singular[:0]),) * len(starts), np.zeros((n, 0)))


def _reached(tools: dict[int, Kinematics], moves: Moves, starts: Ints,
             tolerance: float) -> tuple[Floats, Floats]:
    """Axes (R, 3) that the machine can take with the tool of each run, and by how much (R,) rad they are moved."""
    if moves.axis.strides[0] == 0 and len(moves) and all(
            not reachable_axes(kin, moves.axis[:1], tolerance)[1].any() for kin in tools.values()):
        return moves.axis, repeated(0.0, len(moves))
    if len(tools) == 1:
        axis, moved = reachable_axes(next(iter(tools.values())), moves.axis, tolerance)
        if not moved.any():
            return axis, moved
    axis, moved = np.array(moves.axis), np.zeros(len(moves))
    of_run = np.repeat(moves.tool[starts], np.diff(np.append(starts, len(moves))))
    for rows in groups(of_run):
        axis[rows], moved[rows] = reachable_axes(tools[int(of_run[rows[0]])], moves.axis[rows], tolerance)
    return axis, moved


def _part(machine: Machine, kin: Kinematics, moves: Moves, first: int, last: int, given: tuple[Floats, Floats],
          run_options: RunOptions) -> _Part:
    """A run with the axes `given` (R, 3), which are moved by as much (R,)."""
    rows, curves = np.arange(first, last), moves.run(first, last)
    axis, moved = given[0][first:last], given[1][first:last]
    curves = Curves(curves.start, curves.end, axis[:-1], axis[1:], curves.is_arc, curves.center,
                    curves.normal, curves.sweep)
    led = whole(curves)
    if len(curves) and any(kin.rotary):
        allowed = LEAD_SHARE * (run_options.tolerance - float(moved.max()))
        led = lead_past(kin, curves, _seconds(moves, rows[1:], curves), allowed, machine.limits.velocity)
    return _Part(kin, rows, axis, moved, led, moves.tip[first:last])


def _seconds(moves: Moves, rows: Ints, curves: Curves) -> Floats:
    """Time (N,) of moves at the programmed feed, NaN for rapids."""
    with np.errstate(invalid="ignore", divide="ignore"):
        time = np.where(moves.seconds[rows] > 0.0, moves.seconds[rows], curves.length() / moves.feed[rows])
    return np.where((moves.kind[rows] == Kind.RAPID) | ~(time > 0.0), np.nan, time)


def _run(part: _Part, moves: Moves, run_options: RunOptions, home: Floats) -> PoseRun:
    tip, axis = part.poses()
    owner = np.concatenate([part.rows[:1], part.rows[1:][part.led.parent]])
    rapid = moves.kind[owner] == Kind.RAPID
    rest = rapid | np.append(rapid[1:], True)
    spin = float(moves.spin[part.rows[0]])
    held = held_joints(part.kin, tip[0], axis[0], spin, home) if np.isfinite(spin) else None
    return PoseRun(part.kin, tip, axis, rest, run_options.away(tip, axis), held, part.parameters)


def _opened(machine: Machine, parts: list[_Part], moves: Moves, run_options: RunOptions) -> list[_Part]:
    """The runs with what the machine leaves open planned, cut where it changes."""
    from postproc.joints.open_parameters import planned_parameters

    curves = planned_parameters([_road(part, moves) for part in parts], machine, run_options.singular_distance,
                                run_options.spin, run_options.split, run_options.drawn)
    made = [replace(part, opened=own, places=tuple(curve.measure for curve in own))
            for part, own in zip(parts, curves, strict=True)]
    return [_cut(part, np.max([curve.parts() for curve in part.opened], axis=0)) for part in made]


def _road(part: _Part, moves: Moves) -> RunRoad:
    from postproc.joints.run_roads import RunRoad

    rows, led, asked = part.rows[1:][part.led.parent], part.led, moves.spin[part.rows]
    with np.errstate(invalid="ignore", divide="ignore"):
        time = np.where(moves.seconds[rows] > 0.0, moves.seconds[rows] * (led.u1 - led.u0),
                        led.curves.length() / moves.feed[rows])
    time = np.where((moves.kind[rows] == Kind.RAPID) | ~(time > 0.0) | ~np.isfinite(time), 0.0, time)
    asked = asked[np.isfinite(asked)]
    return RunRoad(part.kin, part.first[0], led.curves, time, float(asked[0]) if len(asked) else np.nan)


def _finer(part: _Part, solution: RunSolution) -> _Part:
    """The run with moves that turn a rotary axis far cut into parts, so that a rewind may stand between their ends."""
    step = np.abs(np.diff(solution.q[:, np.array(part.kin.rotary)], axis=0)).max(axis=1, initial=0.0)
    return _cut(part, np.maximum(np.ceil(np.nan_to_num(step) / _COARSE), 1).astype(np.int64))


def _cut(part: _Part, count: Ints) -> _Part:
    """The run with its curves cut into `count` (N,) even parts each."""
    if not (count > 1).any():
        return part
    led, index = part.led, np.repeat(np.arange(len(count)), count)
    k = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    low, high = k / count[index], np.where(k + 1 == count[index], 1.0, (k + 1) / count[index])
    picked = led.curves.take(index)
    (start, axis0), (end, axis1) = picked.at(low), picked.at(high)
    curves = Curves(start, end, axis0, axis1, picked.is_arc, picked.center, picked.normal,
                    picked.sweep * (high - low))
    u0, u1 = led.u0[index], led.u1[index]
    end = np.where(high == 1.0, u1, u0 + high * (u1 - u0))
    finer = Led(curves, led.parent[index], u0 + low * (u1 - u0), end, led.events)
    places = tuple(np.append(at[:1], at[index] + high * (at[index + 1] - at[index])) for at in part.places)
    return replace(part, led=finer, places=places)


def _together(moves: Moves, parts: list[_Part], found: list[RunSolution], run_options: RunOptions) -> RunPlan:
    """All runs one after the other, cut where there are rewinds."""
    owner = [np.append(0, 1 + p.led.parent) for p in parts]
    refined = cut(moves, np.concatenate([p.rows[k] for p, k in zip(parts, owner, strict=True)]),
                  shared(np.concatenate([np.append(0.0, p.led.u0) for p in parts])),
                  shared(np.concatenate([np.append(1.0, p.led.u1) for p in parts])),
                  *_joined(moves, parts))
    begin = np.cumsum([0, *(len(k) for k in owner)])
    rewinds = [(int(b) + r.row, r) for b, s in zip(begin, found, strict=False) for r in s.rewinds]
    rows = np.array([row for row, _ in rewinds], dtype=np.int64)
    refined = with_rewinds(refined, rows, np.array([r.cuts for _, r in rewinds], dtype=np.bool_),
                           run_options.feed)
    q, singular = np.concatenate([s.q for s in found]), np.concatenate([s.singular for s in found])
    moved = shared(np.concatenate([p.moved[k] for p, k in zip(parts, owner, strict=True)]))
    left = shared(np.repeat([_left(p, run_options) for p in parts], np.diff(begin)))
    given = [part.parameters for part in parts]
    parameters = np.concatenate([np.zeros((len(part.led.curves) + 1, 0)) if some is None else some
                                 for part, some in zip(parts, given, strict=True)])
    if rewinds:
        parameters = np.insert(parameters, rows + 1, parameters[rows], axis=0)
        q = np.insert(q, rows + 1, np.stack([r.after for _, r in rewinds]), axis=0)
        singular, moved, left = (np.insert(x, rows + 1, x[rows]) for x in (singular, moved, left))
    events = tuple((int(p.rows[1 + e.first]), int(p.rows[1 + e.last]), e) for p in parts for e in p.led.events)
    solutions = tuple(replace(s, q=q[:0], singular=singular[:0]) for s in found)
    split = next((curve.seconds for part in parts for curve in part.opened if curve.seconds), ())
    return RunPlan(refined, q, singular, moved, left, events, solutions, parameters, split)


def _joined(moves: Moves, parts: list[_Part]) -> tuple[Floats, Floats]:
    """Tips and axes (R, 3) of all runs."""
    poses, whole = [p.poses() for p in parts], all(p.led.is_whole for p in parts)
    tip = moves.tip if whole else np.concatenate([tip for tip, _ in poses])
    same = whole and all(not p.moved.any() for p in parts)
    return tip, moves.axis if same else shared(np.concatenate([axis for _, axis in poses]))


def _left(part: _Part, run_options: RunOptions) -> float:
    """What moving and leading the axis leave of the tolerance."""
    led = max((e.deviation for e in part.led.events), default=0.0)
    return run_options.tolerance - float(part.moved.max()) - led
