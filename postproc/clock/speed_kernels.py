"""Loops of the control's look-ahead: the speed from which it can slow down in time, and the motion cycle by cycle.

Both know only the joints' derivatives by path length at places of the path (q', q'', q'''), the largest speed there and the
limits of the joints. At speed v and acceleration a along the path a joint has acceleration q'' v^2 + q' a and jerk
q''' v^3 + 3 q'' v a + q' j (chain rule), which gives the a and j that are left.
"""

from __future__ import annotations

import math

from toolpaths.arrays import Floats
from toolpaths.compiled import loop

LEFT = 0.15
"""share of what a straight path along the same direction would allow that is left for changes of speed at least"""
NOTHING = 1e-12
"""derivative by path length below which a joint does not move"""
NEWTON = 20
"""steps of Newton's method at most; three or four do"""
HALVINGS = 9
"""of the jerk that is looked for each cycle"""
TOUCH, TOUCH_SPEED = 1e-4, 1e-6
"""share, and mm/s or rad/s, by which a speed may lie above the one that can be braked"""
NEAR = 0.3
"""of the jerks left, by which the motion may differ from the braking curve when it comes upon it"""
SHORTLY = 16.0
"""cycles: a rest this much before the end is followed by a move of its own to the end"""
SOON = 2.5
"""cycles along the braking curve from which the end is reached at once: constant jerk takes 1.8"""
SLACK = 1.02
"""times the jerk left with which the motion may come upon the braking curve"""


@loop
def left(k: int, v: float, a: float, d1: Floats, d2: Floats, d3: Floats, acceleration: Floats, jerk: Floats,
         straight: Floats) -> tuple[float, float, float, float]:
    """(lowest, highest acceleration, lowest, highest jerk) along the path at place k; straight (N, 2) without bends."""
    a_most, j_most = straight[k, 0], straight[k, 1]
    a_low, a_high, j_low, j_high = -a_most, a_most, -j_most, j_most
    for i in range(d1.shape[1]):
        slope = d1[k, i]
        if abs(slope) > NOTHING:
            bent, turned = d2[k, i] * v * v, d3[k, i] * v * v * v + 3.0 * d2[k, i] * v * a
            if slope < 0.0:
                slope, bent, turned = -slope, -bent, -turned
            a_high, a_low = min(a_high, (acceleration[i] - bent) / slope), max(a_low, (-acceleration[i] - bent) / slope)
            j_high, j_low = min(j_high, (jerk[i] - turned) / slope), max(j_low, (-jerk[i] - turned) / slope)
    a_left, j_left = LEFT * a_most, LEFT * j_most
    return min(a_low, -a_left), max(a_high, a_left), min(j_low, -j_left), max(j_high, j_left)


@loop
def slow_down(s: Floats, cap: Floats, d1: Floats, d2: Floats, d3: Floats, acceleration: Floats, jerk: Floats,
              straight: Floats, v: Floats, a: Floats) -> None:
    """Fill speed v and acceleration a <= 0 (N,) of the braking curve: from each place the joints slow down, jerk limited, to
    what `cap` allows behind it, and rest at the end. Where the curve falls onto a lower cap its acceleration jumps."""
    n = len(s)
    speed = gain = 0.0
    v[n - 1] = a[n - 1] = 0.0
    for i in range(n - 2, -1, -1):
        h = s[i + 1] - s[i]
        a_low, _, _, j = left(i + 1, speed, -gain, d1, d2, d3, acceleration, jerk, straight)
        most = -a_low
        gain = min(gain, most)
        t = (6.0 * h / j) ** (1.0 / 3.0)
        if speed > 0.0:
            t = min(t, h / speed)
        if gain > 0.0:
            t = min(t, math.sqrt(2.0 * h / gain))
        for _ in range(NEWTON):
            step = (t * (speed + t * (gain / 2.0 + j * t / 6.0)) - h) / (speed + t * (gain + j * t / 2.0))
            t -= step
            if abs(step) < 1e-9 * t:
                break
        end = min(gain + j * t, most)
        faster = speed + (gain + end) / 2.0 * t
        if faster > cap[i]:
            faster = cap[i]
            end = min(end, max(0.0, (faster * faster - speed * speed) / (2.0 * h)))
        speed, gain = faster, end
        v[i], a[i] = speed, -gain


