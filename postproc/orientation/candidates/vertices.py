"""Rotary positions that aim a vertex of the polytope along a direction: closed form on a table that turns twice.

In positioned machining the joint rates are G v (see `machines.polytope`). The direction f meets a vertex
where every linear joint uses the same share of its limit, |G_j f| / l_j equal for all j (equation 6 of
Grandguillaume, Lavernhe, Tournier 2017 read row by row). Where G cannot be written as on such a table, Newton
steps from a grid find the positions.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.polytope import box_vertices, held_axis_rates
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_GRID = 24
"""seeds round each rotary joint"""
_STEPS = 30
_SAME = 1e-7
_STEP = 1e-6
_AGREES = 1e-9
"""largest difference of G from that of a table that turns twice"""
_CHECKED = np.array([[0.3, 0.7], [-0.8, 2.0], [1.9, -2.6]])
"""rad, where G is looked at"""


@dataclass(frozen=True)
@arrays(first="3", second="3", rates="3 3")
class TwoAxisTable:
    """A part that turns about two axes, the slides standing as ever: G = rates Rot(second, -t2) Rot(first, -t1).

    Attributes:
        first, second (3,): unit axes, the first nearest to the part, in the table frame at zero
        rates (3, 3): of the linear joints per rate of the tip at zero
        swapped: the second axis is the machine's first rotary joint
    """

    first: Floats
    second: Floats
    rates: Floats
    swapped: bool


def vertex_angles(kin: Kinematics, q: Floats, direction: Floats, limit: Floats) -> Floats:
    """Rotary positions (S, 2) in (-pi, pi], rad, at which `direction` (3,) meets a vertex; none where the machine has none.

    Args:
        q: (J,) joints there; its rotary entries do not matter
        limit: (J,) of joint rates, of any order
    """
    rotary = np.flatnonzero(kin.rotary)
    linear = np.flatnonzero(~np.array(kin.rotary))
    if len(rotary) != 2 or len(linear) != 3 or not kin.straight_slides:
        return np.zeros((0, 2))
    table = table_of(kin, q)
    if table is not None:
        return closed_form(table, direction, limit[linear])
    return numeric(kin, q, direction, limit) if _turns_twice(kin, q) else np.zeros((0, 2))


def table_of(kin: Kinematics, q: Floats) -> TwoAxisTable | None:
    """Where part and slides are related as on a table that turns twice, whatever its axes; None elsewhere."""
    for swapped in (False, True):
        order = -1 if swapped else 1
        rates = _linear_rates(kin, q, np.vstack([np.zeros(2), np.eye(2)[::order], _CHECKED[:, ::order]]))
        if not np.isfinite(rates).all() or abs(np.linalg.det(rates[0])) < _AGREES:
            return None
        first, second = (_axis_of(np.linalg.solve(rates[0], one)) for one in rates[1:3])
        if not np.isfinite([first, second]).all():
            return None
        found = [rates[0] @ rotation(second, -t2) @ rotation(first, -t1) for t1, t2 in _CHECKED]
        if np.abs(found - rates[3:]).max() < _AGREES:
            return TwoAxisTable(first, second, rates[0], swapped)
    return None


def _axis_of(turned: Floats) -> Floats:
    """(3,) about which a matrix turns by -1 rad; NaN where it does not."""
    skew = 0.5 * (turned.T - turned)
    axis = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / np.sin(1.0)
    return axis if abs(np.linalg.norm(axis) - 1.0) < _AGREES else np.full(3, np.nan)


def rotation(axis: Floats, angle: float) -> Floats:
    """(3, 3) about a unit axis (3,), by Rodrigues' formula."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew)


def _turns_twice(kin: Kinematics, q: Floats) -> bool:
    """Whether both rotary joints turn the slides against the part; where one or none does, no direction can be aimed at."""
    rates = _linear_rates(kin, q, np.array([[0.3, 0.7], [1.1, 0.7], [0.3, 1.5]]))
    return bool((np.abs(rates[1:] - rates[0]).max(axis=(1, 2)) > _AGREES).all())


