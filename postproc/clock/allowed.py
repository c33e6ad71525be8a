"""How fast a control may be along its path: places, derivatives there, the largest speed at each.

A bend may take a share of each joint's acceleration and jerk, so that some is left for changes of speed; SINUMERIK has
such a share for the acceleration (machine data 20602, CURV_EFFECT_ON_PATH_ACCEL; 0.75 is the setting its list of machine
data recommends). Feeds, blocks taken up and blocks read ahead hold the speed of whole blocks.
"""

from __future__ import annotations

import numpy as np

from postproc.clock.path import SHORTEST, BlendedPath, CommandedPath
from postproc.clock.settings import ControlSettings
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

AVERAGED = 10
"""blocks over which the time of taking up blocks is averaged"""
SLOWEST = 1e-3
"""mm/s or rad/s: least speed to which few blocks read ahead hold the axes"""
EVEN = 1e-9
"""blocks: parts of a block that are one in the arithmetic of their sum"""
NO_MOTION = 1e-12
"""mm or rad, against division by 0"""
FIRST, FIRST_AT_REST, GROWTH = 0.02, SHORTEST, 0.25
"""mm: distance of the first place from one of the path, and from a rest; how much the distances grow each"""
CORNER = 0.0051
"""mm around a corner that is not rounded off within which the path turns (half of the least width of `path.py`)"""


@dataclass(frozen=True)
@arrays(s="N", dq="N A", d2q="N A", d3q="N A", cap="N", straight="N 2", rests="K")
class Allowed:
    """What is allowed along a path.

    Attributes:
        s (N,): places, mm; dq, d2q, d3q (N, A): derivatives of the joints by path length
        cap (N,): largest speed, mm/s
        straight (N, 2): acceleration and jerk along the path that the joints allow where nothing bends
        rests (K,): rows of the rests, both ends included
    """

    s: Floats
    dq: Floats
    d2q: Floats
    d3q: Floats
    cap: Floats
    straight: Floats
    rests: Ints

    def between(self, first: int, last: int) -> Allowed:
        """The rows from one rest to the next."""
        rows = slice(first, last + 1)
        return Allowed(self.s[rows], self.dq[rows], self.d2q[rows], self.d3q[rows], self.cap[rows], self.straight[rows],
                       np.array([0, last - first]))


