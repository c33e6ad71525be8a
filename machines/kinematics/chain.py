"""Axes of a machine that is one chain from the workpiece to the tool."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Floats, read_only
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LINEAR, ROTARY = "XYZUVWPQRE", "ABC"
"""letters of axes by what they are (ISO 841)"""


@dataclass(frozen=True, eq=False)
@arrays(direction="3", point="3")
class Joint:
    """One axis: letter, kind, unit direction (3,), for a rotary one a point (3,) of its line in mm; all at q = 0."""

    name: str
    rotary: bool
    direction: Floats
    point: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", unit_vector(self.direction))

    @cached_property
    def along(self) -> list[float]:
        """`direction` as plain numbers."""
        return [float(x) for x in self.direction]

    @cached_property
    def place(self) -> list[float]:
        """`point` as plain numbers."""
        return [float(x) for x in self.point]


def unit_vector(v: npt.ArrayLike) -> Floats:
    """`v` (3,) with length 1, read-only."""
    vector = np.asarray(v, dtype=np.float64)
    return read_only(vector / np.linalg.norm(vector))
