"""Strict mode: how much slower a motion must be for its delivered samples to exceed nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.feedrate.kernels.samples import most_used
from postproc.feedrate.motion import Plan
from postproc.feedrate.trajectory import ORDERS, REST_PAD
from toolpaths.arrays import Floats
from toolpaths.compiled import available, compiled

ROUNDS = 12
FITS = 0.9995
"""Ratio, as a factor on time, from which a strict plan is fast enough, for the first TRIES looks at its samples."""
TRIES = 3
CHUNK = 16384
"""samples looked at together"""
MARGIN = 3e-5
"""beyond what samples ask for, as those of the slower motion fall elsewhere; four times as much at each further look"""


def slowed_within(made: Plan, guess: Floats) -> Plan:
    """Each piece slowed down until nothing is exceeded in the samples that are delivered, first by `guess` (P,).

    All limits are homogeneous in time, so that x/g^2 divides velocity by g, acceleration by g^2 and jerk by
    g^3. Samples of the slower motion fall elsewhere, so it is measured again.
    """
    factor = guess
    for turn in range(ROUNDS):
        pieces = tuple(piece if g == 1.0 else piece.slower(g)
                       for piece, g in zip(made.pieces, factor.tolist(), strict=True))
        made = replace(made, pieces=pieces)
        asked = needed(made)
        fits = (asked <= 1.0) & (asked > (FITS if turn < TRIES else 0.0))
        if fits.all():
            return made
        factor = np.where(fits, 1.0, asked * (1.0 + MARGIN * 4.0**turn))
    raise ArithmeticError(f"limits still exceeded by {asked.max() - 1.0:.2g} after slowing down {ROUNDS} times")


def needed(made: Plan, kernel: bool | None = None) -> Floats:
    """Factor (P,) on the time of each piece that its samples ask for; compiled where that can be."""
    plain = made.limits.tool is None and made.limits.forces is None
    return _by_loop(made) if plain and (available() if kernel is None else kernel) else _by_numpy(made)


def _by_numpy(made: Plan) -> Floats:
    asked = np.zeros(len(made.pieces))
    for chunk, own in made.chunks():
        which = np.minimum(np.searchsorted(made.ends, chunk.t[own], side="right"), len(asked) - 1)
        np.maximum.at(asked, which, chunk.worst_slowdown(made.limits)[own])
    return asked


def _by_loop(made: Plan) -> Floats:
    """As `_by_numpy`; without the samples' motion in arrays of their own."""
    worst, fed = np.zeros((len(made.pieces), 3)), np.zeros(len(made.pieces))
    inverse = np.array([1.0 / getattr(made.limits, name) for name in ORDERS])
    steps = made.step ** np.arange(1.0, 4.0)
    for first in range(0, made.samples, CHUNK):
        last = min(first + CHUNK, made.samples)
        low, high = max(first - REST_PAD, 0), min(last + REST_PAD, made.samples)
        parts = []
        for i, at in made.places(low, high):
            eased = made.pieces[i].eased
            s = eased.parameter(at.sigma)
            found = eased.chained(at.sigma, s, eased.path.derivatives(eased.inside(s[0])))
            fed[i] = max(fed[i], float(np.max(s[1] * at.speed / made.feed(s[0]))))
            parts.append((*found, np.stack(at[1:], axis=1), np.full(len(s[0]), i)))
        *orders, along, which = (np.concatenate(column) for column in zip(*parts, strict=True))
        compiled(most_used)(*orders, np.ascontiguousarray(along.T), which, inverse, steps,
                            np.array([first - low, last - low]), worst)
    return np.asarray(np.maximum(np.maximum(worst[:, 0], fed), np.maximum(worst[:, 1] ** 0.5, np.cbrt(worst[:, 2]))))
