"""The condition number of a chain of axes over its rotary positions, proved: boxes of angles that cannot hold a larger one.

J as `analysis/chain.py` has it, slides at home. In a box J = J0 + D with |D| at most d (Frobenius) by intervals of the
turns, so the singular values move by d at most (Weyl) and cond J <= (s1 + d) / (sn - d). Where the chain is singular
inside its range the condition number is infinite there, and that is the answer.
"""

from __future__ import annotations

import numpy as np

from machines.certificate.chains import ChainOfAxes
from machines.certificate.spans import Span, spanned
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CLOSE, MOST, AT_ONCE, SINGULAR = 0.01, 20_000, 1_000, 1e6
"""part of the value to which it is found; boxes at most, at a time; a condition number that counts as infinite"""


@dataclass(frozen=True, eq=False)
@arrays(at="R")
class ChainExtreme:
    """The largest condition number: at least `value`, at the rotary positions `at` (R,) rad, nowhere more than `most`."""

    value: float
    most: float
    at: Floats
    boxes: int


def scaled(rates: Span, rotary: Floats, lever: float) -> Span:
    """J (N, 6, J) with all of it as mm per mm: directions by the lever, rotary axes by one over it."""
    scale = np.ones((6, len(rotary)))
    scale[3:] *= lever
    scale[:, rotary > 0.0] /= lever
    return Span(rates.lo * scale, rates.hi * scale)


def largest_condition(chain: ChainOfAxes, home: Floats, turns: Floats, lever: float) -> ChainExtreme:
    """Over rotary positions between `turns` (R, 2) rad with the slides at `home` (3,) in chain order."""
    rotary = np.array([float(joint.rotary) for joint in chain.joints])
    lower, upper = turns[None, :, 0], turns[None, :, 1]
    most = np.array([np.inf])
    best, place, tried = 0.0, turns.mean(axis=1), 0
    while len(most) and most.max() > best * (1.0 + CLOSE) and tried < MOST and best < SINGULAR:
        order = np.argsort(-most)
        first, rest = order[:AT_ONCE], order[AT_ONCE:]
        low, high = lower[first], upper[first]
        tried += len(first)
        middle = scaled(chain.rates(home, spanned(0.5 * (low + high))), rotary, lever).lo
        off = scaled(chain.rates(home, Span(low, high)), rotary, lever)
        d = np.sqrt((np.maximum(np.abs(off.lo - middle), np.abs(off.hi - middle)) ** 2).sum(axis=(1, 2)))
        values = np.linalg.svd(middle, compute_uv=False)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(values[:, -1] > 0.0, values[:, 0] / values[:, -1], np.inf)
            bound = np.where(values[:, -1] > d, (values[:, 0] + d) / (values[:, -1] - d), np.inf)
        if (k := int(at.argmax()), float(at.max()))[1] > best:
            best, place = float(at[k]), 0.5 * (low[k] + high[k])
        bound = np.minimum(bound, most[first])
        live = bound > best
        if not turns.shape[0]:
            most = np.zeros(0)
            break
        parts = _halved(low[live], high[live])
        lower, upper = (np.concatenate([old[rest], new]) for old, new in zip((lower, upper), parts, strict=True))
        most = np.concatenate([most[rest], np.tile(bound[live], 2)])
    whole = max(best, float(most.max(initial=best)))
    return ChainExtreme(best, np.inf if best >= SINGULAR else whole, place, tried)


def _halved(lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    i, k = (upper - lower).argmax(axis=1) if len(lower) else np.zeros(0, dtype=np.int64), np.arange(len(lower))
    middle = 0.5 * (lower[k, i] + upper[k, i])
    below, above = upper.copy(), lower.copy()
    below[k, i] = above[k, i] = middle
    return np.concatenate([lower, above]), np.concatenate([below, upper])
