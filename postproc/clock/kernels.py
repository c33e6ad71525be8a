"""Loops of the control: the smoothed path's derivatives, and its motion from cycle to cycle.

In every cycle the control takes the largest jerk along the path from which it can still brake to rest, within what it has
read ahead, so that no axis exceeds velocity, acceleration or jerk and no feed is exceeded anywhere before. The
brake is a fixed rule of the state, so what was found possible once stays possible.
"""

from __future__ import annotations

from toolpaths.arrays import Floats
from toolpaths.compiled import loop

TRIES = 5
"""halvings between the brake and the largest jerk"""
FROM_REST = 30
"""the same at rest, where there is no brake to fall back on"""
FREE = 1e-12
"""derivative below which an axis does not limit"""
LONGEST = 100_000
"""cycles of a brake, a bound against endless loops"""


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


@loop
def ranges(k: int, x: float, v: float, a: float, path: Floats, limits: Floats) -> tuple[bool, float, float, float, float]:
    """(within velocity and acceleration, jerk lowest and highest, acceleration lowest and highest) along the path at x.

    path (M, 3 + 3 A): place, derivatives, speed of the next narrow place, largest speed; limits (3, A).
    """
    count = limits.shape[1]
    f = (x - path[k, 0]) / (path[k + 1, 0] - path[k, 0])
    f = min(max(f, 0.0), 1.0)
    within, low, high, least, most = True, -1e30, 1e30, -1e30, 1e30
    for i in range(count):
        p1 = path[k, 1 + i] + f * (path[k + 1, 1 + i] - path[k, 1 + i])
        n = 1 + count + i
        p2 = path[k, n] + f * (path[k + 1, n] - path[k, n])
        n += count
        p3 = path[k, n] + f * (path[k + 1, n] - path[k, n])
        bent, base = p2 * v * v, 3.0 * p2 * v * a + p3 * v * v * v
        if abs(p1) * v > limits[0, i] or abs(p1 * a + bent) > limits[1, i]:
            within = False
        if abs(p1) > FREE:
            size, sign = abs(p1), 1.0 if p1 > 0.0 else -1.0
            low, high = max(low, (-limits[2, i] - sign * base) / size), min(high, (limits[2, i] - sign * base) / size)
            least, most = max(least, (-limits[1, i] - sign * bent) / size), min(most, (limits[1, i] - sign * bent) / size)
        elif abs(base) > limits[2, i]:
            within = False
    return within and low <= high and least <= most, low, high, least, most


@loop
def next_jerk(k: int, x: float, v: float, a: float, low: float, high: float, path: Floats, limits: Floats,
              dt: float) -> tuple[float, float]:
    """The lowest and highest jerk that hold over a whole cycle: at its begin (low, high) and where the state leads."""
    ahead = x + dt * v
    while k < len(path) - 2 and path[k + 1, 0] < ahead:
        k += 1
    _, lower, upper, _, _ = ranges(k, ahead, max(v + dt * a, 0.0), a, path, limits)
    lower, upper = max(low, lower), min(high, upper)
    if lower > upper:
        return low, high
    return lower, upper


@loop
def brake(v: float, a: float, low: float, high: float, least: float, slow: float, share: float,
          dt: float) -> float:
    """The jerk of the fixed rule: build up deceleration, and give it up to be 0 at speed `slow`, below that at rest."""
    above = v - slow if v > slow else v
    if a < 0.0 and a * a >= share * high * (above + a * dt):
        return min(high, a * a / (2.0 * max(above, 1e-12)))
    return min(max(low, (0.98 * least - a) / dt), high)


