"""Singular directions: the path of the tool axis led past them with the least rotary speed that its tolerance allows.

Where the tool comes near the direction of the rotary axis nearest the part (the pole), that axis has to
follow the azimuth of the tool about it, however fast that turns. Seen along the path, an azimuth is allowed
where a direction with it lies
within the tolerance: on the sphere, sin d = sin(theta) sin(azimuth - wanted) for the distance d of a direction at the angle
theta from the pole to a meridian (Napier). Of all azimuths in these gates the taut string turns least
(`taut_string.py`); the nearest point of its meridian is the new direction. Where the pole itself is within
the tolerance the axis is led through it, onto the opposite meridian, so that the azimuth need not turn at all.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.joints.poles import Pole, passages, poles_of, stretches
from postproc.joints.taut_string import taut_string
from toolpaths.arrays import Bools, Floats, Ints, repeated
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

_WIDE = 25.0
"""the axis is led within this many tolerances of the pole: farther off it can gain 0.04 rad of azimuth at most"""
_THROUGH = 1e-9
"""rad: a path that comes nearer goes through the pole as it is"""
_STEP = np.radians(4.0)
"""azimuth between places that are looked at"""
_INSIDE = 0.98
"""of the tolerance, for what may happen between the places"""
_CORE = 0.02
"""of the tolerance: directions nearer to the pole than this are led through it"""


@dataclass(frozen=True)
class SingularPassage:
    """One passage by a singular direction.

    Attributes:
        first, last: curves of the run
        joint: the rotary joint that would turn fast
        miss: rad, how near the given path comes to the pole
        deviation: rad, the largest change of the tool axis
        before, after: rad/s, the fastest turn about the pole at the programmed feed, as given and as led
    """

    first: int
    last: int
    joint: int
    miss: float
    deviation: float
    before: float
    after: float


@dataclass(frozen=True)
@arrays(parent="K", u0="K", u1="K")
class Led:
    """Curves (K) that follow a run's curves with their axes led: number k is part u0..u1 (K,) of curve `parent` (K,)."""

    curves: Curves
    parent: Ints
    u0: Floats
    u1: Floats
    events: tuple[SingularPassage, ...]
    is_whole: bool = False
    """the curves as they were given"""


def whole(curves: Curves) -> Led:
    """The curves as they are."""
    n = len(curves)
    return Led(curves, np.arange(n), repeated(0.0, n), repeated(1.0, n), (), True)


def lead_past(kin: Kinematics, curves: Curves, seconds: Floats, tolerance: float, velocity: Floats) -> Led:
    """The curves (N) of a run with the tool axis led past singular directions.

    Only passages where a rotary axis would pass its velocity are touched.

    Args:
        seconds: (N,) time of each curve at the programmed feed; NaN where it is not cut (rapid)
        tolerance: rad that the axis may be moved
        velocity: (J,) rad/s of rotary joints
    """
    led = whole(curves)
    for pole in poles_of(kin):
        led = _lead(pole, led, seconds, tolerance, float(velocity[pole.joint]))
    return led


def _lead(pole: Pole, led: Led, seconds: Floats, tolerance: float, velocity: float) -> Led:
    curves = led.curves
    passing, least = passages(pole, curves, _WIDE * tolerance)
    if not passing.any():
        return led
    time = seconds[led.parent] * (led.u1 - led.u0)
    turn = angle_between(curves.axis0, curves.axis1)
    with np.errstate(divide="ignore", invalid="ignore"):
        fast = passing & (turn / np.sin(np.maximum(least, _THROUGH)) > velocity * time)
    parts: list[Led] = []
    done = 0
    for first, last in stretches(passing):
        if fast[first:last + 1].any() and least[first:last + 1].min() > _THROUGH:
            window = _window(pole, curves.take(np.arange(first, last + 1)), time[first:last + 1], tolerance)
            if window is not None and window.after < window.before:
                parts.append(_part(led, np.arange(done, first)))
                parts.append(window.cut(led, first, pole))
                done = last + 1
    return led if not parts else _joined([*parts, _part(led, np.arange(done, len(curves)))], led.events)


