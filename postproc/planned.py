"""The planned motion of a program's passes: least time under the limits of the axes and the programmed feed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Limits
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import Options, plan
from postproc.feedrate.shares import Shares
from postproc.feedrate.trajectory import JointTrajectory
from postproc.moves import Moves
from postproc.pass_geometry import PassGeometry, pass_geometry
from postproc.path import Path
from postproc.steady_feed import CORNER, steady_seconds
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.smoothing.smooth import Tolerance

ORDERS = ("velocity", "acceleration", "jerk")


def joint_limits(limits: Limits) -> JointLimits:
    """What the planner needs of a machine's limits."""
    return JointLimits(limits.velocity, limits.acceleration, limits.jerk)


@dataclass(frozen=True)
class PassFeed:
    """Largest ds/dt along a pass: the tip at the feed of each move, or the way of a move in its time.

    `s` (M + 1,) ends of the moves; `feed` (M,) mm/s, NaN where `seconds` (M,) counts.
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

    def _tip_speed(self, s: Floats) -> Floats:
        """(N,) mm of the tip per mm of way."""
        starts = [path.start for path in self.geometry.paths[1:]]
        which, result = np.searchsorted(starts, s, side="right"), np.empty(len(s))
        for k in np.unique(which).tolist():
            here = which == k
            speed = np.linalg.norm(self.geometry.paths[k].tip(s[here]).dq, axis=1)
            result[here] = np.where(speed > STANDS, speed, 0.0)
        return result


STANDS = 1e-9
"""mm of the tip per mm of way: less is round-off"""


@dataclass(frozen=True)
class PlannedMotion:
    """What is planned of a program: its passes, from rest to rest each.

    Attributes:
        passes: in order
        moves: the moves they belong to; limits: of the joints
        needed (K,): least seconds of each block of the Path at a constant feed that keeps the limits, 0 where none binds
    """

    passes: tuple[PassGeometry, ...]
    moves: Moves
    limits: JointLimits
    needed: Floats
    axis_names: tuple[str, ...]

    @cached_property
    def plans(self) -> tuple[Plan, ...]:
        """One for each pass; made when they are first asked for."""
        return tuple(plan_pass(one, self.moves, self.limits) for one in self.passes)

    @property
    def seconds(self) -> float:
        """Time of all passes, rapids and linking moves left out."""
        return float(sum(made.seconds for made in self.plans))

    def trajectories(self) -> tuple[JointTrajectory, ...]:
        """1 ms samples of each pass."""
        return tuple(made.trajectory() for made in self.plans)

    @property
    def shares(self) -> Shares | None:
        """What each limit costs, over all passes; None where nothing cuts."""
        return reduce(add, (made.shares for made in self.plans)) if self.plans else None

    def limiting(self) -> dict[str, dict[str, float]]:
        """Seconds that each limit of each axis costs, as the plan's multipliers share them out."""
        shares = self.shares
        if shares is None:
            return {}
        return {name: {f"{order}_s": float(shares.limits[k, j]) for k, order in enumerate(ORDERS)}
                for j, name in enumerate(self.axis_names)}


def planned_motion(path: Path, moves: Moves, kinematics: Callable[[int], Kinematics], limits: Limits,
                   axis_names: tuple[str, ...], tolerance: Tolerance, stops: Ints,
                   file: str = "") -> tuple[PlannedMotion | None, list[Diagnostic]]:
    """Geometry of all passes of a path, smoothed within `tolerance`, and the feeds that keep the limits.

    Feeds of blocks are for motion that stops at corners; the planned motion blends them (see `steady_feed`).
    """
    bounds = joint_limits(limits)
    blended, diagnostics = pass_geometry(path, moves, kinematics, tolerance, stops, file=file)
    stopping, more = pass_geometry(path, moves, kinematics, tolerance, stops, CORNER, file)
    if diagnostics or more:
        return None, diagnostics or more
    needed = steady_seconds(stopping, bounds, len(path))
    return PlannedMotion(tuple(blended), moves, bounds, needed, axis_names), []


def plan_pass(one: PassGeometry, moves: Moves, limits: JointLimits, options: Options | None = None) -> Plan:
    """The motion of least time along a pass, from rest to rest, stopping where its geometry does."""
    rows = slice(one.first, one.last)
    feed = PassFeed(one, one.smooth.s, moves.feed[rows], moves.seconds[rows])
    made = [plan(path, limits, feed, options=options) for path in one.paths]
    return replace(made[0], pieces=tuple(piece for each in made for piece in each.pieces),
                   iterations=max(each.iterations for each in made), mismatch=max(each.mismatch for each in made),
                   solved=all(each.solved for each in made))