@loop
def stops_within(x: float, v: float, a: float, j: float, k: int, b: int, share: float, limit: float, dt: float, path: Floats,
                 ends: Floats, speed: Floats, limits: Floats) -> bool:
    """Whether after one cycle of jerk j the fixed rule comes to rest at most at `limit`, within all limits."""
    for _ in range(LONGEST):
        x, v, a = x + dt * (v + dt * (a / 2.0 + dt * j / 6.0)), v + dt * (a + dt * j / 2.0), a + dt * j
        if x > limit:
            return False
        while k < len(path) - 2 and path[k + 1, 0] < x:
            k += 1
            if v > path[k, 2 + 3 * limits.shape[1]]:
                return False
        while b < len(speed) - 1 and ends[b + 1] < x:
            b += 1
        if v > speed[b] * (1.0 + 1e-9):
            return False
        if v <= 0.0:
            _, low, high, _, _ = ranges(k, x, 0.0, a, path, limits)
            return a >= -2.0 * high * dt
        good, low, high, least, _ = ranges(k, x, v, a, path, limits)
        if not good:
            return False
        spare = 0.25 * (high - low)
        if j < low - spare or j > high + spare:
            return False
        if -2.0 * high * dt <= a <= 0.0 and v <= high * dt * dt:
            return True
        low, high = next_jerk(k, x, v, a, low, high, path, limits, dt)
        j = brake(v, a, low, high, least, path[k + 1, 1 + 3 * limits.shape[1]], share, dt)
    return False


@loop
def possible(x: float, v: float, a: float, j: float, k: int, b: int, limit: float, dt: float, path: Floats, ends: Floats,
             speed: Floats, limits: Floats) -> float:
    """The share of the jerk with which a brake behind one cycle of jerk j comes to rest within all limits; 0 for none."""
    for share in (1.6, 1.0, 0.5):
        if stops_within(x, v, a, j, k, b, share, limit, dt, path, ends, speed, limits):
            return share
    return 0.0


@loop
def motion(state: Floats, end: float, dt: float, buffer: int, path: Floats, ends: Floats, speed: Floats, limits: Floats,
           out: Floats) -> int:
    """Rows of out (C, 5) filled: place, speed, acceleration at the end of each cycle, its jerk, the share of `brake`; less
    than C once at rest at the end.

    state (4,): place, speed, acceleration, share at the begin; buffer: blocks that are read ahead.
    """
    x, v, a, share, k, b = state[0], state[1], state[2], state[3], 0, 0
    for row in range(len(out)):
        while k < len(path) - 2 and path[k + 1, 0] <= x:
            k += 1
        while b < len(speed) - 1 and ends[b + 1] <= x:
            b += 1
        limit = min(end, ends[min(b + buffer, len(speed))])
        _, low, high, least, most = ranges(k, x, v, a, path, limits)
        low, high = next_jerk(k, x, v, a, low, high, path, limits, dt)
        j = brake(v, a, low, high, least, path[k + 1, 1 + 3 * limits.shape[1]], share, dt) if v > 0.0 else 0.0
        most = min(high, (most - a) / dt, 2.0 * (speed[b] - v - a * dt) / (dt * dt))
        if most > j:
            found = possible(x, v, a, most, k, b, limit, dt, path, ends, speed, limits)
            if found > 0.0:
                j, share = most, found
            else:
                for _ in range(TRIES if v > 0.0 else FROM_REST):
                    middle = (j + most) / 2.0
                    found = possible(x, v, a, middle, k, b, limit, dt, path, ends, speed, limits)
                    if found > 0.0:
                        j, share = middle, found
                    else:
                        most = middle
        ahead = x + dt * (v + dt * (a / 2.0 + dt * j / 6.0))
        if v <= 0.0 and end - ahead <= 8.0 * high * dt * dt * dt:
            return row
        if v <= 0.0 and j <= 0.0:
            ahead = min(end, path[k + 1, 0])
        x, v, a = max(ahead, x), v + dt * (a + dt * j / 2.0), a + dt * j
        if v <= 0.0 or (a <= 0.0 and v <= high * dt * dt and end - x <= 8.0 * high * dt * dt * dt):
            v, a = 0.0, 0.0
        out[row, 0], out[row, 1], out[row, 2], out[row, 3] = x, v, a, j
        out[row, 4] = share
        if end - x <= 8.0 * high * dt * dt * dt and v == 0.0:
            return row + 1
    return len(out)


