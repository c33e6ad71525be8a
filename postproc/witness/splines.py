"""Splines of the CL file (NURBS of NX: clamped cubics from where the tool stands) as dense chords, and what is off them."""

from __future__ import annotations

import numpy as np

from postproc.witness.text import Array

CHORD = 2e-4
"""mm that the chords are from the curve"""
_AT_ONCE, _LOOKS = 200, 64


def points_of(control: Array, knots: list[float]) -> Array:
    """(P, 3) from control points (n, 3) mm and the n - 3 knots behind 0, by the basis functions of Cox and de Boor."""
    t = np.concatenate([np.zeros(4), np.array(knots) / knots[-1], np.ones(3)])
    breaks, parts = np.unique(t), 8
    while True:
        u = np.interp(np.linspace(0.0, len(breaks) - 1.0, 2 * parts * (len(breaks) - 1) + 1), np.arange(len(breaks)), breaks)
        p = _basis(t, u, len(control)) @ control
        off = np.sqrt(((p[1::2] - 0.5 * (p[:-1:2] + p[2::2])) ** 2).sum(axis=1)).max()
        if off <= CHORD or parts > 2000:
            return np.asarray(p)
        parts = int(parts * np.sqrt(off / CHORD)) + 1


def _basis(t: Array, u: Array, n: int) -> Array:
    last = np.flatnonzero(t < t[-1])[-1]
    inside = (t[:-1] <= u[:, None]) & (u[:, None] < t[1:])
    inside[u >= t[-1], last] = True
    basis = inside.astype(float)
    for k in range(1, 4):
        rise, fall = t[k:-1] - t[:-k - 1], t[k + 1:] - t[1:-k]
        up = np.where(rise > 0.0, (u[:, None] - t[:-k - 1]) / np.where(rise > 0.0, rise, 1.0), 0.0)
        down = np.where(fall > 0.0, (t[k + 1:] - u[:, None]) / np.where(fall > 0.0, fall, 1.0), 0.0)
        basis = up * basis[:, :-1] + down * basis[:, 1:]
    return basis[:, :n]


def length_of(points: Array) -> float:
    """mm along chords."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def _chords(tip: Array, points: Array) -> tuple[Array, Array]:
    """(K, P - 1) mm from tips to each chord, and how far along each they are (0 to 1)."""
    begin, travel = points[:-1], np.diff(points, axis=0)
    offset = tip[:, None] - begin
    share = np.clip((offset * travel).sum(axis=2) / np.maximum((travel * travel).sum(axis=1), 1e-30), 0.0, 1.0)
    rest = offset - share[:, :, None] * travel
    return np.sqrt((rest * rest).sum(axis=2)), share


def off_chords(tip: Array, points: Array) -> Array:
    """(K,) mm by which tips are off chords, less what may stand in the place of a spline."""
    away = np.empty(len(tip))
    for first in range(0, len(tip), _AT_ONCE):
        away[first:first + _AT_ONCE] = _chords(tip[first:first + _AT_ONCE], points)[0].min(axis=1)
    return np.maximum(away - CHORD, 0.0)


def goes_back(tip: Array, points: Array, tolerance: float) -> bool:
    """True where tips (K, 3), which are on a spline, do not follow each other along it in their order."""
    tip = tip[np.unique(np.linspace(0, len(tip) - 1, _LOOKS).astype(int))] if len(tip) else tip
    size, at, near = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)), 0.0, tolerance + CHORD
    before = np.cumsum(size) - size
    for away, share in zip(*_chords(tip, points), strict=True):
        places = (before + share * size)[away <= near]
        ahead = places[places >= at - 4.0 * near]
        if len(places) and not len(ahead):
            return True
        at = max(at, float(ahead.min())) if len(ahead) else at
    return False
