"""The path that the machine is planned to take: a joint-space spline along a smoothed path, its deviation bounded.

The joints of the smoothed tip and axis are exact at the sites, and a quintic spline through them is what is
planned, so that its derivatives are exact to every order. Between sites it is compared with the smoothed path
in the part frame, and sites are added where it is off by more than a small share of the tolerance. Serial and
parallel machines alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.feedrate.paths import Derivatives, SplinePath
from postproc.joints.joint_path import nearest_solution
from postproc.planning.geometry_poles import near_poles, past_poles
from postproc.planning.geometry_sites import sites
from toolpaths.arrays import Array, Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shapes import arrays
from toolpaths.smoothing.smooth import Smooth

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

DEGREE = 5
SHARE = 0.05
"""of the tolerance that the joint spline may use"""
ROUNDS = 6
MANY = 50_000
"""sites that are solved together"""
JointsNearby = Callable[[Floats], Floats]
"""Joints (N, J) at s (N,) that the solution must be nearest to: its branch and winding."""


@dataclass(frozen=True)
@arrays(s="N", values="N V", led="N")
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
        from scipy.interpolate import make_interp_spline

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
    def tool_spline(self) -> BSpline:
        """of tip and axis (3 + 3), for limits at the tool; knots as of `fitted`"""
        from scipy.interpolate import make_interp_spline

        return make_interp_spline(self.s, self.values[:, self.joints:], k=DEGREE)

    @cached_property
    def tool(self) -> SplinePath:
        """The same with its derivatives."""
        return SplinePath(self.tool_spline.t, self.tool_spline.c, DEGREE)

    def derivatives(self, s: Floats) -> Derivatives:
        """Joints at s (N,)."""
        return self.spline.derivatives(s)

    def tip(self, s: Floats) -> Derivatives:
        """Tip at s (N,), mm, each (N, 3)."""
        return Derivatives(*(order[:, :3] for order in self.tool.derivatives(s)))

    def axis(self, s: Floats) -> Derivatives:
        """Tool axis at s (N,), each (N, 3)."""
        return Derivatives(*(order[:, 3:] for order in self.tool.derivatives(s)))


@dataclass(frozen=True)
class PathStretch:
    """A smoothed path between two stops, s = first to last, and the joints to stay near to."""

    path: Smooth
    first: float
    last: float
    near: JointsNearby


def machine_paths(stretches: list[PathStretch], kin: Kinematics) -> list[MachinePath | str]:
    """The joints' spline of each, without a stop between its ends; what is wrong where the machine has no
    solution, with the s of the first such place. Many short ones are solved together."""
    result: list[MachinePath | str] = [""] * len(stretches)
    at = {i: sites(one.path, one.first, one.last) for i, one in enumerate(stretches)}
    for turn in range(ROUNDS + 1):
        finer: dict[int, Floats] = {}
        for group in _groups(at):
            made = _interpolated([stretches[i] for i in group], [at[i] for i in group], kin)
            solved = [(i, one) for i, one in zip(group, made, strict=True) if isinstance(one, MachinePath)]
            for i, one in zip(group, made, strict=True):
                result[i] = one
            for (i, one), off in zip(solved, _off([one for _, one in solved], [stretches[i].path for i, _ in solved], kin),
                                     strict=True):
                result[i] = replace(one, worst=float(off.max()))
                if turn < ROUNDS and bool((off > SHARE).any()):
                    finer[i] = _finer(at[i], off > SHARE)
        at = finer
        if not at:
            break
    return result


def _groups(at: dict[int, Floats]) -> list[list[int]]:
    """Numbers in groups of about MANY sites."""
    groups: list[list[int]] = []
    total = MANY
    for i, s in at.items():
        if total + len(s) > MANY:
            groups.append([])
            total = 0
        groups[-1].append(i)
        total += len(s)
    return groups


def _finer(s: Floats, bad: Bools) -> Floats:
    """Sites with one more in the middle of bad intervals and of those next to."""
    wide = bad.copy()
    wide[1:] |= bad[:-1]
    wide[:-1] |= bad[1:]
    return np.sort(np.concatenate((s, 0.5 * (s[:-1] + s[1:])[wide])))


def _split(values: Array, parts: list[Floats]) -> list[Array]:
    return np.split(values, np.cumsum([len(part) for part in parts])[:-1])


def _interpolated(stretches: list[PathStretch], at: list[Floats], kin: Kinematics) -> list[MachinePath | str]:
    """Splines through the exact joints at sites."""
    poses = [one.path.at(s) for one, s in zip(stretches, at, strict=True)]
    tip, axis = np.concatenate([pose[0] for pose in poses]), kin.nearest_axis(np.concatenate([pose[1] for pose in poses]))
    q = nearest_solution(kin, tip, axis, np.concatenate([one.near(s) for one, s in zip(stretches, at, strict=True)]))
    columns = [_split(values, at) for values in (q, tip, axis, near_poles(q, kin))]
    result: list[MachinePath | str] = []
    for one, s, own, own_tip, own_axis, inside in zip(stretches, at, *columns, strict=True):
        good = np.isfinite(own).all(axis=1)
        if not good.all():
            result.append(f"no joints at s = {s[int(np.argmin(good))]:.6g} mm of the smoothed path")
            continue
        joints, led = past_poles(s, own, own_tip, own_axis, inside, kin, one.path.tolerance.axis)
        if led.any():
            own_axis[led] = kin.forward(joints[led])[1]
        result.append(MachinePath.through(s, np.hstack((joints, own_tip, own_axis)), led))
    return result


def _off(made: list[MachinePath], paths: list[Smooth], kin: Kinematics) -> list[Floats]:
    """(N - 1,) of each: deviation of the joint spline from the smoothed path amid the sites, over the tolerance."""
    if not made:
        return []
    middle = [0.5 * (one.s[:-1] + one.s[1:]) for one in made]
    poses = [path.at(s) for path, s in zip(paths, middle, strict=True)]
    tip, axis = np.concatenate([pose[0] for pose in poses]), kin.nearest_axis(np.concatenate([pose[1] for pose in poses]))
    q = np.concatenate([one.fitted(s) for one, s in zip(made, middle, strict=True)])
    found_tip, found_axis = kin.forward(q, near=np.hstack((tip, axis)))
    axis_off = angle_between(found_axis, axis)
    axis_off[np.concatenate([one.led[1:] | one.led[:-1] for one in made])] = 0.0
    tip_off = np.linalg.norm(found_tip - tip, axis=1)
    return [np.nan_to_num(np.maximum(a / path.tolerance.tip, b / path.tolerance.axis), nan=np.inf)
            for path, a, b in zip(paths, _split(tip_off, middle), _split(axis_off, middle), strict=True)]
