"""Where X, Y and Z stand in the coordinates of a program, block by block, for blocks that are worked out from it."""

from __future__ import annotations

import numpy as np

from postproc.readback.text.words import Words
from toolpaths.arrays import Floats, Ints


class AxisPositions:
    """Positions of X, Y, Z by the words of a program, and by what its statements work out in running order."""

    def __init__(self, words: Words) -> None:
        self.stated: dict[str, tuple[Ints, Floats]] = {a: words.pick(a) for a in "XYZ"}
        self.steps: dict[str, tuple[Ints, Floats]] = {}
        for a in "XYZ":
            lines, values = words.pick(a.lower())
            self.steps[a] = lines, np.concatenate([[0.0], np.cumsum(values)])
        self.own: dict[str, tuple[int, float | None]] = dict.fromkeys("XYZ", (0, None))
        """last block that a statement ended, and where; None: not known"""

    def put(self, block: int, letter: str, value: float) -> None:
        """A statement ends at a value."""
        if letter in self.own:
            self.own[letter] = block, value

    def lost(self, block: int, letters: str) -> None:
        """From this block on the position is not known until it is stated."""
        for letter in letters:
            self.own[letter] = block, None

    def at(self, block: int, letter: str) -> float | None:
        """The position before a block; None where it is not known."""
        if letter not in self.own:
            return None
        lines, values = self.stated[letter]
        k = int(np.searchsorted(lines, block)) - 1
        since, value = self.own[letter]
        if k >= 0 and int(lines[k]) >= since and (value is None or int(lines[k]) > since):
            since, value = int(lines[k]), float(values[k])
        if value is None:
            return None
        at, total = self.steps[letter]
        first, last = np.searchsorted(at, [since + 1, block])
        return value + float(total[last] - total[first])
