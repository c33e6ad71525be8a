"""Axes of a machine that is one chain from the workpiece to the tool."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from toolpaths.arrays import Floats, frozen
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(direction="3", point="3")
class Joint:
    """One axis: letter, kind, unit direction (3,), for a rotary one a point (3,) of its line in mm; all at q = 0."""

    name: str
    rotary: bool
    direction: Floats
    point: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", unit_vector(self.direction, "direction"))
        object.__setattr__(self, "point", frozen(self.point, np.float64, (3,), "point"))


def unit_vector(v: Floats, name: str) -> Floats:
    """`v` (3,) with length 1, read-only; `name` for the error of a wrong shape."""
    vector = np.asarray(v, dtype=np.float64)
    return frozen(vector / np.linalg.norm(vector), np.float64, (3,), name)
