"""The path that the machine is planned to take: a joint-space spline along a smoothed path, its deviation bounded.

The joints of the smoothed tip and axis are exact at the sites, and a quintic spline through them is what is planned, so
that its derivatives are exact to every order. Between sites it is compared with the smoothed path in the part frame,
and sites are added where it is off by more than a small share of the tolerance. Serial and parallel machines alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from machines.kinematics.base import Kinematics
from postproc.feedrate.geometry_poles import past_poles
from postproc.feedrate.geometry_sites import sites
from postproc.feedrate.paths import Derivatives, SplinePath
from postproc.joint_path import nearest_solution
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import angle_between
from toolpaths.smoothing.smooth import Smooth

DEGREE = 5
SHARE = 0.05
"""of the tolerance that the joint spline may use"""
ROUNDS = 6
Near = Callable[[Floats], Floats]
"""Joints (N, J) at s (N,) that the solution must be nearest to: its branch and winding."""


@dataclass(frozen=True)
class MachinePath:
    """Joints along s between two stops, three times continuously differentiable; a `feedrate.paths.ToolPath`.

    Attributes:
        s (N,): the sites
        values (N, J + 6): joints, tip and axis there
        worst: largest deviation from the smoothed path between sites, over the tolerance
        led (N,): sites near a singular direction where the axis is led past it, see `past_poles`
        fitted: the joints as scipy's spline
    """

    s: Floats
    values: Floats
    worst: float
    led: Bools
    fitted: BSpline

    @staticmethod
    def through(s: Floats, values: Floats, led: Bools) -> MachinePath:
        """The path through sites."""
        return MachinePath(s, values, 0.0, led, make_interp_spline(s, values[:, :-6], k=DEGREE))

    @property
    def joints(self) -> int:
        """J"""
        return int(self.values.shape[1]) - 6

    @property
    def start(self) -> float:
        return float(self.s[0])

    @property
    def end(self) -> float:
        return float(self.s[-1])

    @property
    def breaks(self) -> Floats:
        """Knots of the spline."""
        return np.asarray(self.fitted.t[DEGREE:-DEGREE])

    @cached_property
    def spline(self) -> SplinePath:
        """of the joints"""
        return SplinePath(self.fitted.t, self.fitted.c, DEGREE)

    @cached_property
    def tool(self) -> SplinePath:
        """of tip and axis, for limits at the tool"""
        found = make_interp_spline(self.s, self.values[:, self.joints:], k=DEGREE)
        return SplinePath(found.t, found.c, DEGREE)

    def derivatives(self, s: Floats) -> Derivatives:
        """Joints at s (N,)."""
        return self.spline.derivatives(s)

    def tip(self, s: Floats) -> Derivatives:
        """Tip at s (N,), mm, each (N, 3)."""
        return Derivatives(*(order[:, :3] for order in self.tool.derivatives(s)))

    def axis(self, s: Floats) -> Derivatives:
        """Tool axis at s (N,), each (N, 3)."""
        return Derivatives(*(order[:, 3:] for order in self.tool.derivatives(s)))


def machine_path(path: Smooth, first: float, last: float, kin: Kinematics, near: Near) -> MachinePath:
    """The joints' spline along `path` from s = first to last, without a stop between.

    Raises:
        ArithmeticError: where the machine has no solution, with the s of the first such place.
    """
    s = sites(path, first, last)
    for turn in range(ROUNDS + 1):
        made = _interpolated(path, s, kin, near)
        off = _off(made, path, kin)
        worst = float(off.max())
        bad = off > SHARE
        if turn == ROUNDS or not bad.any():
            break
        bad[1:] |= bad[:-1]
        bad[:-1] |= bad[1:]
        s = np.sort(np.concatenate((s, 0.5 * (s[:-1] + s[1:])[bad])))
    return replace(made, worst=worst)


def _interpolated(path: Smooth, s: Floats, kin: Kinematics, near: Near) -> MachinePath:
    tip, axis = path.at(s)
    axis = kin.nearest_axis(axis)
    q = nearest_solution(kin, tip, axis, near(s))
    good = np.asarray(np.isfinite(q).all(axis=1))
    if not good.all():
        raise ArithmeticError(f"no joints at s = {s[int(np.argmin(good))]:.6g} mm of the smoothed path")
    q, led = past_poles(s, q, tip, axis, kin, path.tolerance.axis)
    axis[led] = kin.forward(q[led])[1]
    return MachinePath.through(s, np.hstack((q, tip, axis)), led)


def _off(made: MachinePath, path: Smooth, kin: Kinematics) -> Floats:
    """(N - 1,) deviation of the joint spline from the smoothed path amid the sites, over the tolerance."""
    middle = 0.5 * (made.s[:-1] + made.s[1:])
    tip, axis = path.at(middle)
    found_tip, found_axis = kin.forward(made.fitted(middle), near=np.hstack((tip, axis)))
    axis_off = angle_between(found_axis, kin.nearest_axis(axis)) / path.tolerance.axis
    axis_off[made.led[1:] | made.led[:-1]] = 0.0
    off = np.maximum(np.linalg.norm(found_tip - tip, axis=1) / path.tolerance.tip, axis_off)
    return np.asarray(np.nan_to_num(off, nan=np.inf))
