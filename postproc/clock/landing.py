"""The last cycles before a rest, and short moves from rest to rest, in whole cycles."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats

LANDING, LATEST = 12.0, 40.0
"""cycles before a rest from which the motion is one polynomial, and at most where the motion slows down too early"""
SLOWEST = 1e-12
"""mm/s, against division by 0"""


def landed(moved: Floats, end: float, cycle: float, free: Bools) -> Floats:
    """The motion (M, 3) with its last cycles as a polynomial of degree 5 that ends in whole cycles at rest; it begins where
    no bend ahead is slower, `free` (M,).

    Of a motion that comes to rest at constant jerk the time left is 3 r/v, r the length left and v the speed. In a time
    longer by a share e the polynomial begins at 1 - 3 e of that jerk and ends at 1 - 9 e: never above it.
    """
    v = np.maximum(moved[:, 1], SLOWEST)
    late = np.arange(len(moved)) >= len(moved) - LATEST
    left = np.where(late & free & (moved[:, 2] < 0.0), 3.0 * (end - moved[:, 0]) / v, np.inf)
    soon = np.flatnonzero(left <= LANDING * cycle)
    at = int(soon[0]) if len(soon) else int(np.argmin(left))
    if not left[at] <= LATEST * cycle:
        return moved
    count = max(int(np.ceil(left[at] / cycle - 1e-6)), 1)
    length, speed, gain = end - moved[at, 0], moved[at, 1], moved[at, 2]
    whole = count * cycle
    x = np.arange(1.0, float(count)) / count
    p = np.array([length, speed * whole, gain * whole**2 / 2.0])
    c = np.array([10 * p[0] - 6 * p[1] - 3 * p[2], -15 * p[0] + 8 * p[1] + 3 * p[2], 6 * p[0] - 3 * p[1] - p[2]])
    place = p[1] * x + p[2] * x**2 + c[0] * x**3 + c[1] * x**4 + c[2] * x**5
    rate = p[1] + 2 * p[2] * x + 3 * c[0] * x**2 + 4 * c[1] * x**3 + 5 * c[2] * x**4
    bend = 2 * p[2] + 6 * c[0] * x + 12 * c[1] * x**2 + 20 * c[2] * x**3
    tail = np.stack([moved[at, 0] + place, rate / whole, bend / whole**2], axis=1)
    return np.concatenate([moved[:at + 1], tail])


def short_move(start: float, length: float, jerk: float, speed: float, cycle: float) -> Floats:
    """(M, 3) place, speed and acceleration of a move from rest to rest by jerk alone, in four equal phases: length =
    jerk T^3/32, largest speed 2 length/T. It takes whole cycles."""
    count = max(int(np.ceil(max(np.cbrt(32.0 * length / jerk), 2.0 * length / speed) / cycle)), 1)
    whole = count * cycle
    j, t = 32.0 * length / whole**3, np.arange(1.0, float(count)) * cycle
    late = np.minimum(t, whole - t)
    gain = np.where(late < whole / 4.0, j * late, j * (whole / 2.0 - late)) * np.where(t > whole / 2.0, -1.0, 1.0)
    v = np.where(late < whole / 4.0, j * late**2 / 2.0, j * (whole**2 / 16.0 - (whole / 2.0 - late) ** 2 / 2.0))
    rest = whole / 2.0 - late
    place = np.where(late < whole / 4.0, j * late**3 / 6.0, length / 2.0 - j * (whole**2 / 16.0 * rest - rest**3 / 6.0))
    return np.stack([start + np.where(t > whole / 2.0, length - place, place), v, gain], axis=1)
