"""Faults that readings show by themselves: another unit, a sign, columns or points changed over, a point off the rest."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from machines.calibration.noise import CHANCE
from postproc.alignment.fit import Alignment, aligned
from postproc.alignment.readings import MEASURED, Readings
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, info, warning
from toolpaths.rotations import lengths
from toolpaths.units import DEG, MM_PER_INCH

LARGE_MM, LARGE_DEG = 5.0, 3.0
"""shift and turn that a part in its fixture is hardly ever off by"""
BETTER = 10.0
"""times less must be left of a misfit where a fault is put right"""
MOST = 40
"""readings among which two that are changed over are looked for"""
SCALES = {f"numbers that are {ratio:g} times larger (another unit)": ratio
          for ratio in (MM_PER_INCH, 10.0, 1e3)} | {
    f"numbers that are {1.0 / ratio:g} times smaller (another unit)": ratio for ratio in (1.0 / MM_PER_INCH, 0.1, 1e-3)}


@dataclass(frozen=True)
class Explanation:
    """A fault that explains the readings: what it is, and what is left of the misfit where it is put right."""

    what: str
    left: float


def implausible(found: Alignment, large: bool) -> list[Diagnostic]:
    """What speaks against the place that was found; errors but for what `large` accepts."""
    readings, noise = found.readings, found.noise
    if not found.determined.any():
        return [error("align.undetermined", "the readings determine no place", file=readings.file,
                      lines=[*readings.lines[:6]], hint="touch three points of a plane, two of an edge and one of another "
                      "edge, or three points whole")]
    if not found.converged or (noise is not None and noise.more <= CHANCE):
        return [_misfit(found)]
    shift, turn = size_of(found)
    if (shift > LARGE_MM or turn > LARGE_DEG) and not large:
        said = f"the part would stand {shift:.3f} mm and {turn:.4f} degrees from where it was meant"
        explained = _explanations(readings, found)
        return [error("align.large", f"{said}, allowed without --large are {LARGE_MM:g} mm and {LARGE_DEG:g} degrees",
                      file=readings.file, lines=[found.worst[1]] if noise else [],
                      hint=_hint(explained, "look at work offset, units and order of the readings; --large takes it"))]
    result = []
    if noise is None:
        count = int(found.determined.sum())
        result.append(info("align.no_spare", f"{len(readings)} readings for {count} unknowns: none is to spare, so that a "
                           "wrong one cannot be seen", file=readings.file, hint="touch one or two points more"))
    elif not noise.meets:
        result.append(warning("align.noise", f"the readings fit {1.0 / max(noise.left, 1e-9):.3g} times better than their "
                              "stated noise", file=readings.file, hint="state the noise that they have (--sigma-um)"))
    return result


def size_of(found: Alignment) -> tuple[float, float]:
    """(mm that the middle of the readings is off, degrees that the part is turned)."""
    values = found.values
    return float(np.linalg.norm(values[:3])), float(np.linalg.norm(values[3:])) / DEG


def _misfit(found: Alignment) -> Diagnostic:
    readings, (off, line) = found.readings, found.worst
    apart = _worst_pair(readings)
    said = f"; {apart}" if apart else ""
    return error("align.misfit", f"the readings do not fit the part: the one of line {line} is {off:.4f} mm off the place "
                 f"that fits best, stated noise is {1e3 * float(readings.sigma.max()):.3g} um{said}", file=readings.file,
                 lines=[line], hint=_hint(_explanations(readings, found), "measure again, or state the noise that they have "
                                          "(--sigma-um)"))


def _hint(explained: list[Explanation], otherwise: str) -> str:
    if not explained:
        return otherwise
    return "they fit with " + ", or with ".join(one.what for one in explained[:3])


def _worst_pair(readings: Readings) -> str:
    """Two whole points whose distance is not that of the drawing."""
    whole = np.flatnonzero(readings.whole)
    worst, text = 3.0 * float(readings.sigma.max()), ""
    for i, j in combinations(whole.tolist(), 2):
        nominal, measured = (float(np.linalg.norm(p[i] - p[j])) for p in (readings.nominal, readings.measured))
        if abs(measured - nominal) > worst:
            worst = abs(measured - nominal)
            text = (f"points of lines {readings.lines[i]} and {readings.lines[j]} are {measured:.4f} mm apart, "
                    f"nominal {nominal:.4f} mm")
    return text


def _explanations(readings: Readings, found: Alignment) -> list[Explanation]:
    """Faults that explain the readings, the best first."""
    noise = found.noise
    before = noise.left if noise is not None and found.converged else np.inf
    result = []
    for what, other in _changes(readings):
        tried = aligned(other)
        shift, turn = size_of(tried)
        left = tried.noise
        if not tried.converged or shift > LARGE_MM or turn > LARGE_DEG:
            continue
        if left is None:
            result.append(Explanation(what, 1.0) if noise is None else Explanation(what, 2.0))
        elif left.more > CHANCE or left.left * BETTER < before:
            result.append(Explanation(what, left.left))
    return sorted(result, key=lambda one: one.left)


def _changes(readings: Readings) -> Iterator[tuple[str, Readings]]:
    """(what is put right, the readings so)."""
    measured, shown = readings.measured, readings.measured - readings.zero
    for what, scale in SCALES.items():
        yield what, readings.with_measured(readings.zero + shown * scale)
    for j, name in enumerate(MEASURED):
        other = np.array(shown)
        other[:, j] *= -1.0
        yield f"the sign of {name} changed", readings.with_measured(readings.zero + other)
    for i, j in ((0, 1), (1, 2), (0, 2)):
        other = np.array(shown)
        other[:, [i, j]] = other[:, [j, i]]
        yield f"the columns {MEASURED[i]} and {MEASURED[j]} changed over", readings.with_measured(readings.zero + other)
    if len(readings) <= MOST:
        for i, j in combinations(range(len(readings)), 2):
            other = np.array(measured)
            other[[i, j]] = other[[j, i]]
            yield f"the readings of lines {readings.lines[i]} and {readings.lines[j]} changed over", \
                readings.with_measured(other)
    for k in range(len(readings)) if len(readings) > 3 else ():
        yield f"that of line {readings.lines[k]} left out", readings.without(k)


def twice(readings: Readings) -> list[Diagnostic]:
    """Readings of one nominal point that were found at different places, and copies."""
    result = []
    for i, j in combinations(range(len(readings)), 2):
        same = bool((np.abs(readings.normal[i] - readings.normal[j]) < 1e-9).all())
        if same and float(lengths(readings.nominal[[i]] - readings.nominal[[j]])[0]) == 0.0 and bool(
                (readings.measured[i] == readings.measured[j]).all()):
            result.append(error("align.twice", f"lines {readings.lines[i]} and {readings.lines[j]} are the same reading",
                                file=readings.file, lines=[readings.lines[i], readings.lines[j]],
                                hint="each row is a measurement of its own: take the copy out"))
    return result[:6]
