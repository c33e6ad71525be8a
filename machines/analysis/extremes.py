"""The largest value of a measure over a workspace, proved: boxes that cannot hold a larger one are left out.

N = Jq^-1 Jx takes rates of the platform to those of the drives (mm per mm: turns by the lever, arms by the path of their
ends), J its inverse. In a box N = N0 + D = N0 (I + E), |E| <= e < 1, by the rates of N (`certificate/enclosure.py`). So

    |N| <= |N0| + |D|,  |J| <= |J0| + |E J0| + e^2 / (1 - e) |J0|,  cond N = |N| |J|
    |n + d| <= |n| + n.d / |n| + |d|^2 / (2 |n|) of a row n of N0, and of a column j of J0 with d = E j, to which
    e^2 / (1 - e) |j| comes
    -ln |det (I + E)| <= -tr E + |E|_F^2 / (2 (1 - e)), the series of the logarithm
    ln |(I + E)^-1 j| <= -j.E j + e^2 / (1 - e) + e^2 / (2 (1 - e)^2) of a unit vector j, a column of J0

whose first terms are those of the derivative: round a place where a measure is flat boxes close quadratically. The
acceleration of a slide per speed squared is |I - u j|^2 |j| / L, j a row of N and L the rod (III.6.5). Boxes that may hold
more than the largest value seen are halved (branch and bound). Source of the measures: Company 2000, II-24, III.6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cached_property

import numpy as np

from machines.certificate.enclosure import columns, enclosed
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, spanned
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CLOSE, MOST, AT_ONCE = 0.01, 16_000, 500
"""part of the value to which it is found; boxes of a measure at most besides those with which all begin; at a time"""
FINE, START = 0.5, 60_000
"""e of the boxes with which all measures begin; boxes looked at for them at most"""


@dataclass(frozen=True)
class Extreme:
    """The largest value over a workspace: at least `value`, at the pose `place` (mm, rad), and nowhere more than `most`."""

    value: float
    most: float
    place: tuple[float, float, float, float, float]
    boxes: int


@dataclass(frozen=True)
class RateMeasure:
    """A measure of N0 (N, K, K): its value, and the largest in boxes, of value, N0 and what D and E may be."""

    value: Callable[[Floats], Floats]
    most: Callable[[Floats, Floats, Spread], Floats]


@dataclass(frozen=True, eq=False)
@arrays(e="N", larger="N", back="N", trace="N", turned="N", whole="N", rows="N K", columns="N K")
class Spread:
    """Largest over each of N boxes; infinite where nothing is known.

    Attributes:
        e: |E|
        larger: |D|
        back: |E J0| over |J0|
        trace: |tr E|
        turned: |tr E - sum of j.E j| of the unit columns j of J0
        whole: |E|_F
        rows, columns: (N, K) how much longer each row of N and each column of J becomes, over its length, first order and
            what d adds of the second
    """

    e: Floats
    larger: Floats
    back: Floats
    trace: Floats
    turned: Floats
    whole: Floats
    rows: Floats
    columns: Floats

    def part(self, rows: Bools | Ints) -> Spread:
        """Some of them."""
        return Spread(*(getattr(self, name)[rows] for name in SPREAD))

    def with_others(self, others: Spread) -> Spread:
        """These, then the others."""
        return Spread(*(np.concatenate([getattr(self, name), getattr(others, name)]) for name in SPREAD))

    @property
    def bent(self) -> Floats:
        """(N,) what is left of J beyond the first order, over |J0|."""
        return np.asarray(self.e**2 / (1.0 - self.e))

    @property
    def product(self) -> Floats:
        """(N,) the same of ln |det|."""
        return np.asarray(self.whole**2 / (2.0 * (1.0 - self.e)))


SPREAD = tuple(field.name for field in fields(Spread))


def _condition(n: Floats) -> Floats:
    values = np.linalg.svd(n, compute_uv=False)
    return np.asarray(values[:, 0] / values[:, -1])


def _row(n: Floats) -> Floats:
    return np.asarray(np.linalg.norm(n, axis=2).max(axis=1))


def _column(n: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.linalg.inv(n), axis=1).max(axis=1))


def _volume(n: Floats) -> Floats:
    return np.asarray(1.0 / np.abs(np.linalg.det(n)))


def _lost(n: Floats) -> Floats:
    """1 over the conditioning factor (II-23)."""
    return np.asarray(np.prod(np.linalg.norm(np.linalg.inv(n), axis=1), axis=1) * np.abs(np.linalg.det(n)))


def _most_condition(value: Floats, n: Floats, of: Spread) -> Floats:
    largest = np.linalg.norm(n, ord=2, axis=(1, 2))
    return np.asarray(value * (1.0 + of.larger / largest) * (1.0 + of.back + of.bent))


def _most_row(value: Floats, n: Floats, of: Spread) -> Floats:
    return np.asarray((np.linalg.norm(n, axis=2) * (1.0 + of.rows)).max(axis=1))


def _most_column(value: Floats, n: Floats, of: Spread) -> Floats:
    return np.asarray((np.linalg.norm(np.linalg.inv(n), axis=1) * (1.0 + of.columns + of.bent[:, None])).max(axis=1))


def _most_lost(value: Floats, n: Floats, of: Spread) -> Floats:
    columns_bent = n.shape[1] * (of.bent + of.e**2 / (2.0 * (1.0 - of.e) ** 2))
    return np.asarray(value * np.exp(of.turned + columns_bent + of.product))


MEASURES = {
    "condition_number": RateMeasure(_condition, _most_condition),
    "speed_transmission": RateMeasure(_row, _most_row),
    "force_transmission": RateMeasure(_column, _most_column),
    "manipulability": RateMeasure(_volume, lambda value, n, of: value * np.exp(of.trace + of.product)),
    "conditioning_lost": RateMeasure(_lost, _most_lost),
}
"""by the key of the report; of the conditioning factor one over it, whose largest is its least"""


def slide_acceleration(legs: LegGeometry) -> RateMeasure:
    """eta_av of a platform that only translates on slides, 1/mm."""
    basis = np.eye(3)[:, [letter in legs.freedoms for letter in "xyz"]]
    u = (-legs.roots[:, None] * legs.directions) @ basis  # rows of N have the sign of r / |r.u|

    def bent(n: Floats, e: Floats) -> Floats:
        size = np.linalg.norm(n, axis=2)
        flat = np.linalg.norm(np.eye(u.shape[1]) - u[None, :, :, None] * n[:, :, None, :], ord=2, axis=(2, 3))
        return np.asarray(((flat + size * e[:, None]) ** 2 * size * (1.0 + e)[:, None] / legs.lengths).max(axis=1))
    return RateMeasure(lambda n: bent(n, np.zeros(len(n))), lambda value, n, of: bent(n, of.e))


@dataclass(frozen=True, eq=False)
@arrays(lower="N 5", upper="N 5", middle="N K K", share="N 5")
class BoxesOfRates:
    """Boxes of poses with N0 in the middle of each, what D and E may be over it, share of each number of the pose in e."""

    lower: Floats
    upper: Floats
    middle: Floats
    spread: Spread
    share: Floats

    @property
    def e(self) -> Floats:
        """(N,)"""
        return self.spread.e

    def part(self, rows: Bools | Ints) -> BoxesOfRates:
        """Some of them."""
        return BoxesOfRates(self.lower[rows], self.upper[rows], self.middle[rows], self.spread.part(rows), self.share[rows])

    def with_others(self, others: BoxesOfRates) -> BoxesOfRates:
        """These, then the others."""
        lower, upper, middle, share = (np.concatenate([getattr(self, name), getattr(others, name)])
                                       for name in ("lower", "upper", "middle", "share"))
        return BoxesOfRates(lower, upper, middle, self.spread.with_others(others.spread), share)


@dataclass(frozen=True, eq=False)
class RatesOverWorkspace:
    """N over the declared workspace, turns by a lever (mm), in boxes fine enough that each measure may begin with them."""

    poses: PosesOfBoxes
    lever: float

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """(lower, upper) (5,) of the poses."""
        legs = self.poses.legs
        space = legs.workspace
        high = 2.0 * np.pi if legs.tilts_everywhere and space.tilt[1] > 0.0 else 0.0
        free = np.array([letter in legs.freedoms for letter in "xyz"])
        return (np.array([*np.where(free, space.lower, 0.0), space.tilt[0], 0.0]),
                np.array([*np.where(free, space.upper, 0.0), space.tilt[1], high]))

    def boxes(self, lower: Floats, upper: Floats) -> BoxesOfRates:
        """Boxes (N, 5) with what is known of them."""
        return BoxesOfRates(lower, upper, *_over(self.poses, self.lever, Span(lower, upper)))

    @cached_property
    def start(self) -> tuple[BoxesOfRates, int]:
        """(boxes that cover the workspace, boxes looked at): halved until e is below FINE in each, or there are START."""
        lower, upper = self.ends
        todo, done, tried = self.boxes(lower[None], upper[None]), list[BoxesOfRates](), 1
        while len(todo.e) and tried < START:
            good = todo.e < FINE
            done.append(todo.part(good))
            rest = todo.part(~good)
            if not len(rest.e):
                todo = rest
                break
            parts = _halved(rest.lower, rest.upper, rest.share)
            todo = self.boxes(*parts)
            tried += len(todo.e)
        for one in done:
            todo = todo.with_others(one)
        return todo, tried


def rates_over(legs: LegGeometry, lever: float) -> RatesOverWorkspace:
    """Of a machine's legs."""
    return RatesOverWorkspace(PosesOfBoxes(legs, np.zeros(3)), lever)


