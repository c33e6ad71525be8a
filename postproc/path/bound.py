"""How far a block may stray from its curve between its ends: bounds that hold everywhere, not samples.

With e(t) the difference of the block's pose and the reference's pose, both run through in the same t, and |e''| <= M, e
stays within M d^2 / 8 of the straight lines between its values at places d apart (interpolation error), and a straight
line is nowhere longer than at its ends. So max |e| <= max |e(t_k)| + M d^2 / 8. M comes from the derivatives in the middle
of the block and a bound of the third derivative over all of it (`Kinematics.jets`). The reference may be run
through at all: here its parameter is the parabola through its values at the block's ends and middle.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics import columns
from machines.kinematics.base import Kinematics
from machines.kinematics.columns import blocks as in_blocks
from machines.kinematics.taylor import ZERO, TaylorAngle, TaylorVector
from postproc.control.control import Control
from postproc.path.coarse_bound import coarse_bounds, highest
from toolpaths.arrays import Bools, Floats, Ints, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, cross, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

SHORT = 0.1
"""mm: on shorter curves the axis is compared where the curve's own parameter stands, not at the nearest tip"""
_MOST_SKEW = 0.25
MANY = 1000
"""blocks from which on a cheap bound is looked for first"""


@dataclass(frozen=True)
@arrays(u0="N", u1="N", q0="N J", q1="N J", start="* N 3", end="* N 3")
class CurveBlocks:
    """N blocks and what they follow: joints q0 -> q1 (N, J), curves[u0..u1], poses at both ends (tip, axis), (N, 3)."""

    curves: Curves
    u0: Floats
    u1: Floats
    q0: Floats
    q1: Floats
    start: tuple[Floats, Floats]
    end: tuple[Floats, Floats]

    def __len__(self) -> int:
        return len(self.u0)

    def take(self, rows: slice | Bools | Ints) -> CurveBlocks:
        """Some of the blocks."""
        return CurveBlocks(self.curves.take(rows), self.u0[rows], self.u1[rows], self.q0[rows], self.q1[rows],
                           (self.start[0][rows], self.start[1][rows]), (self.end[0][rows], self.end[1][rows]))


def settled_bounds(control: Control, kin: Kinematics, stretch: CurveBlocks, allowed: tuple[float, float], ends: Bools,
                   worst: Floats) -> tuple[Floats, Floats]:
    """As `bounds` within the tolerances `allowed`, of blocks that are taken wherever that is kept, where `ends` (N,).

    The largest of those, and of `worst` (2,), is what `bounds` finds; where a cheap bound shows that a block keeps the
    tolerances and is not the worst, that bound stands for it.
    """
    coarse = None if control.tip_law or len(stretch) < MANY else coarse_bounds(
        kin, stretch.curves, (stretch.q0, stretch.q1), stretch.start, stretch.end, SHORT)
    if coarse is None:
        return bounds(control, kin, stretch, *allowed)
    kept = ends & (coarse[0] <= allowed[0]) & (coarse[1] <= allowed[1])
    known = ~kept
    known[highest(np.where(kept, coarse, 0.0))] = True
    first = np.flatnonzero(known)
    coarse[:, first] = bounds(control, kin, stretch.take(first), *allowed)
    good = ends[first] & (coarse[0, first] <= allowed[0]) & (coarse[1, first] <= allowed[1])
    worst = np.maximum(worst, coarse[:, first[good]].max(axis=1, initial=0.0))
    rest = np.flatnonzero(~known & ((coarse[0] > worst[0]) | (coarse[1] > worst[1])))
    if len(rest):
        coarse[:, rest] = bounds(control, kin, stretch.take(rest), *allowed)
    return coarse[0], coarse[1]


def bounds(control: Control, kin: Kinematics, stretch: CurveBlocks, tolerance: float,
           axis_tolerance: float) -> tuple[Floats, Floats]:
    """Bounds (tip (N,) mm, axis (N,) rad) of the deviation of blocks from their curves under the control's law.

    The tip's is that from the nearest point of the curve; the axis's that from the great circle at that point. They
    are looked at more closely where that may bring them inside the tolerances. NaN poses give infinity.
    """
    tip, axis = np.empty(len(stretch)), np.empty(len(stretch))
    for part in in_blocks(len(stretch)):
        tip[part], axis[part] = _bounds(control, kin, stretch.take(part), tolerance, axis_tolerance)
    return tip, axis


