"""Plain loops over samples of a motion: where it is by time, and what the samples use of the limits.

The numpy functions `Profile.at` and `JointTrajectory.worst_slowdown` are the references. How they are rounded:
`toolpaths/compiled.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop


@loop
def passed(sigma: Any, times: Any, pieces: Any, nodes: Any, t: Any, out: Any) -> None:
    """Knot and travel behind it, out (2, N), at times t (N,) that rise; sigma, times (K,) of knots, pieces (4, K - 1).

    nodes (2, 5) of Gauss on [0, 1] and weights; two steps of Newton from the motion of constant jerk.
    """
    last = sigma.shape[0] - 2
    k = 0
    for i in range(t.shape[0]):
        if t[i] < times[k]:
            k = 0
        while k < last and t[i] >= times[k + 1]:
            k += 1
        rest, h = t[i] - times[k], sigma[k + 1] - sigma[k]
        a, b, c, d = pieces[0, k], pieces[1, k], pieces[2, k], pieces[3, k]
        speed = np.sqrt(a)
        travel = min(max(rest * (speed + rest * (0.25 * b + rest * c * speed / 6.0)), 0.0), h)
        for _ in range(2):
            x = a + travel * (b + travel * (c + travel * d))
            total = 0.0
            for j in range(nodes.shape[1]):
                u = nodes[0, j] * travel
                total += nodes[1, j] / np.sqrt(a + u * (b + u * (c + u * d)))
            travel = min(max(travel + (rest - 0.5 * travel * total) * np.sqrt(x), 0.0), h)
        out[0, i], out[1, i] = k, travel


@loop
def most_used(q: Any, d1: Any, d2: Any, d3: Any, at: Any, which: Any, inverse: Any, steps: Any, own: Any,
              worst: Any) -> None:
    """Largest ratios to velocity, acceleration, jerk of each piece, kept in worst (P, 3), over samples own[0] to own[1].

    q (N, J), its derivatives by sigma d1 to d3; at (3, N) speed, acceleration, jerk along it; which (N,) pieces;
    inverse (3, J) of the limits; steps (3,) powers of the step. Differences count for all samples that
    they are of; before the first sample and behind the last one all is at rest.
    """
    count, joints = q.shape
    for i in range(own[0], own[1]):
        v, a, s = at[0, i], at[1, i], at[2, i]
        velocity, acceleration, jerk = 0.0, 0.0, 0.0
        for j in range(joints):
            b1, b2, b3 = d1[i, j], d2[i, j], d3[i, j]
            velocity = max(velocity, abs(b1 * v) * inverse[0, j])
            acceleration = max(acceleration, abs(b2 * v * v + b1 * a) * inverse[1, j])
            jerk = max(jerk, abs(b3 * v * v * v + 3.0 * b2 * v * a + b1 * s) * inverse[2, j])
        p = which[i]
        worst[p, 0] = max(worst[p, 0], velocity)
        worst[p, 1] = max(worst[p, 1], acceleration)
        worst[p, 2] = max(worst[p, 2], jerk)
    for end in range(own[0], own[1] + 3):
        at0, at1 = min(end, count - 1), min(max(end - 1, 0), count - 1)
        at2, at3 = min(max(end - 2, 0), count - 1), min(max(end - 3, 0), count - 1)
        velocity, acceleration, jerk = 0.0, 0.0, 0.0
        for j in range(joints):
            one, two, three = q[at0, j] - q[at1, j], q[at1, j] - q[at2, j], q[at2, j] - q[at3, j]
            velocity = max(velocity, abs(one) * inverse[0, j])
            acceleration = max(acceleration, abs(one - two) * inverse[1, j])
            jerk = max(jerk, abs(one - two - (two - three)) * inverse[2, j])
        velocity, acceleration, jerk = velocity / steps[0], acceleration / steps[1], jerk / steps[2]
        for p in range(which[at3], which[at0] + 1):
            worst[p, 2] = max(worst[p, 2], jerk)
        for p in range(which[at2], which[at0] + 1):
            worst[p, 1] = max(worst[p, 1], acceleration)
        for p in range(which[at1], which[at0] + 1):
            worst[p, 0] = max(worst[p, 0], velocity)
