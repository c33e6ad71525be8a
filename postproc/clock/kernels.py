"""Loop of the control's path: derivatives of a smoothed polyline."""

from __future__ import annotations

from toolpaths.arrays import Floats
from toolpaths.compiled import loop


@loop
def add_turns(s: Floats, q: Floats, dq: Floats, d2q: Floats, d3q: Floats, vertex: Floats, du: Floats,
              width: Floats) -> None:
    """Add to the position and derivatives of the polyline at places s (M,) what smoothing its vertices changes."""
    low = 0
    for i in range(len(vertex)):
        w = width[i]
        while low > 0 and s[low - 1] > vertex[i] - w / 2:
            low -= 1
        while low < len(s) and s[low] < vertex[i] - w / 2:
            low += 1
        k = low
        while k < len(s) and s[k] <= vertex[i] + w / 2:
            x = (s[k] - vertex[i]) / w + 0.5
            step = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x) - (1.0 if s[k] >= vertex[i] else 0.0)
            shift = w * x**4 * (2.5 - 3.0 * x + x * x) - max(s[k] - vertex[i], 0.0)
            first = 30.0 * x * x * (1.0 - x) * (1.0 - x) / w
            second = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (w * w)
            for j in range(du.shape[1]):
                q[k, j] += du[i, j] * shift
                dq[k, j] += du[i, j] * step
                d2q[k, j] += du[i, j] * first
                d3q[k, j] += du[i, j] * second
            k += 1