@dataclass(frozen=True)
@arrays(curve="P", u="P", axis="P 3")
class _Window:
    """New axes (P, 3) at places (curve (P,), u (P,)) of a stretch of curves, ends included, and what that does."""

    curve: Ints
    u: Floats
    axis: Floats
    curves: Curves
    miss: float
    deviation: float
    before: float
    after: float

    def cut(self, led: Led, first: int, pole: Pole) -> Led:
        """The parts between the places as curves."""
        index, u0 = self.curve[:-1], self.u[:-1]
        u1 = np.where(self.curve[1:] == index, self.u[1:], 1.0)
        picked = self.curves.take(index)
        start, _ = picked.at(u0)
        end, _ = picked.at(u1)
        curves = Curves(start, end, self.axis[:-1], self.axis[1:], picked.is_arc, picked.center, picked.normal,
                        picked.sweep * (u1 - u0))
        row = first + index
        span = led.u1[row] - led.u0[row]
        event = SingularPassage(int(led.parent[first]), int(led.parent[first + len(self.curves) - 1]), pole.joint, self.miss,
                                self.deviation, self.before, self.after)
        end_u = np.where(u1 == 1.0, led.u1[row], led.u0[row] + u1 * span)
        return Led(curves, led.parent[row], led.u0[row] + u0 * span, end_u, (event,))


def _window(pole: Pole, curves: Curves, time: Floats, tolerance: float) -> _Window | None:
    """The axes of a stretch of curves led past the pole, ends kept; None where its time is not known."""
    if not (time > 0.0).all():
        return None
    curve, u = _places(pole, curves, tolerance)
    _, axis = curves.take(curve).at(u)
    theta, azimuth = pole.polar(axis)
    at = np.concatenate([[0.0], np.cumsum(time)])[curve] + u * time[curve]
    azimuth = np.unwrap(azimuth)
    new, string = _led_axes(pole, axis, azimuth, at, _INSIDE * tolerance)
    before = float((np.abs(np.diff(azimuth)) / np.diff(at)).max())
    after = float((np.abs(np.diff(string)) / np.diff(at)).max())
    return _Window(curve, u, new, curves, float(theta.min()), float(angle_between(new, axis).max()),
                   before, after)


def _led_axes(pole: Pole, given: Floats, azimuth: Floats, at: Floats, reach: float) -> tuple[Floats, Floats]:
    """(axes (P, 3), azimuths (P,) of the rotary axis) of the best taut string: on this side of the pole, or through it.

    `given` (P, 3) are the axes as they are, `azimuth` their azimuths without jumps.
    """
    theta = pole.polar(given)[0]
    free = theta <= reach * (1.0 - _CORE)
    free[[0, -1]] = False
    travels = [(azimuth, np.ones(len(azimuth)))]
    if free.any():
        travels.append(_through(theta, azimuth, free))
    strings = [_string(theta, flat, sign, free, at, reach) for flat, sign in travels]
    best = int(np.argmin([np.abs(np.diff(s) / np.diff(at)).max() for s in strings]))
    string, (flat, sign) = strings[best], travels[best]
    signed = np.arctan(np.tan(sign * theta) * np.cos(string - flat))
    signed = sign * np.maximum(sign * signed, np.where(theta <= 1.1 * reach, _CORE * reach, 0.0))
    signed[_crossings(sign)] = 0.0
    axis = pole.direction(signed, string)
    axis[[0, -1]] = given[[0, -1]]
    return axis, string


def _string(theta: Floats, flat: Floats, sign: Floats, free: Bools, at: Floats, reach: float) -> Floats:
    """The azimuths (P,) of the taut string; next to the pole itself they stand still, so that nothing turns on it."""
    width = np.where(free, 1e3, np.arcsin(np.clip(np.sin(reach) / np.maximum(np.sin(theta), np.sin(reach)), 0.0, 1.0)))
    width[[0, -1]] = 0.0
    string = taut_string(at, flat - width, flat + width)
    for m in _crossings(sign):
        adjacent = np.array([k for k in (m - 1, m + 1) if free[k]], dtype=np.int64)
        string[adjacent] = string[m]
    return string


