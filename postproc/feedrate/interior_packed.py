"""One linearisation of `interior.py` on compiled loops: values packed for `kernels/interior.py`."""

from __future__ import annotations

import numpy as np

from postproc.feedrate.interior import Multipliers
from postproc.feedrate.kernels.coefficients import advance, begin, relative, tie_ends
from postproc.feedrate.kernels.interior import COMMON, HERE, LANES, PER_JOINT, assemble, direction, pentadiagonal
from postproc.feedrate.kernels.packing import begin_multipliers, pack
from postproc.feedrate.problem import SpeedProblem
from toolpaths.arrays import Floats
from toolpaths.compiled import compiled


class PackedSteps:
    """As `NumpySteps`; see `interior.NewtonSteps`."""

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
        self._middle = _by_block(problem.middle, blocks)
        self._here = np.zeros(HERE * LANES)
        self._zc = self._rc = np.zeros(0)
        self._low, self._force = np.zeros((3, self._room)), np.zeros(self._room)
        self._scratch = np.empty((3, self._room))
        common = np.stack((1.0 / problem.cap, problem.weight, *problem.tight))
        compiled(pack)(self._w, self._v, problem.basis.stencil.reshape(9, knots), common,
                       problem.dq, problem.d2q, problem.d3q)

    @property
    def c(self) -> Floats:
        """Coefficients (K + 2,)."""
        return self._all[:self._size]

    def multipliers(self) -> Multipliers:
        """See `interior.NewtonSteps`."""
        knots, joints = self.problem.basis.knots, len(self.problem.dq)
        z = self._v[:, :, 3:7].transpose(1, 2, 0, 3).reshape(joints, 4, -1)[:, :, :knots]
        return Multipliers(self._w[:, 14].reshape(-1)[:knots], z[:, 0] - z[:, 1], z[:, 2] - z[:, 3])

    def assemble(self, mu: float, primal: float, dual: float) -> tuple[float, float]:
        """See `interior.NewtonSteps`."""
        if not len(self._zc):
            compiled(begin_multipliers)(self._w, self._v, self._all, self._inverse, self._middle, mu)
            self._zc, self._rc = mu / self.c, np.zeros(self._size)
        compiled(advance)(self._all, self._step, self._zc, self._rc, primal, dual)
        w, v = self._w.reshape(-1), self._v.reshape(-1)
        ends = compiled(begin)(self._all, self._zc, mu, self._low, self._force)
        gap, time = compiled(assemble)(w, v, self._here, self._all, self._inverse, self._middle, self._blocks, mu,
                                       dual, self._low, self._force)
        return gap + ends, time

    def direction(self, mu: float) -> tuple[float, float]:
        """See `interior.NewtonSteps`."""
        low, right = self._low[:, :self._size], self._force[:self._size]
        first, last = self.problem.basis.tied
        compiled(tie_ends)(low, right, first, last)
        here = slice(first - 1, self._size - last + 1)
        room = self._scratch[:, here]
        if not compiled(pentadiagonal)(low[:, here], right[here], room[0], room[1:]):
            return 0.0, 0.0
        ends = compiled(relative)(right, first, last, self._all, self._zc, mu, self._step, self._rc)
        w, v = self._w.reshape(-1), self._v.reshape(-1)
        inner = compiled(direction)(w, v, self._here, self._step, self._inverse, self._middle, self._blocks, mu)
        fall, loss = (max(pair) for pair in zip(ends, inner, strict=True))
        return (1.0 / fall if fall > 0.0 else np.inf, 1.0 / loss if loss > 0.0 else np.inf)


def _by_block(middle: Floats | None, blocks: int) -> Floats:
    """Middles (J, K) of the acceleration rows by block, joint and lane, (B J LANES,); without any, one block of zeros for all."""
    if middle is None:
        return np.zeros(LANES)
    padded = np.zeros((len(middle), blocks * LANES))
    padded[:, :middle.shape[1]] = middle
    return padded.reshape(len(middle), blocks, LANES).transpose(1, 0, 2).reshape(-1)
