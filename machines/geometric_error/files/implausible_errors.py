"""Errors too large to be any: a wrong unit, most likely."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.curves import largest
from machines.geometric_error.tables.lattice import COLUMNS
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG

LARGE = {False: (1.0, 100.0), True: (0.5 * DEG, 10.0 * DEG)}
"""mm, and rad of angles: errors that are refused unless the file says that they are so, and that no machine has"""


@dataclass(frozen=True)
class TooLarge:
    """An error above what machines have; `path` where a model file gives it, the last its name.

    `large` of its methods: True where such errors are said to be so.
    """

    path: tuple[str, ...]
    size: float
    turn: bool

    def refused(self, large: bool) -> bool:
        """True for one that is no warning."""
        return not (large and self.size <= LARGE[self.turn][1])

    def message(self, large: bool) -> str:
        """The error, its size, and what is allowed."""
        most = f"; errors above {self._shown(LARGE[self.turn][large])} are refused" if self.refused(large) else ""
        return f"{self.path[-1]} is up to {self._shown(self.size)}{most}"

    def hint(self, large: bool, units: str, key: str) -> str:
        """What to do: where the units stand, and what says that the error is so."""
        if not self.refused(large):
            return f"{key} says that it is so"
        may = self.size <= LARGE[self.turn][1]
        return f"most likely a wrong unit: {units}" + (f"; {key} if it is so" if may else "")

    def _shown(self, size: float) -> str:
        return f"{size / DEG:.4g} degrees" if self.turn else f"{size:.4g} mm"


def _table(name: str) -> tuple[str, str]:
    """The table of a dimension."""
    first, second = name.split(".")[:2]
    return (first, second) if first in ("bars", "passive") else ("legs", first.rstrip("12"))


def too_large(model: ErrorModel) -> list[TooLarge]:
    """The errors of a model above 1 mm or 0.5 degrees."""
    found = [TooLarge(("components", str(c.name)), largest(c.curve), c.name.angular) for c in model.axes.components]
    found += [TooLarge(("location", name), abs(value), angular(name)) for name, value in model.axes.constants.items()]
    if model.rods is not None:
        found += [TooLarge((*_table(name), name), abs(value), angular(name, model.rods))
                  for name, value in zip(model.rods.names, model.rods.values.tolist(), strict=True)]
    if model.map is not None:
        found += [TooLarge(("map", "table", name), float(np.abs(model.map.table[..., k]).max()), k >= 3)
                  for k, name in enumerate(COLUMNS)]
    return [one for one in found if not one.size <= LARGE[one.turn][0]]