def _crossings(sign: Floats) -> Ints:
    """Places of the pole itself: before each change of side."""
    return np.flatnonzero(np.diff(sign) != 0.0)


def _through(theta: Floats, azimuth: Floats, free: Bools) -> tuple[Floats, Floats]:
    """(azimuths on meridians (P,), side of the pole on them (P,)) where each free stretch is gone through straight.

    The side changes behind the place nearest to the pole. Whether it does is reported by the azimuths far
    from the pole, before and after the stretch.
    """
    flat, sign = azimuth.copy(), np.ones(len(azimuth))
    found = stretches(free)
    gaps = [(a[1], b[0]) for a, b in pairwise(found)]
    between = [0, *(i + int(theta[i:j].argmax()) for i, j in gaps), len(free) - 1]
    for (first, last), (before, after) in zip(found, pairwise(between), strict=True):
        halves = np.rint((flat[after] - flat[before]) / np.pi)
        behind = first + int(theta[first:last + 1].argmin()) + 1
        flat[behind:] -= halves * np.pi
        sign[behind:] *= 1.0 if halves % 2 == 0 else -1.0
    return flat, sign


def _places(pole: Pole, curves: Curves, tolerance: float) -> tuple[Ints, Floats]:
    """(curve (P,), u (P,)) of places in the order of the path: ends, and between them even steps of azimuth."""
    curve, u = [], []
    for k in range(len(curves)):
        inner = _inner(pole, curves.axis0[k], curves.axis1[k], tolerance)
        curve.append(np.full(len(inner) + 1, k))
        u.append(np.concatenate([[0.0], inner]))
    curve.append(np.array([len(curves) - 1]))
    u.append(np.array([1.0]))
    return np.concatenate(curve), np.concatenate(u)


def _inner(pole: Pole, a: Floats, b: Floats, tolerance: float) -> Floats:
    """Places u of a great circle from a to b (3,), within the cone that is led: from its foot f at the angle
    m from the pole, the azimuth turns by atan(tan(psi) / sin(m)) over the path psi (Napier)."""
    normal = np.cross(a, b)
    turn, size = float(angle_between(a[None], b[None])[0]), float(np.linalg.norm(normal))
    normal = normal / size
    unit = pole.frame[2]
    foot = float(np.arctan2(np.cross(normal, a) @ unit, a @ unit))
    least = max(abs(float(np.arcsin(np.clip(normal @ unit, -1.0, 1.0)))), 0.1 * tolerance)
    azimuth = np.arange(-np.pi / 2 + _STEP, np.pi / 2, _STEP)
    psi = np.arctan(np.sin(least) * np.tan(azimuth))
    outer = _WIDE * tolerance * np.geomspace(0.05, 1.0, 9)
    psi = np.unique(np.concatenate([psi, outer, -outer, [0.0]]))
    psi = psi[np.abs(psi) <= _WIDE * tolerance * 1.0001]
    u = (foot + psi) / turn
    return np.asarray(u[(u > 1e-6) & (u < 1.0 - 1e-6)])


def _part(led: Led, rows: Ints) -> Led:
    return Led(led.curves.take(rows), led.parent[rows], led.u0[rows], led.u1[rows], ())


def _joined(parts: list[Led], events: tuple[SingularPassage, ...]) -> Led:
    curves = Curves(*(np.concatenate([getattr(p.curves, k) for p in parts]) for k in Curves.__dataclass_fields__))
    parent, u0, u1 = (np.concatenate(column) for column in zip(*((p.parent, p.u0, p.u1) for p in parts), strict=True))
    return Led(curves, parent, u0, u1, events + tuple(e for p in parts for e in p.events))
