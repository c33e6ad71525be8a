"""The planned motion of a program's passes: least time under the limits of the axes and the programmed feed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from functools import cached_property, reduce
from operator import add
from typing import get_args

import numpy as np

from machines.choices import MotionOrder
from machines.dynamics.limits import LEAST, force_limits
from machines.kinematics.base import Kinematics
from machines.machine import Limits, Machine
from postproc.feedrate.limits import JointLimits, ToolLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.shares import LimitShares
from postproc.feedrate.trajectory import JointTrajectory
from postproc.path.added_points import cut_at
from postproc.path.model import FEED, JointPath
from postproc.planning.pass_geometry import PassGeometry, pass_geometry
from postproc.planning.planned_errors import PlannedCorrection
from postproc.planning.sampled_limits import worst_ratio
from postproc.planning.steady_feed import CORNER, steady_seconds
from postproc.planning.word_feeds import points_between, with_points, word_seconds
from postproc.reference.moves import Moves
from postproc.setup.model import ToolSetup
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import REPORT, Diagnostic, DiagnosticError, error, require
from toolpaths.shapes import arrays
from toolpaths.smoothing.blend import SHARPEST
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.units import DEG

ORDERS: tuple[MotionOrder, ...] = get_args(MotionOrder)
BEYOND = 0.002
"""share of a limit that round-off of derivatives may take; `steady_feed.ROUNDING` keeps half of it free"""
STRAIGHT, CORNER_TURN = 1e-3, 0.5
"""rad between blocks that a control takes as points of one curve"""
SHORTEST = 0.005
"""mm or degrees that a part of a block goes at least, in the axis that goes farthest: 50 steps of the usual words"""


def joint_limits(limits: Limits) -> JointLimits:
    """What the planner needs of a machine's limits."""
    return JointLimits(limits.velocity, limits.acceleration, limits.jerk)


def limits_at_feed(machine: Machine, kinematics: Kinematics, tool: ToolLimits | None = None,
                   cutting_force: float = 0.0) -> JointLimits:
    """What the planner needs of a machine that cuts: limits of axes, tool and motors.

    Args:
        kinematics: at the tip
        cutting_force: N at the tip
    """
    return replace(joint_limits(machine.cutting_limits), tool=tool, forces=force_limits(machine, kinematics, cutting_force))


def tool_limits(tool: ToolSetup | None) -> ToolLimits | None:
    """What the planner needs of a tool of the set-up; None where it has no limit."""
    if tool is None or not tool.limited:
        return None
    return ToolLimits((tool.axis_rate or np.inf) * DEG, tool.tip_acceleration or np.inf,
                      tool.tip_jerk or np.inf)


@dataclass(frozen=True)
@arrays(s="C+1", feed="C", seconds="C")
class PassFeed:
    """Largest ds/dt along a pass: the tip at the feed of each move, or the path of a move in its time.

    `s` (C + 1,) ends of the curves; `feed` (C,) mm/s, NaN where `seconds` (C,) counts.
    """

    geometry: PassGeometry
    s: Floats
    feed: Floats
    seconds: Floats

    def __call__(self, s: Floats) -> Floats:
        """(N,) at s (N,); infinite where only the axis turns at a feed of the tip."""
        move = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.feed) - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            timed = np.diff(self.s)[move] / self.seconds[move]
            fed = self.feed[move] / self._tip_speed(s)
        return np.asarray(np.where(np.isnan(self.feed[move]), timed, fed))

    @property
    def breaks(self) -> Floats:
        """Where one move yields to another feed; each move of a stated time has its own."""
        before, behind = self.feed[:-1], self.feed[1:]
        return np.asarray(self.s[1:-1][(before != behind) & (np.diff(self.s)[1:] > 0.0)])

    def _tip_speed(self, s: Floats) -> Floats:
        """(N,) mm of the tip per mm of path."""
        starts = [path.start for path in self.geometry.paths[1:]]
        which, result = np.searchsorted(starts, s, side="right"), np.empty(len(s))
        for k in np.unique(which).tolist():
            here = which == k
            speed = np.linalg.norm(self.geometry.paths[k].tip(s[here]).dq, axis=1)
            result[here] = np.where(speed > STANDS, speed, 0.0)
        return result


