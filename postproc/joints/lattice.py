"""The joints that a run of poses can have: branches followed from pose to pose, and the windings that travel allows.

A state of a pose is a branch of the inverse and, for each rotary axis of limited travel, a number of whole
turns. The rotary values of a branch are carried on from pose to pose without a jump (`values`); at k turns a
joint then stands at value + 2 pi k, and travel allows k from `least` to `most`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Limits
from postproc.joints.tracks import TRAVEL_SLACK, branches_of, following
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import TWO_PI, wrap
from toolpaths.shapes import arrays

_MANY = 1 << 30


@dataclass(frozen=True)
@arrays(tip="N 3", axis="N 3", rest="N", away="N", held="J", parameters="N F")
class PoseRun:
    """Poses that the tool goes through without retracting.

    Attributes:
        kin: with the tool
        tip, axis: (N, 3) in the table frame
        rest: (N,) True where the tool does not cut, so that it may be drawn back; None: it cuts everywhere
        away: (N,) s that drawing back there and coming down again takes; None: nothing
        held: (J,) where a rotary joint must stand that the tool lies along along the whole path; None: where it is best
        parameters: (N, F) what the machine leaves open; None: as its inverse takes them
    """

    kin: Kinematics
    tip: Floats
    axis: Floats
    rest: Bools | None = None
    away: Floats | None = None
    held: Floats | None = None
    parameters: Floats | None = None


@dataclass(frozen=True)
@arrays(values="B N J", family="B N", leads="int8: B N-1", free="N-1", inside="B N", wound="W", least="int32: B N W",
        most="int32: B N W", rotary="R", rest="N", away="N")
class Lattice:
    """States of N poses on B branches; `wound` (W,) are the joints whose turns count, `limits` those of the machine.

    Attributes:
        values: (B, N, J) joints, rotaries carried on along each branch; NaN where a branch has no solution
        family: (B, N) True where the tool lies along a rotary axis
        leads: (B, N - 1) the branch that each branch leads to at the next pose
        free: (N - 1,) True where the branch may change on the spot: the tool is about to leave a rotary axis
        inside: (B, N) True where the linear joints are inside travel
        least, most: (B, N, W) turns that travel allows
        rest, away: of the run
    """

    values: Floats
    family: Bools
    leads: Array
    free: Bools
    inside: Bools
    wound: Ints
    least: Array
    most: Array
    limits: Limits
    rotary: Bools
    rest: Bools
    away: Floats

    @property
    def poses(self) -> int:
        """N"""
        return int(self.values.shape[1])

    @cached_property
    def clock(self) -> Floats:
        """(B, N) s: time from the first pose along each branch, every axis at its velocity."""
        step = np.abs(np.diff(self.values, axis=1)) / self.limits.velocity
        time = np.nan_to_num(step.max(axis=2, initial=0.0))
        return np.concatenate([np.zeros((len(time), 1)), np.cumsum(time, axis=1)], axis=1)

    def joints(self, branch: int, pose: int, turns: tuple[int, ...]) -> Floats:
        """(J,) of a state."""
        q: Floats = self.values[branch, pose].copy()
        q[self.wound] += TWO_PI * np.array(turns)
        return q

    def on(self, branch: int, pose: int, turns: tuple[int, ...],
           target: int) -> tuple[tuple[int, ...], Floats]:
        """(turns at the next pose on branch `target`, path (J,)), every rotary axis going the shorter path."""
        step = self.values[target, pose + 1] - self.values[branch, pose]
        travel = np.where(self.rotary, wrap(step), step)
        added = np.nan_to_num(np.rint((travel - step) / TWO_PI)).astype(np.int64)[self.wound]
        return tuple(int(k) for k in np.array(turns, dtype=np.int64) + added), travel

    def between(self, values: Floats, turns: tuple[int, ...], others: Floats,
                other_turns: tuple[int, ...]) -> Floats:
        """Paths (..., J) from one state to another at standing tool; axes without limits go the shorter path."""
        step = others - values
        travel = np.where(self.endless, wrap(step), step)
        travel[..., self.wound] += TWO_PI * (np.array(other_turns, dtype=np.float64) - np.array(turns, dtype=np.float64))
        return np.asarray(travel)

    @cached_property
    def endless(self) -> Bools:
        """(J,) rotary joints without limits."""
        result = self.rotary.copy()
        result[self.wound] = False
        return result

    def seconds(self, travel: Floats) -> Floats:
        """Time of joint paths (..., J), every axis at its velocity."""
        return np.asarray(np.nan_to_num((np.abs(travel) / self.limits.velocity).max(axis=-1)))


def lattice_of(run: PoseRun, limits: Limits, near: Floats) -> Lattice:
    """The states of a run; where the tool lies along a rotary axis along the whole path, that axis stands as
    in `near` (F, J).

    Such a run has a branch for each row of `near`.
    """
    rotary = np.array(run.kin.rotary)
    branches, family = branches_of(run.kin, run.tip, run.axis, near, run.parameters)
    leads, free = following(run.kin, run.tip, run.axis, branches, family)
    values = branches.copy()
    for j in np.flatnonzero(rotary):
        values[:, :, j] = carried_on(branches[:, :, j])
    wound = np.flatnonzero(rotary & (np.isfinite(limits.lower) | np.isfinite(limits.upper)))
    least, most = _turns(values[:, :, wound], limits.lower[wound], limits.upper[wound])
    slides = np.flatnonzero(~rotary)
    low, high = limits.lower[slides] - TRAVEL_SLACK, limits.upper[slides] + TRAVEL_SLACK
    held = (values[:, :, slides] >= low) & (values[:, :, slides] <= high)
    inside = np.asarray(held.all(axis=2) & np.isfinite(values).all(axis=2), dtype=np.bool_)
    n = len(run.tip)
    return Lattice(values, family, leads, free, inside, wound, least, most, limits, rotary,
                   np.zeros(n, dtype=np.bool_) if run.rest is None else run.rest,
                   np.zeros(n) if run.away is None else run.away)


def carried_on(angles: Floats) -> Floats:
    """Angles (B, N) without jumps between neighbours, each row from its first finite value; NaN stays."""
    good = np.isfinite(angles)
    if good.all():
        return np.asarray(angles[:, :1] + np.concatenate(
            [np.zeros((len(angles), 1)), np.cumsum(wrap(np.diff(angles, axis=1)), axis=1)], axis=1))
    result = angles.copy()
    for row, kept in zip(result, good, strict=True):
        if kept.any():
            row[kept] = carried_on(row[kept][None])[0]
    return result


def _turns(values: Floats, lower: Floats, upper: Floats) -> tuple[Array, Array]:
    """(least, most) whole turns that bring values (..., W) into travel; least > most where none does."""
    with np.errstate(invalid="ignore"):
        least = np.ceil((lower - TRAVEL_SLACK - values) / TWO_PI)
        most = np.floor((upper + TRAVEL_SLACK - values) / TWO_PI)
    least, most = (np.where(np.isnan(values), none, turns) for none, turns in ((1.0, least), (0.0, most)))
    return np.clip(least, -_MANY, _MANY).astype(np.int32), np.clip(most, -_MANY, _MANY).astype(np.int32)
