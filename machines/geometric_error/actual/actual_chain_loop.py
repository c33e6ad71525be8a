"""A serial chain's motion with its errors in one loop over points: the compiled twin of `axis_motion.driven`, same bits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.geometric_error.actual.axis_motion import SERIES, Line
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.kinematics.chain_loop import turn_vector
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, loop
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_ROWS, _NUMBERS = ("float64", 2), ("int64", 1)
NONE = -1
"""no such error, no such angle"""
TOGETHER = 4096
"""points that are looked at together: their errors, of which there are dozens each, stay near the processor"""


@dataclass(frozen=True)
@arrays(kinds="C 2", lines="C 3 3", zero="C")
class ActualChainLoop:
    """C axes from the workpiece to the tool as the loop takes them.

    Attributes:
        axes: letters and columns of q
        kinds: 1 where an axis turns, 1 where its errors act on its tool's side; lines: direction, point, reference point
        zero: by how much each stands farther than it counts
    """

    axes: tuple[tuple[str, int], ...]
    kinds: Ints
    lines: Floats
    zero: Floats

    @classmethod
    def of(cls, lines: Sequence[Line]) -> ActualChainLoop:
        """Of the actual lines of a chain."""
        return cls(tuple((line.joint.name, line.index) for line in lines),
                   np.array([(line.joint.rotary, line.moving) for line in lines], dtype=np.int64),
                   np.array([(line.direction, line.point, line.reference) for line in lines]),
                   np.array([line.zero for line in lines]))

    def poses(self, q: Floats, approach: Floats | None, errors: SerialErrors, carried: Floats) -> Floats | None:
        """(V, N, 3): a point and directions `carried` (V, 3) at joints q (N, J) reached by `approach` (N, J).

        None where an angle is too large for its series: then numpy's sines are needed.
        """
        result = np.empty((len(carried), len(q), 3))
        for first in range(0, len(q), TOGETHER):
            part = slice(first, first + TOGETHER)
            found = self._some(q[part], None if approach is None else approach[part], errors, carried)
            if found is None:
                return None
            result[:, part] = found
        return result

    def _some(self, q: Floats, approach: Floats | None, errors: SerialErrors, carried: Floats) -> Floats | None:
        """As `poses`, of few."""
        x, cos, sin = np.empty((3, len(self.axes), len(q)))
        values: list[Floats] = []
        which = np.full((len(self.axes), 6), NONE)
        for c, (name, j) in enumerate(self.axes):
            np.add(q[:, j], self.zero[c], out=x[c])
            if self.kinds[c, 0]:
                np.cos(x[c], out=cos[c])
                np.sin(x[c], out=sin[c])
            torsor = errors.torsors(name, q[:, j], 0.0 if approach is None else approach[:, j])
            for part, value in enumerate(torsor):
                if not isinstance(value, float):
                    which[c, part] = len(values)
                    values.append(value)
        error = np.array(values).reshape(len(values), len(q))
        angles = error[which[:, 3:][which[:, 3:] != NONE]]
        if not np.square(angles).max(initial=0.0) < SERIES:
            return None
        return compiled(actual_chain_poses)(x, cos, sin, error, which, self.kinds, self.lines.reshape(-1, 3), carried)


@loop(takes=(_ROWS, _ROWS, _ROWS, _ROWS, ("int64", 2), ("int64", 2), _ROWS, _ROWS))
def actual_chain_poses(x: Floats, cos: Floats, sin: Floats, error: Floats, which: Ints, kinds: Ints, lines: Floats,
                       carried: Floats) -> Floats:
    """(V, N, 3): a point and directions at the tool's end, `carried` (V, 3), moved by C axes in turn.

    Args:
        x: (C, N) mm or rad from the actual zeros; cos, sin: (C, N) of them
        error: (E, N) component errors; `which` (C, 6): row of each, -1 for none
        kinds: (C, 2), lines: (3 C, 3) as in `ActualChainLoop`
    """
    result = np.empty((len(carried), x.shape[1], 3))
    v, arm = np.empty(carried.shape), np.empty(carried.shape)
    for n in range(x.shape[1]):
        for m in range(len(carried)):
            for i in range(3):
                v[m, i] = carried[m, i]
        for c in range(len(kinds) - 1, -1, -1):
            if kinds[c, 1] == 1:
                displace(v, arm, n, error, which[c], lines[3 * c + 2])
            if kinds[c, 0] == 1:
                for i in range(3):
                    v[0, i] = v[0, i] - lines[3 * c + 1, i]
                for m in range(len(v)):
                    turn_vector(v[m], lines[3 * c], cos[c, n], sin[c, n])
                for i in range(3):
                    v[0, i] = v[0, i] + lines[3 * c + 1, i]
            else:
                for i in range(3):
                    if lines[3 * c, i] != 0.0:
                        v[0, i] = v[0, i] + x[c, n] * lines[3 * c, i]
            if kinds[c, 1] == 0:
                displace(v, arm, n, error, which[c], lines[3 * c + 2])
        for m in range(len(carried)):
            for i in range(3):
                result[m, n, i] = v[m, i]
    return result


@loop
def displace(v: Floats, arm: Floats, n: int, error: Floats, which: Ints, centre: Floats) -> None:
    """Turn v (V, 3), a point about `centre` (3,) and directions, about z, y, x, then displace the point; `arm` (V, 3) is
    room to work in. `which` (6,) as in `actual_chain_poses`; see `axis_motion.displaced`."""
    for m in range(len(v)):
        for i in range(3):
            arm[m, i] = v[m, i] - centre[i] if m == 0 else v[m, i]
    for i in range(2, -1, -1):
        if which[3 + i] >= 0:
            angle = error[which[3 + i], n]
            square = angle * angle
            cos = 1.0 - square * (0.5 - square / 24.0)
            sin = angle * (1.0 - square * (1.0 / 6.0 - square / 120.0))
            j, k = (i + 1) % 3, (i + 2) % 3
            for m in range(len(v)):
                one, other = arm[m, j], arm[m, k]
                arm[m, j], arm[m, k] = cos * one - sin * other, sin * one + cos * other
    for m in range(len(v)):
        for i in range(3):
            if m > 0:
                v[m, i] = arm[m, i]
                continue
            v[0, i] = v[0, i] + (arm[0, i] - (v[0, i] - centre[i]))
            if which[i] >= 0:
                v[0, i] = v[0, i] + error[which[i], n]