STANDS = 1e-9
"""mm of the tip per mm of path: less is round-off"""


@dataclass(frozen=True)
@arrays(by_control="K")
class PlannedMotion:
    """What is planned of a program: its passes, from rest to rest each.

    Attributes:
        source: what the passes are made from
        strict: no sample of the plans exceeds a limit; else those between its knots may, jerks by some tenths
        made: the passes with their corners blended and their plans; None: made when they are first asked for
        by_control (K,): least s of each block at which the control can run it by its own rules, where these are known
    """

    source: Source
    strict: bool = False
    made: tuple[tuple[PassGeometry, Plan], ...] | None = None
    by_control: Floats | None = None

    @cached_property
    def passes(self) -> tuple[PassGeometry, ...]:
        """The passes with their corners blended.

        Raises:
            DiagnosticError: where the smoothed path leaves the reach of the machine.
        """
        if self.made is not None:
            return tuple(one for one, _ in self.made)
        found, diagnostics = self.source.geometry()
        require(diagnostics)
        return tuple(found)

    @cached_property
    def plans(self) -> tuple[Plan, ...]:
        """One for each pass.

        Raises:
            DiagnosticError: where no motion keeps the limits.
        """
        return tuple(plan for _, plan in self.made) if self.made is not None else tuple(map(self._plan, self.passes))

    @cached_property
    def needed(self) -> Floats:
        """(K,) least seconds of each block of the Path, 0 where nothing is planned: at the highest speed that the plan has
        in it, by the control's rules where these are known, and at which a constant feed keeps the limits of the tool; of a
        control that limits no jerk and makes its ramps itself, at which a constant feed keeps all limits.

        Raises:
            DiagnosticError: as `passes` and `plans`.
        """
        steady = self._steady[1]
        if not self.source.limited_jerk:
            return steady
        if self.by_control is not None:
            steady = np.fmax(steady, self.by_control)
            if not self.source.tools:
                return steady
        return np.fmax(steady, word_seconds(tuple(zip(self.passes, self.plans, strict=True)), len(self.source.path)))

    @cached_property
    def _steady(self) -> tuple[tuple[PassGeometry, ...], Floats]:
        """The passes stopping at corners, and (K,) s of each block at a constant feed that keeps `Source.steady`."""
        count = len(self.source.path)
        if self.source.limited_jerk and not self.source.tools and not self.source.motors_limited:
            return (), np.zeros(count)
        found, diagnostics = self.source.geometry(CORNER)
        require(diagnostics)
        return tuple(found), steady_seconds([(one, self.source.steady(one)) for one in found], count)

    def _plan(self, one: PassGeometry) -> Plan:
        try:
            options = PlannerOptions(override=self.source.override, strict=self.strict)
            return plan_pass(one, self.source.moves, self.source.bounds_of(one), options)
        except (ValueError, ArithmeticError) as fault:
            lines = self.source.moves.line[one.move[[0, -1]]].tolist()
            raise DiagnosticError([error("plan.failed", f"no motion could be planned: {fault}", file=self.source.file,
                                         lines=lines, hint=f"{REPORT}; --feed programmed needs no plan")]) from fault

    def with_points(self, home: Floats, unit: Floats, whole: Bools) -> PlannedMotion:
        """The same motion on blocks of which none spans too much change of speed; arcs stay whole.

        Args:
            home: (J,) joints before the first block; unit (J,): mm or degrees of a unit of each joint
            whole: (M,) moves whose blocks stay as they are
        """
        path, made = self.source.path, tuple(zip(self.passes, self.plans, strict=True))
        before = np.concatenate([home[None], path.q[:-1]])
        travel = (np.abs(path.q - before) * unit).max(axis=1, initial=0.0)
        fit = (path.code == FEED) & ~whole[path.move] & ~_on_curve((path.q - before) * unit, travel)
        added = points_between(made, fit, travel, SHORTEST)
        cut = cut_at(path, self.source.moves, self.source.kinematics, home, *added)
        return replace(self, source=replace(self.source, path=cut),
                       made=tuple((with_points(one, added, len(path)), plan) for one, plan in made))

    @property
    def seconds(self) -> float:
        """Time of all passes, rapids and linking moves left out."""
        return float(sum(made.seconds for made in self.plans))

    def trajectories(self) -> tuple[JointTrajectory, ...]:
        """1 ms samples of each pass."""
        return tuple(made.trajectory() for made in self.plans)

    @property
    def shares(self) -> LimitShares | None:
        """What each limit costs, over all passes; None where nothing cuts, or the machine states no jerk."""
        known = bool(self.passes) and bool(np.isfinite(self.source.bounds.jerk).all())
        return reduce(add, (made.shares for made in self.plans)) if known else None

    def limiting(self) -> dict[str, dict[str, float]]:
        """Seconds that each limit of each axis costs, as the plan's multipliers share them out; "tool", where one has
        limits: rate of its axis, acceleration and jerk of the tip."""
        shares = self.shares
        if shares is None:
            return {}
        names = (*self.source.machine.axis_names, *(("tool",) if self.source.tools else ()))
        return {name: {f"{order}_s": float(shares.limits[k, j]) for k, order in enumerate(ORDERS)}
                for j, name in enumerate(names)}


