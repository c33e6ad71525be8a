"""The volume that a parallel machine is declared to work in: a box of the platform's reference point, and its tilt."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(lower="3", upper="3")
class Workspace:
    """Box `lower`..`upper` (3,) mm of the platform's reference point in the machine frame, tilt (2,) rad."""

    lower: Floats
    upper: Floats
    tilt: tuple[float, float] = (0.0, 0.0)

    @property
    def middle(self) -> Floats:
        """(3,) mm"""
        result: Floats = 0.5 * (self.lower + self.upper)
        return result

    def margins(self, points: Floats) -> Floats:
        """Signed distance (N, 3) mm of points (N, 3) to the nearer face per coordinate; negative outside."""
        result: Floats = np.minimum(points - self.lower, self.upper - points)
        return result

    def grid(self, counts: tuple[int, int, int, int]) -> tuple[Floats, Floats]:
        """(points (M, 3), tilt (M,)) of an even grid that includes the faces; one tilt where the machine has none."""
        sides = [np.linspace(lo, hi, n) for lo, hi, n in zip(self.lower, self.upper, counts[:3], strict=True)]
        tilts = np.linspace(*self.tilt, counts[3]) if self.tilt[0] < self.tilt[1] else np.array(self.tilt[:1])
        mesh = np.meshgrid(*sides, tilts, indexing="ij")
        return np.stack([m.ravel() for m in mesh[:3]], axis=1), mesh[3].ravel()

    def random(self, rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
        """(points (n, 3), tilt (n,)), evenly spread."""
        return rng.uniform(self.lower, self.upper, (n, 3)), rng.uniform(*self.tilt, n)
