"""A control with look-ahead and limited jerk, executed cycle by cycle: times of blocks, and the motion of the axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.clock.allowed import NO_MOTION, SLOWEST, Allowed, allowed
from postproc.clock.landing import landed, short_move
from postproc.clock.path import BlendedPath, CommandedPath, blended, sharp
from postproc.clock.settings import BACKWARD, ControlSettings
from postproc.clock.speed_kernels import can_brake, run, slow_down
from toolpaths.arrays import Bools, Floats
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

COMPILE_FROM = 30
"""places from which the loops are compiled: each cycle looks some tens of cycles ahead"""
FEWEST, LONGEST, CALLS = 256, 1e6, 8
"""cycles that are made room for at least each time; s, and times, after which a motion is given up"""
ROUNDS, USED = 6, 1.08
"""times that bends are passed more slowly at most, until no joint uses more than USED of the jerk that is planned with"""
SLIGHT = 0.1
"""share of a jerk: bends that take less do not become slower"""
GENTLE = 0.95
"""of the accelerations and jerks has the braking curve, so that the motion can come up to it from below"""
GENTLER, LAST, AGAIN = (0.94, 0.93, 0.92, 0.9), 30, 160
"""other such shares; cycles before a rest in which a motion that speeds up again has slowed down too early, and from which
at most it is tried again: from where it can still brake so"""
NEAR = 2
"""cycles around such a place that become slower"""
SPIKE, LESS = 2.0, 0.95
"""a jerk that is exceeded more than that is no bend: the motion came upon its braking curve too late, and comes upon it
otherwise by a little less speed"""


@dataclass(frozen=True)
@arrays(t="T", q="T A", qd="T A", qdd="T A", qddd="T A")
class AxisMotion:
    """Set points of the axes each cycle, behind their filters.

    Attributes:
        t (T,): s; q, qd, qdd, qddd (T, A): position, velocity, acceleration and jerk, mm or rad and s; the last two are the
            differences of qd from cycle to cycle
    """

    t: Floats
    q: Floats
    qd: Floats
    qdd: Floats
    qddd: Floats


@dataclass(frozen=True)
@arrays(s="T", t="T", v="T", a="T", ends="V")
class ControlMotion:
    """The executed motion, rests without time but for what filters take to settle.

    Attributes:
        s, t, v, a (T,): places along `path`, time, speed and acceleration there, each cycle
        ends (V,): s at which each point of the commanded path is reached
        delay: s by which filters hold the axes back
    """

    path: BlendedPath
    settings: ControlSettings
    s: Floats
    t: Floats
    v: Floats
    a: Floats
    ends: Floats
    delay: float

    @property
    def seconds(self) -> float:
        """Time of the whole motion, until the axes stand."""
        return float(self.t[-1])

    def times(self) -> Floats:
        """(V,) s at which each point of the commanded path is reached."""
        moving = np.concatenate([[True], np.diff(self.s) > 0.0])
        t = np.interp(self.ends, self.s[moving], self.t[moving]) + self.delay / 2.0
        return np.asarray(np.where(self.ends >= self.s[-1], self.t[-1], np.where(self.ends <= self.s[0], self.t[0], t)))

    def axes(self) -> AxisMotion:
        """Position and derivatives of each axis by time."""
        step = self.settings.cycle
        if len(self.s) == 1:
            still = np.zeros_like(self.path.q)
            return AxisMotion(self.t, self.path.q, still, still, still)
        d = self.path.derivatives(self.s)
        q, qd = d.q, d.dq * self.v[:, None]
        for j, seconds in enumerate(() if self.settings.smoothing is None else self.settings.smoothing.tolist()):
            q[:, j], qd[:, j] = (_mean(one[:, j], round(seconds / step)) for one in (q, qd))
        qdd = np.diff(qd, axis=0, prepend=qd[:1]) / step
        return AxisMotion(self.t, q, qd, qdd, np.diff(qdd, axis=0, prepend=qdd[:1]) / step)


def execute(commanded: CommandedPath, settings: ControlSettings) -> ControlMotion:
    """What the control makes of a path.

    Raises:
        ArithmeticError: no end was reached.
    """
    path, room = looked_over(commanded, settings)
    delay = settings.delay
    if room is None:
        still = np.zeros(1)
        return ControlMotion(path, settings, still, still, still, still, path.ends, 0.0)
    settle = np.zeros((round(delay / settings.cycle), 3))
    parts: list[Floats] = []
    for first, last in zip(room.rests[:-1].tolist(), room.rests[1:].tolist(), strict=True):
        moved = between_rests(room, first, last, settings)
        parts += [moved, settle + np.array([room.s[last], 0.0, 0.0])]
    parts.append(np.array([[room.s[-1], 0.0, 0.0]]))
    s, v, a = np.concatenate(parts).T
    s = np.maximum.accumulate(np.minimum(s, path.end))
    return ControlMotion(path, settings, s, settings.cycle * np.arange(float(len(s))), v, a, path.ends, delay)


def looked_over(commanded: CommandedPath, settings: ControlSettings) -> tuple[BlendedPath, Allowed | None]:
    """The path that the control makes of what it is given, and what it allows along it; None where nothing moves."""
    if settings.corner_step is not None:
        commanded = sharp(commanded)
    commanded = replace(commanded, stop=commanded.stop | _turns_back(commanded))
    path = blended(commanded)
    return path, allowed(commanded, path, settings) if path.s[-1] > path.s[0] else None


def _turns_back(commanded: CommandedPath) -> Bools:
    """(V,) where the path turns back, at which the axes rest."""
    step = np.diff(commanded.points, axis=0) * commanded.weight
    moving = np.flatnonzero(np.linalg.norm(step, axis=1) > NO_MOTION)
    u = step[moving] / np.linalg.norm(step[moving], axis=1)[:, None]
    result = np.zeros(len(commanded.points), dtype=bool)
    result[moving[1:]] = (u[1:] * u[:-1]).sum(axis=1) < BACKWARD
    return result


def between_rests(room: Allowed, first: int, last: int, settings: ControlSettings) -> Floats:
    """(M, 3) place, speed and acceleration each cycle from one rest to before the next; where a joint's jerk is exceeded in
    a bend the bend is passed more slowly."""
    part = room.between(first, last)
    best, least = np.zeros((0, 3)), np.inf
    for _ in range(ROUNDS):
        moved = _moved(part, settings)
        used = _jerk_used(part, moved, settings)
        if used.max(initial=0.0) < least:
            best, least = moved, float(used.max(initial=0.0))
        if least <= USED:
            break
        part = replace(part, cap=_slower(part, moved, used))
    return best


def _moved(part: Allowed, settings: ControlSettings) -> Floats:
    """(M, 3) the motion from rest to rest under the largest speeds of a part. Where it speeds up again before it rests,
    since the cycle in which it began to slow down was half a one too late, it slows down otherwise by a little."""
    moved = _run(part, settings, np.array([part.s[0], 0.0, 0.0]), GENTLE)
    late = moved[-LAST:]
    if len(late) and (late[:, 2] > 0.0).any() and late[0, 2] < 0.0:
        for share in GENTLER:
            again = _again(part, settings, moved, share)
            moved = again if len(again) < len(moved) else moved
    s = part.s
    ahead = np.minimum.accumulate(part.cap[::-1])[::-1]
    free = moved[:, 1] <= ahead[np.clip(np.searchsorted(s, moved[:, 0], side="right") - 1, 0, len(s) - 1)]
    return landed(moved, float(s[-1]), settings.cycle, free)


def _again(part: Allowed, settings: ControlSettings, moved: Floats, share: float) -> Floats:
    """(M, 3) a motion whose end is braked under another share of the limits."""
    back = AGAIN
    while back < len(moved):
        begin = len(moved) - back
        end = _run(part, settings, moved[begin], share)
        if len(end):
            return np.concatenate([moved[:begin], end])
        back *= 2
    return _run(part, settings, np.array([part.s[0], 0.0, 0.0]), share)


def _run(part: Allowed, settings: ControlSettings, begin: Floats, share: float) -> Floats:
    """(M, 3) the motion from a state (3,) to rest, its braking curve under that share of the limits; none from a state that
    is too fast for that curve."""
    first = max(int(np.searchsorted(part.s, begin[0], side="right")) - 1, 0)
    part = part.between(first, len(part.s) - 1)
    s, v, a = part.s, np.empty(len(part.s)), np.empty(len(part.s))
    chosen(slow_down, len(s), COMPILE_FROM)(s, part.cap, *_bends(part, settings, share), v, a)
    if begin[1] > 0.0 and not chosen(can_brake, len(s), COMPILE_FROM)(
            s, v, 0, *begin.tolist(), settings.cycle, *_bends(part, settings, 1.0)):
        return np.zeros((0, 3))
    rough = float((np.diff(s) / np.maximum((v[1:] + v[:-1]) / 2.0, SLOWEST)).sum())
    if rough > LONGEST:
        raise ArithmeticError(f"the motion takes {rough:.3g} s")
    loop, bends, state, made = chosen(run, len(s), COMPILE_FROM), _bends(part, settings, 1.0), begin.copy(), []
    while state[0] < s[-1] or state[1] > 0.0:
        out = np.empty((FEWEST + round(1.5 * rough / settings.cycle), 3))
        made.append(out[:loop(s, v, a, settings.cycle, *bends, state, out)])
        if state[1] <= 0.0 and state[0] < s[-1]:
            most = float(part.cap[max(int(np.searchsorted(s, state[0], side="right")) - 1, 0):].min())
            made.append(short_move(state[0], s[-1] - state[0], float(part.straight[-1, 1]), most, settings.cycle))
            break
        if len(made) > CALLS:
            raise ArithmeticError(f"no end is reached within {sum(map(len, made)) * settings.cycle:.3g} s")
    return np.concatenate(made)


def _bends(part: Allowed, settings: ControlSettings, share: float) -> tuple[Floats, ...]:
    """Derivatives of a part's path and a share of its limits, laid out alike whatever the share, so that loops are compiled
    once."""
    return part.dq, part.d2q, part.d3q, *(share * one for one in (settings.acceleration, settings.jerks, part.straight))


def _jerk_used(part: Allowed, moved: Floats, settings: ControlSettings) -> Floats:
    """(M,) largest share of a joint's jerk each cycle, by the derivatives of the path; 0 where bends take little of it."""
    s, v, a = moved.T
    j = np.diff(a, append=0.0) / settings.cycle
    k = np.clip(np.searchsorted(part.s, s, side="right") - 1, 0, len(part.s) - 2)
    bend = 3.0 * part.d2q[k] * (v * a)[:, None] + part.d3q[k] * (v**3)[:, None]
    used = np.abs((part.dq[k] * j[:, None] + bend) / settings.jerks)
    return np.asarray(np.where(np.abs(bend / settings.jerks) > SLIGHT, used, 0.0).max(axis=1))


def _slower(part: Allowed, moved: Floats, used: Floats) -> Floats:
    """(N,) largest speeds, reduced around where a jerk is exceeded by its cube root (jerks of a path go by v^3)."""
    cap, s = part.cap.copy(), moved[:, 0]
    for i in np.flatnonzero(used > USED).tolist():
        low, high = np.searchsorted(part.s, s[[max(i - NEAR, 0), min(i + NEAR, len(s) - 1)]]).tolist()
        rows = slice(low, high + 1)
        less = used[i] ** (-1.0 / 3.0) if used[i] < SPIKE else LESS
        cap[rows] = np.minimum(cap[rows], max(moved[i, 1] * less, SLOWEST))
    return cap


def _mean(values: Floats, count: int) -> Floats:
    """Values (T,), each with the mean of the last `count`."""
    if count <= 1:
        return values
    total = np.cumsum(np.concatenate([np.full(count, values[0]), values]))
    return np.asarray((total[count:] - total[:-count]) / count)