def _on_curve(step: Floats, travel: Floats) -> Bools:
    """(K,) blocks, steps (K, J) between joints, that go on at either end into a block of another direction: points of one
    curve. A point on the chord between two would be a corner for the control."""
    u = step / np.maximum(np.linalg.norm(step, axis=1), SHORTEST / 10.0)[:, None]
    turn = np.linalg.norm(np.diff(u, axis=0), axis=1)
    bent = (turn > STRAIGHT) & (turn < CORNER_TURN) & (travel[1:] > 0.0) & (travel[:-1] > 0.0)
    return np.asarray(np.append(bent, False) | np.append(False, bent))


@dataclass(frozen=True)
@arrays(stops="S")
class Source:
    """What passes are made from: blocks, moves, machine, kinematics by tool, tolerance, rows before which it
    stops, how geometric errors are corrected, where they are, the feed override (1 for 100 %) at which the
    motion is planned, limits by index of the tool, whether the
    control limits jerks, and N at the tip while it cuts, by index of the tool."""

    path: JointPath
    moves: Moves
    machine: Machine
    kinematics: Callable[[int], Kinematics]
    tolerance: Tolerance
    stops: Ints
    file: str = ""
    correction: PlannedCorrection | None = None
    override: float = 1.0
    tools: Mapping[int, ToolLimits] = field(default_factory=dict)
    limited_jerk: bool = True
    cutting: Mapping[int, float] = field(default_factory=dict)

    @property
    def motors_limited(self) -> bool:
        """Whether the machine file says what its motors can give."""
        return self.machine.dynamics is not None and self.machine.dynamics.limited

    @property
    def bounds(self) -> JointLimits:
        """Limits of the joints."""
        return joint_limits(self.machine.cutting_limits)

    def bounds_of(self, one: PassGeometry) -> JointLimits:
        """Limits of the joints, of the tool that cuts a pass, and of the motors."""
        tool = int(self.moves.tool[one.move[0]])
        return limits_at_feed(self.machine, self.kinematics(tool), self.tools.get(tool), self.cutting.get(tool, 0.0))

    def steady(self, one: PassGeometry) -> JointLimits:
        """What no control keeps by itself, so that it is kept at the constant feed of a block: limits of tool and motors,
        and those of the axes where it limits no jerk."""
        free, found = np.full(len(self.machine.axis_names), np.inf), self.bounds_of(one)
        return JointLimits(free, free, free, found.tool, found.forces) if self.limited_jerk else found

    def geometry(self, sharpest: float = SHARPEST) -> tuple[list[PassGeometry], list[Diagnostic]]:
        """See `pass_geometry`."""
        return pass_geometry(self.path, self.moves, self.kinematics, self.tolerance, self.stops, sharpest, self.file,
                             self.correction)


