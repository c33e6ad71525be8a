"""Commands that put the tool of a machine with errors where the nominal one would have it.

Chord (Newton) iteration on the exact model in the coordinates w of `actual`, with the rates of the nominal
machine: errors of 1e-4 leave 1e-4 of themselves at each step. The tip is always corrected in full: the three
    displacements can do it at
any turn. The axis is corrected by the R turns, along the two principal directions of the axis's rates:

- where a turn moves the axis well, in full;
- near a pole, where it moves it ever less: the share (s / POLE)^2 of the error at rate s, and more only where
  less would leave the axis tolerance, by no more than MOST_TURN. So the rotary motion stays bounded and fades
  at the pole, where the tip alone is corrected;
- directions that the machine does not have (3 and 4 axes, tilt of a Delta) are left: they are the residual.

Points of one group (3+2, cycles, arcs) get one and the same turn, that of their mean error.
"""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.actual import Actual
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

POLE = 0.0175
"""axis rates (rad per rad, sine of the angle from a rotary axis) below which the axis is corrected in part; 1 degree"""
MOST_TURN = 0.1
"""rad that a rotary axis is moved at most near a pole"""
AXIS_TOLERANCE = 0.05 * DEG
"""rad, unless another is given"""
BLIND = 1e-9
"""axis rate below which a turn does not move the axis"""
CLOSED = 4e-8, 5e-10
"""mm and rad: steps that small are not taken any more"""
STEPS = 20
"""at most; realistic errors take 2 or 3, only the points that are open go on"""


@dataclass(frozen=True)
@arrays(q="N J", tip_before="N", axis_before="N", tip_after="N", axis_after="N", tip_residual="N 3", axis_residual="N 3",
        partial="N", unmeasured="N J")
class CorrectedCommands:
    """Corrected commands and what they do on the machine with errors.

    Attributes:
        q: (N, J) joints, NaN where there is no correction (out of reach or of the measured range)
        tip_before, axis_before: (N,) mm and rad, deviation of the nominal joints
        tip_after, axis_after: (N,) mm and rad, what is left: the residual field
        tip_residual, axis_residual: (N, 3) actual less wanted, after
        partial: (N,) True near a pole, where the axis is corrected in part
        unmeasured: (N, J) joints outside the measured range
        steps: iterations taken
    """

    q: Floats
    tip_before: Floats
    axis_before: Floats
    tip_after: Floats
    axis_after: Floats
    tip_residual: Floats
    axis_residual: Floats
    partial: Bools
    unmeasured: Bools
    steps: int


def correct(actual: Actual, q: Floats, tip: Floats, axis: Floats, *, group: Ints | None = None,
            direction: Floats | None = None, axis_tolerance: float = AXIS_TOLERANCE, turn: bool = True,
            beyond: bool | Bools = False) -> CorrectedCommands:
    """Joints near the nominal q (N, J) at which the machine with errors has its tool at tip and axis (N, 3).

    Args:
        q: nominal joints of those poses, branch and winding as wanted
        group: (N,) points with the same number >= 0 get the same turn; -1 turns freely
        direction: (N, J) sign of each joint's last motion, see `approach`
        axis_tolerance: rad, what the axis may keep near a pole
        turn: False leaves the rotary axes as they are
        beyond: True, for all or (N,), corrects outside the measured range too, with the error at its end
    """
    nominal = actual.coordinates(q, np.concatenate([tip, axis], axis=1))
    unmeasured = actual.outside(nominal)
    w = np.where((np.any(unmeasured, axis=1) & ~np.asarray(beyond))[:, None], np.nan, nominal)
    at_tip, at_axis = actual.aim(w, direction)
    before = _deviation(at_tip, at_axis, tip, axis)
    rates = actual.rates(nominal)
    turns = _Turns(rates[:, 3:, 3:], w, group) if turn and actual.turns else None
    slides, w, steps = _inverse(rates[:, :3, :3]), w.copy(), 0
    rows: slice | Ints = slice(None)
    while True:
        turned = np.zeros((len(w[rows]), actual.turns)) if turns is None else turns.to(axis[rows] - at_axis[rows], rows)
        if turns is not None and steps == 0:
            turned += turns.near_pole(axis - at_axis, axis_tolerance)
        gap = tip[rows] - at_tip[rows] - np.einsum("nij,nj->ni", rates[rows, :3, 3:], turned)
        step = np.concatenate([np.einsum("nij,nj->ni", slides[rows], gap), turned], axis=1)
        closed = np.abs(step) <= np.where(np.arange(step.shape[1]) < 3, *CLOSED)
        open_ = ~np.all(closed | np.isnan(w[rows, : step.shape[1]]), axis=1)
        if steps == STEPS or not open_.any():
            break
        if group is None:
            rows, step = np.arange(len(w))[rows][open_], step[open_]
        w[rows, : step.shape[1]] += step
        at_tip[rows], at_axis[rows] = actual.aim(w[rows], None if direction is None else direction[rows])
        steps += 1
    partial = np.zeros(len(q), dtype=np.bool_) if turns is None else np.asarray(np.any(turns.weak, axis=1))
    after = _deviation(at_tip, at_axis, tip, axis)
    return CorrectedCommands(_wound(actual, w, q), *before, *after, at_tip - tip, at_axis - axis, partial,
                             unmeasured, steps)


