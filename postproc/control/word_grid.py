"""The grid that the axis words of a program lie on: their decimals, in the units that the program states lengths in."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from postproc.control.control import Control
from postproc.controllers.model import ControllerFile
from toolpaths.arrays import Floats, Ints, slices
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(places="J", unit="J")
class WordGrid:
    """Decimals (J,) of the axis words, and the mm or degrees (J,) that 1 stands for: 25.4 for inches."""

    places: Ints
    unit: Floats

    @cached_property
    def grain(self) -> Floats:
        """(J,) mm or degrees of a last decimal."""
        return np.asarray(self.unit * 10.0 ** -self.places.astype(np.float64))

    @cached_property
    def most(self) -> int:
        """The most decimals of all words."""
        return int(self.places.max())

    def rounded(self, words: Floats) -> Floats:
        """Words (K, J), mm and degrees, on the grid."""
        grain, result = 10.0 ** -self.places, np.empty(words.shape)
        for rows in slices(len(words)):
            result[rows] = np.round(np.round(words[rows] / self.unit / grain) * grain, self.most) * self.unit
        return result

    def trimmed(self, words: Floats) -> Floats:
        """Words (K, J), mm and degrees, with the most decimals of all: positions of home."""
        return np.asarray(np.round(words / self.unit, self.most) * self.unit)


def word_grid(control: Control, controller: ControllerFile) -> WordGrid:
    """The grid of the axis words of a machine."""
    style, rotary = controller.format, np.array(control.machine.rotary)
    return WordGrid(np.where(rotary, style.rotary_decimals, style.linear_decimals).astype(np.int64),
                    np.where(rotary, 1.0, controller.unit))