def planned_motion(source: Source) -> tuple[PlannedMotion | None, list[Diagnostic]]:
    """The motion of a path's passes within all limits; errors where there is none, or where it exceeds a limit."""
    motion = PlannedMotion(source, strict=True)
    try:
        stopping, steady = motion._steady
        planned = zip(motion.passes, motion.plans, strict=True) if source.limited_jerk else ()
        found = [one for one in planned if _worst(one[1]) > 1.0 + BEYOND]
    except DiagnosticError as fault:
        return None, list(fault.diagnostics)
    beyond = [] if source.limited_jerk else _limits_exceeded(list(stopping), steady, source)
    if found:
        one, made = max(found, key=lambda pair: _worst(pair[1]))
        beyond.append(_beyond(_worst(made), source.moves.line[one.move[[0, -1]]].tolist(), len(found), source.file))
    beyond += _too_weak(motion)
    return (None, beyond) if beyond else (motion, [])


def _too_weak(motion: PlannedMotion) -> list[Diagnostic]:
    """An error where standing still, under gravity and the force at the tool, takes more than a motor has."""
    source, worst = motion.source, (0.0, "", 0)
    if not source.motors_limited:
        return []
    for one in motion.passes:
        forces = source.bounds_of(one).forces
        shares = np.zeros((0, 0)) if forces is None else forces.standing(source.path.q[one.block])
        if shares.size and shares.max() > worst[0]:
            k, j = np.unravel_index(int(shares.argmax()), shares.shape)
            names = (source.machine.by_drives or source.machine).axis_names
            worst = float(shares[k, j]), names[int(j)], int(source.path.move[one.block[k]])
    if worst[0] <= 1.0 - LEAST:
        return []
    return [error("plan.force", f"standing still, or hardly moving, takes {worst[0]:.2f} times the force that the motor of "
                  f"{worst[1]} can give: at most {1.0 - LEAST:g} leave some for motion",
                  file=source.file, lines=[int(source.moves.line[worst[2]])],
                  hint="check masses, force, balance and friction of [dynamics] in the machine file, and cutting_force of "
                       "the set-up")]


def _limits_exceeded(passes: list[PassGeometry], needed: Floats, source: Source) -> list[Diagnostic]:
    """An error where blocks that take the seconds (K,) needed exceed a limit of the machine file at sampled places."""
    worst, where, count = 1.0 + BEYOND, 0, 0
    for one in passes:
        ratio = worst_ratio(one, needed[one.block], source.machine.limits)
        count += int((ratio > 1.0 + BEYOND).sum())
        if len(ratio) and ratio.max() > worst:
            worst, where = float(ratio.max()), int(source.moves.line[source.path.move[one.block[ratio.argmax()]]])
    return [_beyond(worst, [where], count, source.file)] if count else []


def _beyond(worst: float, lines: list[int], count: int, file: str) -> Diagnostic:
    return error("plan.limits", f"a planned feed would take {worst:.3f} times what an axis can do", file=file, lines=lines,
                 count=count, hint=f"{REPORT}; --feed programmed needs no plan")


def _worst(made: Plan) -> float:
    """Largest ratio of a plan's samples to a limit; of velocities and accelerations where no jerk is limited."""
    return float(made.usage().worst) if np.isfinite(made.limits.jerk).all() else 0.0


def pass_feed(one: PassGeometry, moves: Moves) -> PassFeed:
    """The largest speed along a pass as the moves ask for it."""
    return PassFeed(one, one.smooth.s, moves.feed[one.move], moves.seconds[one.move] * one.share)


def plan_pass(one: PassGeometry, moves: Moves, limits: JointLimits,
              options: PlannerOptions | None = None) -> Plan:
    """The motion of least time along a pass, from rest to rest, stopping where its geometry does.

    Of second order where the machine states no jerk for some axis.
    """
    feed = pass_feed(one, moves)
    run = plan if np.isfinite(limits.jerk).all() else plan_second_order
    made = [run(path, limits, feed, options=options) for path in one.paths]
    return replace(made[0], pieces=tuple(piece for each in made for piece in each.pieces),
                   iterations=max(each.iterations for each in made), mismatch=max(each.mismatch for each in made),
                   solved=all(each.solved for each in made))
