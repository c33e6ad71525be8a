"""Turns of a platform over boxes of poses, with their rates: by tilt and heading, and by angles that follow."""

from __future__ import annotations

import numpy as np

from machines.certificate.spans import Span, spanned, stacked, turned_by
from machines.kinematics.leg_geometry import TurnLetters
from toolpaths.arrays import Floats


def least_turns(turns: TurnLetters, pose: Span) -> tuple[Span, Span]:
    """(R (N, 3, 3), its derivatives by tilt and heading (N, 2, 3, 3)) of poses (N, 5), of a platform of such turns."""
    n = len(pose.lo)
    c, s = turned_by(pose[:, 3])
    if turns == "c":
        return _about_z(c, s)
    heading = {"a": spanned(np.full(n, -0.5 * np.pi)), "b": spanned(np.zeros(n))}.get(turns, pose[:, 4])
    ch, sh = turned_by(heading)
    none, left = spanned(np.zeros(n)), spanned(1.0) - c

    def of(a: Span, b: Span, fixed: float) -> Span:
        """fixed I + a K + b K^2, K = (0, 0, ch; 0, 0, sh; -ch, -sh, 0), which turns z towards the heading."""
        across = ch * sh * b
        return stacked([spanned(fixed) - ch.square() * b, -across, ch * a, -across, spanned(fixed) - sh.square() * b,
                        sh * a, -(ch * a), -(sh * a), spanned(fixed) - b], -1).reshape(n, 3, 3)

    double, flat = ch * sh * left * 2.0, (ch.square() - sh.square()) * left
    by_heading = stacked([double, -flat, -(sh * s), -flat, -double, ch * s, sh * s, -(ch * s), none], -1)
    return of(s, left, 1.0), stacked([of(c, s, 0.0), by_heading.reshape(n, 3, 3)], 1)


def _about_z(c: Span, s: Span) -> tuple[Span, Span]:
    """(R (N, 3, 3), its derivatives by tilt and heading (N, 2, 3, 3)) of turns about z with that cosine and sine (N,)."""
    n = len(c.lo)
    none, one = spanned(np.zeros(n)), spanned(np.ones(n))
    turn = stacked([c, -s, none, s, c, none, none, none, one], -1).reshape(n, 3, 3)
    by_turn = stacked([-s, -c, none, c, -s, none, none, none, none], -1).reshape(n, 3, 3)
    return turn, stacked([by_turn, by_turn * 0.0], 1)


def turns_about(axes: str, angles: Span) -> tuple[Span, Span]:
    """(R (N, 3, 3) about each of `axes`, x y z, in turn by angles (N, A), its rates by them (N, A, 3, 3))."""
    n = len(angles.lo)
    one = spanned(np.broadcast_to(np.eye(3), (n, 3, 3)))
    turn, rates = one, list[Span]()
    for k, axis in enumerate(axes):
        step, by = _about(axis, angles[:, k])
        rates = [product(rate, step) for rate in rates] + [product(turn, by)]
        turn = product(turn, step)
    return turn, stacked(rates, 1)


def _about(axis: str, angle: Span) -> tuple[Span, Span]:
    """(R (N, 3, 3), its rate) of one turn."""
    k = "xyz".index(axis)
    c, s = turned_by(angle)
    along = np.eye(3)[k]
    over = np.cross(np.eye(3), -along)  # over @ v = along x v
    aside = np.eye(3) - np.outer(along, along)
    cs, sn = c[:, None, None], s[:, None, None]
    return cs * aside + sn * over + np.outer(along, along), cs * over - sn * aside


def product(a: Span, b: Span) -> Span:
    """a b of matrices (..., 3, 3)."""
    return (a[..., :, :, None] * b[..., None, :, :]).sum(-2)


def applied(turn: Span, vectors: Floats) -> Span:
    """(..., K, 3): turns (..., 3, 3) of vectors (K, 3)."""
    middle, radius = vectors @ np.swapaxes(turn.middle, -1, -2), np.abs(vectors) @ np.swapaxes(turn.radius, -1, -2)
    return Span(middle - radius, middle + radius)
