"""From reference moves to blocks in joints: runs solved, linked and linearised, with the time each block may take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace

import numpy as np

import postproc.joints.faults as joint_faults
import postproc.path.faults as faults
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.progress import Progress
from postproc.control.modes import OutputModes, WordFrame
from postproc.joints.run_plan import RunPlan, plan_moves
from postproc.path.blocks import LEG, PathBuilder, add_run, rapid_codes
from postproc.path.home_links import add_home_links
from postproc.path.linearise import approached
from postproc.path.links import Link, Pose, SafeSpace, has_retract_axis, plan_link
from postproc.path.model import FEED, TRAVERSE, JointPath
from postproc.path.rewinds import RetractPlan
from postproc.path.solved_runs import SolvedRun, SolvedRuns, solved_runs
from postproc.path.zero_entry import BELOW_HOME, ZeroEntry, cost, needed, zero_entry
from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Floats, Ints, as_slice, distinct, taken, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors, info
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind

_STRETCH = 60_000
"""moves that become blocks together: what is known of them meanwhile stays small"""


@dataclass(frozen=True)
@arrays(operation="O")
class _Road:
    """What building a path needs throughout; `home_rows`: linked rows whose link goes by home."""

    plan: RunPlan
    modes: OutputModes
    operation: Ints
    space: SafeSpace
    drawing: RetractPlan
    home_rows: frozenset[int]
    file: str


@dataclass(frozen=True)
class _Stand:
    """Where the tool stands, None before the first run, the frame of its words, the tool's kinematics."""

    pose: Pose | None
    frame: WordFrame
    kin: Kinematics


def build_path(modes: OutputModes, kinematics: Callable[[int], Kinematics], moves: Moves, space: SafeSpace,
               home_rows: frozenset[int], operation: Ints, tolerance: float, axis_tolerance: float, file: str = "",
               progress: Progress | None = None, drawing: RetractPlan | None = None,
               rapids_as_feed: bool = False, off_path: bool = False) -> tuple[JointPath | None, list[Diagnostic]]:
    """Blocks for all moves (in the table frame).

    Args:
        kinematics: the kinematics with the tool of that index of the Toolpath
        home_rows: linked rows of Moves whose link goes by home (tool change, GOHOME, first)
        operation (M,): of each move
        tolerance, axis_tolerance: mm and rad that linearising may use
        drawing: what the set-up says about rewinds and preferred joints; default: its defaults
        rapids_as_feed: rapids that would leave their line may be feed moves
        off_path: blocks of cuts may end off their curve, within the tolerance, where they are fewer so (`balanced.py`)
    """
    machine, given, drawing = modes.control.machine, moves, drawing or RetractPlan.default(space)
    plan = plan_moves(machine, kinematics, moves, drawing.run_options(machine, axis_tolerance),
                      None if progress is None else lambda run: progress("joints", run, int(given.link.sum())))
    moves = plan.refined.moves
    road = _Road(plan, modes, operation[plan.refined.origin], space, drawing,
                 plan.refined.among(home_rows), file)
    out = PathBuilder(moves, len(machine.axis_names))
    out.frame(modes.base)
    runs, diagnostics = solved_runs(plan, modes, kinematics, road.operation, axis_tolerance, file)
    if has_errors(diagnostics):
        return None, faults.merged(diagnostics)
    runs, worst, turns, more = _add_runs(out, road, runs, tolerance, machine, off_path)
    diagnostics += more
    start = _Stand(None, modes.base, kinematics(int(moves.tool[0])))
    stand, longer, more = _add_links(out, road, runs, start, progress)
    diagnostics += more
    if has_errors(diagnostics):
        return None, faults.merged(diagnostics)
    _add_end(out, modes, stand, space, len(moves) - 1)
    out.begin[len(moves)] = out.count
    columns = out.joined()
    path = _of_given(columns, out, plan, len(given), np.concatenate(turns), worst, start.kin.open_parameters)
    diagnostics += joint_faults.planned(plan, machine, given, file)
    if path.opened:
        diagnostics.append(info("joints.opened", joint_faults.opened(path.opened, path.split_seconds), file=file))
    diagnostics += cost(modes.tcp_code, longer, file)
    return path, faults.merged(diagnostics) + faults.off_line(path.code, path.u, path.move, path.seconds,
                                                              given, file, rapids_as_feed,
                                                              bool(modes.tcp_code) and any(machine.rotary))