def allowed(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> Allowed:
    """The largest speeds of a path under its feeds and the joints' limits."""
    s = grid(path)
    d = path.derivatives(s)
    dq, d2q, d3q = d.dq, d.d2q, d.d3q
    acceleration, jerk = settings.acceleration, settings.jerks
    cap = _by_block(path, block_speeds(commanded, path, settings), s)
    if settings.corner_step is not None:
        passed, sharp = _by_steps(commanded, path, settings.corner_step, settings.acceleration, s)
        cap = np.minimum(cap, passed)
        d2q, d3q = (np.where(sharp[:, None], 0.0, one) for one in (d2q, d3q))
    with np.errstate(divide="ignore"):
        cap = np.minimum(cap, (settings.velocity / np.abs(dq)).min(axis=1))
        cap = np.minimum(cap, np.sqrt((settings.bend_acceleration * acceleration / np.abs(d2q)).min(axis=1)))
        cap = np.minimum(cap, np.cbrt((settings.bend_jerk * jerk / np.abs(d3q)).min(axis=1)))
        straight = np.stack([np.minimum((limit / np.abs(dq)).min(axis=1), np.linalg.norm(limit * commanded.weight))
                             for limit in (acceleration, jerk)], axis=1)
    rests = np.searchsorted(s, path.stops)
    return Allowed(s, dq, d2q, d3q, np.maximum(cap, SLOWEST), straight, rests)


def grid(path: BlendedPath) -> Floats:
    """(N,) places of a path, of its blocks' ends and, between them, ever wider away from each."""
    base = np.unique(np.concatenate([path.s, path.ends]))
    base = base[np.diff(base, prepend=-np.inf) > 1e-9]
    base = np.unique(np.concatenate([base, path.stops]))
    length = np.diff(base)
    rest = np.isin(base, path.stops)
    first = np.where(rest[:-1] | rest[1:], FIRST_AT_REST, FIRST)
    half = np.maximum(np.ceil(np.log1p(GROWTH * length / (2.0 * first)) / np.log1p(GROWTH)), 1).astype(np.int64)
    half = np.where(length > first, half, 0)
    owner = np.repeat(np.arange(len(length)), 2 * half)
    step = np.arange(len(owner)) - (np.cumsum(2 * half) - 2 * half)[owner]
    n = half[owner]
    near = np.where(step < n, step, 2 * n - step).astype(np.float64)
    share = ((1.0 + GROWTH) ** near - 1.0) / ((1.0 + GROWTH) ** n - 1.0) / 2.0
    share = np.where(step < n, share, 1.0 - share)
    return np.unique(np.concatenate([base, base[owner] + share * length[owner]]))


def block_speeds(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> Floats:
    """(N,) largest speed of each block along the path of all axes: its feed, blocks taken up, blocks read ahead; inf where a
    block does not move."""
    along = np.diff(path.ends)
    moving = along > 0.0
    speed = np.full(len(along), np.inf)
    speed[moving] = commanded.speed[moving] * along[moving] / commanded.length[moving]
    if settings.block_time > 0.0:
        n, k = len(along), np.arange(len(along))
        low, high = np.maximum(k - AVERAGED // 2, 0), np.minimum(k + AVERAGED // 2 + 1, n)
        taken = np.append(0.0, np.cumsum(commanded.parts))
        speed = np.minimum(speed, (path.ends[high] - path.ends[low]) / (taken[high] - taken[low]) / settings.block_time)
    return np.where(moving, np.minimum(speed, _seen(commanded, path, settings)), np.inf)


def _seen(commanded: CommandedPath, path: BlendedPath, settings: ControlSettings) -> Floats:
    """(N,) speed from which the axes come to rest, at constant jerk, within the blocks read ahead of each block's end; inf
    where they rest before.

    A ramp of constant jerk j from v to rest takes 2 sqrt(v/j) over v sqrt(v/j), and with its acceleration held at a
    v/a + a/j over v (v/a + a/j)/2: solved for v.
    """
    from scipy.ndimage import maximum_filter1d  # loaded where a control's clock is asked for

    n = len(commanded.length)
    read = np.cumsum(commanded.parts)
    last = np.minimum(np.searchsorted(read, read - commanded.parts + settings.buffer + EVEN, side="right"), n)
    room = np.maximum(path.ends[last] - path.ends[1:], 0.5 * np.diff(path.ends))
    along = np.diff(path.ends)[:, None]  # 0 of a block that is too short to be a motion: it turns no axis
    slope = np.where(along > 0.0, np.abs(np.diff(commanded.points, axis=0)) / np.maximum(along, NO_MOTION), 0.0)
    width = min(settings.buffer, n)
    steepest = maximum_filter1d(slope, width, axis=0, origin=-(width // 2), mode="nearest")
    most = np.maximum(steepest, NO_MOTION)
    a, j = (settings.acceleration / most).min(axis=1), (settings.jerks / most).min(axis=1)
    ramp = 0.5 * a * a / j
    v = np.where(room < a**3 / j**2, np.cbrt(room * room * j), np.sqrt(ramp * ramp + 2.0 * a * room) - ramp)
    return np.where(last == n, np.inf, np.maximum(v, SLOWEST))


def _by_block(path: BlendedPath, speed: Floats, s: Floats) -> Floats:
    """(N,) speeds at places: of the block, at its ends the lesser of both sides."""
    moving = np.diff(path.ends) > 0.0
    ends, speed = np.append(path.ends[:-1][moving], path.ends[-1]), speed[moving]
    before = np.clip(np.searchsorted(ends, s, side="left") - 1, 0, len(speed) - 1)
    behind = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(speed) - 1)
    return np.minimum(speed[before], speed[behind])


def _by_steps(commanded: CommandedPath, path: BlendedPath, step: Floats, acceleration: Floats,
              s: Floats) -> tuple[Floats, Bools]:
    """(largest speed, whether the path turns at once) at places (N,): corners without a tolerance are passed at the speed at
    which no joint's velocity jumps by more than `step` (A,), nor by more than its acceleration allows in half a block on
    either side."""
    along = np.diff(path.ends)
    moving = np.flatnonzero(along > 0.0)
    slope = np.diff(commanded.points, axis=0)[moving] / along[moving, None]
    around = (along[moving[1:]] + along[moving[:-1]]) / 2.0
    with np.errstate(divide="ignore"):
        turn = np.abs(np.diff(slope, axis=0))
        passed = np.minimum((step / turn).min(axis=1, initial=np.inf),
                            np.sqrt((acceleration / turn).min(axis=1, initial=np.inf) * around))
    at = commanded.tolerance[moving[1:]] == 0.0
    corner, passed = path.ends[moving[1:]][at], passed[at]
    cap, sharp = np.full(len(s), np.inf), np.zeros(len(s), dtype=bool)
    for side in (-CORNER, CORNER):
        k = np.searchsorted(corner, s + side) - (side > 0.0)
        near = np.flatnonzero((k >= 0) & (k < len(corner)))
        near = near[np.abs(corner[k[near]] - s[near]) <= CORNER]
        cap[near], sharp[near] = np.minimum(cap[near], passed[k[near]]), True
    return cap, sharp
