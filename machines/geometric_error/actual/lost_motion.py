"""Lost motion: from which direction an axis is where it is, while it takes up what it loses by turning back.

The approach direction is a number per axis: +1 reached forwards, -1 backwards, between by shares. An axis that turns back
    first moves
through the play g between its two approach directions: a step d changes the approach direction by 2 d / g,
held between -1 and 1 (the play operator; Brokate, Sprekels, Hysteresis and Phase Transitions, 1996, 2.1).
Steps one after the other compose to one function of the approach direction before them, again a shift held
between two bounds, so that whole programs are walked in a few passes.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, within
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

GRAIN = 5e-5, 1e-6
"""mm and rad, half of a last decimal: motion below it turns nothing, and play below it counts as that much"""


@dataclass(frozen=True)
@arrays(shift="...", low="...", high="...")
class PlaySteps:
    """Functions of the approach direction: clip(approach direction + shift, low, high); arrays of one shape."""

    shift: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, step: Floats, gap: Floats) -> PlaySteps:
        """Of steps mm or rad against plays (same shape, above 0)."""
        return cls(2.0 * step / gap, np.full(step.shape, -1.0), np.full(step.shape, 1.0))

    def then(self, after: PlaySteps) -> PlaySteps:
        """These, then those."""
        low, high = (within(bound + after.shift, after.low, after.high) for bound in (self.low, self.high))
        return PlaySteps(self.shift + after.shift, low, high)

    def at(self, approach: Floats) -> Floats:
        """The approach direction after them."""
        return within(approach + self.shift, self.low, self.high)

    def rows(self, part: slice) -> PlaySteps:
        """Some of the rows."""
        return PlaySteps(self.shift[part], self.low[part], self.high[part])

    def walked(self) -> PlaySteps:
        """Row k: all from the first to k, one after the other (prefix composition in log2 passes; Hillis, Steele, 1986)."""
        done, n, reach = self, len(self.shift), 1
        while reach < n:
            later = done.rows(slice(None, -reach)).then(done.rows(slice(reach, None)))
            done = PlaySteps(*(np.concatenate([head[:reach], tail]) for head, tail in (
                (done.shift, later.shift), (done.low, later.low), (done.high, later.high))))
            reach *= 2
        return done


def turning_sign(step: Floats, rotary: Bools) -> Floats:
    """Sign (N, J) of the last motion of joints that go by steps (N, J) one after the other: what goes back by
    less than the grain of words, in one step or in many, turns nothing; 0 before a joint has moved by that much."""
    least = np.broadcast_to(np.where(rotary, GRAIN[1], GRAIN[0]), step.shape)
    approach = PlaySteps.of(step, least).walked().at(np.zeros((1, step.shape[1])))
    return carried_on(np.where(np.abs(approach) == 1.0, approach, 0.0))


def carried_on(approach: Floats) -> Floats:
    """Signs (N, J) with every 0 replaced by the last sign before it."""
    last = np.where(approach != 0.0, np.arange(len(approach))[:, None], 0)
    np.maximum.accumulate(last, axis=0, out=last)
    result: Floats = np.take_along_axis(approach, last, axis=0)
    return result