def _of_given(columns: dict[str, Array], out: PathBuilder, plan: RunPlan, count: int, turns: Ints,
              worst: Floats, names: tuple[str, ...]) -> JointPath:
    """The path of the parts of moves as that of the `count` moves themselves."""
    parts = plan.refined
    singular = np.zeros(count, dtype=bool)
    singular[parts.origin] = plan.singular
    columns = columns | {"move": parts.origin[columns["move"]], "u": parts.at(columns["move"], columns["u"])}
    return JointPath(**columns, begin=parts.begins(out.begin, count), singular=singular,
                     turns=distinct(parts.origin[turns]),
                     worst_tip=float(worst[0]), worst_axis=float(worst[1]), frames=tuple(out.frames),
                     rewinds=parts.origin[parts.rewind], events=plan.events,
                     opened=tuple((name, float(column.min()), float(column.max()))
                                  for name, column in zip(names, plan.parameters.T, strict=False)),
                     split_seconds=plan.split_seconds)


def _add_runs(out: PathBuilder, road: _Road, runs: SolvedRuns, tolerance: float, machine: Machine,
              off_path: bool) -> tuple[SolvedRuns, Floats, list[Ints], list[Diagnostic]]:
    """The blocks of all runs, those of one frame and tool together: (runs as their ends are approached, worst
    deviations (2,), rows with turns, faults)."""
    worst, turns, found = np.zeros(2), [np.zeros(0, dtype=np.int64)], list[Diagnostic]()
    moves = road.plan.refined.moves
    together: dict[tuple[int, int, float], list[SolvedRun]] = {}
    for run in runs.each:
        out.frame(run.frame)
        if run.last - run.first > 1:
            together.setdefault((id(run.frame), id(run.kin), run.left), []).append(run)
    for some in together.values():
        rows = np.concatenate([np.arange(run.first + 1, run.last) for run in some])
        runs = _approached(runs, some[0].kin, moves, rows)
        step = len(rows) if off_path else _STRETCH
        for at in range(0, len(rows), step):
            part = rows[at:at + step]
            starts, ends = as_slice(part - 1), as_slice(part)
            left, turned, broken = add_run(out, some[0].frame, some[0].kin, moves, part, _curves(runs, moves, part),
                                           runs.q[starts], runs.q[ends].copy(), tolerance, some[0].left, off_path)
            worst = np.maximum(worst, left)
            turns.append(turned)
            found += faults.broken(machine, moves, broken, runs.q[[broken - 1, broken]], road.file)
    return runs, worst, turns, found


def _approached(runs: SolvedRuns, kin: Kinematics, moves: Moves, rows: Ints) -> SolvedRuns:
    """The runs with those moves `rows` (N,) that end where the tool lies along a rotary axis as the moves need it there."""
    if not any(kin.rotary):
        return runs
    some = rows[kin.singular(without_nan(runs.q[as_slice(rows)]))]
    where, joints = approached(kin, _curves(runs, moves, some), runs.q[some - 1], runs.q[some])
    if not len(where):
        return runs
    q = runs.q.copy()
    q[some[where]] = joints
    return replace(runs, q=q)


def _curves(runs: SolvedRuns, moves: Moves, rows: Ints) -> Curves:
    """The curves of moves `rows` (N,), none of them linked, with the tool axes of the runs."""
    curves = moves.curves(as_slice(rows))
    return _with_axes(curves, taken(runs.axis, as_slice(rows - 1)), taken(runs.axis, as_slice(rows)))


