"""One linearisation of `interior.py` on compiled loops: values packed for `kernels/interior.py`."""

from __future__ import annotations

import numpy as np

from postproc.feedrate.interior import Multipliers, NumpySteps
from postproc.feedrate.kernels.coefficients import advance, begin, relative, tie_ends
from postproc.feedrate.kernels.interior import COMMON, LANES, PER_JOINT, assemble, band, direction, pentadiagonal
from postproc.feedrate.problem import SpeedProblem
from toolpaths.arrays import Floats
from toolpaths.compiled import compiled


class PackedSteps:
    """As `NumpySteps`, which makes the first z; see `interior.Steps`."""

    def __init__(self, problem: SpeedProblem, c: Floats) -> None:
        self.problem = problem
        knots, joints = problem.basis.knots, len(problem.dq)
        blocks = -(-knots // LANES)
        self._room = blocks * LANES + 2
        self._size, self._blocks = knots + 2, np.uint64(blocks)
        self._all = np.ones(self._room)
        self._all[:self._size] = c
        self._step = np.zeros(self._room)
        self._inverse = np.ascontiguousarray(np.stack((1.0 / problem.limits.acceleration, 1.0 / problem.limits.jerk)))
        self._w = np.zeros((blocks, COMMON, LANES))
        self._v = np.zeros((blocks, joints, PER_JOINT, LANES))
        self._middle = np.zeros(LANES if problem.middle is None else blocks * joints * LANES)
        self._zc = self._rc = np.zeros(0)
        self._low, self._force = np.zeros((3, self._room)), np.zeros(self._room)
        self._scratch = np.empty((3, self._room))
        self._fill(self._w, 0, problem.basis.stencil.reshape(9, knots))
        self._fill(self._w, 9, np.stack((1.0 / problem.cap, problem.weight, *problem.tight)))
        self._fill(self._w, 13, np.zeros((1, knots)), pad=1.0)
        for j in range(joints):
            self._fill(self._v[:, j], 0, np.stack((problem.dq[j], problem.d2q[j], problem.d3q[j])))
            if problem.middle is not None:
                self._fill(self._middle.reshape(blocks, joints, LANES), j, problem.middle[j:j + 1])

    @property
    def c(self) -> Floats:
        """Coefficients (K + 2,)."""
        return self._all[:self._size]

    def _fill(self, into: Floats, field: int, rows: Floats, pad: float = 0.0) -> None:
        """Put rows (F, K) into fields from `field` on."""
        whole = np.full((len(rows), self._room - 2), pad)
        whole[:, :rows.shape[1]] = rows
        into[:, field:field + len(rows)] = whole.reshape(len(rows), -1, LANES).transpose(1, 0, 2)

    def _first(self, mu: float) -> None:
        """z = mu / slack everywhere."""
        slack = NumpySteps(self.problem, self.c).slacks()
        self._fill(self._w, 14, mu / slack[0][None], pad=mu)
        for j in range(len(self.problem.dq)):
            self._fill(self._v[:, j], 3, mu / np.stack([slack[i][j] for i in range(1, 5)]), pad=mu)
        self._zc, self._rc = mu / self.c, np.zeros(self._size)

    def multipliers(self) -> Multipliers:
        """See `interior.Steps`."""
        knots, joints = self.problem.basis.knots, len(self.problem.dq)
        z = self._v[:, :, 3:7].transpose(1, 2, 0, 3).reshape(joints, 4, -1)[:, :, :knots]
        return Multipliers(self._w[:, 14].reshape(-1)[:knots], z[:, 0] - z[:, 1], z[:, 2] - z[:, 3])

    def assemble(self, mu: float, primal: float, dual: float) -> tuple[float, float]:
        """See `interior.Steps`."""
        if not len(self._zc):
            self._first(mu)
        compiled(advance)(self._all, self._step, self._zc, self._rc, primal, dual)
        w, v = self._w.reshape(-1), self._v.reshape(-1)
        gap, time = compiled(assemble)(w, v, self._all, self._inverse, self._middle, self._blocks, mu, dual)
        gap += compiled(begin)(self._all, self._zc, mu, self._low, self._force)
        compiled(band)(w, self._blocks, self._low, self._force)
        return gap, time

    def direction(self, mu: float) -> tuple[float, float]:
        """See `interior.Steps`."""
        low, right = self._low[:, :self._size], self._force[:self._size]
        first, last = self.problem.basis.tied
        compiled(tie_ends)(low, right, first, last)
        here = slice(first - 1, self._size - last + 1)
        room = self._scratch[:, here]
        if not compiled(pentadiagonal)(low[:, here], right[here], room[0], room[1:]):
            return 0.0, 0.0
        ends = compiled(relative)(right, first, last, self._all, self._zc, mu, self._step, self._rc)
        w, v = self._w.reshape(-1), self._v.reshape(-1)
        inner = compiled(direction)(w, v, self._step, self._inverse, self._middle, self._blocks, mu)
        fall, loss = (max(pair) for pair in zip(ends, inner, strict=True))
        return (1.0 / fall if fall > 0.0 else np.inf, 1.0 / loss if loss > 0.0 else np.inf)
