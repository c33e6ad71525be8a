"""What a kinematics that gives only inverse and forward does not say itself: differences and samples, no proof.

Everything here takes `forward`, a function of joints (N, J) that gives (tip (N, 3), axis (N, 3)), mm and rad.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.columns import blocks
from machines.kinematics.taylor import TaylorVector
from toolpaths.arrays import Bools, Floats, Ints

Forward = Callable[[Floats], tuple[Floats, Floats]]
MM, RAD = 1e-2, 1e-4
"""steps of differences of linear and rotary joints; the error of the fourth order is then about that of the digits"""
INTERVALS = 8
"""of a straight move, between the places where it is looked at"""
SAFETY = 2.0
"""a third derivative counts as so many times the largest one seen"""
NEWTON_STEPS, CLOSED = 40, 1e-10
"""of `at_tip`; mm"""
ALONG_ITSELF = 1e-6
"""least singular value over the largest one, of rates in mm and 100 mm per rad: below it joints move, the tool does not"""
SCALE = 100.0
"""mm per rad"""


def rates(forward: Forward, q: Floats, rotary: tuple[bool, ...]) -> Floats:
    """d(tip, axis)/dq (N, 6, J) by central differences of the fourth order."""
    result = np.empty((len(q), 6, q.shape[1]))
    for j, turns in enumerate(rotary):
        h = RAD if turns else MM
        step = np.zeros(q.shape[1])
        step[j] = h
        one, two = (_pose(forward, q + k * step) - _pose(forward, q - k * step) for k in (1.0, 2.0))
        result[:, :, j] = (8.0 * one - two) / (12.0 * h)
    return result


def twists(rate: Floats, axis: Floats) -> Floats:
    """(v, omega) (N, 6, J) of rates (N, 6, J) at tool axes (N, 3); omega about the tool axis, which no pose
    shows, counts as none."""
    return np.concatenate([rate[:, :3], np.cross(axis[:, :, None], rate[:, 3:], axis=1)], axis=1)


def free(rate: Floats, rotary: tuple[bool, ...]) -> Bools:
    """True (N,) where some joints may move and the tool stands: rates (N, 6, J) of dependent columns."""
    if not any(rotary):
        return np.zeros(len(rate), dtype=np.bool_)
    scaled = rate * np.array([1.0, 1.0, 1.0, SCALE, SCALE, SCALE])[:, None] / np.where(rotary, SCALE, 1.0)
    values = np.linalg.svd(np.nan_to_num(scaled), compute_uv=False)
    return np.asarray(values[:, -1] < ALONG_ITSELF * values[:, 0])


def jets(forward: Forward, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
    """(tip, axis) along the straight moves q0 -> q1 (N, J).

    Value and derivatives in the middle by differences of fourth order; the third over the whole move is
    SAFETY times the largest third difference seen, which is no bound.
    """
    n = len(q0)
    value, first, second, third = np.empty((n, 6)), np.empty((n, 6)), np.empty((n, 6)), np.empty((n, 2))
    for part in blocks(n):
        value[part], first[part], second[part], third[part] = _derivatives(forward, q0[part], q1[part])
    tip, axis = (TaylorVector(list(value[:, k].T), list(first[:, k].T), list(second[:, k].T), third[:, i])
                 for i, k in enumerate((slice(0, 3), slice(3, 6))))
    return tip, axis


def _derivatives(forward: Forward, q0: Floats, q1: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """(value, first, second derivative (N, 6) in the middle, estimate (N, 2) of the third's size) of tip and axis."""
    shares = np.linspace(0.0, 1.0, INTERVALS + 1)
    return differences(np.stack([_pose(forward, q0 + t * (q1 - q0)) for t in shares]))


def differences(seen: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The same of poses (INTERVALS + 1, N, 6), or of any vectors (INTERVALS + 1, N, 3 G), evenly along the moves."""
    h, k = 1.0 / INTERVALS, INTERVALS // 2
    near, far = seen[k + 1] - seen[k - 1], seen[k + 2] - seen[k - 2]
    first = (8.0 * near - far) / (12.0 * h)
    near, far = seen[k + 1] + seen[k - 1] - 2.0 * seen[k], seen[k + 2] + seen[k - 2] - 2.0 * seen[k]
    second = (16.0 * near - far) / (12.0 * h * h)
    step = np.diff(seen, n=3, axis=0) / h**3
    sizes = np.linalg.norm(step.reshape(*step.shape[:2], step.shape[2] // 3, 3), axis=3).max(axis=0)
    return seen[k], first, second, SAFETY * sizes


def at_tip(forward: Forward, jacobian: Callable[[Floats], Floats], tip: Floats, q: Floats,
           solved: Ints) -> Floats:
    """q (N, J) with the joints `solved` (3,) such that the tip (N, 3) is there: Newton from q; NaN where it
    does not come there."""
    result = np.array(q, dtype=np.float64)
    live = np.flatnonzero(np.isfinite(result).all(axis=1) & np.isfinite(tip).all(axis=1))
    closed = np.zeros(len(q), dtype=np.bool_)
    for _ in range(NEWTON_STEPS):
        if not len(live):
            break
        here, _ = forward(result[live])
        gap = tip[live] - here
        done = np.linalg.norm(gap, axis=1) <= CLOSED * np.maximum(1.0, np.abs(tip[live]).max(axis=1))
        closed[live[done]] = True
        live, gap = live[~done], gap[~done]
        columns = jacobian(result[live])[:, :3][:, :, solved]
        good = np.isfinite(gap).all(axis=1) & np.isfinite(columns).all(axis=(1, 2))
        live, gap, columns = live[good], gap[good], columns[good]
        result[np.ix_(live, solved)] += np.einsum("nij,nj->ni", np.linalg.pinv(columns), gap)
    result[~closed] = np.nan
    return result


def _pose(forward: Forward, q: Floats) -> Floats:
    return np.concatenate(forward(q), axis=1)


Followed = Callable[[Floats, Floats, Ints], Floats]
"""tool axis (N, 3) at tips (N, 3), from joints (N, J) of which those named are solved for"""


def axis_jet(followed: Followed, q0: Floats, q1: Floats, tip0: Floats, tip1: Floats,
             solved: Ints) -> TaylorVector:
    """The tool axis along moves of straight tips tip0 -> tip1 (N, 3), joints that are not `solved` even from q0 to q1.

    The third derivative is what was seen, as in `jets`.
    """
    shares = np.linspace(0.0, 1.0, INTERVALS + 1)
    seen = np.stack([followed(tip0 + t * (tip1 - tip0), q0 + t * (q1 - q0), solved) for t in shares])
    value, first, second, third = differences(seen)
    return TaylorVector(list(value.T), list(first.T), list(second.T), third[:, 0])
