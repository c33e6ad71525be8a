"""Arcs that stay arcs: whether an arc of the path is one in the words of the program, in which plane and sense."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from toolpaths.arrays import Array, Bools, Floats, Ints, repeated
from toolpaths.dataclass import dataclass
from toolpaths.rotations import whole_turns
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

PLANE_COLUMNS = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
"""numbers (of X, Y, Z) of the first and second axis of G17, G18, G19; G3 turns the first towards the second"""
PLANE_AXIS = {plane: 3 - i - j for plane, (i, j) in PLANE_COLUMNS.items()}
"""number of the axis square to the plane"""
_SQUARE = 1e-7
"""rad that the axis of an arc may be off the axis of the plane"""
_FLAT = 0.0002
"""mm by which an arc may leave a tilted plane, whose printed angles are rounded, or rise in it and count as flat"""
_SHORTEST = 0.01
_RADIUS_SLACK = 0.002


@dataclass(frozen=True)
@arrays(keep="N", plane="int8: N", ccw="N", center="N 3", parts="N")
class WordArcs:
    """For N curves: `keep` (N,) True where the words describe the same arc; then `plane` (17, 18, 19), `ccw`
    as seen from the positive end of the third axis, `center` (N, 3) in the words X, Y, Z relative to the
    start point, and `parts` (N,) equal blocks of at most one turn each."""

    keep: Bools
    plane: Array
    ccw: Bools
    center: Floats
    parts: Ints


def word_arcs(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> WordArcs:
    """Which of the curves, run at fixed rotary joints between q0 and q1 (N, J), are arcs in a plane of the words."""
    n = len(curves)
    rows = np.flatnonzero(curves.is_arc)
    if not len(rows):
        return _no_arcs(n)
    keep, center = np.zeros(n, dtype=bool), np.zeros((n, 3))
    plane, ccw = np.full(n, 17, dtype=np.int8), np.zeros(n, dtype=bool)
    parts = np.ones(n, dtype=np.int64)
    if control.tips_straight and (control.xyz >= 0).all():
        arc = curves.take(rows)
        rotary = np.array(kin.rotary)
        fixed = (q0[rows][:, rotary] == q1[rows][:, rotary]).all(axis=1) & (arc.axis0 == arc.axis1).all(axis=1)
        to_words = control.tip_to_words(kin, q0[rows])
        square = np.abs(to_words @ np.swapaxes(to_words, 1, 2) - np.eye(3)).max(axis=(1, 2)) < 1e-9
        turn = np.asarray(np.linalg.det(to_words))
        normal = np.asarray(np.einsum("nij,nj->ni", to_words, arc.normal)) * turn[:, None]
        third = np.abs(normal).argmax(axis=1)
        along = np.take_along_axis(normal, third[:, None], axis=1)[:, 0]
        radius = np.linalg.norm(arc.start - arc.center, axis=1)
        off = np.linalg.norm(normal - along[:, None] * np.eye(3)[third], axis=1)
        allowed = _SQUARE if control.law != "tilted" else np.maximum(_SQUARE,
                                                                     np.minimum(1e-4, _FLAT / radius))
        keep[rows] = fixed & square & (off <= allowed) & _well_shaped(arc)
        plane[rows] = np.array([19, 18, 17], dtype=np.int8)[third]
        ccw[rows] = along > 0.0
        rise = np.abs(np.einsum("nij,nj->ni", to_words, arc.end - arc.start)[np.arange(len(rows)), third])
        keep[rows] &= np.isin(plane[rows], control.arc_planes)
        keep[rows] &= (rise <= (_FLAT if control.law == "tilted" else 1e-9)) | np.isin(plane[rows], control.helix_planes)
        center[rows] = np.einsum("nij,nj->ni", to_words, arc.center - arc.start)
        parts[rows] = np.maximum(np.ceil(arc.sweep / (2.0 * np.pi) - 1e-9), 1).astype(np.int64)
    return WordArcs(keep, plane, ccw, center, parts)


def _no_arcs(n: int) -> WordArcs:
    return WordArcs(*(repeated(one, n) for one in (False, np.int8(17), False, np.zeros(3), 1)))


def _well_shaped(arc: Curves) -> Bools:
    """Same radius at both ends, and ends that rounding cannot take for one another."""
    def radial(tip: Floats) -> Floats:
        offset = tip - arc.center
        result: Floats = offset - np.einsum("ni,ni->n", offset, arc.normal)[:, None] * arc.normal
        return result
    first, last = radial(arc.start), radial(arc.end)
    r0, r1 = np.linalg.norm(first, axis=1), np.linalg.norm(last, axis=1)
    gap = np.linalg.norm(last - first, axis=1)
    whole = np.abs(arc.sweep - whole_turns(arc.sweep)) < 1e-9
    ends = np.where(whole, gap < 1e-6, gap > _SHORTEST)
    return np.asarray((np.abs(r0 - r1) < _RADIUS_SLACK) & (r0 > _SHORTEST) & ends)
