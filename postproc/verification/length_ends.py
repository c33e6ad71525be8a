"""The least lengths of tools found so far at which something of their program fails, and the search for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field

import numpy as np

from postproc.readback.comparison.length_margins import MUCH
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

SIGNS = -1.0, 1.0
"""shorter, longer"""
LEAST = 1e-6
"""mm or rad per mm: less is arithmetic"""
_ROUNDS, _CLOSE = 60, 1e-5
_FEW, _FARTHER = 16, 4.0

Room = Callable[[Ints, Floats], Floats]
"""What is left of a tolerance or a clearance at places (K,) with tools longer by mm (K,), no faster than they move."""


def _nearest(tool: Ints, sure: Floats) -> Ints:
    """The few places of every tool that are nearest to their tolerance."""
    order = np.lexsort((sure, tool))
    rank = np.arange(len(order)) - np.searchsorted(tool[order], tool[order])
    return np.asarray(order[rank < _FEW])


def _first_zero(room: Room, places: Ints, direction: float, ends: tuple[Floats, Floats], left: tuple[Floats, Floats],
                tool: Ints) -> Floats:
    """(K,) mm, between `ends` (K,) and close to where the room of places (K,) ends, that leave some; `left` (K,) at `ends`.

    False position (Illinois); places that are not the first of their tool are not followed to the end.
    """
    (low, high), (f_low, f_high) = (np.array(ends[0]), np.array(ends[1])), (np.array(left[0]), np.array(left[1]))
    side, first = np.zeros(len(low)), np.full(tool.max() + 1, np.inf)
    for _ in range(_ROUNDS):
        np.minimum.at(first, tool, high)
        k = np.flatnonzero((high - low > _CLOSE * high) & (low < first[tool]))
        if not len(k):
            break
        share = np.clip(f_low[k] / (f_low[k] - f_high[k]), 0.5 * _CLOSE, 0.9)
        x = np.minimum(low[k] + share * (high[k] - low[k]), _FARTHER * low[k] + _FARTHER * LEAST)
        x = np.where(x < high[k], x, 0.5 * (low[k] + high[k]))
        at = room(places[k], direction * x)
        inside = at > 0.0
        f_high[k[inside & (side[k] > 0.0)]] *= 0.5
        f_low[k[~inside & (side[k] < 0.0)]] *= 0.5
        low[k[inside]], f_low[k[inside]] = x[inside], at[inside]
        high[k[~inside]], f_high[k[~inside]] = x[~inside], at[~inside]
        side[k] = np.where(inside, 1.0, -1.0)
    return low


@dataclass
class Ends:
    """The least length found so far: mm (T, 2) by tool and sign, and what fails there."""

    numbers: Ints
    mm: Floats = field(init=False)
    what: list[list[str]] = field(init=False)

    def __post_init__(self) -> None:
        self.mm = np.full((len(self.numbers), 2), MUCH)
        self.what = [["", ""] for _ in self.numbers]

    def add(self, tool: Ints, sign: int, mm: Floats, what: str) -> None:
        """Lengths (N,) of tools (N,), as indices; the shorter ones stay."""
        least = np.full(len(self.numbers), np.inf)
        np.minimum.at(least, tool, mm)
        for t in np.flatnonzero(least < self.mm[:, sign]).tolist():
            self.mm[t, sign], self.what[t][sign] = max(least.item(t), 0.0), what

    def follow(self, tool: Ints, speed: Floats, room: Room, what: str) -> None:
        """Places (N,) with a speed (N,) mm or rad per mm, of a clearance: as far as is left, again and again."""
        goes = np.flatnonzero(speed > LEAST)
        if not len(goes):
            return
        speed, tool = speed[goes], tool[goes]
        sure = np.maximum(room(goes, np.zeros(len(goes))), 0.0) / speed
        for sign, direction in enumerate(SIGNS):
            for some in (_nearest(tool, sure), np.arange(len(goes))):
                x, most = np.array(sure), self.mm[tool, sign]
                k = some[(sure[some] > _CLOSE * (sure[some] + LEAST)) & (sure[some] < most[some])]
                for _ in range(_ROUNDS - 1):
                    if not len(k):
                        break
                    step = np.maximum(room(goes[k], direction * x[k]), 0.0) / speed[k]
                    x[k] += step
                    k = k[(step > _CLOSE * (x[k] + LEAST)) & (x[k] < most[k])]
                self.add(tool[some], sign, x[some], what)

    def leave(self, tool: Ints, speed: Floats, room: Room, what: str) -> None:
        """Places (N,) of a tolerance, as above: a tip on a line is never farther from its path than at the ends
        of the line, so a place that keeps the tolerance at a length keeps it at all lengths between."""
        goes = np.flatnonzero(speed > LEAST)
        if not len(goes):
            return
        speed, tool, left = speed[goes], tool[goes], np.maximum(room(goes, np.zeros(len(goes))), 0.0)
        sure = left / speed
        for sign, direction in enumerate(SIGNS):
            for k in (_nearest(tool, sure), np.arange(len(goes))):
                most = self.mm[tool[k], sign]
                k, most = k[sure[k] < most], most[sure[k] < most]
                beyond = room(goes[k], direction * most) if len(k) else most
                k, most, beyond = k[beyond < 0.0], most[beyond < 0.0], beyond[beyond < 0.0]
                if len(k):
                    mm = _first_zero(room, goes[k], direction, (sure[k], most), (left[k], beyond), tool[k])
                    self.add(tool[k], sign, mm, what)
