"""Plain loop of `paths.SplinePath.derivatives`, compiled for long paths; scipy's splines there are the reference.

How it is rounded: `toolpaths/compiled.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop


@loop
def spline(knots: Any, degree: Any, c0: Any, c1: Any, c2: Any, c3: Any, s: Any, out: Any) -> None:
    """Joints and three derivatives, out (4, N, J), of a B-spline at s (N,), any order; quick where s rises.

    c0 to c3 are coefficients of the spline and its derivatives. The recursion for the basis functions of one
    degree passes through those of all lower degrees, which the derivatives need (de Boor; Piegl and Tiller,
    The NURBS Book, A2.2).
    """
    joints = c0.shape[1]
    last = knots.shape[0] - degree - 2
    basis, left, right = np.empty(degree + 1), np.empty(degree + 1), np.empty(degree + 1)
    cell = degree
    for i in range(s.shape[0]):
        at = s[i]
        if at < knots[cell] or at >= knots[min(cell + 8, last) + 1]:
            cell = min(max(np.searchsorted(knots, at, side="right") - 1, degree), last)
        while cell < last and at >= knots[cell + 1]:
            cell += 1
        basis[0] = 1.0
        for p in range(1, degree + 1):
            left[p], right[p] = at - knots[cell + 1 - p], knots[cell + p] - at
            passed = 0.0
            for r in range(p):
                share = basis[r] / (right[r + 1] + left[p - r])
                basis[r] = passed + right[r + 1] * share
                passed = left[p - r] * share
            basis[p] = passed
            order = degree - p
            if order < 4:
                c = c0 if order == 0 else c1 if order == 1 else c2 if order == 2 else c3
                for j in range(joints):
                    total = 0.0
                    for r in range(p + 1):
                        total += basis[r] * c[cell - degree + r, j]
                    out[order, i, j] = total