@loop
def left_to_brake(k: int, v: float, a: float, d1: Floats, d2: Floats, d3: Floats, acceleration: Floats, jerk: Floats,
                  straight: Floats) -> tuple[float, float]:
    """The lowest acceleration and jerk of `left`, to the last digit."""
    a_most, j_most = straight[k, 0], straight[k, 1]
    a_low, j_low = -a_most, -j_most
    for i in range(d1.shape[1]):
        slope = d1[k, i]
        if abs(slope) > NOTHING:
            bent, turned = d2[k, i] * v * v, d3[k, i] * v * v * v + 3.0 * d2[k, i] * v * a
            if slope < 0.0:
                slope, bent, turned = -slope, -bent, -turned
            a_low = max(a_low, (-acceleration[i] - bent) / slope)
            j_low = max(j_low, (-jerk[i] - turned) / slope)
    return min(a_low, -(LEFT * a_most)), min(j_low, -(LEFT * j_most))


@loop
def interval(s: Floats, k: int, x: float) -> int:
    """The interval of x, looked for from interval k."""
    while k < len(s) - 2 and s[k + 1] <= x:
        k += 1
    return k


@loop
def above(s: Floats, v: Floats, k: int, x: float, speed: float) -> bool:
    """Whether a speed is above the one that can be braked at x in interval k; roots are drawn where it is near."""
    if speed <= min(v[k], v[k + 1]):
        return False
    part = min(max((x - s[k]) / (s[k + 1] - s[k]), 0.0), 1.0)
    low, high = v[k] * math.sqrt(v[k]), v[k + 1] * math.sqrt(v[k + 1])
    between = low + (high - low) * part
    if speed * math.sqrt(speed) <= between:
        return False
    return bool(speed > between ** (2.0 / 3.0) * (1.0 + TOUCH) + TOUCH_SPEED)


@loop
def braked(s: Floats, v: Floats, k: int, x: float) -> tuple[int, float]:
    """(interval, speed of the braking curve) at x, looked for from interval k: v^1.5 is linear, as it is at a rest."""
    k = interval(s, k, x)
    part = min(max((x - s[k]) / (s[k + 1] - s[k]), 0.0), 1.0)
    low, high = v[k] * math.sqrt(v[k]), v[k + 1] * math.sqrt(v[k + 1])
    return k, (low + (high - low) * part) ** (2.0 / 3.0)


@loop
def can_brake(s: Floats, v: Floats, k: int, x: float, speed: float, gain: float, cycle: float, d1: Floats, d2: Floats,
              d3: Floats, acceleration: Floats, jerk: Floats, straight: Floats) -> bool:
    """Whether braking as hard as the joints can from (x, speed, gain) stays below the braking curve."""
    while speed > 0.0:
        k = interval(s, k, x)
        if above(s, v, k, x, speed):
            return False
        a_low, j_low = left_to_brake(k, speed, gain, d1, d2, d3, acceleration, jerk, straight)
        if gain <= a_low:
            return True
        less = max(gain + j_low * cycle, a_low)
        slower = speed + (gain + less) / 2.0 * cycle
        x += cycle * (speed + cycle * (2.0 * gain + less) / 6.0)
        speed, gain = slower, less
        if x >= s[-1]:
            return speed <= 0.0
    return True


