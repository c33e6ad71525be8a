"""Poses of a program's blocks: machine coordinates through the model of machine and control."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.readback.execution import assembly
from postproc.readback.execution.execute import Motion
from toolpaths.arrays import Bools, Floats, Ints, repeated, taken
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from machines.geometric_error.actual.error_rates import ErrorRates

SAMPLES = (0.2, 0.4, 0.6, 0.8, 1.0)
"""where each block is looked at; other places than those that linearising looks at"""
FEW = 5_000
"""places that are made at once: more cost as much together as one after the other"""


@dataclass(frozen=True)
@arrays(before="E 6")
class BlockPoses:
    """Gives the poses of a program's blocks: control, kinematics by tool number, gauge length by register.

    `before` (E, 6) is the gauge point's pose where each block begins, on machines whose joints do not determine it alone.
    """

    control: Control
    kinematics: Callable[[int], Kinematics]
    lengths: dict[int, float]
    before: Floats | None = None
    _asked: list[tuple[Motion, Ints, BlockMotions]] = field(default_factory=list, init=False, repr=False,
                                                            compare=False)
    _ahead: list[tuple[Motion, Ints, _Ahead]] = field(default_factory=list, init=False, repr=False, compare=False)

    def _approaches(self, motion: Motion, rows: Ints) -> BlockMotions:
        """Those of the blocks asked for last are kept: the same ones are asked for at several fractions."""
        if not self._asked or self._asked[0][0] is not motion or self._asked[0][1] is not rows:
            self._asked[:] = [(motion, rows, BlockMotions.of(motion, self.control, rows))]
        return self._asked[0][2]

    def forget(self) -> None:
        """Nothing is kept of the blocks that were asked for last."""
        self._asked.clear()
        self._ahead.clear()

    def poses(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of the blocks `rows` at fraction t."""
        for ahead, k in self._known(motion, rows, t):
            if not ahead.poses:
                every = np.concatenate(ahead.positions), np.tile(rows, len(ahead.times))
                ahead.poses.extend(a.reshape(-1, len(rows), 3) for a in self._placed(motion, every[1], every[0]))
            return ahead.poses[0][k], ahead.poses[1][k]
        return self._placed(motion, rows, self._position(motion, rows, t))

    def look_ahead(self, motion: Motion, rows: Ints, times: Sequence[float | Floats]) -> None:
        """Said before the poses and joints of the same blocks at several fractions, one or (K,), are asked for; of few
        blocks they are made at once."""
        between = [t for t in times if not _whole(t)]
        self._ahead.clear()
        if 0 < len(rows) * len(between) <= FEW:
            shares = np.concatenate([np.broadcast_to(np.asarray(t), len(rows)) for t in between])
            found = BlockMotions.of(motion, self.control, rows).tiled(len(between)).at(shares)
            parts = iter(found.reshape(len(between), len(rows), -1))
            positions = [motion.end[rows] if _whole(t) else next(parts) for t in times]
            self._ahead.append((motion, rows, _Ahead(times, positions)))

    def _known(self, motion: Motion, rows: Ints, t: float | Floats) -> Iterator[tuple[_Ahead, int]]:
        """What was made ahead of just these blocks, with the number of the fraction t in it; nothing of others."""
        for blocks, asked, ahead in self._ahead:
            if blocks is motion and asked is rows and (k := ahead.number(t)) >= 0:
                yield ahead, k

    def _position(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """Machine coordinates (K, J) of the blocks `rows` at fraction t."""
        if _whole(t):
            return motion.end[rows]
        found = next((ahead.positions[k] for ahead, k in self._known(motion, rows, t)), None)
        return self._approaches(motion, rows).at(t) if found is None else found

    def at_coordinates(self, motion: Motion, rows: Ints, beginning: Floats, xyz: Floats) -> Floats:
        """Tips (K, 3) where X, Y, Z of the frames of blocks stand at `xyz` (K, 3), all else as in `beginning` (K, J)."""
        position = np.array(beginning)
        position[:, self.control.xyz] = xyz
        return self._placed(motion, rows, motion.table.position(motion.frame[rows], position))[0]

    def _placed(self, motion: Motion, rows: Ints, position: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of machine coordinates (K, J) with the tools and registers of the blocks `rows`."""
        tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
        for k, (number, h) in alike(motion.tool[rows], motion.register[rows]):
            kin, offset = self.kinematics(number), self.lengths.get(h, 0.0) if h >= 0 else 0.0
            if self.before is None:
                tip[k], axis[k] = self._pose(position[k], kin, offset)
            else:
                tip[k], axis[k] = self._followed(motion, rows[k], position[k], kin)
        return tip, axis

    def joints(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """Joints (K, J) of the blocks `rows` at fraction t."""
        position = self._position(motion, rows, t)
        if self.control.base != "tcp":
            return np.asarray(position / self.control.unit)
        q = np.empty_like(position)
        for h in np.unique(motion.register[rows]).tolist():
            k = np.flatnonzero(motion.register[rows] == h)
            q[k] = self._held(position[k], self.lengths.get(h, 0.0) if h >= 0 else 0.0)
        return q

    def lawful(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) where the law of the blocks has the tool: on the machine without errors, as the
        control holds it."""
        tip, axis = self.nominal(motion, rows, t)
        numbers, other = motion.frame[rows], self._other_pivots(motion, rows)
        if other.any():
            tip, axis, q = np.array(tip), np.array(axis), self.joints(motion, rows, t)
        for number in np.unique(numbers[other]).tolist():
            k, kin = np.flatnonzero(numbers == number), motion.frames[number].kinematics
            assert kin is not None
            tip[k], axis[k] = kin.forward(q[k])
        return tip, axis

    def nominal(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """As `poses`, of the machine without errors."""
        return self.poses(motion, rows, t)

    def off_law(self, motion: Motion, rows: Ints) -> Bools:
        """(K,) blocks in which the machine is not that of the law."""
        return self._other_pivots(motion, rows)

    def _other_pivots(self, motion: Motion, rows: Ints) -> Bools:
        """(K,) blocks in which the control holds other pivots than the machine has."""
        other = np.array([self.control.own_kinematics is not None and frame.kinematics is not None
                          for frame in motion.frames])
        return np.asarray(other[motion.frame[rows]])

    def error_rates(self, motion: Motion, rows: Ints, q: Floats, reach: Floats) -> ErrorRates:
        """How fast what the machine adds to the law may change near joints q (K, J) that move by up to `reach` (K, J)."""
        from machines.geometric_error.actual.error_rates import joined, pivot_rates

        frames = motion.frame[rows], motion.tool[rows]
        return joined((k, pivot_rates(self.kinematics(tool), motion.frames[frame].kinematics, q[k]))
                      for k, (frame, tool) in alike(*frames))

    def arm(self, motion: Motion, rows: Ints, q: Floats) -> Floats:
        """(K,) mm from the tip to the farthest turning axis at q (K, J), and while the tip stands on the part."""
        from machines.geometric_error.actual.error_rates import standing_arm

        result = np.zeros(len(rows))
        for k, (tool,) in alike(motion.tool[rows]):
            result[k] = standing_arm(self.kinematics(tool), q[k])
        return result

    def approach(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """(K, J) from which direction each joint is where it is: 0 on a machine without lost motion."""
        return np.zeros((len(rows), len(self.control.machine.axis_names)))

    def gaps(self, motion: Motion, rows: Ints, q: Floats, reach: Floats) -> Floats:
        """(K, J) mm or rad of lost motion, at least; infinite where there is none."""
        return np.full(q.shape, np.inf)

    def corrected_between(self, motion: Motion, rows: Ints) -> Floats:
        """(K,) mm that the corrections of the tip may change by in blocks: none on the machine without errors."""
        return np.zeros(len(rows))

    def looks(self, motion: Motion, rows: Ints) -> Iterator[tuple[Ints, Floats]]:
        """(numbers (M,) of `rows`, fractions (M,)) where long blocks are looked at besides SAMPLES; none without errors."""
        return iter(())

    def bent(self, motion: Motion, rows: Ints) -> Bools:
        """(K,) True for rapids that are dog-legs."""
        return _bent(motion, self.control, rows)

    def times(self, motion: Motion, rows: Ints) -> list[float | Floats]:
        """Fractions at which blocks are looked at: SAMPLES, and the corners of dog-legs, (K,) each; made ready."""
        corners = self.corners(motion, rows).T if self.control.rapids == "dog-leg" else ()
        times: list[float | Floats] = [*SAMPLES, *corners]
        self.look_ahead(motion, rows, times)
        return times

    def corners(self, motion: Motion, rows: Ints) -> Floats:
        """(K, J) fractions at which the axes of dog-legs come to their ends, 1 in blocks that are none."""
        step = motion.end[rows] - begins(motion, rows)
        own = np.abs(step) / (self.control.machine.limits.velocity * self.control.unit)
        longest = own.max(axis=1, initial=0.0)
        bent = _bent(motion, self.control, rows) & (longest > 0.0)
        return np.asarray(np.where(bent[:, None], own / np.where(longest > 0.0, longest, 1.0)[:, None], 1.0))

    def _held(self, position: Floats, offset: float) -> Floats:
        """Joints that a control with its own kinematics takes under a tool length offset."""
        words = position - self.control.work_offset
        words[:, self.control.xyz[2]] -= offset
        return self.control.joints(words, self.control.machine.kinematics.with_tool(offset), offset)

    def _pose(self, position: Floats, kin: Kinematics, offset: float) -> tuple[Floats, Floats]:
        if self.control.base != "tcp":
            return kin.forward(position / self.control.unit)
        return kin.forward(self._held(position, offset))

    def _followed(self, motion: Motion, rows: Ints, position: Floats,
                  kin: Kinematics) -> tuple[Floats, Floats]:
        assert self.before is not None
        near = self.before[rows].copy()
        near[:, :3] -= kin.tool_length * near[:, 3:]
        unit = self.control.unit
        pose = assembly.walk(kin, begins(motion, rows) / unit, position / unit, near)
        return pose[:, :3], pose[:, 3:]


@dataclass(frozen=True)
class _Ahead:
    """Machine coordinates, each (K, J), of some blocks at several fractions, and poses there where asked for."""

    times: Sequence[float | Floats]
    positions: list[Floats]
    poses: list[Floats] = field(default_factory=list)
    """none, or tips and axes (T, K, 3)"""

    def number(self, t: float | Floats) -> int:
        """Which of the fractions t is; -1 for none."""
        return next((k for k, time in enumerate(self.times) if time is t), -1)


def poses_before(motion: Motion, control: Control) -> Floats | None:
    """`BlockPoses.before` of a program; None where the joints alone determine the pose."""
    kin = control.machine.kinematics
    if control.base == "tcp" or kin.straight_slides:
        return None
    home = motion.start / control.unit
    ends = assembly.ends(kin, motion.end / control.unit, home)
    return np.concatenate([np.hstack(kin.forward(home[None, :])), ends[:-1]])


def begins(motion: Motion, rows: Ints) -> Floats:
    """Machine coordinates (K, J) where blocks begin."""
    result: Floats = motion.end[rows - 1]
    result[rows == 0] = motion.start
    return result


def positions(motion: Motion, control: Control, rows: Ints, t: float | Floats) -> Floats:
    """Machine coordinates (K, J) of blocks at fraction t, one or (K,): as the law of each block has it."""
    return motion.end[rows] if _whole(t) else BlockMotions.of(motion, control, rows).at(t)


def _whole(t: float | Floats) -> bool:
    return isinstance(t, float) and t == 1.0


@dataclass(frozen=True)
@arrays(rows="K", before="K J", end="K J", frame="K", first="K J", last="K J")
class BlockMotions:
    """Blocks `rows` (K,) with what of their motion does not depend on the fraction: machine coordinates (K,
    J) at both ends, and the coordinates of their frames there."""

    motion: Motion
    control: Control
    rows: Ints
    before: Floats
    end: Floats
    frame: Ints
    first: Floats
    last: Floats

    @classmethod
    def of(cls, motion: Motion, control: Control, rows: Ints) -> BlockMotions:
        """What `at` needs."""
        before, end, frame = begins(motion, rows), motion.end[rows], taken(motion.frame, rows)
        return cls(motion, control, rows, before, end, frame, *coordinates(motion, rows))

    def tiled(self, times: int) -> BlockMotions:
        """The blocks `times` times one after the other, (times K) of them."""
        before, end = np.tile(self.before, (times, 1)), np.tile(self.end, (times, 1))
        first, last = (before, end) if self.motion.table.plain else (
            np.tile(self.first, (times, 1)), np.tile(self.last, (times, 1)))
        return BlockMotions(self.motion, self.control, np.tile(self.rows, times), before, end, np.tile(self.frame, times),
                            first, last)

    @cached_property
    def bent(self) -> Ints:
        """Numbers of the blocks that are dog-legs."""
        return np.flatnonzero(_bent(self.motion, self.control, self.rows))

    def at(self, t: float | Floats) -> Floats:
        """Machine coordinates (K, J) at fraction t, one or (K,)."""
        share = np.broadcast_to(np.asarray(t), len(self.rows))
        along = _along(self.motion, self.control.xyz, self.rows, self.first, self.last, share)
        result: Floats = self.motion.table.position(self.frame, along)
        k = self.bent
        if len(k):
            speed = self.control.machine.limits.velocity * self.control.unit
            result[k] = _dog_leg(self.before[k], self.end[k], share[k], speed)
        return result


def _bent(motion: Motion, control: Control, rows: Ints) -> Bools:
    """(K,) rapids in which each axis runs for itself: not where the control keeps the tip straight."""
    if control.rapids != "dog-leg":
        return np.zeros(len(rows), dtype=bool)
    straight = np.array([frame.law == "tcp" for frame in motion.frames])
    return np.asarray((motion.code[rows] == 0) & ~straight[motion.frame[rows]])


def _dog_leg(before: Floats, end: Floats, t: Floats, speed: Floats) -> Floats:
    """Positions (K, J) at fraction t (K,) of the time: each axis at its rapid speed (J,) until it is there."""
    step = end - before
    own = np.abs(step) / speed
    longest = own.max(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(own > 0.0, np.minimum(t[:, None] * longest / own, 1.0), 1.0)
    result: Floats = before + share * step
    return result


def _along(motion: Motion, xyz: Ints, rows: Ints, before: Floats, end: Floats, t: Floats) -> Floats:
    """Coordinates (K, J) at fraction t (K,): straight, or on the arc in its plane."""
    result = before + t[:, None] * (end - before)
    arc = motion.code[rows] == 2
    for plane, (i, j) in PLANE_COLUMNS.items() if arc.any() else ():
        k = np.flatnonzero(arc & (motion.plane[rows] == plane))
        if len(k):
            a, b = int(xyz[i]), int(xyz[j])
            center = motion.center[rows[k]][:, (i, j)]
            first, last = before[k][:, (a, b)] - center, end[k][:, (a, b)] - center
            angle = np.arctan2(first[:, 1], first[:, 0]) + t[k] * signed_sweep(first, last, motion.ccw[rows[k]])
            radius = (1.0 - t[k]) * np.hypot(*first.T) + t[k] * np.hypot(*last.T)
            result[k, a], result[k, b] = center[:, 0] + radius * np.cos(angle), center[:, 1] + radius * np.sin(angle)
    return result


def signed_sweep(first: Floats, last: Floats, ccw: Bools) -> Floats:
    """Sweep (K,) rad of arcs between radius vectors (K, 2), positive anti-clockwise; equal ends are a full turn."""
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    angle = np.mod(np.arctan2(cross, (first * last).sum(axis=1)), 2.0 * np.pi)
    same = (np.abs(first - last) < 1e-9).all(axis=1)
    forward = np.where(same, 2.0 * np.pi, angle)
    backward = np.where(same, -2.0 * np.pi, angle - 2.0 * np.pi)
    return np.where(ccw, forward, backward)


def coordinates(motion: Motion, rows: Ints) -> tuple[Floats, Floats]:
    """Coordinates (K, J) where blocks begin and end, each in the frame of its block.

    A block that follows the one before it in `rows`, in the same frame, begins where that one ends: each such
    place is computed once.
    """
    frame, before, end = taken(motion.frame, rows), begins(motion, rows), motion.end[rows]
    if motion.table.plain:
        return before, end
    follows = np.zeros(len(rows), dtype=bool)
    follows[1:] = (np.diff(rows) == 1) & (np.diff(frame) == 0)
    apart = np.flatnonzero(~follows)
    found = motion.table.coordinates(np.concatenate([frame[apart], frame]), np.concatenate([before[apart], end]))
    last = found[len(apart):]
    first = np.roll(last, 1, axis=0)
    first[apart] = found[:len(apart)]
    return first, last


def arc_sweeps(motion: Motion, control: Control) -> Floats:
    """(E,) sweep of arc blocks, rad, positive; NaN for others."""
    arcs = np.flatnonzero(motion.code == 2)
    if not len(arcs):
        return repeated(np.nan, len(motion))
    result = np.full(len(motion), np.nan)
    before, end = coordinates(motion, arcs)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(motion.plane[arcs] == plane)
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            center = motion.center[arcs[k]][:, (i, j)]
            result[arcs[k]] = np.abs(signed_sweep(before[k][:, columns] - center, end[k][:, columns] - center,
                                                  motion.ccw[arcs[k]]))
    return result


def alike(*columns: Ints) -> Iterator[tuple[Ints, tuple[int, ...]]]:
    """(rows, values) of columns (K,), by their values."""
    for rows in groups(*columns):
        yield rows, tuple(column.item(rows[0]) for column in columns)
