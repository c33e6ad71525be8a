"""The largest value of a measure over a workspace, proved: boxes that cannot hold a larger one are left out.

N = Jq^-1 Jx takes rates of the platform to those of the drives (mm per mm: turns by the lever, arms by the path of their
ends), J its inverse. In a box N = N0 (I + E), with |E| at most e by the rates of N (`certificate/enclosure.py`), so that
cond N <= cond N0 (1 + e) / (1 - e), a row of N is at most (1 + e) times, a column of J at most 1 / (1 - e) times that in the
middle, |det N| at least (1 - e)^K times. The acceleration of a slide per speed squared is |I - u j|^2 |j| / L, j a row of N
and L the rod (III.6.5). Boxes that may hold more than the largest value seen are halved (branch and bound). Source of the
measures: Company 2000, II-24, III.6.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from machines.certificate.enclosure import columns, enclosed
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, spanned
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CLOSE, MOST, FEW, AT_ONCE = 0.01, 16_000, 5_000, 500
"""part of the value to which it is found; boxes of a measure at most besides those with which all begin, of products of
singular values; at a time"""
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
    """A measure of N0 (N, K, K): its value, and the largest, of value, N0 and e (N,), where N = N0 (I + E), |E| <= e."""

    value: Callable[[Floats], Floats]
    most: Callable[[Floats, Floats, Floats], Floats]
    few: bool = False
    """whether its bounds are so wide that more than FEW boxes hardly help"""


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


MEASURES = {
    "condition_number": RateMeasure(_condition, lambda value, n, e: value * (1.0 + e) / (1.0 - e)),
    "speed_transmission": RateMeasure(_row, lambda value, n, e: value * (1.0 + e)),
    "force_transmission": RateMeasure(_column, lambda value, n, e: value / (1.0 - e)),
    "manipulability": RateMeasure(_volume, lambda value, n, e: value / (1.0 - e) ** n.shape[1], True),
    "conditioning_lost": RateMeasure(_lost, lambda value, n, e: value * ((1.0 + e) / (1.0 - e)) ** n.shape[1], True),
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
    return RateMeasure(lambda n: bent(n, np.zeros(len(n))), lambda value, n, e: bent(n, e))


@dataclass(frozen=True, eq=False)
@arrays(lower="N 5", upper="N 5", middle="N K K", e="N", share="N 5")
class BoxesOfRates:
    """Boxes of poses with N0 in the middle of each, e over it (infinite where nothing is known), share of each number in
    e."""

    lower: Floats
    upper: Floats
    middle: Floats
    e: Floats
    share: Floats

    def part(self, rows: Bools | Ints) -> BoxesOfRates:
        """Some of them."""
        return BoxesOfRates(self.lower[rows], self.upper[rows], self.middle[rows], self.e[rows], self.share[rows])

    def with_others(self, others: BoxesOfRates) -> BoxesOfRates:
        """These, then the others."""
        names = ("lower", "upper", "middle", "e", "share")
        return BoxesOfRates(*(np.concatenate([getattr(self, name), getattr(others, name)]) for name in names))


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
        middle, e, share = _over(self.poses, self.lever, Span(lower, upper))
        return BoxesOfRates(lower, upper, middle, e, share)

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
            with np.errstate(divide="ignore", invalid="ignore"):
                bound = np.where(some.e < 1.0, measure.most(value, some.middle, some.e), np.inf)
            most[fresh] = np.minimum(np.nan_to_num(bound, nan=np.inf, posinf=np.inf), most[fresh])
        keep = most > best
        live, most = live.part(keep), most[keep]
        if not len(most) or most.max() <= best * (1.0 + close) or more >= (FEW if measure.few else MOST):
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


def _over(poses: PosesOfBoxes, lever: float, pose: Span) -> tuple[Floats, Floats, Floats]:
    """(N0 (N, K, K), e (N,), share of each number of the pose (N, 5)); e is infinite where nothing is known."""
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
    share = np.linalg.norm(inverse @ by.middle, ord=2, axis=(2, 3))
    share = (share + np.linalg.norm(np.abs(inverse) @ by.radius, axis=(2, 3))) * pose.radius
    return safe, np.where(known, share.sum(axis=1), np.inf), np.where(known[:, None], share, pose.radius)


def _halved(lower: Floats, upper: Floats, share: Floats) -> tuple[Floats, Floats]:
    """(lower, upper) of the halves of boxes across what matters most."""
    i = np.where(upper > lower, share, -1.0).argmax(axis=1)
    k = np.arange(len(lower))
    middle = 0.5 * (lower[k, i] + upper[k, i])
    below, above = upper.copy(), lower.copy()
    below[k, i] = above[k, i] = middle
    return np.concatenate([lower, above]), np.concatenate([below, upper])
