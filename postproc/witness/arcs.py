"""Circle records of all dialects: centre, axis and how far the tool goes round."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.dialect import WitnessDialect
from postproc.witness.text import Array, Record, words_of

_TURN = 2.0 * math.pi
_GEOMETRY = re.compile(r"\b(CIRCLE|LINE|CYLNDR|POINT)\s*/([^()]*)", re.IGNORECASE)
_SAME, _NEAR = 2e-5, 2e-3
"""mm: ends that count as one point; ends too near each other to be sure of"""


@dataclass(frozen=True)
class Given:
    """A record: centre and axis (right-hand sense) in the units and system of the file, whole turns, angle
    (rad) or NaN; where there is a direction at its start, `toward`, that decides the sense."""

    centre: tuple[float, ...]
    normal: tuple[float, ...]
    turns: float = 0.0
    angle: float = math.nan
    toward: tuple[float, ...] | None = None


def circle(r: Record, dialect: WitnessDialect) -> Given | None:
    """CIRCLE of NX and Makino (11 numbers), Creo (7), SolidWorks (6; 7 and a word), others (4, 6, 7)."""
    n = r.numbers
    turns = r.after("TIMES") or 0.0
    if r.has("TIMES"):
        n = n[:-1]
    if len(n) not in (4, 6, 7, 11) or r.has("SWEEP"):
        return None
    normal = tuple(n[3:6]) if len(n) > 4 else (0.0, 0.0, 1.0)
    if r.has("CLOCKWISE", "CLW"):
        return Given(tuple(n[:3]), (0.0, 0.0, -1.0), turns)
    if r.has("COUNTERCLOCKWISE", "CCLW"):
        return Given(tuple(n[:3]), (0.0, 0.0, 1.0), turns)
    sense = -1 if len(n) == 11 and dialect.name in ("generic", "solidworks", "surfcam") else dialect.sense or 1
    return Given(tuple(n[:3]), tuple(sense * v for v in normal), turns)


def movarc(r: Record) -> Given | None:
    """MOVARC/centre, axis, radius, ANGLE, degrees."""
    angle = r.after("ANGLE")
    n = r.numbers
    if angle is None or len(n) != 8 or r.has("CENTER"):
        return None
    sense = -1.0 if angle < 0.0 else 1.0
    return Given(tuple(n[:3]), tuple(sense * v for v in n[3:6]), 0.0, math.radians(abs(angle)))


def tlon(r: Record, toward: tuple[float, ...] | None) -> tuple[Given, tuple[float, ...]] | None:
    """TLON,GOFWD/ (CIRCLE/c, r),ON,(LINE/c, e) and (CYLNDR/c, axis, r),ON,(PLANE/...(POINT/c),(POINT/e)): arc, its end."""
    if toward is None:
        return None
    found = [(word.upper(), [w for w in words_of(body) if isinstance(w, float)]) for word, body in _GEOMETRY.findall(r.body)]
    if not found:
        return None
    (first, n), ends = found[0], [v[-3:] for word, v in found[1:] if (word, len(v)) in (("LINE", 6), ("POINT", 3))]
    axis = {("CIRCLE", 4): (), ("CIRCLE", 7): tuple(n[3:6]), ("CYLNDR", 7): tuple(n[3:6])}.get((first, len(n)))
    if axis is None or not ends:
        return None
    return Given(tuple(n[:3]), axis or (0.0, 0.0, 1.0), toward=toward), tuple(ends[-1])


def resolved(given: dict[int, Given], tip: Array, place: Array, common: Array, frames: list[tuple[Array, Array]],
             scale: float, dialect: WitnessDialect) -> tuple[Array, Array, Array, Array, list[int]]:
    """(arc (N,), centre, normal (K, 3), sweep (K,), rows of arcs that this reader is not sure of) in the absolute frame."""
    arc = np.full(len(tip), -1, np.int32)
    row = np.array([r for r in given if 0 < r < len(tip)], np.int64)
    own = [given[int(r)] for r in row]
    none = np.zeros((0, 3))
    if not own:
        return arc, none, none, np.zeros(0), []
    centre = scale * np.array([g.centre for g in own])
    normal = unit(np.array([g.normal for g in own]))
    toward = np.array([g.toward or (np.nan,) * 3 for g in own])
    matrices, origins = stacked(frames)
    at = np.flatnonzero(~common[row])
    matrix = matrices[place[row[at]]]
    centre[at], normal[at], toward[at] = (np.einsum("nij,nj->ni", matrix, v[at]) for v in (centre, normal, toward))
    centre[at] += origins[place[row[at]]]
    u, v = tip[row - 1] - centre, tip[row] - centre
    against = np.einsum("ni,ni->n", np.cross(normal, u), toward) < 0.0
    normal[against] = -normal[against]
    height = np.einsum("ni,ni->n", u, normal)
    sweep, sure = _sweeps(u, v, normal, own, dialect)
    arc[row] = np.arange(len(row))
    return arc, centre + height[:, None] * normal, normal, sweep, row[~sure].tolist()


def stacked(frames: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """(matrices (K, 3, 3), origins (K, 3)) of systems."""
    return np.stack([m for m, _ in frames]), np.stack([o for _, o in frames])


def _sweeps(u: Array, v: Array, normal: Array, own: list[Given], dialect: WitnessDialect) -> tuple[Array, Array]:
    """(angle (K,) from u to v about the normal with whole turns, True (K,) where nothing about it hangs on rounding)."""
    u = u - np.einsum("ni,ni->n", u, normal)[:, None] * normal
    v = v - np.einsum("ni,ni->n", v, normal)[:, None] * normal
    turns, stated = np.array([g.turns for g in own]), np.array([g.angle for g in own])
    angle = np.arctan2(np.einsum("ni,ni->n", np.cross(u, v), normal), (u * v).sum(axis=1)) % _TURN
    chord = np.sqrt(((u - v) ** 2).sum(axis=1))
    counted = turns > 0.0
    angle = np.where(counted & (chord <= _NEAR) & (angle > math.pi), angle - _TURN, angle) + _TURN * turns
    whole = (chord <= _SAME) & dialect.whole & ~counted
    sure = counted | whole | (chord > _NEAR) | np.isfinite(stated)
    return np.where(np.isfinite(stated), stated, np.where(whole, _TURN, angle)), sure
