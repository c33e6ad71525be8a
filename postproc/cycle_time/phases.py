"""Time of each block by what holds it: the common answer of all models."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Array, Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(up="N", steady="N", down="N", peak="N")
class Ramps:
    """A motion along N lengths under constant accelerations, s and mm or rad.

    Attributes:
        up, steady, down (N,): s of gaining speed, of constant speed, of losing it
        peak (N,): largest speed
    """

    up: Floats
    steady: Floats
    down: Floats
    peak: Floats

    @property
    def seconds(self) -> Floats:
        return np.asarray(self.up + self.steady + self.down)


def ramps(length: Floats, first: Floats, last: Floats, target: Floats, rate: Floats,
          gentle: Bools | None = None) -> Ramps:
    """The trapezoid of each length (N,) from speed `first` to `last` with at most `target` between, accelerations `rate`.

    v_peak^2 = (2 a L + v0^2 + v1^2)/2 where the target is not reached. `gentle`: one constant acceleration
    for the whole length instead. Ends that the rate cannot join take it anyway.
    """
    peak = np.sqrt(np.maximum((2.0 * rate * length + first**2 + last**2) / 2.0, 0.0))
    peak = np.maximum(np.minimum(peak, target), np.maximum(first, last))
    up, down = (peak - first) / rate, (peak - last) / rate
    travel = (peak**2 - first**2 + peak**2 - last**2) / (2.0 * rate)
    steady = np.maximum(length - travel, 0.0) / np.where(peak > 0.0, peak, 1.0)
    if gentle is not None and gentle.any():
        with np.errstate(over="ignore"):
            whole = 2.0 * length / np.maximum(first + last, 1e-300)
        up = np.where(gentle, np.where(last > first, whole, 0.0), up)
        down = np.where(gentle, np.where(last < first, whole, 0.0), down)
        steady = np.where(gentle, np.where(last == first, whole, 0.0), steady)
        peak = np.where(gentle, np.maximum(first, last), peak)
    return Ramps(up, steady, down, peak)


@dataclass(frozen=True)
@arrays(begin="E", end="E", ramp="E", steady="E", jerk="E", peak="E", lost_stop="E",
        lost_corner="E", pause="P")
class BlockTimes:
    """What a model says of E blocks.

    Attributes:
        begin, end (E,): s since the start of the program at which the control takes up and leaves each block
        ramp, steady, jerk (E,): s of gaining or losing speed, of constant speed, of building up acceleration;
            their sum is at most end - begin
        peak (E,): largest speed, mm/s or rad/s
        lost_stop, lost_corner (E,): s that ramps to and from stops and corners cost over going on at the peak
        pause (P,): s that each pause takes
        found: what the model has to say of these times
    """

    begin: Floats
    end: Floats
    ramp: Floats
    steady: Floats
    jerk: Floats
    peak: Floats
    lost_stop: Floats
    lost_corner: Floats
    pause: Floats
    found: tuple[Diagnostic, ...] = ()

    @property
    def seconds(self) -> Floats:
        """(E,) of each block."""
        return np.asarray(self.end - self.begin)


def summed(values: Floats, index: Array, count: int) -> Floats:
    """(count,) sums of values by index."""
    return np.bincount(index, weights=values, minlength=count).astype(np.float64)
