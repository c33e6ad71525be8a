"""What a fit leaves of its readings against what is stated of their noise: chi-square, and the scale of the covariance.

Sums of squared weighted residuals of readings at their stated noise follow a chi-square of as many degrees of
freedom as there are readings to spare; both tails are looked at (JCGM 100, annexes G and H; Birge 1932 for
the scale). Robust fits are judged by the median of the residuals, which outliers do not move, with the
degrees of freedom that it is worth.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import gammainc, gammaincc, stdtrit

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

CHANCE = 1e-3
"""of a fit at the stated noise to be called one that misses it, on either side"""
MEDIAN = 0.6744897501960817
"""of the size of a normal deviate, over its standard deviation"""
WORTH = 0.368
"""degrees of freedom of that median against those of the sum of squares"""
HUBER_LOSS, MEDIAN_LOSS = 1.0526, 0.5 * np.pi
"""variance of robust fits of normal residuals over that of least squares"""
NORMAL = 1.959963984540054
"""standard deviations of the 95 % bounds of a normal deviate"""


@dataclass(frozen=True)
class Noise:
    """What is left of the readings.

    Attributes:
        left: root of what is left over the stated noise, by degrees of freedom: 1 is right
        freedom: degrees of freedom, above 0
        robust: True where the fit counts residuals beyond the stated noise linearly
    """

    left: float
    freedom: float
    robust: bool = False

    @property
    def more(self) -> float:
        """Chance that readings at the stated noise leave as much, or more."""
        return float(gammaincc(0.5 * self.freedom, 0.5 * self.freedom * self.left**2))

    @property
    def less(self) -> float:
        """Chance that they leave as little, or less."""
        return float(gammainc(0.5 * self.freedom, 0.5 * self.freedom * self.left**2))

    @property
    def meets(self) -> bool:
        """True where neither is a rare chance."""
        return min(self.more, self.less) > CHANCE

    def scaled(self, factor: float) -> Noise:
        """Where so many times as much is left."""
        return replace(self, left=factor * self.left)

    @property
    def scale(self) -> float:
        """Factor on a covariance made from the stated noise: 1 where no more than that is left, else what is
        left, squared, so that NORMAL standard deviations hold 95 % as Student's t has it for few degrees of
        freedom. A robust fit has the variance of Huber's at the stated noise, and comes to that of least
        absolute values where the noise is larger."""
        more = max(self.left, 1.0)
        lost = HUBER_LOSS + (MEDIAN_LOSS - HUBER_LOSS) * (1.0 - 1.0 / more) if self.robust else 1.0
        if self.left <= 1.0:
            return lost
        return float(lost * (more * stdtrit(self.freedom, 0.975) / NORMAL) ** 2)


def noise_of(weighted: Floats, unknowns: float, robust: bool = False) -> Noise | None:
    """Of weighted residuals (R,) of a fit that takes so many degrees of freedom; None where no reading is to spare."""
    spare = len(weighted) - unknowns
    if spare <= 0:
        return None
    if not robust:
        return Noise(float(np.sqrt(np.sum(weighted**2) / spare)), float(spare))
    middle = float(np.median(np.abs(weighted))) / MEDIAN
    return Noise(middle * float(np.sqrt(len(weighted) / spare)), max(WORTH * spare, 1.0), True)
