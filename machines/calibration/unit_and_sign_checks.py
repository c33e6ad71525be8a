"""Faults of a measurement table that the readings themselves show: a wrong unit or sign, two columns changed over.

Where a fit does not leave the noise that is stated, the same fit is made with each fault put right; one that
brings what is left to the stated noise, or far nearer to it, is named. What all readings share (one sign, a
turn of the zero) cannot be
seen: the errors found only have it too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from machines.calibration.machine_fit import Measurements, problem_of
from machines.calibration.measurement_file import ReversalModel
from machines.calibration.noise import Noise, noise_of
from machines.calibration.problem import CalibrationProblem, solve
from machines.calibration.remedies import Remedy, TableChange, TableFault, TriedRemedy
from machines.calibration.reversal import identify, reversal_span
from machines.calibration.rotary_bench import PARTS, Bench
from machines.calibration.rotary_fit import rotary_span
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.tables.csv_table import LENGTHS, other_units
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats

BETTER = 3.0
"""times less is left, for a fault that does not come to the stated noise to be named"""
LOUD = 2.0
"""times the stated noise, from which on such a one is looked for"""
ALIKE = 1.1
"""times what the best of them leaves: faults that cannot be distinguished from it"""
SHOWN = 3
"""faults that are named"""
TURNED = 1e-6
"""of a direction: a table frame that never turns"""
REFITTED = 5
"""faults of the axes' columns, those that leave least at the first order, that are fitted in full"""
EDGE = 1e-6
"""mm or rad beyond a travel that are numbers' own"""
ROWS = 400
"""of a table that faults are looked for in"""
PAIRS = ((0, 1), (1, 2), (0, 2))
TENFOLD: dict[TableChange, float] = {"tenfold": 10.0, "tenth": 0.1}


def machine_table_fault(start: ErrorModel, kinematics: Kinematics, measured: Measurements, wanted: Sequence[str],
                        travel: tuple[Floats, Floats], units: Sequence[str], joints: Sequence[str],
                        columns: Sequence[str]) -> TableFault | None:
    """The fault of a table of poses, bar or laser, None where there is none.

    Args:
        travel: lower and upper ends (J,) of the axes, mm and rad
        units, joints: units of the columns of readings, of the axes' columns
        columns: names of the columns of readings
    """
    some = np.unique(np.linspace(0, len(measured.q) - 1, ROWS).astype(np.int64))
    part = replace(measured, q=measured.q[some], read=measured.read[some],
                   approaches=None if measured.approaches is None else measured.approaches[some])

    def left(other: Measurements) -> Noise | None:
        result = solve(problem_of(start, kinematics, other, wanted))
        return result.noise if result.converged else None

    def tried() -> Iterable[TriedRemedy]:
        others = [*_positions(part, kinematics, travel, joints), *_other_directions(part, start, kinematics)]
        roughly = [(size, k) for k, (_, other) in enumerate(others)
                   if (size := _roughly(problem_of(start, kinematics, other, wanted))) is not None]
        for _, k in sorted(roughly)[:REFITTED]:
            yield TriedRemedy(others[k][0], left(others[k][1]))
        if part.kind != "distance":
            yield from _readings(problem_of(start, kinematics, part, wanted), part.read, columns, units)

    return _best(left(part), tried)


def _roughly(problem: CalibrationProblem) -> float | None:
    """Logarithm of what a fit leaves, in either direction, taken at the first order; None where it leaves nothing."""
    span = _span(problem.jacobian(problem.guess)[:, problem.free] / problem.sigma[:, None])
    y = (problem.observed - problem.predict(problem.guess)) / problem.sigma
    noise = noise_of(y - span @ (span.T @ y), span.shape[1])
    return None if noise is None or not noise.left > 0.0 else abs(float(np.log(noise.left)))