def _add_links(out: PathBuilder, road: _Road, runs: SolvedRuns, stand: _Stand,
               progress: Progress | None) -> tuple[_Stand, list[float], list[Diagnostic]]:
    """The linking moves to all runs in order: (where the tool stands at the end, s that entries at zero cost, faults)."""
    space, refined = road.space, road.plan.refined
    moves, longer, found = refined.moves, list[float](), list[Diagnostic]()
    linked = np.array([run.first in road.home_rows and not refined.rewind[run.first] for run in runs.each],
                      dtype=np.bool_)
    done = np.zeros(len(runs.each), dtype=np.bool_)
    for base in dict.fromkeys(run.modes.base for run in runs.each):
        done |= add_home_links(out, base, space, runs, moves, linked)
    for run, there in zip(runs.each, done.tolist(), strict=True):
        modes = run.modes
        first, end, before = run.first, run.last - 1, stand
        by_home = first in road.home_rows or _changes_length(modes, before, run.frame)
        pose = Pose(moves.tip[end], runs.axis[end], runs.q[end], run.frame.control)
        stand = _Stand(pose, run.frame, run.kin)
        if there:
            continue
        target = Pose(moves.tip[first], runs.axis[first], runs.q[first], run.frame.control)
        travel = _travel(modes, before.frame, run.frame, by_home)
        enters = modes.at_zero and run.frame is modes.tcp and travel is not modes.tcp
        link = road.drawing.link(travel.control, run.kin, before.pose, target) if refined.rewind[first] else plan_link(
            travel.control, before.kin, run.kin, space, before.pose, target, by_home)
        entry = None
        if enters and needed(modes.control, link):
            link = link if by_home else plan_link(travel.control, before.kin, run.kin, space, before.pose,
                                                  target, True)
            entry = zero_entry(modes.control, modes.tcp.control, run.kin, space, link)
            longer.append(entry.seconds)
            link = replace(link, clear=link.clear and entry.clear)
        down = by_home and modes.from_home(run.frame.control.law) and has_retract_axis(travel.control)
        leaving = road.modes.at(before.frame.control.place).base
        _add_link(out, moves, first, link, _Legs(before.frame, leaving if by_home else travel, travel, run.frame, before.kin,
                                                 run.kin, before.pose, entry, down, _risen(modes, before.frame, link)))
        inside = _home_inside(modes, before.kin, run.kin, space) if by_home else None
        if not link.clear or (inside is not None and not has_retract_axis(travel.control)):
            found.append(faults.no_path(modes.control.machine, moves, first, road.file, space.lower, inside))
        if progress:
            progress("blocks", run.last, len(moves))
    return stand, longer, found


def _home_inside(modes: OutputModes, before: Kinematics, after: Kinematics, space: SafeSpace) -> Floats | None:
    """(3,) tip of the tool at home, in the table frame, where that is inside the extent of what is cut; else None."""
    for kin in (before, after):
        tip, axis = kin.forward(modes.control.machine.home[None])
        if not space.in_plane and space.room(tip, axis)[0] < 0.0:
            return np.asarray(tip[0])
    return None


def _travel(modes: OutputModes, before: WordFrame, after: WordFrame, by_home: bool) -> WordFrame:
    """The frame of the path between the safe planes: that of the tip where it is so on both sides, at one place."""
    stays = before is after and after.control.law == "tcp" and not by_home
    return before if stays else modes.base


def _changes_length(modes: OutputModes, before: _Stand, after: WordFrame) -> bool:
    """True where one of two modes takes the length register itself: the tool goes by home, where its length may change."""
    laws = before.frame.control.law, after.control.law
    lifts = modes.tip_from_home and has_retract_axis(modes.base.control)
    return lifts and before.pose is not None and before.frame is not after and "tcp" in laws


def _risen(modes: OutputModes, before: WordFrame, link: Link) -> Floats:
    """Joints (0 or 1, J) below home, in the mode that cancels the length where it ends: on a link by home the last block
    before that, with room for tools that are longer at the machine."""
    control, stays = modes.base.control, np.zeros((0, link.home.shape[-1]))
    if not (modes.tip_from_home and before.control.law == "tcp" and has_retract_axis(control)) or not len(link.home):
        return stays
    axis = control.machine.retract_axis
    up = link.home[:1].copy()
    rise = up[0, axis] - link.retract[-1, axis] if len(link.retract) else 0.0
    up[0, axis] -= np.sign(rise) * BELOW_HOME
    return up if abs(rise) > BELOW_HOME else stays