def largest_over(rates: RatesOverWorkspace, measure: RateMeasure, close: float = CLOSE) -> Extreme:
    """Over the declared workspace, to `close` of its value, or as far as that many boxes lead."""
    live, tried = rates.start
    lower, upper = rates.ends
    corners = np.stack(np.meshgrid(*np.stack([lower, upper]).T), axis=-1).reshape(-1, 5)
    at = measure.value(_over(rates.poses, rates.lever, spanned(corners))[0])
    best, place = float(at.max()), corners[int(at.argmax())]
    most, more = np.full(len(live.e), np.inf), 0
    fresh: Bools = np.ones(len(live.e), dtype=np.bool_)
    while True:
        if fresh.any():
            some = live.part(fresh)
            value = measure.value(some.middle)
            if (k := int(value.argmax()), float(value.max()))[1] > best:
                best, place = float(value[k]), 0.5 * (some.lower[k] + some.upper[k])
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                bound = np.where(some.e < 1.0, measure.most(value, some.middle, some.spread), np.inf)
            most[fresh] = np.minimum(np.nan_to_num(bound, nan=np.inf, posinf=np.inf), most[fresh])
        keep = most > best
        live, most = live.part(keep), most[keep]
        if not len(most) or most.max() <= best * (1.0 + close) or more >= MOST:
            break
        order = np.argsort(-most)
        first, rest = order[:AT_ONCE], order[AT_ONCE:]
        chosen = live.part(first)
        new = rates.boxes(*_halved(chosen.lower, chosen.upper, chosen.share))
        more += len(new.e)
        fresh = np.arange(len(rest) + len(new.e)) >= len(rest)
        live, most = live.part(rest).with_others(new), np.concatenate([most[rest], np.tile(most[first], 2)])
    x, y, z, tilt, heading = place.tolist()
    return Extreme(best, max(best, float(most.max(initial=best))), (x, y, z, tilt, heading), tried + more)


