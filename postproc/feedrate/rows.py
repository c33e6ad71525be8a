"""What limits the motion at places of a path: joints, and where asked for the tool and the forces, as rows of one kind.

The tip's acceleration lies in the plane of tangent t and normal n of its path, and so does its jerk but for
|b p'''| x^1.5 along the binormal b, which only caps x. The disc of allowed vectors in that plane is replaced by the
regular octagon inside it that touches it along +-t and +-n: on straight lines nothing is given away,
elsewhere at most 1 - cos(pi/8) = 7.6 %. Where a twisted path has jerk in the plane and out of it at once,
strict mode sees to their sum.

Forces of motors depend on the place and are not the same on both sides: |a x'/2 + b x + o| <= 1 is a row whose first and
second derivatives are a and b, without a third, about the middle -o (`LimitRows.middle`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np

from postproc.feedrate.limits import JointLimits, MotorLimits, ToolLimits, squared_speed, steady_cap
from postproc.feedrate.paths import Derivatives, Eased, ParametricToolPath
from toolpaths.arrays import Floats, Ints
from toolpaths.rotations import unit

UNBOUND = 1e4
"""Where no velocity bounds x, this many times the steady cap does, so that numbers stay comparable."""
FREE, AT_ONCE = 0.9, 65536
"""of a limit of forces, up to which it is left out where nothing can bring more; places looked at together"""
OCTAGON = np.pi / 8.0 * np.array([1.0, 3.0, 5.0, 7.0])
"""Directions of its sides from the tangent; the opposite ones come with each row."""


class LimitRows(NamedTuple):
    """Derivatives by sigma (N, R), limits (R,) of acceleration and jerk, largest x = sigma_dot^2 (N,) and what caps it.

    Rows are the joints, behind them those of the tool, then those of forces, one a joint; `capped` (N,) is the joint, J for
    the tool, R for the feed. `middle` (N, R) is added to the accelerations over their limits, None: 0.
    """

    dq: Floats
    d2q: Floats
    d3q: Floats
    limits: JointLimits
    cap: Floats
    capped: Ints
    middle: Floats | None = None


class ToolMotion(NamedTuple):
    """At places of a path: tip by sigma, unit tangent, normal and binormal (N, 3), |d axis/d sigma| (N,)."""

    tip: Derivatives
    frame: tuple[Floats, Floats, Floats]
    tilt: Floats


def rows(eased: Eased, sigma: Floats, limits: JointLimits, feed: Callable[[Floats], Floats]) -> LimitRows:
    """All rows at sigma (N,); `feed` gives the largest ds/dt at s."""
    s = eased.parameter(sigma)
    at = eased.chained(sigma, s, eased.path.derivatives(eased.inside(s[0])))
    allowed = np.where(s[1] > 0.0, feed(s[0]) / np.where(s[1] > 0.0, s[1], 1.0), np.inf)
    with np.errstate(divide="ignore"):
        speeds = limits.velocity / np.abs(at.dq)
    if limits.tool is None:
        free = np.full(len(sigma), np.inf)
        at, limits, middle = with_forces(at, limits, np.minimum(speeds.min(axis=1), allowed))
        return _capped(at, limits, speeds, free, allowed)._replace(middle=middle)
    found = tool(eased, sigma, s)
    with np.errstate(divide="ignore"):
        binormal = limits.tool.jerk / np.abs(np.einsum("ij,ij->i", found.frame[2], found.tip.d3q))
        tilted = np.minimum(limits.tool.tilt_rate / found.tilt, np.cbrt(binormal))
    inner, most = _octagon(found, limits.tool)
    both = Derivatives(at.q, *(np.concatenate(pair, axis=1) for pair in zip(at[1:], inner, strict=True)))
    velocity, acceleration, jerk = (np.append(old, np.full(4, new)) for old, new in (
        (limits.velocity, np.inf), (limits.acceleration, most[0]), (limits.jerk, most[1])))
    wide = JointLimits(velocity, acceleration, jerk, forces=limits.forces)
    both, wide, middle = with_forces(both, wide, np.minimum(np.minimum(speeds.min(axis=1), allowed), tilted))
    return _capped(both, wide, speeds, tilted, allowed)._replace(middle=middle)


def with_forces(at: Derivatives, limits: JointLimits, speed: Floats) -> tuple[Derivatives, JointLimits, Floats | None]:
    """The rows (N, R) and behind them those of the forces of the joints, where they are limited, at speeds up to (N,); their
    middles."""
    if limits.forces is None:
        return at, limits, None
    joints = at.q.shape[1]
    first, second, own = limits.forces.rows(at.q, at.dq[:, :joints], at.d2q[:, :joints], speed)
    columns = zip(at[1:], (first, second, np.zeros_like(first)), strict=True)
    free, one = np.full(joints, np.inf), np.ones(joints)
    most = JointLimits(np.append(limits.velocity, free), np.append(limits.acceleration, one), np.append(limits.jerk, free),
                       forces=limits.forces)
    return Derivatives(at.q, *map(np.column_stack, columns)), most, np.column_stack((np.zeros_like(at.dq), own))


def forces_bind(eased: Eased, sigma: Floats, limits: JointLimits, feed: Callable[[Floats], Floats]) -> bool:
    """Whether limits of forces may slow a motion down at sigma (N,), or the others hold everywhere before they do.

    By the largest s'^2 that velocities and feed allow and the largest |s''| that accelerations allow next to it.
    """
    if limits.forces is None:
        return False
    for first in range(0, len(sigma), AT_ONCE):
        s = eased.inside(eased.parameter(sigma[first:first + AT_ONCE])[0])
        at = eased.path.derivatives(s)
        most = np.minimum(squared_speed(at.dq, limits.velocity), feed(s) ** 2)[:, None]
        a, b, middle = (np.abs(row) for row in limits.forces.rows(at.q, at.dq, at.d2q, np.sqrt(most[:, 0])))
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.nanmin((limits.acceleration + np.abs(at.d2q) * most) / np.abs(at.dq), axis=1)
            if not (a * change[:, None] + b * most <= FREE * (1.0 - middle)).all():
                return True
    return False


def steady_force_speed(eased: Eased, sigma: Floats, forces: MotorLimits) -> Floats:
    """Largest constant sigma_dot (N,) under limits of forces."""
    at = eased.derivatives(sigma)
    return np.asarray(forces.steady(at.q, at.dq, at.d2q).min(axis=1))


def tool(eased: Eased, sigma: Floats, s: Floats) -> ToolMotion:
    """The tool at sigma (N,), s (4, N) as of `Eased.parameter`."""
    path, inside = cast(ParametricToolPath, eased.path), eased.inside(s[0])
    inner = path.tip(inside)
    tangent = unit(inner.dq, 0.0)
    normal = _across(inner.d2q, tangent)
    flat = np.linalg.norm(normal, axis=1) <= 1e-12 * np.linalg.norm(inner.d2q, axis=1)
    normal[flat] = _across(inner.d3q, tangent)[flat]
    normal = unit(normal, 0.0)
    tilt = np.linalg.norm(path.axis(inside).dq, axis=1) * s[1]
    return ToolMotion(eased.chained(sigma, s, inner), (tangent, normal, np.cross(tangent, normal)), tilt)


def at_tool(found: ToolMotion, speed: Floats, rates: tuple[Floats, Floats, Floats]) -> Floats:
    """(N, 3) what each limit at the tool is of: rate of its axis, acceleration and jerk of the tip; `speed` (N,) along
    sigma, `rates` (N, 3) of the tip in time."""
    return np.column_stack((found.tilt * speed, *(np.linalg.norm(rate, axis=1) for rate in rates[1:])))


def steady_tool_speed(eased: Eased, sigma: Floats, limits: ToolLimits) -> Floats:
    """Largest constant sigma_dot (N,) under the limits at the tool."""
    found = tool(eased, sigma, eased.parameter(sigma))
    with np.errstate(divide="ignore"):
        acceleration, jerk = (limit / np.linalg.norm(order, axis=1) for limit, order in
                              ((limits.acceleration, found.tip.d2q), (limits.jerk, found.tip.d3q)))
        steady = np.minimum(np.sqrt(acceleration), np.cbrt(jerk))
        return np.asarray(np.minimum(limits.tilt_rate / found.tilt, steady))


def _octagon(found: ToolMotion, limits: ToolLimits) -> tuple[list[Floats], tuple[float, float]]:
    """Derivatives of the tip along the normals of the octagon's sides, (N, 4) each; limits of acceleration and jerk."""
    tangent, normal = (np.stack([np.einsum("ij,ij->i", axis, order) for order in found.tip[1:]]) for axis in found.frame[:2])
    sides = tangent[:, :, None] * np.cos(OCTAGON) + normal[:, :, None] * np.sin(OCTAGON)
    inscribed = float(np.cos(np.pi / 8.0))
    return list(sides), (inscribed * limits.acceleration, inscribed * limits.jerk)


def _capped(at: Derivatives, limits: JointLimits, joints: Floats, tool: Floats, feed: Floats) -> LimitRows:
    """With the cap from velocities, feed and tool as speeds along sigma; joints (N, J), the others (N,)."""
    count, named = at.dq.shape[1], joints.shape[1]
    speeds = np.column_stack((joints, tool, feed))
    which = speeds.argmin(axis=1)
    cap = speeds[np.arange(len(speeds)), which] ** 2
    free = np.isinf(cap)
    if free.any():
        cap[free] = UNBOUND * steady_cap(at.d2q[free], at.d3q[free], limits)
    if not np.all(np.isfinite(cap)):
        raise ValueError("the path stands still somewhere between its ends: no limit bounds the speed there")
    return LimitRows(at.dq, at.d2q, at.d3q, limits, cap, np.where(which > named, count, which))


def _across(vectors: Floats, tangent: Floats) -> Floats:
    return np.asarray(vectors - np.einsum("ij,ij->i", vectors, tangent)[:, None] * tangent)
