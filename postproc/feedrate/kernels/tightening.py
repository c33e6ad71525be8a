"""Plain loop of `tightening.worst_ratios`, compiled for long motions; the numpy function there is the reference.

How it is rounded: `toolpaths/compiled.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop


@loop
def worst(d1: Any, d2: Any, d3: Any, x: Any, inverse: Any, out: Any) -> None:
    """Velocity, acceleration, jerk over their limits, the worst joint, out (3, N).

    d1, d2, d3 (N, J) by sigma; x (3, N) squared speed and its derivatives; inverse (3, J) of the limits.
    """
    joints = d1.shape[1]
    for i in range(d1.shape[0]):
        x0, x1, x2 = x[0, i], x[1, i], x[2, i]
        velocity, acceleration, jerk = 0.0, 0.0, 0.0
        for j in range(joints):
            a, b, c = d1[i, j], d2[i, j], d3[i, j]
            velocity = max(velocity, abs(a) * inverse[0, j])
            acceleration = max(acceleration, abs(b * x0 + 0.5 * a * x1) * inverse[1, j])
            jerk = max(jerk, abs(c * x0 + 1.5 * b * x1 + 0.5 * a * x2) * inverse[2, j])
        root = np.sqrt(x0)
        out[0, i], out[1, i], out[2, i] = velocity * root, acceleration, jerk * root