def _over(poses: PosesOfBoxes, lever: float, pose: Span) -> tuple[Floats, Spread, Floats]:
    """(N0 (N, K, K), what D and E may be, share of each number of the pose in e (N, 5))."""
    legs = poses.legs
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        here, over = enclosed(poses, spanned(pose.middle)), enclosed(poses, pose)
        count, (free, _) = len(legs.names), columns(legs)
        scale = np.where(np.array(free) < 3, 1.0, legs.lever / (lever or 1.0))
        middle = here.matrix.lo[:, :count][:, :, free] * scale / here.cosine.lo[:, :, None]
        rows = Span(over.matrix.lo, over.matrix.hi)[:, :count][:, :, free] * scale
        change = over.change[:, :, :count][:, :, :, free] * scale
        cosine = over.cosine[:, :, None]
        by = (change - rows.over(cosine)[:, None] * over.cosine_change[..., None]).over(cosine[:, None])
    finite: Bools = np.asarray(np.isfinite(by.lo) & np.isfinite(by.hi))
    known: Bools = np.asarray(finite.all(axis=(1, 2, 3)) & (over.under.lo > 0.0).all(axis=1))
    fine: Bools = np.asarray(np.isfinite(middle).all(axis=(1, 2)))
    safe = np.where(fine[:, None, None], middle, np.eye(count))
    inverse = np.linalg.inv(safe)[:, None]
    by = Span(*(np.where(known[:, None, None, None], end, 0.0) for end in (by.lo, by.hi)))
    moves, off = inverse @ by.middle, np.abs(inverse) @ by.radius
    share = (np.linalg.norm(moves, ord=2, axis=(2, 3)) + np.linalg.norm(off, axis=(2, 3))) * pose.radius
    own = inverse[:, 0] / np.linalg.norm(inverse[:, 0], axis=1, keepdims=True)
    size = np.linalg.norm(inverse[:, 0], ord=2, axis=(1, 2))[:, None]
    trace = np.einsum("ndkk->nd", moves)
    turned = trace - np.einsum("nik,ndij,njk->nd", own, moves, own)
    off_trace, across = np.einsum("ndkk->nd", off), np.einsum("nik,ndij,njk->nd", np.abs(own), off, np.abs(own))
    larger = np.linalg.norm(by.middle, ord=2, axis=(2, 3)) + np.linalg.norm(by.radius, axis=(2, 3))
    back = (np.linalg.norm(moves @ inverse, ord=2, axis=(2, 3)) + np.linalg.norm(off @ np.abs(inverse), axis=(2, 3))) / size
    whole = np.linalg.norm(moves, axis=(2, 3)) + np.linalg.norm(off, axis=(2, 3))
    half = pose.radius
    longer = _longer(safe, by.middle, by.radius, half)
    cols = _longer(np.swapaxes(inverse[:, 0], 1, 2), np.swapaxes(moves @ inverse, 2, 3),
                   np.swapaxes(off @ np.abs(inverse), 2, 3), half)
    rates = (larger, back, np.abs(trace) + off_trace, np.abs(turned) + off_trace + across, whole)
    found = [share.sum(axis=1), *((rate * pose.radius).sum(axis=1) for rate in rates)]
    spread = Spread(*(np.where(known, value, np.inf) for value in found),
                    *(np.where(known[:, None], value, np.inf) for value in (longer, cols)))
    return safe, spread, np.where(known[:, None], share, pose.radius)