def _bounds(control: Control, kin: Kinematics, s: CurveBlocks, tolerance: float,
            axis_tolerance: float) -> tuple[Floats, Floats]:
    off = _Offset.of(control, kin, s)
    tip, axis = off.bound(s.curves, 0.5)
    seen = (off.seen.tip <= tolerance) & (off.seen.axis <= 2.0 * np.sin(0.5 * axis_tolerance))
    closer = seen & ((tip > tolerance) | (axis > axis_tolerance)) & np.isfinite(tip)
    if closer.any():
        tip[closer], axis[closer] = off.take(closer).looked_at(control, kin, s.take(closer))
    return tip, axis


@dataclass(frozen=True)
@arrays(tip="N", axis="N", along="N")
class _Seen:
    """Largest |e| (N,) at the places looked at: of the tip, of the axis, of the tip's part along the curve's chord."""

    tip: Floats
    axis: Floats
    along: Floats

    @classmethod
    def at(cls, tip: Floats, axis: Floats, chord: Floats) -> _Seen:
        """From e itself, (N, 3) each."""
        return cls(lengths(tip), lengths(axis), np.abs(_dot(tip, chord)))

    def __or__(self, other: _Seen) -> _Seen:
        return _Seen(np.maximum(self.tip, other.tip), np.maximum(self.axis, other.axis),
                     np.maximum(self.along, other.along))

    def take(self, rows: Bools) -> _Seen:
        return _Seen(self.tip[rows], self.axis[rows], self.along[rows])


@dataclass(frozen=True)
@arrays(turn="N")
class _Offset:
    """e(t) of N blocks: what was seen of it, bounds of |e''| (same meanings), and the reference's parameter.

    `turn` (N,) is the whole curve's turn of the axis, rad.
    """

    seen: _Seen
    bend: _Seen
    turn: Floats
    travel: TaylorAngle

    @classmethod
    def of(cls, control: Control, kin: Kinematics, s: CurveBlocks) -> _Offset:
        """Looked at where the blocks begin and end and in their middle."""
        n, chord = len(s), _chord(s.curves)
        tip, axis = _law_jets(control, kin, s)
        travel, turn = _travel(s, columns.to_rows(tip.value, n)), angle_between(s.curves.axis0, s.curves.axis1)
        tip, axis = tip - tip_reference(s.curves, travel), axis - axis_reference(s.curves, travel, turn)
        seen = _Seen.at(columns.to_rows(tip.value, n), columns.to_rows(axis.value, n), chord)
        for pose, u in ((s.start, s.u0), (s.end, s.u1)):
            on_tip, on_axis = s.curves.at(u)
            seen = seen | _Seen.at(pose[0] - on_tip, pose[1] - on_axis, chord)
        along = np.abs(_dot(columns.to_rows(tip.second, n), chord)) + 0.5 * tip.third
        return cls(seen, _Seen(tip.bend() + np.zeros(n), axis.bend() + np.zeros(n), along), turn, travel)

    def take(self, rows: Bools) -> _Offset:
        """Some of the blocks."""
        value, first, second = (np.broadcast_to(x, rows.shape)[rows] for x in (
            self.travel.value, self.travel.first, self.travel.second))
        return _Offset(self.seen.take(rows), self.bend.take(rows), self.turn[rows], TaylorAngle(value, first, second))

    def bound(self, curves: Curves, apart: float) -> tuple[Floats, Floats]:
        """(mm, rad), e having been seen at places `apart` of the block from each other."""
        share = apart * apart / 8.0
        tip = self.seen.tip + share * self.bend.tip
        with np.errstate(invalid="ignore"):  # unbounded, and so NaN: infinite below
            axis = self.seen.axis + share * self.bend.axis + self.turn * self._deviation(curves, tip, share)
        angle = 2.0 * np.arcsin(np.minimum(0.5 * axis, 1.0))
        return without_nan(tip, np.inf), without_nan(angle, np.inf)

    def _deviation(self, curves: Curves, tip: Floats, share: float) -> Floats:
        """Bound (N,) of the curve's parameter at the point nearest to the tip less the reference's."""
        length = curves.length()
        extent = np.where(length > SHORT, length, np.inf)
        along = self.seen.along + share * self.bend.along
        arc = np.flatnonzero(curves.is_arc)
        if len(arc):
            radius = lengths(cross(curves.start[arc] - curves.center[arc], curves.normal[arc]))
            along[arc] = 0.5 * np.pi * tip[arc]
            extent[arc] = np.where(np.isfinite(extent[arc]), radius * curves.sweep[arc], np.inf)
        return np.asarray(along / extent, dtype=np.float64)

    def looked_at(self, control: Control, kin: Kinematics, s: CurveBlocks) -> tuple[Floats, Floats]:
        """The bounds with the quarters looked at too."""
        seen, chord = self.seen, _chord(s.curves)
        for t in (0.25, 0.75):
            tip, axis, _ = control.between(s.q0, s.q1, np.full(len(s), t), kin)
            h = t - 0.5
            place = self.travel.value + h * (self.travel.first + 0.5 * h * self.travel.second)
            on_tip, on_axis = s.curves.at(np.asarray(place))
            seen = seen | _Seen.at(tip - on_tip, axis - on_axis, chord)
        return _Offset(seen, self.bend, self.turn, self.travel).bound(s.curves, 0.25)