def _with_axes(curves: Curves, axis0: Floats, axis1: Floats) -> Curves:
    return Curves(curves.start, curves.end, axis0, axis1, curves.is_arc, curves.center, curves.normal,
                  curves.sweep)


@dataclass(frozen=True)
@arrays(risen="_ J")
class _Legs:
    """Frames and kinematics of a linking move: where it comes from, to home, on the path, where it goes to."""

    before: WordFrame
    home: WordFrame
    travel: WordFrame
    after: WordFrame
    kin_before: Kinematics
    kin_after: Kinematics
    start: Pose | None
    entry: ZeroEntry | None = None
    """where the mode that it goes to is entered with the tables at zero"""
    down: bool = False
    """the travel down from home, the last of `Link.index`, is in the mode that it goes to"""
    risen: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """joints (0 or 1, J) up to which the tool rises in the mode that it comes from"""


def _add_link(out: PathBuilder, moves: Moves, row: int, link: Link, legs: _Legs) -> None:
    """Retract, home, then the records without motion, then index and the approach to the pose itself.

    A cutting move that is linked to (no RAPID before it) is approached at its feed. Before a mode is entered
    the rotary axes are stated, whether they turn or not.
    """
    if legs.start is not None:
        _leg(out, legs.before, legs.kin_before, legs.start.q, _with_rise(link, legs.risen), row)
    out.link(legs.home, link.home, row, not legs.home.control.tip_law, link.home_state)
    out.begin[row] = out.count
    if legs.entry is not None:
        out.link(legs.travel, legs.entry.before[:-1], row, False, legs.entry.state[:-1])
        out.link(legs.travel, legs.entry.before[-1:], row, True, legs.entry.state[-1:])
        out.link(legs.after, legs.entry.inside, row)
    state = link.index_state.copy()
    if len(state) and legs.after is not legs.travel and not state[:, legs.travel.control.rotary].any(axis=0).all():
        state[-1] = True
    if legs.entry is None:
        last = len(state) - int(legs.down)
        out.link(legs.travel, link.index[:last], row, False, state[:last])
        out.link(legs.after, link.index[last:], row)
    if not len(link.approach):
        return
    begin = link.index[-1]
    if moves.kind[row] == Kind.RAPID:
        _leg(out, legs.after, legs.kin_after, begin, link.approach, row)
        return
    n = len(link.approach)
    tips, _ = legs.kin_after.forward(np.concatenate([begin[None], link.approach]))
    travels = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    seconds = travels / moves.feed[row] if moves.feed[row] > 0.0 else np.full(n, moves.seconds[row] / n)
    out.link(legs.after, link.approach, row, code=np.full(n, FEED, dtype=np.int8), seconds=seconds)


def _with_rise(link: Link, risen: Floats) -> Floats:
    """Joints (K, J) of the retract, and of the rise to below home."""
    return np.concatenate([link.retract, risen]) if len(risen) else link.retract


def _leg(out: PathBuilder, frame: WordFrame, kin: Kinematics, begin: Floats, q: Floats, row: int) -> None:
    """Blocks (K, J) along the tool axis in rapid, at feed where rapids would leave the line."""
    code = rapid_codes(frame.control, kin, np.concatenate([begin[None], q[:-1]]) if len(q) else q, q, *LEG)
    out.link(frame, q, row, code=code, seconds=np.where(code == TRAVERSE, np.nan, 0.0))


def _add_end(out: PathBuilder, modes: OutputModes, stand: _Stand, space: SafeSpace, row: int) -> None:
    """The travel home behind the last run."""
    if stand.pose is None:
        return
    out.ended, modes = 1, modes.at(stand.frame.control.place)
    link = plan_link(modes.base.control, stand.kin, stand.kin, space, stand.pose, None, True)
    _leg(out, stand.frame, stand.kin, stand.pose.q, _with_rise(link, _risen(modes, stand.frame, link)), row)
    out.link(modes.base, link.home, row, not modes.base.control.tip_law, link.home_state)