def _longer(rows: Floats, middle: Floats, radius: Floats, half: Floats) -> Floats:
    """(N, K) how much longer rows (N, K, K) become, over their length, that change by `middle` +- `radius` (N, 5, K, K) per
    number of the pose, which goes `half` (N, 5) to either side."""
    size = np.linalg.norm(rows, axis=2)
    unit = rows / size[:, :, None]
    first = np.abs(np.einsum("nkj,ndkj->ndk", unit, middle)) + np.einsum("nkj,ndkj->ndk", np.abs(unit), radius)
    whole = np.linalg.norm(middle, axis=3) + np.linalg.norm(radius, axis=3)
    first, whole = ((one * half[:, :, None]).sum(axis=1) / size for one in (first, whole))
    return np.asarray(first + 0.5 * whole**2)


def _halved(lower: Floats, upper: Floats, share: Floats) -> tuple[Floats, Floats]:
    """(lower, upper) of the halves of boxes across what matters most."""
    i = np.where(upper > lower, share, -1.0).argmax(axis=1)
    k = np.arange(len(lower))
    middle = 0.5 * (lower[k, i] + upper[k, i])
    below, above = upper.copy(), lower.copy()
    below[k, i] = above[k, i] = middle
    return np.concatenate([lower, above]), np.concatenate([below, upper])
