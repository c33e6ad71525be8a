"""What each order of motion allows along the mean direction of a pass: the reach of its polytope, and the seconds of that.

Velocity, acceleration and jerk have different units; they compare by the time that a straight path as long as
the pass is takes from rest to rest where only this order is limited. The slowest binds.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from machines.choices import MotionOrder
from machines.polytope import Polytope, held_axis_polytope
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.passes.passes import CuttingStretch
from postproc.planning.planned import ORDERS
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass


@dataclass(frozen=True)
class Reach:
    """One order along the mean direction.

    Attributes:
        order: "velocity", "acceleration", "jerk"; "feed" for the programmed one
        rate: mm/s, mm/s2 or mm/s3
        axis: the joint that ends it, "" for the feed
        seconds: least, from rest to rest straight over the length
    """

    order: MotionOrder | Literal["feed"]
    rate: float
    axis: str
    seconds: float


def reaches(made: Candidate) -> tuple[Reach, ...]:
    """Reaches of a turned pass in the middle of its longest stretch; none where it cannot be run or has no direction.

    Orders without a limit are left out.
    """
    direction, length = direction_of(made.one.longest)
    found = []
    for order, shape in polytopes(made).items():
        rate, joint = shape.reach(direction), int(shape.binding(direction)[0])
        if np.isfinite(rate[0]) and rate[0] > 0.0:
            seconds = float(least_seconds(order, rate, length)[0])
            found.append(Reach(order, float(rate[0]), made.machine.axis_names[joint], seconds))
    return tuple(found)


def feed_of(made: Candidate) -> Reach | None:
    """The largest feed of the longest stretch, as an order of its own; None where the pass cannot be run or
    has no direction."""
    stretch = made.one.longest
    length = direction_of(stretch)[1]
    if stretch is None or made.refused or not length:
        return None
    rate = float(stretch.feed(stretch.s).max())
    return Reach("feed", rate, "", length / rate)


def least_under(made: Candidate, axes: Floats, near: Floats | None = None) -> Floats:
    """Seconds (N,) of the slowest order, as `Reach.seconds`, under tool axes (N, 3), table frame; NaN where out of reach.

    In the middle of the longest stretch of `made`, on the branch that is fastest; travel is not looked at.

    Args:
        near: (N, J) joints that say where a joint stands which the axis leaves free; default: home
    """
    one, limits, stretch = made.one, made.machine.cutting_limits, made.one.longest
    direction, length = direction_of(stretch)
    if stretch is None or not length:
        return np.full(len(axes), np.nan)
    tip = stretch.tip[len(stretch.tip) // 2] + one.radius * (one.axis - axes)
    pose, result = np.hstack((tip, axes)), np.full(len(axes), np.nan)
    for q in one.kin.inverse(tip, axes, near=made.machine.home if near is None else near):
        slowest = np.zeros(len(axes))
        for order, rate in zip(ORDERS, (limits.velocity, limits.acceleration, limits.jerk), strict=True):
            if np.isfinite(rate[~np.array(one.kin.rotary)]).any():
                reach = held_axis_polytope(one.kin, q, rate, pose).reach(direction)
                slowest = np.maximum(slowest, least_seconds(order, reach, length))
        result = np.fmin(result, slowest)
    return result


def least_held(made: Candidate, joint: int, angles: Floats) -> Floats:
    """As `least_under`, with the axis of `made` and its free rotary `joint` held at `angles` (N,), rad."""
    near = np.tile(made.machine.home, (len(angles), 1))
    near[:, joint] = angles
    return least_under(made, np.tile(made.axis, (len(angles), 1)), near)


def binding(found: tuple[Reach, ...]) -> Reach | None:
    """The order that takes longest."""
    return max(found, key=lambda one: one.seconds, default=None)


def least_seconds(order: MotionOrder, rate: Floats, length: float) -> Floats:
    """Seconds (N,) from rest to rest over `length` (mm) where only one order is limited to `rate` (N,).

    L / v; 2 sqrt(L / a), half the way speeding up; (32 L / j)^(1/3), jerk +, -, -, + for a quarter of the time each
    (integrated: L = j T^3 / 32).
    """
    if order == "velocity":
        return np.asarray(length / rate)
    return np.asarray(2.0 * np.sqrt(length / rate) if order == "acceleration" else np.cbrt(32.0 * length / rate))


def direction_of(stretch: CuttingStretch | None) -> tuple[Floats, float]:
    """Mean direction (3,) of a stretch and the length of its chord, mm; (0, 0, 0) and 0 where it has none."""
    mean = None if stretch is None else stretch.directions().get("mean")
    if stretch is None or mean is None:
        return np.zeros(3), 0.0
    return mean, float(np.linalg.norm(stretch.tip[-1] - stretch.tip[0]))


def polytopes(made: Candidate) -> dict[MotionOrder, Polytope]:
    """By order, the polytope of tip rates in the middle of the longest stretch, table frame, mm and s.

    Empty where the pass cannot be run, has no direction, the machine cannot move the tip alone, or for a slim `Candidate`.
    """
    one, stretch = made.one, made.one.longest
    if stretch is None or made.refused or not made.sites or not direction_of(stretch)[1]:
        return {}
    which = next(k for k, other in enumerate(one.stretches) if other is stretch)
    middle = len(stretch.tip) // 2
    q = made.sites[which][middle:middle + 1]
    axis = stretch.axis[middle] if one.fixed else made.axis
    near = np.hstack((stretch.tip[middle] + one.shift(made.axis), axis))[None]
    limits = made.machine.cutting_limits
    shapes = {order: held_axis_polytope(one.kin, q, rate, near)
              for order, rate in zip(ORDERS, (limits.velocity, limits.acceleration, limits.jerk), strict=True)}
    return {order: shape for order, shape in shapes.items() if np.isfinite(shape.normals).all() and shape.normals.size}
