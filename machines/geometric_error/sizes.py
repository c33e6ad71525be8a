"""Errors too large to be any: a wrong unit, most likely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from machines.geometric_error.covariance import angular
from machines.geometric_error.curves import largest
from machines.geometric_error.lattice import COLUMNS
from machines.geometric_error.model import ErrorModel
from toolpaths.units import DEG

LARGE = {False: (1.0, 100.0), True: (0.5 * DEG, 10.0 * DEG)}
"""mm, and rad of angles: errors that are told, and that no machine has"""


@dataclass(frozen=True)
class TooLarge:
    """An error that is doubtful, or one that `never` is any; `path` where a model file gives it, the last its name."""

    path: tuple[str, ...]
    size: float
    turn: bool

    @property
    def never(self) -> bool:
        """True for one that no machine has."""
        return not self.size <= LARGE[self.turn][1]

    @property
    def message(self) -> str:
        """The error and its size."""
        shown = f"{self.size / DEG:.4g} degrees" if self.turn else f"{self.size:.4g} mm"
        return f"{self.path[-1]} is up to {shown}: is the unit right?"


def too_large(model: ErrorModel) -> list[TooLarge]:
    """The errors of a model that are doubtful."""
    found = [TooLarge(("components", str(c.name)), largest(c.curve), c.name.angular) for c in model.axes.components]
    found += [TooLarge(("location", name), abs(value), angular(name)) for name, value in model.axes.constants.items()]
    if model.rods is not None:
        found += [TooLarge(("legs", name.split(".")[0].rstrip("12"), name), abs(value), angular(name))
                  for name, value in zip(model.rods.names, model.rods.values.tolist(), strict=True)]
    if model.map is not None:
        found += [TooLarge(("map", "table", name), float(np.abs(model.map.table[..., k]).max()), k >= 3)
                  for k, name in enumerate(COLUMNS)]
    return [one for one in found if not one.size <= LARGE[one.turn][0]]
