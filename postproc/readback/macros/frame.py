"""Frames of a program: its coordinates as those of the work offset, turned, scaled, mirrored and shifted.

SINUMERIK Programming Manual Fundamentals, coordinate transformations (frames): TRANS, ROT, SCALE and MIRROR start from
the work offset, ATRANS, AROT, ASCALE and AMIRROR go on from the frame in force; several angles in one block turn about Z,
then the new Y, then the new X (MD10600 FRAME_ANGLE_INPUT_MODE = 1, its default).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import combinations

from toolpaths.dataclass import dataclass

FrameRow = tuple[float, float, float]
FrameTurn = tuple[FrameRow, FrameRow, FrameRow]
AXES = "XYZ"
UNTURNED: FrameTurn = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_SMALL = 1e-12
"""entries of a turn below it come from rounding of sines and cosines alone"""
IN_PLANE = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
"""first, second axis and normal of a plane"""


@dataclass(frozen=True)
class CoordinateFrame:
    """Points p of the program lie at turn p + shift, mm, in the work offset."""

    turn: FrameTurn = UNTURNED
    shift: FrameRow = (0.0, 0.0, 0.0)

    @property
    def turned(self) -> bool:
        """True where it does more than shift."""
        return self.turn != UNTURNED

    @property
    def square(self) -> bool:
        """True where its axes are square to one another, as those of one rotation, then scales and mirrors, always are."""
        columns = [_row(row[j] for row in self.turn) for j in range(3)]
        return all(abs(sum(a * b for a, b in zip(u, v, strict=True))) <= 1e-9 * math.hypot(*u) * math.hypot(*v)
                   for u, v in combinations(columns, 2))

    def before(self, inner: CoordinateFrame) -> CoordinateFrame:
        """The frame in which `inner` is stated in the coordinates of this one."""
        turn = _cleaned((sum(self.turn[i][k] * inner.turn[k][j] for k in range(3)) for j in range(3)) for i in range(3))
        return CoordinateFrame(turn, _row(a + b for a, b in zip(self.vector(inner.shift), self.shift, strict=True)))

    def vector(self, v: FrameRow) -> FrameRow:
        """A direction of the program in the work offset."""
        return _row(sum(row[j] * v[j] for j in range(3)) for row in self.turn)

    def needed(self, axis: int) -> list[int]:
        """Axes of the program whose coordinates decide one of the work offset."""
        return [j for j in range(3) if self.turn[axis][j]]

    def inverse(self) -> FrameTurn:
        """The turn back, by cofactors; no scale is 0."""
        t = self.turn
        size = sum(t[0][j] * _cofactor(t, 0, j) for j in range(3))
        return _cleaned((_cofactor(t, j, i) / size for j in range(3)) for i in range(3))

    def flat(self, plane: int) -> float:
        """The size that lengths in a plane take, negative where it is mirrored; NaN where its circles do not stay so."""
        i, j, n = IN_PLANE[plane]
        t = self.turn
        if t[i][n] or t[j][n] or t[n][i] or t[n][j]:
            return math.nan
        size = t[i][i] * t[j][j] - t[i][j] * t[j][i]
        first, second = math.hypot(t[i][i], t[j][i]), math.hypot(t[i][j], t[j][j])
        square = abs(t[i][i] * t[i][j] + t[j][i] * t[j][j]) <= 1e-9 * first * second
        same = abs(first - second) <= 1e-9 * first
        return math.copysign(first, size) if square and same else math.nan

    def keeps(self, axis: int) -> bool:
        """True where an axis keeps its direction and size, and the others stay square to it."""
        return all(self.turn[axis][j] == UNTURNED[axis][j] == self.turn[j][axis] for j in range(3))


def shifted(given: Mapping[str, float]) -> CoordinateFrame:
    """TRANS: mm by axis."""
    return CoordinateFrame(shift=_row(given.get(a, 0.0) for a in AXES))


def rotated(given: Mapping[str, float]) -> CoordinateFrame:
    """ROT: degrees about each axis."""
    frame = CoordinateFrame()
    for k in (2, 1, 0):
        angle = math.radians(given.get(AXES[k], 0.0))
        i, j = (k + 1) % 3, (k + 2) % 3
        rows = [list(row) for row in UNTURNED]
        rows[i][i] = rows[j][j] = math.cos(angle)
        rows[i][j], rows[j][i] = -math.sin(angle), math.sin(angle)
        frame = frame.before(CoordinateFrame(_cleaned(rows)))
    return frame


def scaled(given: Mapping[str, float]) -> CoordinateFrame:
    """SCALE: factors by axis; MIRROR: those that are -1."""
    return CoordinateFrame(_cleaned((given.get(a, 1.0) * v for v in row) for a, row in zip(AXES, UNTURNED, strict=True)))


def _row(values: Iterable[float]) -> FrameRow:
    a, b, c = values
    return a, b, c


def _cleaned(turn: Iterable[Iterable[float]]) -> FrameTurn:
    a, b, c = (_row(_whole(v) for v in row) for row in turn)
    return a, b, c


def _whole(value: float) -> float:
    """Without the rounding of sines and cosines of right angles."""
    near = float(round(value))
    return near if abs(value - near) <= _SMALL else value


def _cofactor(t: FrameTurn, i: int, j: int) -> float:
    a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
    return t[a][c] * t[b][d] - t[a][d] * t[b][c]
