"""Splines of the CL file (NURBS of NX: clamped cubics from where the tool stands) as dense chords, and what is off them;
polynomials in the text of a program, against the blocks that were executed for them."""

from __future__ import annotations

import re

import numpy as np

from postproc.witness.evidence import Case, ExecutedBlocks, Finding
from postproc.witness.text import Array

CHORD = 2e-4
"""mm that the chords are from the curve"""
_AT_ONCE, _LOOKS, _NEAR = 100, 64, 0.5
_REMARK = re.compile(rb";[^\n]*")
_PO = re.compile(rb"PO\s*\[\s*([XYZ])\s*\]\s*=\s*\(([^()]*)\)|\b([XYZ])\s*=\s*PO\s*\(([^()]*)\)")
_PL = re.compile(rb"\bPL\s*=\s*([\d.]+)")
_SPL = re.compile(rb"K([123])([XYZ])\s*([-+]?[\d.]+(?:\s?E[-+]?\d+)?)")
_INCH, _MM = re.compile(rb"\bG700?(?!\d)|BEGIN PGM[^\n]*INCH"), re.compile(rb"\bG710?(?!\d)|BEGIN PGM[^\n]*MM")
_WORD = re.compile(rb"(?<![A-Z\[(=])([XYZ])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_ENDS = re.compile(rb"(?<![A-Z])G0?[0-3](?![\d.])|\bPOLY\b")
ROUNDED = 2e-4
"""mm that words and coefficients of a polynomial may be rounded by"""


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
    return _to_chords(tip, points[:-1], np.diff(points, axis=0))


def _to_chords(tip: Array, begin: Array, travel: Array) -> tuple[Array, Array]:
    """The same of chords by their begins and travels (P, 3)."""
    offset = tip[:, None] - begin
    share = np.clip((offset * travel).sum(axis=2) / np.maximum((travel * travel).sum(axis=1), 1e-30), 0.0, 1.0)
    rest = offset - share[:, :, None] * travel
    return np.sqrt((rest * rest).sum(axis=2)), share


def off_chords(tip: Array, points: Array) -> Array:
    """(K,) mm by which tips are off chords, less what may stand in the place of a spline."""
    away, low, high = np.empty(len(tip)), np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    for first in range(0, len(tip), _AT_ONCE):
        some = tip[first:first + _AT_ONCE]
        near = ((high >= some.min(axis=0) - _NEAR) & (low <= some.max(axis=0) + _NEAR)).all(axis=1)
        here = _to_chords(some, points[:-1][near], np.diff(points, axis=0)[near])[0].min(axis=1, initial=np.inf)
        far = here > _NEAR  # a chord that is nearer than that is among those looked at
        here[far] = _chords(some[far], points)[0].min(axis=1)
        away[first:first + _AT_ONCE] = here
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


def check_curves(case: Case, executed: ExecutedBlocks) -> tuple[list[Finding], int]:
    """Polynomials of the text (POLY of SINUMERIK, SPL of a TNC) that the blocks executed for them do not follow; how many
    were compared. Both start and end where the blocks do, so that what is compared is how they bow between."""
    text = _REMARK.sub(b"", case.program.upper())
    if (b"PO" not in text and b"SPL" not in text and b"BSPLINE" not in text) or (np.diff(executed.line) < 0).any():
        return [], 0
    inch = _INCH.search(text) is not None
    if inch and _MM.search(text):
        return [], 0
    columns = [executed.letters.index(a) for a in "XYZ" if a in executed.letters]
    blocks, scale = text.split(b"\n"), 25.4 if inch else 1.0
    worst, count = _off_polygons(blocks, executed, columns, scale) if len(columns) == 3 else ((0.0, 0), 0)
    for number, block in enumerate(blocks, 1):
        bow = _bow(block) if b"PO" in block or b"SPL" in block else None
        first, last = np.searchsorted(executed.line, [number, number + 1])
        if bow is None or last <= first or len(columns) < 3:
            continue
        places = np.cumsum(executed.steps(np.arange(first, last))[:, columns], axis=0)
        p = np.arange(1.0, last - first + 1.0)[:, None] / (last - first)
        powers = sum(term * (p ** n - p) for n, term in enumerate(bow, 2))
        off = np.abs(places - places[-1] * p - powers * scale).max()
        worst, count = max(worst, (float(off), number)), count + 1
    if worst[0] <= ROUNDED:
        return [], count
    said = f"the blocks of a polynomial are {worst[0]:.4f} mm off what its numbers say"
    return [Finding("path", said, 0, worst[1])], count


def _off_polygons(blocks: list[bytes], executed: ExecutedBlocks, columns: list[int],
                  scale: float) -> tuple[tuple[float, int], int]:
    """((mm by which blocks executed for a BSPLINE are off the curve of its control points at most, its line), how many were
    compared). A cubic with equal knots, tangential to the polygon at both ends, from where the block before it has ended;
    the next G0 to G3 or POLY ends it."""
    worst, count, held = (0.0, 0), 0, list[tuple[int, dict[bytes, float]]]()
    here, inside = dict[bytes, float](), False
    for number, block in enumerate([*blocks, b"G0"], 1):
        ends = _ENDS.search(block) is not None
        if inside and ends and held:
            first, last = np.searchsorted(executed.line, [held[0][0], held[-1][0] + 1])
            travel = executed.steps(np.arange(first, last))[:, columns]
            off = _off_polygon(np.array([[at[a] for a in (b"X", b"Y", b"Z")] for _, at in held]) * scale, travel)
            worst, count = max(worst, (off, held[0][0])), count + 1
        inside = (inside or b"BSPLINE" in block) and not ends
        words = {m[1]: float(m[2]) for m in _WORD.finditer(block)}
        here |= words
        if b"BSPLINE" in block:
            held = []
        if inside and words:
            held.append((number, dict(here)))
    return worst, count


def _off_polygon(points: Array, travel: Array) -> float:
    """mm of executed blocks by their travel (N, 3), as many for each piece, from the curve whose control points behind the
    first one (n, 3) are given; infinite where they are no such curve."""
    places = np.cumsum(travel, axis=0)
    pieces = len(points) + 1 - 3
    if pieces < 1 or not len(places):
        return float("inf")
    control = np.concatenate([points[-1:] - places[-1], points])
    knots = np.concatenate([np.zeros(4), np.arange(1.0, pieces), np.full(4, float(pieces))])
    at = np.arange(1.0, len(places) + 1.0) * (pieces / len(places))
    said = np.concatenate([_basis(knots, some, len(control)) @ control
                           for some in np.array_split(at, max(len(at) * len(control) // 2**20, 1))])
    return float(np.abs(places - (said - control[0])).max())


def _bow(block: bytes) -> Array | None:
    """(4, 3) second to fifth coefficients of a block in X, Y, Z, its parameter from 0 to 1; None where it has none."""
    result = np.zeros((4, 3))
    length = float(found[1]) if (found := _PL.search(block)) else 1.0
    terms = [(m[1] or m[3], (m[2] or m[4]).split(b",")) for m in _PO.finditer(block)]
    for axis, values in terms:
        for n, value in enumerate(values[1:]):
            result[n, b"XYZ".index(axis)] = float(value.replace(b"EX", b"e")) * length ** (n + 2)
    parts = {(int(m[1]), b"XYZ".index(m[2])): float(m[3].replace(b" ", b"")) for m in _SPL.finditer(block)}
    for (n, axis), value in parts.items():  # t = 1 - p
        result[0, axis] += value if n == 2 else 3.0 * value if n == 3 else 0.0
        result[1, axis] -= value if n == 3 else 0.0
    return result if terms or parts else None