def _law_jets(control: Control, kin: Kinematics, s: CurveBlocks) -> tuple[TaylorVector, TaylorVector]:
    """Tip and axis along the blocks under the control's law; with standing rotaries a plane's law is that of the axes."""
    if control.tip_law:
        return kin.tip_jets(s.q0, s.q1, s.start[0], s.end[0], control.xyz)
    return kin.jets(s.q0, s.q1)


def _travel(s: CurveBlocks, middle: Floats) -> TaylorAngle:
    """The curve's parameter through both ends and the point nearest to the block's middle."""
    even = 0.5 * (s.u0 + s.u1)
    length = s.curves.length()
    found = np.where(length > SHORT, s.curves.project(without_nan(middle), even), even)
    return curve_parameter(s.u0, found, s.u1)


def curve_parameter(u0: Floats, middle: Floats, u1: Floats) -> TaylorAngle:
    """The parabola (N,) of the curve's parameter through `u0`, `middle` and `u1`, monotone."""
    even, reach = 0.5 * (u0 + u1), _MOST_SKEW * np.abs(u1 - u0)
    value = np.clip(middle, even - reach, even + reach)
    return TaylorAngle(value, u1 - u0, 4.0 * (u0 - 2.0 * value + u1))


def tip_reference(curves: Curves, travel: TaylorAngle) -> TaylorVector:
    """The curve's tip: straight, or on arcs the radius vector, blended between the ends, turned about the centre."""
    span, start = curves.end - curves.start, curves.start
    arc = curves.is_arc
    if not arc.any():
        return _run(start, span, travel)
    first = np.where(arc[:, None], curves.start - curves.center, 0.0)
    last = _turned_back(curves)
    jet = _run(np.where(arc[:, None], curves.center + first, start), np.where(arc[:, None], last - first, span), travel)
    sweep = np.where(arc, curves.sweep, 0.0)
    turn = TaylorAngle(sweep * travel.value, sweep * travel.first, sweep * travel.second)
    normal = np.where(arc[:, None], curves.normal, [0.0, 0.0, 1.0])
    return jet.turned(list(normal.T), list(np.where(arc[:, None], curves.center, 0.0).T), turn)


def _turned_back(curves: Curves) -> Floats:
    """The end's radius vector (N, 3) turned back by the whole sweep; 0 where no arc is."""
    arc = np.flatnonzero(curves.is_arc)
    result = np.zeros_like(curves.start)
    offset, normal, sweep = curves.end[arc] - curves.center[arc], curves.normal[arc], curves.sweep[arc]
    c, s = np.cos(sweep)[:, None], np.sin(sweep)[:, None]
    along = _dot(offset, normal)[:, None] * normal
    result[arc] = along + c * (offset - along) - s * cross(normal, offset)
    return result


def _run(start: Floats, span: Floats, travel: TaylorAngle) -> TaylorVector:
    d = list(span.T)
    return TaylorVector(columns.plus(list(start.T), columns.times(travel.value, d)), columns.times(travel.first, d),
                        columns.times(travel.second, d))


def axis_reference(curves: Curves, travel: TaylorAngle, turn: Floats) -> TaylorVector:
    """The tool axis on the great circle."""
    normal = cross(curves.axis0, curves.axis1)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(size > 0.0, normal / np.where(size > 0.0, size, 1.0), [0.0, 0.0, 1.0])
    whole = np.where(size[:, 0] > 0.0, turn, 0.0)
    angle = TaylorAngle(whole * travel.value, whole * travel.first, whole * travel.second)
    return TaylorVector(list(curves.axis0.T)).turned(list(normal.T), ZERO, angle)


def _chord(curves: Curves) -> Floats:
    """Unit vectors (N, 3) from start to end, 0 where there is no path."""
    span = curves.end - curves.start
    size = np.linalg.norm(span, axis=1, keepdims=True)
    return np.asarray(span / np.where(size > 0.0, size, 1.0), dtype=np.float64)


def _dot(a: Floats, b: Floats) -> Floats:
    result: Floats = np.einsum("ni,ni->n", a, b)
    return result
