"""Plain loops that lay a problem out for `interior.py`, and begin its multipliers; `NumpySteps` is the reference.

How they are rounded: `toolpaths/compiled.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop


@loop
def pack(w: Any, v: Any, stencil: Any, common: Any, dq: Any, d2q: Any, d3q: Any) -> None:
    """Stencil (9, K), common (4, K), joints (J, K) into w (B, COMMON, LANES) and v (B, J, PER_JOINT, LANES), zero before."""
    lanes, joints, knots = w.shape[2], dq.shape[0], dq.shape[1]
    for block in range(w.shape[0]):
        for i in range(lanes):
            k = block * lanes + i
            if k >= knots:
                w[block, 13, i] = 1.0
                continue
            for field in range(9):
                w[block, field, i] = stencil[field, k]
            for field in range(4):
                w[block, 9 + field, i] = common[field, k]
            for j in range(joints):
                v[block, j, 0, i], v[block, j, 1, i], v[block, j, 2, i] = dq[j, k], d2q[j, k], d3q[j, k]


@loop
def begin_multipliers(w: Any, v: Any, c: Any, inverse: Any, middle: Any, mu: Any) -> None:
    """z = mu / slack of every row; c (K + 2, padded), inverse and middle as of `interior.assemble`."""
    lanes, joints = w.shape[2], v.shape[1]
    own = 0 if middle.shape[0] == lanes else lanes
    for block in range(w.shape[0]):
        for i in range(lanes):
            k = block * lanes + i
            x = w[block, 0, i] * c[k] + w[block, 1, i] * c[k + 1] + w[block, 2, i] * c[k + 2] + w[block, 13, i]
            x1 = w[block, 3, i] * c[k] + w[block, 4, i] * c[k + 1] + w[block, 5, i] * c[k + 2]
            x2 = w[block, 6, i] * c[k] + w[block, 7, i] * c[k + 1] + w[block, 8, i] * c[k + 2]
            root = 1.0 / np.sqrt(x)
            w[block, 14, i] = mu / (1.0 - x * w[block, 9, i])
            for j in range(joints):
                q1, q2, q3 = v[block, j, 0, i], v[block, j, 1, i], v[block, j, 2, i]
                scale = inverse[0, j] * w[block, 11, i]
                use = q2 * scale * x + 0.5 * q1 * scale * x1 + middle[(block * joints + j) * own + i]
                v[block, j, 3, i], v[block, j, 4, i] = mu / (1.0 - use), mu / (1.0 + use)
                scale = inverse[1, j] * w[block, 12, i]
                use = q3 * scale * x + 1.5 * q2 * scale * x1 + 0.5 * q1 * scale * x2
                v[block, j, 5, i], v[block, j, 6, i] = mu / (root - use), mu / (root + use)
