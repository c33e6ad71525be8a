"""The highest constant speed of each block at which no axis exceeds velocity, acceleration or jerk anywhere
in it, nor the tool the limits that the set-up gives it.

At a constant rate v of the path parameter the joints move with q' v, q'' v^2 and q''' v^3. The passes must stop at corners
(`CORNER`): there no feed of a block keeps the limits, and the control slows down by itself.
"""

from __future__ import annotations

import numpy as np

from postproc.feedrate.limits import JointLimits, MotorLimits, ToolLimits
from postproc.planning.geometry import DEGREE, MachinePath
from postproc.planning.pass_geometry import PassGeometry
from toolpaths.arrays import Floats

CORNER = 0.2
"""rad: the largest turn in one joint of the path that is meant to be passed at the feed of a block"""
PLACES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""of each block, where its forces are looked at"""
ROUNDING = 1e-3
"""Part of the speed that rounding of feed words may take"""


def steady_seconds(passes: list[tuple[PassGeometry, JointLimits]], count: int) -> Floats:
    """(count,) least seconds of each block of a Path at a constant feed; 0 where no limit binds.

    `passes`: each with its limits.
    """
    seconds = np.zeros(count)
    for one, limits in passes:
        travel = one.ends - one.begin
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = travel / ((1.0 - ROUNDING) * steady_speed(one, limits))
        np.maximum.at(seconds, one.block, np.where(travel > 0.0, needed, 0.0))
    return seconds


def steady_speed(one: PassGeometry, limits: JointLimits) -> Floats:
    """(k,) largest constant ds/dt in each block of a pass."""
    breaks = np.concatenate([path.breaks[:-1] for path in one.paths] + [one.paths[-1].breaks[-1:]])
    speed = np.concatenate([span_speed(path, limits) for path in one.paths])
    low = np.clip(np.searchsorted(breaks, one.begin, side="right") - 1, 0, len(speed) - 1)
    high = np.clip(np.searchsorted(breaks, one.ends, side="left"), low + 1, len(speed))
    slowest = np.minimum.reduceat(np.append(speed, np.inf), np.stack((low, high), axis=1).ravel())[::2]
    return np.asarray(slowest if limits.forces is None else np.minimum(slowest, _force_speed(one, limits.forces)))


def _force_speed(one: PassGeometry, forces: MotorLimits) -> Floats:
    """(k,) the same under limits of forces, by PLACES of each block and the largest change between them."""
    travel, path = one.ends - one.begin, np.searchsorted([p.end for p in one.paths], one.ends)
    used = np.zeros((len(PLACES), len(travel)))
    for k, made in enumerate(one.paths):
        here = np.flatnonzero(path == k)
        for row, place in enumerate(PLACES):
            at = made.derivatives(np.clip(one.begin[here] + place * travel[here], made.start, made.end))
            used[row, here] = (forces.steady(at.q, at.dq, at.d2q) ** -2.0).max(axis=1, initial=0.0)
    worst = used.max(axis=0) + 0.5 * np.abs(np.diff(used, axis=0)).max(axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(1.0 / worst))


def span_speed(path: MachinePath, limits: JointLimits) -> Floats:
    """(S,) largest constant ds/dt on each span between knots, from below: derivatives stay within the hull of
    their B-spline coefficients (de Boor, A Practical Guide to Splines, XI)."""
    speed = np.full(len(path.s) - DEGREE, np.inf)
    orders = _hulls(path.fitted.t, path.fitted.c, len(speed))
    for order, (limit, hull) in enumerate(zip((limits.velocity, limits.acceleration, limits.jerk), orders, strict=True), 1):
        with np.errstate(divide="ignore"):
            speed = np.minimum(speed, np.min(limit / np.max(np.abs(hull), axis=0), axis=1) ** (1.0 / order))
    return speed if limits.tool is None else np.minimum(speed, _tool_speed(path, limits.tool, len(speed)))


def _tool_speed(path: MachinePath, limits: ToolLimits, spans: int) -> Floats:
    """(S,) the same for tip and tool axis, by the lengths of the coefficients' vectors."""
    first, second, third = _hulls(path.tool_spline.t, path.tool_spline.c, spans)
    tilt, acceleration, jerk = (np.linalg.norm(hull[..., columns], axis=2).max(axis=0) for hull, columns in
                                ((first, np.s_[3:]), (second, np.s_[:3]), (third, np.s_[:3])))
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum(limits.tilt_rate / tilt, np.minimum(
            np.sqrt(limits.acceleration / acceleration), np.cbrt(limits.jerk / jerk))))


def _hulls(t: Floats, c: Floats, spans: int) -> list[Floats]:
    """Coefficients (degree, S, columns) between which each of three derivatives lies on each span."""
    result = []
    for order in (1, 2, 3):
        degree = DEGREE + 1 - order
        c = degree * np.diff(c, axis=0) / (t[degree + 1:-1] - t[1:-degree - 1])[:, None]
        t = t[1:-1]
        result.append(np.stack([c[k:k + spans] for k in range(degree)]))
    return result