@loop
def largest(s: Floats, v: Floats, k: int, x: float, speed: float, gain: float, cycle: float, d1: Floats, d2: Floats,
            d3: Floats, acceleration: Floats, jerk: Floats, straight: Floats) -> tuple[float, float, float]:
    """(place, speed, acceleration) a cycle later with the largest jerk from which the motion can brake."""
    a_low, a_high, j_low, j_high = left(k, speed, gain, d1, d2, d3, acceleration, jerk, straight)
    low, high, best, tried = j_low, j_high, j_low, j_high
    for _ in range(HALVINGS):
        more = min(gain + tried * cycle, a_high)
        faster = speed + (gain + more) / 2.0 * cycle
        there = x + cycle * (speed + cycle * (2.0 * gain + more) / 6.0)
        if faster >= 0.0 and can_brake(s, v, k, there, faster, more, cycle, d1, d2, d3, acceleration, jerk, straight):
            best = low = tried
            if tried == j_high:
                break
        else:
            high = tried
        tried = (low + high) / 2.0
    more = max(min(gain + best * cycle, a_high), a_low)
    faster = speed + (gain + more) / 2.0 * cycle
    there = min(x + max(cycle * (speed + cycle * (2.0 * gain + more) / 6.0), 0.0), s[-1])
    _, most = braked(s, v, k, there)
    if faster > most * (1.0 + TOUCH) + TOUCH_SPEED:
        faster = most
        more = (faster - speed) / cycle
    return there, faster, more


@loop
def soon(s: Floats, v: Floats, k: int, x: float, cycle: float) -> bool:
    """Whether the end is reached along the braking curve within SOON cycles from x in interval k."""
    last = len(s) - 1
    share = (s[k + 1] - x) / (s[k + 1] - s[k])
    time = share * 2.0 * (s[k + 1] - s[k]) / max(v[k] + v[k + 1], TOUCH_SPEED)
    for i in range(k + 1, last):
        if time > SOON * cycle:
            return False
        time += 2.0 * (s[i + 1] - s[i]) / max(v[i] + v[i + 1], TOUCH_SPEED)
    return bool(time <= SOON * cycle)


@loop
def run(s: Floats, v: Floats, a: Floats, cycle: float, d1: Floats, d2: Floats, d3: Floats, acceleration: Floats,
        jerk: Floats, straight: Floats, state: Floats, out: Floats) -> int:
    """Fill out (M, 3) with place, speed, acceleration each cycle and return how many there are; `state` (3,) is where it
    begins and where it goes on: with another call, or, at rest before the end, with a move of its own.

    Each cycle: along the braking curve where its jerk is within what is left, else the largest jerk from which it can brake.
    """
    x, speed, gain = state[0], state[1], state[2]
    k = count = 0
    while count < len(out):
        out[count, 0], out[count, 1], out[count, 2] = x, speed, gain
        count += 1
        k, _ = braked(s, v, k, x)
        if x >= s[-1] - straight[k, 1] * cycle * cycle * cycle and soon(s, v, k, x, cycle):
            state[0], state[1], state[2] = s[-1], 0.0, 0.0
            break
        _, _, j_low, j_high = left(k, speed, gain, d1, d2, d3, acceleration, jerk, straight)
        at, there, faster, more = k, x, speed, gain
        for _ in range(3):
            there = min(x + cycle * (speed + cycle * (2.0 * gain + more) / 6.0), s[-1])
            at, faster = braked(s, v, k, there)
            more = a[at] + (a[at + 1] - a[at]) * min((there - s[at]) / (s[at + 1] - s[at]), 1.0)
        needed = (more - gain) / cycle
        near = abs(speed + (gain + more) / 2.0 * cycle - faster) <= NEAR * (j_high - j_low) * cycle * cycle
        near = near and there > x + speed * cycle / 4.0
        along = near and SLACK * j_low <= needed <= SLACK * j_high and there < s[-1] and can_brake(
            s, v, at, there, faster, more, cycle, d1, d2, d3, acceleration, jerk, straight)
        if not along:
            there, faster, more = largest(s, v, k, x, speed, gain, cycle, d1, d2, d3, acceleration, jerk, straight)
            if faster <= 0.0:
                faster = more = 0.0
                there = min(x + speed / 2.0 * cycle, s[-1])
                if speed <= 0.0 or s[-1] - there < straight[k, 1] * (SHORTLY * cycle) ** 3 / 32.0:
                    state[0], state[1], state[2] = there, 0.0, 0.0
                    break
        x = max(there, x)
        speed, gain = faster, more
    else:
        state[0], state[1], state[2] = x, speed, gain
    return count
