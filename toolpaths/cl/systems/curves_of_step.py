"""Curves of STEP (ISO 10303-42) as straight lines and arcs: POLYLINE, TRIMMED_CURVE of LINE and CIRCLE, COMPOSITE_CURVE."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.systems.part21 import Instance, Reference, Value
from toolpaths.dataclass import dataclass

_DEEPEST = 20
_OFF_CIRCLE = 0.01
"""mm"""


class Unread(Exception):
    """What is not carried out, with its line."""

    def __init__(self, what: str, line: int):
        super().__init__(what)
        self.line = line


@dataclass(frozen=True)
class Piece:
    """Straight, or right-hand about `normal` round `centre`, to `end`, mm; the first of a curve says where it begins."""

    end: tuple[float, ...]
    centre: tuple[float, ...] = ()
    normal: tuple[float, ...] = ()


Found = Mapping[int, Instance]


def _of(found: Found, value: Value, owner: Instance) -> Instance:
    got = found.get(value.number) if isinstance(value, Reference) else None
    if got is None:
        raise Unread(f"{owner.name} names nothing", owner.line)
    return got


def point(found: Found, one: Instance) -> Floats:
    """(3,) of CARTESIAN_POINT or DIRECTION (name, (x, y, z))."""
    numbers = one.value(1)
    if one.name not in ("CARTESIAN_POINT", "DIRECTION") or not isinstance(numbers, tuple) or len(numbers) != 3 or not all(
            isinstance(v, float) for v in numbers):
        raise Unread(f"{one.name} in the place of a point of three numbers", one.line)
    return np.array(numbers, np.float64)


def place(found: Found, one: Instance) -> tuple[Floats, Floats]:
    """(origin (3,), rotation (3, 3)) of AXIS2_PLACEMENT_3D(name, location, axis, reference direction)."""
    origin = point(found, _of(found, one.value(1), one))
    z = np.array([0.0, 0.0, 1.0]) if one.value(2) is None else point(found, _of(found, one.value(2), one))
    x = np.array([1.0, 0.0, 0.0]) if one.value(3) is None else point(found, _of(found, one.value(3), one))
    z = z / np.linalg.norm(z)
    x = x - (x @ z) * z
    if not np.linalg.norm(x) > 0.0:
        raise Unread("its axis and its reference direction are the same", one.line)
    x = x / np.linalg.norm(x)
    return origin, np.column_stack([x, np.cross(z, x), z])


def pieces(found: Found, curve: Instance, deep: int = 0) -> list[Piece]:
    """Where a curve begins, then its pieces."""
    if deep > _DEEPEST:
        raise Unread("curves within curves", curve.line)
    if curve.name == "POLYLINE":
        listed = curve.value(1)
        if not isinstance(listed, tuple) or len(listed) < 2:
            raise Unread("POLYLINE of fewer than two points", curve.line)
        return [Piece(tuple(point(found, _of(found, p, curve)).tolist())) for p in listed]
    if curve.name == "TRIMMED_CURVE":
        return _trimmed(found, curve)
    if curve.name == "COMPOSITE_CURVE":
        return _composite(found, curve, deep)
    raise Unread(f"curve {curve.name}: read are POLYLINE, TRIMMED_CURVE of LINE or CIRCLE, and COMPOSITE_CURVE", curve.line)


def _composite(found: Found, curve: Instance, deep: int) -> list[Piece]:
    """COMPOSITE_CURVE(name, (segments), -), each COMPOSITE_CURVE_SEGMENT(transition, same sense, curve)."""
    run: list[Piece] = []
    listed = curve.value(1)
    for one in listed if isinstance(listed, tuple) else ():
        segment = _of(found, one, curve)
        part = pieces(found, _of(found, segment.value(2), segment), deep + 1)
        part = backwards(part) if segment.value(1) == ".F." else part
        if run and float(np.abs(np.subtract(run[-1].end, part[0].end)).max()) > 1e-6:
            raise Unread("its segments do not meet", segment.line)
        run += part[1:] if run else part
    if not run:
        raise Unread("COMPOSITE_CURVE without segments", curve.line)
    return run


def _trimmed(found: Found, curve: Instance) -> list[Piece]:
    """TRIMMED_CURVE(name, curve, (from), (to), sense, -), by the points among its limits."""
    basis, ends = _of(found, curve.value(1), curve), []
    for value in (curve.value(2), curve.value(3)):
        named = [v for v in value if isinstance(v, Reference)] if isinstance(value, tuple) else []
        if not named:
            raise Unread("TRIMMED_CURVE by parameters: read are limits by points", curve.line)
        ends.append(tuple(point(found, _of(found, named[0], curve)).tolist()))
    if basis.name == "LINE":
        return [Piece(end) for end in ends]
    if basis.name != "CIRCLE":
        raise Unread(f"TRIMMED_CURVE of {basis.name}: read are LINE and CIRCLE", curve.line)
    centre, matrix = place(found, _of(found, basis.value(1), basis))
    along, radius = (np.array(ends) - centre) @ matrix, basis.value(2)
    off = np.hypot(np.hypot(*along.T[:2]) - (radius if isinstance(radius, float) else np.nan), along[:, 2]).max()
    if not off <= _OFF_CIRCLE:
        raise Unread(f"TRIMMED_CURVE whose ends lie {off:.4g} mm off its CIRCLE; {_OFF_CIRCLE:g} is allowed", curve.line)
    normal = matrix[:, 2] * (-1.0 if curve.value(4) == ".F." else 1.0)
    return [Piece(ends[0]), Piece(ends[1], tuple(centre.tolist()), tuple(normal.tolist()))]


def backwards(run: list[Piece]) -> list[Piece]:
    """The same curve from its end to its start."""
    turned = [Piece(run[-1].end)]
    for before, piece in zip(run[-2::-1], run[:0:-1], strict=True):
        turned.append(Piece(before.end, piece.centre, tuple(-v for v in piece.normal)))
    return turned