def _positions(m: Measurements, kinematics: Kinematics, travel: tuple[Floats, Floats],
               units: Sequence[str]) -> Iterable[tuple[Remedy, Measurements]]:
    """Faults of the columns of the axes, and the measurements without them; all inside travel."""
    names, one = kinematics.axis_names, np.eye(len(kinematics.axis_names))
    rotary = np.array(kinematics.rotary)
    moved = np.ptp(m.q, axis=0) + np.abs(m.q).max(axis=0) > 0.0
    found = [(Remedy("sign", names[j]), m.q * (1.0 - 2.0 * one[j])) for j in np.flatnonzero(moved)]
    for a in range(len(names)):
        for b in range(a + 1, len(names)):
            if rotary[a] == rotary[b] and (m.q[:, a] != m.q[:, b]).any():
                found.append((Remedy("columns", f"{names[a]} and {names[b]}"), m.q[:, _swapped(len(names), a, b)]))
    groups = [[int(j)] for j in np.flatnonzero(moved)]
    groups += [np.flatnonzero(moved & (rotary == turns)).tolist() for turns in (False, True)]
    for group in [g for g in groups if g and (len(g) == 1 or len({units[j] for j in g}) == 1)]:
        who = ", ".join(f"{names[j]}" for j in group)
        found += [(remedy, m.q * (1.0 + (size - 1.0) * one[group].sum(axis=0)))
                  for remedy, size in _sizes(who, units[group[0]])]
    for remedy, q in found:
        inside = (q >= travel[0] - EDGE).all() and (q <= travel[1] + EDGE).all()
        if inside and np.isfinite(kinematics.forward(q)[0]).all():
            yield remedy, replace(m, q=q)
    if m.approaches is not None and m.approaches.any():
        yield Remedy("sign", "the approach directions"), replace(m, approaches=-m.approaches)
    if m.kind == "along" and m.toward is not None:
        for k, x in enumerate("xyz"):
            if abs(m.toward[k]) < 1.0 - TURNED:
                yield Remedy("toward", to=x), replace(m, toward=one[k, :3])


def _other_directions(m: Measurements, start: ErrorModel,
                      kinematics: Kinematics) -> Iterable[tuple[Remedy, Measurements]]:
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
        yield Remedy("frame"), replace(m, read=read)


def _readings(problem: CalibrationProblem, read: Floats, columns: Sequence[str],
              units: Sequence[str]) -> Iterable[TriedRemedy]:
    """Faults of the readings (N,) or (N, C); what a fit leaves of them is taken at the first order, errors being small."""
    table = read.reshape(len(read), -1)
    rates = problem.jacobian(problem.guess)[:, problem.free] / problem.sigma[:, None]
    span = _span(rates)
    without = problem.predict(problem.guess)
    for remedy, other, size in _changed(table, columns, units):
        y = (other.ravel() - without) / problem.sigma
        yield TriedRemedy(remedy, noise_of(y - span @ (span.T @ y), span.shape[1]), size)


def _changed(table: Floats, columns: Sequence[str],
             units: Sequence[str]) -> Iterable[tuple[Remedy, Floats, bool]]:
    """Readings (..., C) with each fault put right; True where they have another size."""
    count = len(columns)
    kinds = [k for k in ({0, 1, 2}, {3, 4, 5}) if max(k) < count] if count > 1 else []
    groups = [list(range(count))] if len({u in LENGTHS for u in units}) == 1 else []
    groups += [sorted(k) for k in kinds if len(k) < count or not groups]
    groups += [[j] for j in range(count)] if count > 1 else []
    if len({u in LENGTHS for u in units}) == 1:
        yield Remedy("sign", "all readings"), -table, False
    for group in groups:
        factor = np.isin(np.arange(count), group)
        if len({units[j] for j in group}) == 1:
            who = ", ".join(columns[j] for j in group)
            for remedy, size in _sizes(who, units[group[0]]):
                yield remedy, np.where(factor, size, 1.0) * table, True
        if len(group) == 1:
            yield Remedy("sign", columns[group[0]]), np.where(factor, -1.0, 1.0) * table, False
    for kind in kinds:
        for a, b in PAIRS:
            i, j = sorted(kind)[a], sorted(kind)[b]
            yield Remedy("columns", f"{columns[i]} and {columns[j]}"), table[..., _swapped(count, i, j)], False


def _sizes(what: str, unit: str) -> list[tuple[Remedy, float]]:
    """Other units that numbers under `unit` may be in, and what they are larger by."""
    return [*((Remedy("unit", what, other), size) for other, size in other_units(unit).items()),
            *((Remedy(change, what), size) for change, size in TENFOLD.items())]


