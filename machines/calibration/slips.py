"""Slips of a measurement table that the readings themselves show: a sign turned round, two columns changed over.

Where a fit leaves more than noise, the same fit is made with each slip put right; one that leaves much less is named. Signs
of all readings together cannot be seen: the errors found only have the other sign.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from machines.calibration.machine_fit import Measurements, fit
from machines.calibration.measurement_file import ReversalModel
from machines.calibration.problem import CalibrationResult
from machines.calibration.reversal import identify
from machines.calibration.rotary_fit import rotary_span
from machines.calibration.simulator import PARTS, Bench
from machines.geometric_error.model import ErrorModel
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats

BETTER = 3.0
"""times less is left, for a slip to be named"""
ALIKE = 1.1
"""times what the best of them leaves: slips that cannot be told from it"""
TURNED = 1e-6
"""of a direction: a table frame that never turns"""
ROWS = 400
"""of a table that slips are looked for in"""
PAIRS = ((0, 1), (1, 2), (0, 2))


def machine_slip(start: ErrorModel, kinematics: Kinematics, measured: Measurements, wanted: Sequence[str]) -> str:
    """The slip of a table of poses, bar or laser, "" where there is none."""
    some = np.unique(np.linspace(0, len(measured.q) - 1, ROWS).astype(np.int64))
    part = replace(measured, q=measured.q[some], read=measured.read[some],
                   ways=None if measured.ways is None else measured.ways[some])
    others = [*_others(part, kinematics), *_other_directions(part, start, kinematics)]
    tried = ((words, _left(fit(start, kinematics, other, wanted).result)) for words, other in others)
    return _best(_left(fit(start, kinematics, part, wanted).result), tried)


def _others(m: Measurements, kinematics: Kinematics) -> Iterable[tuple[str, Measurements]]:
    """Each slip in words, and the measurements without it."""
    names, sign = kinematics.axis_names, np.eye(len(kinematics.axis_names))
    for j in np.flatnonzero(np.abs(m.q).max(axis=0) > 0.0):
        other = m.q * (1.0 - 2.0 * sign[j])
        if np.isfinite(kinematics.forward(other)[0]).all():
            yield f"with {names[j]} turned round", replace(m, q=other)
    if m.ways is not None and m.ways.any():
        yield "with the ways turned round", replace(m, ways=-m.ways)
    if m.kind != "distance":
        yield "with all readings turned round", replace(m, read=-m.read)
    if m.kind == "position":
        for k, x in enumerate("xyz"):
            yield f"with d{x} turned round", replace(m, read=m.read * (1.0 - 2.0 * np.eye(3)[k]))
        for a, b in PAIRS:
            yield f"with d{'xyz'[a]} and d{'xyz'[b]} changed over", replace(m, read=m.read[:, _swapped(3, a, b)])


def _other_directions(m: Measurements, start: ErrorModel,
                      kinematics: Kinematics) -> Iterable[tuple[str, Measurements]]:
    """Readings along x, y, z of the machine, turned to those of the table frame by how the slides move the tip."""
    if m.kind != "position":
        return
    actual = start.zero().on(kinematics)
    w = actual.coordinates(m.q)
    level = w.copy()
    level[:, 3:] = 0.0
    slides, straight = actual.rates(w)[:, :3, :3], actual.rates(level)[:, :3, :3]
    turn = slides @ np.linalg.inv(straight)
    if np.abs(turn - np.eye(3)).max() > TURNED:
        read = np.einsum("nij,nj->ni", turn, m.read)
        yield "with dx, dy, dz along the machine instead of the table", replace(m, read=read)


def rotary_slip(bench: Bench, readings: Floats, sigma: Floats, harmonics: int) -> str:
    """The slip of a table of all six readings (m, n, 6), "" where there is none."""
    span, weights = rotary_span(bench, readings, sigma, harmonics)
    others = [(f"with {part} turned round", readings * (1.0 - 2.0 * np.eye(6)[k])) for k, part in enumerate(PARTS)]
    others += [(f"with {PARTS[a + k]} and {PARTS[b + k]} changed over", readings[:, :, _swapped(6, a + k, b + k)])
               for k in (0, 3) for a, b in PAIRS]
    if (np.isfinite(readings) == np.isfinite(readings[::-1])).all():
        others.append(("with the set-ups in the other order", readings[::-1]))

    def left(values: Floats) -> float:
        """See `_left`; what is fitted is the same for all of them."""
        y = values[np.isfinite(readings)] / weights
        return float(np.linalg.norm(y - span @ (span.T @ y)) / np.sqrt(max(len(y) - span.shape[1], 1)))

    return _best(left(readings), ((words, left(other)) for words, other in others))


def reversal_slip(readings: Floats, sigma: float, given: ReversalModel) -> str:
    """The slip of a table of angular readings (m, n), "" where there is none."""
    m, n = readings.shape
    shifts = given.shifts or tuple(range(m))
    other = identify(readings, sigma, given.zeroed, shifts=[(-k) % n for k in shifts])
    words = f"with the indexer turned the other way, shifts = {[(-k) % n for k in shifts]}"
    return _best(_left(identify(readings, sigma, given.zeroed, shifts=shifts).result), [(words, _left(other.result))])


def _swapped(count: int, a: int, b: int) -> list[int]:
    order = list(range(count))
    order[a], order[b] = b, a
    return order


def _best(now: float, tried: Iterable[tuple[str, float]]) -> str:
    """The words that leave least, and those that leave as little, where that is far less than is left now."""
    left = sorted((size, words) for words, size in tried)
    if not left or BETTER * left[0][0] >= now:
        return ""
    words = " or ".join(words for size, words in left if size <= ALIKE * left[0][0])
    return f"{words} only {left[0][0]:.3g} times would be left"


def _left(result: CalibrationResult) -> float:
    """Root mean square of what is left by readings to spare, inf where there are none or the fit comes to no end."""
    spare = len(result.residuals) - result.rank
    return float(np.sqrt(result.cost_after / spare)) if spare > 0 and result.converged else np.inf
