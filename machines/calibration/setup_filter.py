"""What the mounting of the instrument can pretend, and what taking it out of the readings takes of the true signal.

The mounting's columns of one reading (C 1.35) are as good as never independent (C 1.32 cannot be inverted): they are
grouped by rank, and only their span is taken out, as an orthogonal projection. What the projection removes of a signal that
the axis itself could have is told per harmonic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from machines.calibration.problem import CalibrationResult, linear, solve
from machines.calibration.simulator import MOUNTS, PARTS, Bench, mount_jacobian
from toolpaths.arrays import Floats
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(span="n r", removed="n//2+1")
class SetupFilter:
    """Of one kind of reading.

    Attributes:
        reading: index into dx dy dz ex ey ez
        result: fit of the 18 mounting errors: rank, groups that cannot be told apart
        span: (n, rank) orthonormal columns that are taken out
        removed: (n // 2 + 1,) share of the root mean square that is lost of a signal of harmonic 0, 1, 2, ...
            of the axis's own error of the same name
    """

    reading: int
    result: CalibrationResult
    span: Floats
    removed: Floats

    def __call__(self, readings: Floats) -> Floats:
        """Readings (m, n) without what the mounting can explain, C 1.34."""
        result: Floats = readings - (readings @ self.span) @ self.span.T
        return result


def setup_filter(bench: Bench, reading: str, observed: Floats | None = None, sigma: float = 1.0) -> SetupFilter:
    """The filter of a reading, "ez" for instance; `observed` (n,) only serves `result.values`.

    Raises:
        ValueError: where there is no such reading.
    """
    if reading not in PARTS:
        raise ValueError(f"no reading {reading!r}; known: {', '.join(PARTS)}")
    row, n = PARTS.index(reading), bench.steps
    columns = mount_jacobian(bench)[:, row]
    names = [f"{mount}.{part}" for mount in MOUNTS for part in PARTS]
    result = solve(linear(names, columns, np.zeros(n) if observed is None else observed, np.full(n, sigma)))
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 1e-12 * max(size.max(), 1e-300), size, np.inf)
    u, values, _ = np.linalg.svd(scaled, full_matrices=False)
    span = u[:, : int(np.sum(values > 1e-9 * values[0]))]
    return SetupFilter(row, result, span, np.array([_lost(span, bench, h) for h in range(n // 2 + 1)]))


def _lost(span: Floats, bench: Bench, harmonic: int) -> float:
    """Largest share, over the phase, that the projection takes of cos(h angle + phase)."""
    waves = np.stack([np.cos(harmonic * bench.angles), np.sin(harmonic * bench.angles)], axis=1)
    kept = [w for w in waves.T if np.linalg.norm(w) > 1e-9]
    basis = np.stack([w / np.linalg.norm(w) for w in kept], axis=1)
    return float(np.linalg.svd(span.T @ basis, compute_uv=False)[0]) if span.shape[1] else 0.0