def rotary_table_fault(bench: Bench, readings: Floats, sigma: Floats, harmonics: int,
                       units: Sequence[str]) -> TableFault | None:
    """The fault of a table of all six readings (m, n, 6), None where there is none."""
    span, weights = rotary_span(bench, readings, sigma, harmonics)

    def left(values: Floats) -> Noise | None:
        """What is fitted is the same for all of them."""
        y = values[np.isfinite(readings)] / weights
        return noise_of(y - span @ (span.T @ y), span.shape[1])

    def tried() -> Iterable[TriedRemedy]:
        for remedy, other, size in _changed(readings, PARTS, units):
            yield TriedRemedy(remedy, left(other), size)
        for change, factor in TENFOLD.items():
            yield TriedRemedy(Remedy(change, "all readings"), left(factor * readings), True)
        for remedy, other in _rearranged(readings):
            yield TriedRemedy(remedy, left(other))

    return _best(left(readings), tried)


def _rearranged(readings: Floats) -> Iterable[tuple[Remedy, Floats]]:
    """Set-ups and steps of readings (m, n, ...) counted otherwise, where the same ones are there."""
    back = np.roll(readings[:, ::-1], 1, axis=1)
    others = [(Remedy("order"), readings[::-1]), (Remedy("steps"), back)]
    others += [(Remedy("sign", f"set-up {k}"), np.where(
        (np.arange(len(readings)) == k).reshape(-1, *[1] * (readings.ndim - 1)), -readings, readings))
        for k in range(len(readings))] if len(readings) > 1 else []
    if readings.shape[0] == readings.shape[1]:
        others.append((Remedy("columns", "the columns setup and step"), np.swapaxes(readings, 0, 1)))
    return ((remedy, other) for remedy, other in others if (np.isfinite(other) == np.isfinite(readings)).all())


def reversal_table_fault(readings: Floats, sigma: float, given: ReversalModel,
                         unit: str) -> TableFault | None:
    """The fault of a table of angular readings (m, n), None where there is none."""
    m, n = readings.shape
    shifts = given.shifts or tuple(range(m))
    known = np.isfinite(readings)
    span = reversal_span(readings, given.zeroed, shifts)

    def left(values: Floats) -> Noise | None:
        y = values[known] / sigma
        return noise_of(y - span @ (span.T @ y), span.shape[1])

    def tried() -> Iterable[TriedRemedy]:
        other = [(-k) % n for k in shifts]
        yield TriedRemedy(Remedy("indexer", to=str(other)),
                          identify(readings, sigma, given.zeroed, shifts=other).result.noise)
        for remedy, size in _sizes("reading", unit):
            yield TriedRemedy(remedy, left(size * readings), True)
        for remedy, rearranged in _rearranged(readings):
            if remedy.change != "steps":
                yield TriedRemedy(remedy, left(rearranged))

    return _best(left(readings), tried)


def _span(rows: Floats) -> Floats:
    """Orthonormal columns (R, rank) of what rows (R, P) can explain, columns scaled to one length."""
    length = np.linalg.norm(rows, axis=0)
    u, s, _ = np.linalg.svd(rows / np.where(length > 0.0, length, 1.0), full_matrices=False)
    return np.asarray(u[:, s > 1e-9 * s.max(initial=0.0)])


def _swapped(count: int, a: int, b: int) -> list[int]:
    order = list(range(count))
    order[a], order[b] = b, a
    return order


def _best(now: Noise | None, tried: Callable[[], Iterable[TriedRemedy]]) -> TableFault | None:
    """The faults that come to the stated noise where `now` does not; without any those that leave least,
    where that is far less than is left now."""
    if now is None or now.meets:
        return None
    known = [(one, one.noise) for one in tried() if one.noise is not None and one.noise.left > 0.0]
    if now.left < 1.0:  # what is put in disorder leaves more, not less
        known = [(one, noise) for one, noise in known if one.size]
    good = [(abs(np.log(noise.left)), one) for one, noise in known if noise.meets and _nearer(noise, now)]
    if not good and now.left > LOUD:
        good = [(float(np.log(noise.left)), one) for one, noise in known
                if BETTER * noise.left < now.left and noise.left > 1.0 and not one.size]
    if not good:
        return None
    best = min(size for size, _ in good)
    alike = [one for size, one in sorted(good, key=lambda pair: pair[0]) if size <= best + np.log(ALIKE)]
    if not all(one.size for one in alike):
        alike = [one for one in alike if not one.size]
    left = next(noise.left for one, noise in known if one is alike[0])
    return TableFault(tuple(one.remedy for one in alike[:SHOWN]), left, now.left > 1.0, all(one.size for one in alike))


def _nearer(noise: Noise, now: Noise) -> bool:
    """True where what is left is nearer to the stated noise by half, which no chance makes it."""
    return now.left == 0.0 or bool(abs(np.log(noise.left)) < 0.5 * abs(np.log(now.left)))