def closed_form(table: TwoAxisTable, direction: Floats, limit: Floats) -> Floats:
    """Rotary positions (S, 2) of all eight vertices of the box `limit` (3,), at most 16 over a full turn.

    Rot(first, -t1) f = Rot(second, t2) u, u the unit vector of vertex over rates: the second subproblem of
    Paden (1986) and Kahan. On a table C on A it is equation 7 of the paper.
    """
    w1, w2 = table.first, table.second
    u = np.linalg.solve(table.rates, box_vertices(limit).T).T
    u = u / np.linalg.norm(u, axis=1, keepdims=True)
    f = np.broadcast_to(direction / np.linalg.norm(direction), u.shape)
    c, a, b = float(w1 @ w2), f @ w1, u @ w2
    if 1.0 - c * c < _AGREES:
        return np.zeros((0, 2))
    along = (np.outer(a - c * b, w1) + np.outer(b - c * a, w2)) / (1.0 - c * c)
    left = (1.0 - np.einsum("ij,ij->i", along, along)) / (1.0 - c * c)
    across = np.sqrt(np.maximum(left, 0.0))[:, None] * np.cross(w1, w2)
    met = left > -1e-12
    found = [np.column_stack((-_about(w1, f, along + side), _about(w2, u, along + side)))[met] for side in (across, -across)]
    angles = _distinct(np.concatenate(found))
    return angles[:, ::-1] if table.swapped else angles


def _about(axis: Floats, start: Floats, end: Floats) -> Floats:
    """Angles (N,) about a unit axis (3,) from vectors (N, 3) to others."""
    flat = np.einsum("ij,ij->i", start, end) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(np.cross(start, end) @ axis, flat))


def _linear_rates(kin: Kinematics, q: Floats, angles: Floats) -> Floats:
    """G (N, 3, 3) of the linear joints at rotary positions (N, 2)."""
    rotary, linear = np.flatnonzero(kin.rotary), np.flatnonzero(~np.array(kin.rotary))
    return held_axis_rates(kin, _turned(q, rotary, angles))[:, linear]


def numeric(kin: Kinematics, q: Floats, direction: Floats, limit: Floats) -> Floats:
    """Rotary positions (S, 2) of vertices by damped Newton steps from a grid, for any two rotary joints."""
    linear = np.flatnonzero(~np.array(kin.rotary))
    ring = (np.arange(_GRID) + 0.5) * 2.0 * np.pi / _GRID - np.pi
    at = np.stack(np.meshgrid(ring, ring, indexing="ij"), axis=-1).reshape(-1, 2)

    def apart(angles: Floats) -> Floats:
        """(N, 2): differences of the shares of the limits that the slides use."""
        rates = _linear_rates(kin, q, angles) @ direction
        share = np.abs(rates) / limit[linear] * limit[linear].min()
        return np.asarray(share[:, :2] - share[:, 1:])

    for _ in range(_STEPS):
        value = apart(at)
        slope = np.stack([(apart(at + h) - apart(at - h)) / (2.0 * _STEP) for h in _STEP * np.eye(2)], axis=2)
        step = np.einsum("nij,nj->ni", np.linalg.pinv(slope, rcond=1e-6), value)
        at = at - step * np.minimum(1.0, 0.3 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
    good: Bools = np.abs(apart(at)).max(axis=1) < 1e-10
    return _distinct(at[good])


def _turned(q: Floats, rotary: Ints, angles: Floats) -> Floats:
    """Joints (N, J): those of q (J,) with other rotary positions (N, 2)."""
    result = np.tile(q, (len(angles), 1))
    result[:, rotary] = angles
    return result


def _distinct(angles: Floats) -> Floats:
    """Each position once, as principal values."""
    kept = np.zeros((0, 2))
    for one in -(np.mod(-angles + np.pi, 2.0 * np.pi) - np.pi):
        off = np.abs(np.exp(1j * kept) - np.exp(1j * one)).max(axis=1, initial=0.0)
        if not bool((off < _SAME).any()):
            kept = np.vstack([kept, one])
    return kept
