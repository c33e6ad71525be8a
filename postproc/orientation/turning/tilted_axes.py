"""Tool axes turned by a smooth field along a cut.

The field d(s) (3,) is a cubic B-spline in the table frame. What lies along the axis a of the CL file turns nothing: the axis
is turned by the angle |t| towards t = d - (d.a) a, so that no place is turned by more than |d|, and |d| is nowhere more than
the longest coefficient (the basis is positive and sums to 1: de Boor, A Practical Guide to Splines, 2001, chapter IX).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

DEGREE = 3
_SMALL = 1e-12


@dataclass(frozen=True)
@arrays(knots="K")
class TiltBasis:
    """Cubic B-splines over knots (K,): K - 4 of them."""

    knots: Floats

    @staticmethod
    def over(length: float, step: float) -> TiltBasis:
        """On [0, length], the knots evenly at most `step` apart."""
        count = max(int(np.ceil(length / step - 1e-9)), 1)
        inner = np.linspace(0.0, length, count + 1)
        return TiltBasis(np.concatenate((np.zeros(DEGREE), inner, np.full(DEGREE, inner[-1]))))

    @property
    def count(self) -> int:
        """Coefficients."""
        return len(self.knots) - DEGREE - 1

    def at(self, s: Floats) -> csr_matrix:
        """(N, C) values of the basis at s (N,)."""
        from scipy.interpolate import BSpline
        from scipy.sparse import csr_matrix

        inside = np.clip(s, self.knots[0], self.knots[-1])
        return csr_matrix(BSpline.design_matrix(inside, self.knots, DEGREE))


def turned_axes(axis: Floats, field: Floats) -> Floats:
    """(N, 3) unit axes (N, 3) turned by the field (N, 3), rad; where the field turns nothing, the axis itself."""
    across = field - np.einsum("ni,ni->n", field, axis)[:, None] * axis
    angle = np.linalg.norm(across, axis=1)[:, None]
    turned = np.cos(angle) * axis + np.sinc(angle / np.pi) * across
    return np.where(angle > _SMALL, turned / np.linalg.norm(turned, axis=1, keepdims=True), axis)
