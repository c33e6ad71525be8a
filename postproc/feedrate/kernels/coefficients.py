"""Plain loops of `interior_packed.py` over the coefficients themselves: their rows c >= 0, and tied ends.

How they are rounded: `toolpaths/compiled.py`.
"""

from __future__ import annotations

from typing import Any

from toolpaths.compiled import loop


@loop
def advance(c: Any, step: Any, z: Any, rate: Any, primal: Any, dual: Any) -> None:
    """Take the last step: c (n,) and the multipliers z (n,) of c >= 0, whose relative changes are `rate`."""
    for i in range(z.shape[0]):
        c[i] += primal * step[i]
        z[i] *= 1.0 + dual * rate[i]


@loop
def begin(c: Any, z: Any, mu: Any, low: Any, force: Any) -> Any:
    """Begin lower band (3, padded) and right side (padded,) with the rows c >= 0; returns their gap."""
    n, gap = z.shape[0], 0.0
    low[:] = 0.0
    force[n:] = 0.0
    for i in range(n):
        over = 1.0 / c[i]
        low[0, i], force[i] = z[i] * over, mu * over
        gap += z[i] * c[i]
    return gap


@loop
def tie_ends(low: Any, right: Any, first: Any, last: Any) -> None:
    """As `interior.tie`."""
    n = right.shape[0]
    for end in range(2):
        start, stop, keep = (0, first, first - 1) if end == 0 else (n - last, n, n - last)
        main, below, second, force = 0.0, 0.0, 0.0, 0.0
        for i in range(start, stop):
            main += low[0, i]
            force += right[i]
            if i < stop - 1:
                below += low[1, i]
            if i < stop - 2:
                second += low[2, i]
        low[0, keep], right[keep] = main + 2.0 * (below + second), force
    if first > 1:
        low[1, first - 1] += low[2, first - 2]
    if last > 1:
        low[1, n - last - 1] += low[2, n - last - 1]


@loop
def relative(right: Any, first: Any, last: Any, c: Any, z: Any, mu: Any, step: Any, rate: Any) -> Any:
    """Spread the answer over the tied ends into `step`, relative changes of z into `rate`; largest decreases of c and z."""
    n = right.shape[0]
    fall, loss = 0.0, 0.0
    for i in range(n):
        change = right[min(max(i, first - 1), n - last)]
        share = change / c[i]
        other = mu / (c[i] * z[i]) - 1.0 - share
        step[i], rate[i] = change, other
        fall, loss = max(fall, -share), max(loss, -other)
    return fall, loss
