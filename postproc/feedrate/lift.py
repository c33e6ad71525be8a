"""What a motion would gain if one limit alone were lifted: plans without it, for the limits that cost something."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.feedrate.feed import FeedLimit
from postproc.feedrate.limits import JointLimits, ToolLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.paths import ParametricPath
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.feedrate.trajectory import ORDERS

HIGHER = 1e3
"""By this much a limit is raised: some velocity and some jerk must bound a motion that is planned."""


class Gain(NamedTuple):
    """Joint (-1 the feed, J the tool), order (1 velocity, 2 acceleration, 3 jerk), seconds saved without this limit."""

    axis: int
    order: int
    seconds: float


def gains(path: ParametricPath, limits: JointLimits, feed: FeedLimit, stops: Sequence[float], made: Plan,
          options: PlannerOptions | None = None,
          least: float = 1e-3) -> list[Gain]:
    """Gains, largest first, of the limits whose share of `made` is `least` of its time or more; one plan each.

    They do not add up: where one limit goes, the next one binds. A limit without a share gains nothing, the problem
    being convex next to its optimum. `made` is the plan of the same arguments in fast mode.

    Raises:
        ArithmeticError: where one of the plans is not solved: its time says nothing of a gain.
    """
    def time(limits: JointLimits, feed: FeedLimit) -> float:
        return _solved(plan(path, limits, feed, stops, options))

    before, enough, found = _solved(made), least * made.seconds, []
    shares = made.shares
    for order, axis in np.argwhere(shares.limits >= enough).tolist():
        found.append(Gain(axis, order + 1, before - time(without(limits, axis, order + 1), feed)))
    if shares.feed >= enough:
        found.append(Gain(-1, 1, before - time(limits, np.inf)))
    return sorted(found, key=lambda gain: -gain.seconds)


def _solved(made: Plan) -> float:
    """Seconds of a plan that is solved."""
    if not made.solved:
        raise ArithmeticError(f"a plan of {made.seconds:.4g} s is not solved: no gain can be taken from it")
    return made.seconds


def without(limits: JointLimits, axis: int, order: int) -> JointLimits:
    """`limits` with that of one joint, or of the tool for axis J, and one order lifted."""
    if axis == len(limits.velocity):
        tool = limits.tool or ToolLimits()
        return replace(limits, tool=replace(tool, **{("tilt_rate", "acceleration", "jerk")[order - 1]: np.inf}))
    values = getattr(limits, ORDERS[order - 1]).copy()
    values[axis] *= HIGHER
    return replace(limits, **{ORDERS[order - 1]: values})
