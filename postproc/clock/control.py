"""A control with look-ahead and limited jerk, as sound as the planner: times of blocks, and the motion of the axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from postproc.clock.path import BlendedPath, CommandedPath, blended
from postproc.feedrate.feed import StepFeed
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import PlannerOptions, plan
from toolpaths.arrays import Floats
from toolpaths.shapes import arrays

STEEPEST = 0.02
"""s in which full acceleration is built up where no jerk is stated"""
AVERAGED = 10
"""blocks over which the time of taking up blocks is averaged"""
SLOWEST = 1e-3
"""mm/s or rad/s: least speed to which few blocks read ahead hold the axes"""
ALIKE, STEP = 0.02, 1e-3
"""steps of the logarithm of speeds that taking up blocks allows, and of feeds along the path of all axes"""
EVEN = 1e-9
"""blocks: parts of a block that are one in the arithmetic of their sum"""
NO_MOTION = 1e-12
"""mm or rad, against division by 0"""


@dataclass(frozen=True)
@arrays(velocity="A", acceleration="A", jerk="A")
class ControlSettings:
    """How a control plans.

    Attributes:
        velocity, acceleration, jerk (A,): largest of each axis, mm or rad per s, s2, s3; jerk inf where none is stated
        buffer: blocks that are read ahead; block_time: s that each takes at least
        strict: no sample exceeds a limit; else samples between the plan's knots may exceed jerks by some tenths
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    buffer: int = 200
    block_time: float = 0.0
    strict: bool = True


@dataclass(frozen=True)
@arrays(s="T", t="T", v="T", ends="V")
class ControlMotion:
    """The executed motion, rests without time.

    Attributes:
        plan: None where nothing moves
        s, t, v (T,): places along `path`, time and speed there; the ends of blocks and the knots of the plan
        ends (V,): s at which each point of the commanded path is reached
    """

    path: BlendedPath
    plan: Plan | None
    s: Floats
    t: Floats
    v: Floats
    ends: Floats

    @property
    def seconds(self) -> float:
        """Time of the whole motion."""
        return float(self.t[-1])

    @property
    def solved(self) -> bool:
        """Whether no stretch takes longer than the limits ask for."""
        return self.plan is None or self.plan.solved

    def joints(self) -> Floats:
        """(K, A) machine coordinates each `plan.step`."""
        return self.path.q[:1] if self.plan is None else self.plan.trajectory().q

    def times(self) -> Floats:
        """(V,) s at which each point of the commanded path is reached."""
        return np.interp(self.ends, self.s, self.t)


def execute(commanded: CommandedPath, settings: ControlSettings) -> ControlMotion:
    """What the control makes of a path.

    Raises:
        ValueError: no speed above 0 is allowed somewhere.
        ArithmeticError: no motion within the limits was found.
    """
    path = blended(commanded)
    if path.s[-1] <= path.s[0]:
        still = np.zeros(1)
        return ControlMotion(path, None, still, still, still, path.ends)
    jerk = np.minimum(settings.jerk, settings.acceleration / STEEPEST)
    limits = JointLimits(settings.velocity, settings.acceleration, jerk)
    made = plan(path, limits, StepFeed(*_feed(commanded, path, settings)), path.stops[1:-1].tolist(),
                PlannerOptions(strict=settings.strict))
    knots = [np.clip(one.eased.parameter(one.profile.sigma)[0], one.eased.first, one.eased.last) for one in made.pieces]
    s = np.unique(np.concatenate([path.ends, *knots]))
    return ControlMotion(path, made, s, np.maximum.accumulate(made.time(s)), made.speed(s), path.ends)


def _feed(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> tuple[Floats, Floats]:
    """(edges, values) of the largest speed along the path: the feed, blocks taken up, blocks read ahead."""
    along = np.diff(path.ends)
    moving = along > 0.0
    speed = np.full(len(along), np.inf)
    ratio = along[moving] / commanded.length[moving]
    speed[moving] = commanded.speed[moving] * np.exp(np.round(np.log(ratio) / STEP) * STEP)
    n = len(along)
    k = np.arange(n)
    if settings.block_time > 0.0:
        low, high = np.maximum(k - AVERAGED // 2, 0), np.minimum(k + AVERAGED // 2 + 1, n)
        taken = np.append(0.0, np.cumsum(np.broadcast_to(commanded.part, n)))
        held = (path.ends[high] - path.ends[low]) / (taken[high] - taken[low]) / settings.block_time
        speed = np.where(held < speed, _stepped(held), speed)
    held = _seen(commanded, path, settings)
    speed = np.where(held < speed, _stepped(held), speed)
    return np.append(path.ends[:-1][moving], path.ends[-1]), speed[moving]


def _seen(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> Floats:
    """(N,) speed from which the axes come to rest, at constant jerk, within the blocks read ahead of each block's end;
    inf where they rest before."""
    n = len(commanded.length)
    read = np.cumsum(np.broadcast_to(commanded.part, n))
    last = np.minimum(np.searchsorted(read, read - commanded.part + settings.buffer + EVEN, side="right"), n)
    room = np.maximum(path.ends[last] - path.ends[1:], 0.5 * np.diff(path.ends))
    slope = np.abs(np.diff(commanded.points, axis=0)) / np.maximum(np.diff(path.ends), NO_MOTION)[:, None]
    width = min(settings.buffer, n)
    steepest = maximum_filter1d(slope, width, axis=0, origin=-(width // 2), mode="nearest")
    most = np.maximum(steepest, NO_MOTION)
    a = (settings.acceleration / most).min(axis=1)
    j = (np.minimum(settings.jerk, settings.acceleration / STEEPEST) / most).min(axis=1)
    ramp = 0.5 * a * a / j
    v = np.where(room < a**3 / j**2, np.cbrt(room * room * j), np.sqrt(ramp * ramp + 2.0 * a * room) - ramp)
    return np.where(last == n, np.inf, np.maximum(v, SLOWEST))


def _stepped(speed: Floats) -> Floats:
    """Speeds in steps, so that they change only where they differ clearly."""
    return np.exp(np.floor(np.log(np.maximum(speed, SLOWEST)) / ALIKE) * ALIKE)
