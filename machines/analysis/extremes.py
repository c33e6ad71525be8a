"""The largest value of a measure over a workspace, proved: boxes that cannot hold a larger one are left out.

N = Jq^-1 Jx takes rates of the platform to those of the drives (mm per mm: turns by the lever, arms by the path of their
ends), J its inverse. In a box N = N0 (I + E), with |E| at most e by the rates of N (`certificate/enclosure.py`), so that
cond N <= cond N0 (1 + e) / (1 - e), a row of N is at most (1 + e) times, a column of J at most 1 / (1 - e) times that in the
middle. Boxes that may hold more than the largest value seen are halved (branch and bound). Source of the measures: Company
2000, II-24, III.6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from machines.certificate.enclosure import columns, enclosed
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, spanned
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Bools, Floats

CLOSE, MOST, FEW, AT_ONCE = 0.01, 10_000, 4_000, 500
"""part of the value to which it is found; boxes at most, of a tool that tilts in every direction; at a time"""


@dataclass(frozen=True)
class Extreme:
    """The largest value over a workspace: at least `value`, at the pose `place` (mm, rad), and nowhere more than `most`."""

    value: float
    most: float
    place: tuple[float, float, float, float, float]
    boxes: int


@dataclass(frozen=True)
class RateMeasure:
    """A measure of N (N, K, K): its value, and the largest that it may have where N = N0 (I + E), |E| <= e (N,)."""

    value: Callable[[Floats], Floats]
    most: Callable[[Floats, Floats], Floats]


def _condition(n: Floats) -> Floats:
    values = np.linalg.svd(n, compute_uv=False)
    return np.asarray(values[:, 0] / values[:, -1])


def _row(n: Floats) -> Floats:
    return np.asarray(np.linalg.norm(n, axis=2).max(axis=1))


def _column(n: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.linalg.inv(n), axis=1).max(axis=1))


MEASURES = {
    "condition_number": RateMeasure(_condition, lambda value, e: value * (1.0 + e) / (1.0 - e)),
    "speed_transmission": RateMeasure(_row, lambda value, e: value * (1.0 + e)),
    "force_transmission": RateMeasure(_column, lambda value, e: value / (1.0 - e)),
}
"""by the key of the report"""


def largest_over(legs: LegGeometry, lever: float, measure: RateMeasure, close: float = CLOSE) -> Extreme:
    """Over the declared workspace, to `close` of its value, or as far as that many boxes lead."""
    space, poses = legs.workspace, PosesOfBoxes(legs, np.zeros(3))
    high = 2.0 * np.pi if legs.tilts_everywhere and space.tilt[1] > 0.0 else 0.0
    free = np.array([letter in legs.freedoms for letter in "xyz"])
    lower = np.array([*np.where(free, space.lower, 0.0), space.tilt[0], 0.0])[None]
    upper = np.array([*np.where(free, space.upper, 0.0), space.tilt[1], high])[None]
    corners = np.stack(np.meshgrid(*np.concatenate([lower, upper]).T), axis=-1).reshape(-1, 5)
    at, _, _ = _over(poses, lever, measure, spanned(corners))
    best, place, tried = float(at.max()), corners[int(at.argmax())], len(corners)
    most, limit = np.array([np.inf]), FEW if high else MOST
    while len(most) and most.max() > best * (1.0 + close) and tried < limit:
        order = np.argsort(-most)
        first, rest = order[:AT_ONCE], order[AT_ONCE:]
        value, e, share = _over(poses, lever, measure, Span(lower[first], upper[first]))
        tried += len(first)
        if (k := int(value.argmax()), float(value.max()))[1] > best:
            best, place = float(value[k]), 0.5 * (lower[first][k] + upper[first][k])
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = np.where(e < 1.0, measure.most(value, e), np.inf)
        bound = np.minimum(np.nan_to_num(bound, nan=np.inf, posinf=np.inf), most[first])
        live = bound > best
        halves = _halved(lower[first][live], upper[first][live], share[live])
        lower, upper = (np.concatenate([old[rest], new]) for old, new in zip((lower, upper), halves, strict=True))
        most = np.concatenate([most[rest], bound[live], bound[live]])
    x, y, z, tilt, heading = place.tolist()
    return Extreme(best, max(best, float(most.max(initial=best))), (x, y, z, tilt, heading), tried)


def _over(poses: PosesOfBoxes, lever: float, measure: RateMeasure, pose: Span) -> tuple[Floats, Floats, Floats]:
    """(value in the middle (N,), e (N,), share of each number of the pose (N, 5)); e is infinite where nothing is known."""
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
    return measure.value(safe), np.where(known, share.sum(axis=1), np.inf), np.where(known[:, None], share, pose.radius)


def _halved(lower: Floats, upper: Floats, share: Floats) -> tuple[Floats, Floats]:
    """(lower, upper) of the halves of boxes across what matters most."""
    i = np.where(upper > lower, share, -1.0).argmax(axis=1)
    k = np.arange(len(lower))
    middle = 0.5 * (lower[k, i] + upper[k, i])
    below, above = upper.copy(), lower.copy()
    below[k, i] = above[k, i] = middle
    return np.concatenate([lower, above]), np.concatenate([below, upper])
