"""A serial chain's poses, and its slides at a tip, in loops over points: compiled twins of `Serial`'s columns, same bits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from machines.kinematics.chain import Joint
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, loop, wanted
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_ROWS, _INDEX = ("float64", 2), ("int64", 1)
COMPILE_FROM = 20_000
"""points that are worth compiling for; fewer take the loop where any is compiled anyway"""


def pays(n: int) -> bool:
    """True where a loop over a chain is faster than its columns for n points."""
    return wanted(n, COMPILE_FROM)


@dataclass(frozen=True)
@arrays(turn="C", column="C", along="C 3", place="C 3", turning="R")
class ChainLoop:
    """C joints as the loop takes them, see there; `turning` (R,): columns of q of the rotary ones."""

    turn: Ints
    column: Ints
    along: Floats
    place: Floats
    turning: Ints

    @classmethod
    def of(cls, chain: Sequence[Joint], axis_names: Sequence[str]) -> ChainLoop:
        """Of a chain whose joints stand in q in the order of `axis_names`."""
        column = [axis_names.index(joint.name) for joint in chain]
        turning = [at for at, joint in zip(column, chain, strict=True) if joint.rotary]
        turn = [turning.index(at) if joint.rotary else -1 for at, joint in zip(column, chain, strict=True)]
        return cls(np.array(turn), np.array(column), np.array([joint.along for joint in chain]),
                   np.array([joint.place for joint in chain]), np.array(turning, dtype=np.int64))

    @cached_property
    def sliding(self) -> tuple[int, int]:
        """The first slide of the chain, and one past the last."""
        at = np.flatnonzero(self.turn < 0)
        return int(at[0]), int(at[-1]) + 1

    @cached_property
    def slides_together(self) -> bool:
        """No rotary joint stands between the slides."""
        first, end = self.sliding
        return bool((self.turn[first:end] < 0).all())

    def _turned(self, q: Floats) -> tuple[Floats, Floats]:
        """Cosine and sine (R, N) of the rotary joints; as numpy has them, whose bits the columns have too."""
        cos, sin = np.empty((2, len(self.turning), len(q)))
        for k, j in enumerate(self.turning.tolist()):
            np.cos(q[:, j], out=cos[k])
            np.sin(q[:, j], out=sin[k])
        return cos, sin

    def poses(self, q: Floats, carried: Floats) -> Floats:
        """(1 + C, N, 3), see `chain_poses`."""
        return compiled(chain_poses)(q, *self._turned(q), self.turn, self.column, self.along, self.place, carried)

    def at_tip(self, tip: Floats, q: Floats, at_zero: Floats, from_slides: Floats) -> Floats:
        """(N, J), see `chain_at_tip`; only where no rotary joint stands between the slides."""
        chain = self.turn, self.column, self.along, self.place
        return compiled(chain_at_tip)(tip, q, *self._turned(q), *chain, *self.sliding, at_zero, from_slides)


def coarse_bends(chain: Sequence[Joint], axis_names: Sequence[str], tip: Floats, q0: Floats, q1: Floats) -> Floats | None:
    """(2, N), see `chain_bends`, of the tip (3,) at zero: cheaper than `jets`; None of few moves, and of no chain."""
    if not chain or not pays(len(q0)):
        return None
    loops = ChainLoop.of(chain, axis_names)
    return compiled(chain_bends)(q0, q1, loops.turn, loops.column, loops.along, loops.place, tip)


@loop(takes=(_ROWS, _ROWS, _ROWS, _INDEX, _INDEX, _ROWS, _ROWS, _ROWS))
def chain_poses(q: Floats, cos: Floats, sin: Floats, turn: Ints, column: Ints, along: Floats, place: Floats,
                carried: Floats) -> Floats:
    """(1 + C, N, 3): a point and directions at the tool's end, `carried` (1 + C, 3), moved by C joints in turn.

    Args:
        q: (N, J) joints; `column` (C,): where each joint of the chain stands in it, from the part to the tool
        cos, sin: (R, N) of the rotary joints; `turn` (C,): which of them a joint is, -1 for slides
        along, place: (C, 3) directions of the joints, points of rotary ones
    """
    result = np.empty((len(carried), len(q), 3))
    v = np.empty(3)
    for n in range(len(q)):
        for m in range(len(carried)):
            for i in range(3):
                v[i] = carried[m, i]
            for c in range(len(turn) - 1, -1, -1):
                if turn[c] >= 0:
                    for i in range(3 if m == 0 else 0):
                        v[i] = v[i] - place[c, i]
                    turn_vector(v, along[c], cos[turn[c], n], sin[turn[c], n])
                    for i in range(3 if m == 0 else 0):
                        v[i] = v[i] + place[c, i]
                elif m == 0:
                    for i in range(3):
                        if along[c, i] != 0.0:
                            v[i] = v[i] + q[n, column[c]] * along[c, i]
            for i in range(3):
                result[m, n, i] = v[i]
    return result


@loop(takes=(_ROWS, _ROWS, _ROWS, _ROWS, _INDEX, _INDEX, _ROWS, _ROWS, ("int64", 0), ("int64", 0), ("float64", 1), _ROWS))
def chain_at_tip(tip: Floats, q: Floats, cos: Floats, sin: Floats, turn: Ints, column: Ints, along: Floats, place: Floats,
                 first: int, end: int, at_zero: Floats, from_slides: Floats) -> Floats:
    """(N, J): q with the slides, joints `first` to `end` of the chain, as they bring the tip (N, 3) there.

    Args:
        q, cos, sin, turn, column, along, place: as in `chain_poses`
        at_zero: (3,) the tip where all joints stand at 0
        from_slides: (3, 3) slides per displacement of the tip
    """
    result = np.empty(q.shape)
    gap, start = np.empty(3), np.empty(3)
    for n in range(len(q)):
        for i in range(3):
            gap[i], start[i] = tip[n, i], at_zero[i]
        for c in range(first):
            turn_point(gap, along[c], place[c], cos[turn[c], n], -sin[turn[c], n])
        for c in range(len(turn) - 1, end - 1, -1):
            turn_point(start, along[c], place[c], cos[turn[c], n], sin[turn[c], n])
        for j in range(q.shape[1]):
            result[n, j] = q[n, j]
        for k in range(end - first):
            slide = 0.0
            for i in range(3):
                if from_slides[k, i] != 0.0:
                    slide = slide + from_slides[k, i] * (gap[i] - start[i])
            result[n, column[first + k]] = slide
    return result


@loop(takes=(_ROWS, _ROWS, _INDEX, _INDEX, _ROWS, _ROWS, ("float64", 1)))
def chain_bends(q0: Floats, q1: Floats, turn: Ints, column: Ints, along: Floats, place: Floats, tip: Floats) -> Floats:
    """(2, N) what |second derivative| of tip (mm) and axis (rad) nowhere exceeds on straight moves q0 -> q1 (N, J) in t.

    From the tool to the part: the tip is within `far` of a point that the slides carry, faster than `speed` and bent more
    than `bend` nowhere. A turn by w adds w r to the speed and 2 w speed + w^2 r to the bend, r the reach square to its line
    (r'' = R ((a''W + a'^2 W^2) s + 2 a'W s' + s''), see `taylor`). No sine: several times what `jets` finds.
    """
    result = np.empty((2, len(q0)))
    a, b, slid, free = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(q0)):
        far = speed = bend = turned = 0.0
        for i in range(3):
            a[i] = b[i] = tip[i]
            slid[i] = 0.0
        for c in range(len(turn) - 1, -1, -1):
            begin, end = q0[n, column[c]], q1[n, column[c]]
            if turn[c] < 0:
                for i in range(3):
                    a[i], b[i] = a[i] + begin * along[c, i], b[i] + end * along[c, i]
                    slid[i] = slid[i] + (end - begin) * along[c, i]
                continue
            speed += length_of(slid)
            whole = across = 0.0
            for v in (a, b):
                for i in range(3):
                    free[i] = v[i] - place[c, i]
                whole = max(whole, length_of(free))
                lies = free[0] * along[c, 0] + free[1] * along[c, 1] + free[2] * along[c, 2]
                for i in range(3):
                    free[i] = free[i] - lies * along[c, i]
                across = max(across, length_of(free))
            w = abs(end - begin)
            bend += w * (2.0 * speed + w * (far + across))
            speed += w * (far + across)
            far += whole
            turned += w
            for i in range(3):
                a[i] = b[i] = place[c, i]
                slid[i] = 0.0
        result[0, n], result[1, n] = bend, turned * turned
    return result


@loop
def length_of(v: Floats) -> float:
    """|v| of v (3,)."""
    return float(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))


@loop
def turn_point(v: Floats, d: Floats, place: Floats, cos: float, sin: float) -> None:
    """Turn the point v (3,) about the line through `place` (3,) along the unit d (3,)."""
    for i in range(3):
        v[i] = v[i] - place[i]
    turn_vector(v, d, cos, sin)
    for i in range(3):
        v[i] = v[i] + place[i]


@loop
def turn_vector(v: Floats, d: Floats, cos: float, sin: float) -> None:
    """Turn v (3,) about the unit d (3,) (Rodrigues); about an axis of coordinates two numbers change."""
    for i in range(3):
        if abs(d[i]) == 1.0:
            j, k = (i + 1) % 3, (i + 2) % 3
            signed = sin if d[i] > 0.0 else -sin
            x, y = v[j], v[k]
            v[j], v[k] = cos * x - signed * y, signed * x + cos * y
            return
    a, b, c = v[0], v[1], v[2]
    near = d[0] * a + d[1] * b + d[2] * c
    v[0] = near * d[0] + cos * (a - near * d[0]) + sin * (d[1] * c - d[2] * b)
    v[1] = near * d[1] + cos * (b - near * d[1]) + sin * (d[2] * a - d[0] * c)
    v[2] = near * d[2] + cos * (c - near * d[2]) + sin * (d[0] * b - d[1] * a)