def _wound(actual: Actual, w: Floats, q: Floats) -> Floats:
    """Joints of w; every joint of a row is NaN where one is."""
    joints = actual.joints(w)
    result: Floats = np.where(np.isnan(joints).any(axis=1, keepdims=True) | np.isnan(w).any(axis=1, keepdims=True), np.nan,
                              joints)
    return result


def _deviation(tip: Floats, axis: Floats, wanted_tip: Floats, wanted_axis: Floats) -> tuple[Floats, Floats]:
    """(mm, rad), each (N,); the angle from the chord, which keeps its digits."""
    chord = np.linalg.norm(axis - wanted_axis, axis=1)
    return np.linalg.norm(tip - wanted_tip, axis=1), 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))


def _inverse(rates: Floats) -> Floats:
    """Inverse (N, 3, 3) of rates (N, 3, 3), Cramer's rule; NaN where the slides depend."""
    a, b, c = rates[:, :, 0], rates[:, :, 1], rates[:, :, 2]
    result = np.empty(rates.shape)
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        for row, (one, two) in enumerate(((b, c), (c, a), (a, b))):
            result[:, row, i] = one[:, j] * two[:, k] - one[:, k] * two[:, j]
    volume = np.einsum("ni,ni->n", a, result[:, 0])
    result /= np.where(np.abs(volume) > BLIND, volume, np.nan)[:, None, None]
    return result


class _Turns:
    """The turns (N, R) that move the axis by given differences: principal directions of the axis's rates."""

    def __init__(self, rates: Floats, live: Floats, group: Ints | None) -> None:
        self.rates = rates
        normal = np.einsum("nik,nil->nkl", rates, rates)
        self.member = None if group is None else _members(group)
        self.weight = np.where(np.isnan(live).any(axis=1), 0.0, 1.0)
        square, self.vectors = _principal(self._mean(normal))
        self.rate = np.sqrt(np.maximum(square, 0.0))
        self.weak: Bools = np.asarray(self.rate < POLE)

    def _mean(self, values: Floats) -> Floats:
        """Means over the groups, spread back to their points."""
        if self.member is None:
            return values
        flat = np.nan_to_num(values.reshape(len(values), -1)) * self.weight[:, None]
        count = np.bincount(self.member, self.weight)
        sums = np.stack([np.bincount(self.member, column) for column in flat.T], axis=1)
        means = sums / np.where(count > 0.0, count, 1.0)[:, None]
        result: Floats = means[self.member].reshape(values.shape)
        return result

    def _parts(self, difference: Floats, rows: slice | Ints) -> Floats:
        """A^T e along the principal directions (N, R)."""
        right = np.einsum("nik,ni->nk", self.rates[rows], difference)
        right = right if self.member is None else self._mean(right)
        result: Floats = np.einsum("nkr,nk->nr", self.vectors[rows], right)
        return result

    def to(self, difference: Floats, rows: slice | Ints) -> Floats:
        """The turns (N, R) that change the axis by `difference` (N, 3), as far as strong directions do."""
        weak = self.weak[rows]
        along = np.where(weak, 0.0, self._parts(difference, rows) / np.where(weak, 1.0, self.rate[rows]) ** 2)
        return self._turns(along, rows)

    def near_pole(self, difference: Floats, tolerance: float) -> Floats:
        """The turns (N, R) along the weak directions: see the top of this file."""
        rate = np.where(self.rate > BLIND, self.rate, np.inf)
        error = np.where(self.weak, self._parts(difference, slice(None)) / rate, 0.0)
        size = np.where(error != 0.0, np.abs(error), 1.0)
        gain = np.maximum((self.rate / POLE) ** 2, 1.0 - tolerance / size)
        return self._turns(error / rate * np.minimum(gain, MOST_TURN * rate / size), slice(None))

    def _turns(self, along: Floats, rows: slice | Ints) -> Floats:
        """(N, R) from amounts (N, R) along the principal directions."""
        result: Floats = np.einsum("nkr,nr->nk", self.vectors[rows], along)
        return result


def _principal(normal: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (N, R) and vectors (N, R, R) of symmetric matrices (N, R, R), R = 1 or 2, in closed form."""
    if normal.shape[1] == 1:
        return normal[:, :, 0], np.ones_like(normal)
    a, b, c = normal[:, 0, 0], normal[:, 0, 1], normal[:, 1, 1]
    angle = 0.5 * np.arctan2(2.0 * b, a - c)
    cos, sin = np.cos(angle), np.sin(angle)
    large, apart = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    small = np.maximum(a * c - b * b, 0.0) / np.where(large + apart > 0.0, large + apart, 1.0)
    return (np.stack([large + apart, small], axis=1),
            np.stack([np.stack([cos, sin], axis=1), np.stack([-sin, cos], axis=1)], axis=2))


def _members(group: Ints) -> Ints:
    """Group numbers (N,) without gaps; every -1 becomes a group of its own."""
    alone = group < 0
    own = np.where(alone, np.arange(len(group)) + (group.max(initial=0) + 1), group)
    result: Ints = np.unique(own, return_inverse=True)[1].astype(np.int64)
    return result
