"""A control with look-ahead and limited jerk, executed from cycle to cycle: times of blocks, and the motion of the axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.clock.kernels import motion
from postproc.clock.path import BlendedPath, CommandedPath, blended
from toolpaths.arrays import Floats
from toolpaths.compiled import chosen
from toolpaths.shapes import arrays

MARGIN = 0.99
"""of the limits that a control uses: between two cycles and two places of the path they are not looked at"""
NARROW = 0.9
"""of the speed that a bend allows is what is braked to"""
STEEPEST = 0.02
"""s in which full acceleration is built up where no jerk is stated"""
CYCLES = 64
"""cycles of the shortest move"""
CHUNK = 4096
"""cycles that are computed in one go"""
AVERAGED = 10
"""blocks over which the time of taking up blocks is averaged"""


@dataclass(frozen=True)
@arrays(velocity="A", acceleration="A", jerk="A")
class ControlSettings:
    """How a control plans.

    Attributes:
        velocity, acceleration, jerk (A,): largest of each axis, mm or rad per s, s2, s3; jerk inf where none is stated
        cycle: s between two set points; buffer: blocks that are read ahead; block_time: s that each takes at least
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    cycle: float = 0.002
    buffer: int = 200
    block_time: float = 0.0


@dataclass(frozen=True)
@arrays(t="T", s="T", v="T", a="T", ends="V")
class ControlMotion:
    """The executed motion, rests between stretches without time.

    Attributes:
        t, s, v, a (T,): time, place on `path`, speed and acceleration along it
        ends (V,): s at which each point of the commanded path is reached
    """

    path: BlendedPath
    t: Floats
    s: Floats
    v: Floats
    a: Floats
    ends: Floats

    def joints(self) -> Floats:
        """(T, A) machine coordinates: of the quintics that have the path's derivatives up to the second at its places."""
        p = self.path
        k = np.clip(np.searchsorted(p.s, self.s, side="right") - 1, 0, len(p.s) - 2)
        h = (p.s[k + 1] - p.s[k])[:, None]
        x = (self.s - p.s[k])[:, None] / h
        y = 1.0 - x
        near = y**3 * (p.q[k] * (1 + 3 * x + 6 * x * x) + h * p.dq[k] * x * (1 + 3 * x) + h * h * p.d2q[k] * x * x / 2)
        k = k + 1
        far = x**3 * (p.q[k] * (1 + 3 * y + 6 * y * y) - h * p.dq[k] * y * (1 + 3 * y) + h * h * p.d2q[k] * y * y / 2)
        return np.asarray(near + far)


def execute(commanded: CommandedPath, settings: ControlSettings) -> ControlMotion:
    """What the control makes of a path."""
    path = blended(commanded)
    jerk = np.minimum(settings.jerk, settings.acceleration / STEEPEST)
    limits = MARGIN * np.stack([settings.velocity, settings.acceleration, jerk])
    speed = _allowed(commanded, path, settings)
    slow, most = narrow(path, limits, float(speed[np.isfinite(speed)].max(initial=0.0)))
    table = np.concatenate([path.s[:, None], path.dq, path.d2q, path.d3q, slow[:, None], most[:, None]], axis=1)
    t, s, rows = list[Floats]([np.zeros(1)]), list[Floats]([np.zeros(1)]), list[Floats]([np.zeros((1, 2))])
    now = 0.0
    for begin, end in zip(path.stops[:-1].tolist(), path.stops[1:].tolist(), strict=True):
        low, high = np.searchsorted(path.s, (begin, end))
        first, last = np.searchsorted(path.ends, (begin, end))
        dt, made = _stretch(table[low:high + 1], path.ends[first:last + 1], speed[first:last], limits, begin, end, settings)
        t.append(np.asarray(now + dt * np.arange(1, len(made) + 1), dtype=np.float64))
        now = float(t[-1][-1])
        reached = made[-1, 0] - begin
        s.append(begin + (made[:, 0] - begin) * ((end - begin) / reached))
        rows.append(made[:, 1:3])
    time, place, both = np.concatenate(t), np.concatenate(s), np.concatenate(rows)
    return ControlMotion(path, time, place, both[:, 0], both[:, 1], np.interp(path.ends, place, time))


def narrow(path: BlendedPath, limits: Floats, top: float) -> tuple[Floats, Floats]:
    """(M,) speed of the next place that is slow by its bend, but of none from which a later one cannot be reached; and
    the speed that the bend at each place allows."""
    with np.errstate(divide="ignore"):
        cap = np.minimum((limits[0] / np.abs(path.dq)).min(axis=1), np.minimum(
            np.sqrt((limits[1] / np.abs(path.d2q)).min(axis=1)), np.cbrt((limits[2] / np.abs(path.d3q)).min(axis=1))))
        slope = np.abs(path.dq).max(axis=0)
        gentle = 0.5 * min(float((limits[1] / slope).min()), float(np.sqrt((limits[2] / slope).min() * max(top, 1e-9))))
    gained = 2.0 * gentle * path.s
    reach = np.minimum.accumulate((cap**2 + gained)[::-1])[::-1] - gained
    lowest = np.append(reach[:-1] <= reach[1:], True) & np.concatenate([[True], reach[1:] <= reach[:-1]])
    at = np.flatnonzero(lowest)
    following = np.minimum(np.searchsorted(at, np.arange(len(cap))), len(at) - 1)
    return NARROW * np.sqrt(np.maximum(reach[at[following]], 0.0)), cap


def _allowed(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> Floats:
    """(N,) speeds: of the feed, and as fast as blocks are taken up."""
    if settings.block_time <= 0.0:
        return np.ascontiguousarray(commanded.speed)
    n = len(commanded.speed)
    k = np.arange(n)
    low, high = np.maximum(k - AVERAGED // 2, 0), np.minimum(k + AVERAGED // 2 + 1, n)
    mean = (path.ends[high] - path.ends[low]) / (high - low)
    return np.ascontiguousarray(np.minimum(commanded.speed, mean / settings.block_time))


def _stretch(table: Floats, ends: Floats, speed: Floats, limits: Floats, begin: float, end: float,
             settings: ControlSettings) -> tuple[float, Floats]:
    """(cycle, rows of `motion`) from rest to rest."""
    length = end - begin
    slope = np.maximum(np.abs(table[:, 1:1 + limits.shape[1]]).max(axis=0), 1e-12)
    jerk, top = float((limits[2] / slope).min()), min(float((limits[0] / slope).min()), float(speed.max()))
    least = 4.0 * np.cbrt(length / (2.0 * jerk)) + length / top
    dt = min(settings.cycle, least / CYCLES)
    run = chosen(motion, 1, 1)
    state, parts = np.array([begin, 0.0, 0.0, 1.0]), list[Floats]()
    while True:
        out = np.zeros((CHUNK, 5))
        count = run(state, end, dt, settings.buffer, table, ends, speed, limits, out)
        parts.append(out[:count])
        if count < CHUNK:
            return dt, np.concatenate(parts)
        state = out[-1, [0, 1, 2, 4]]
