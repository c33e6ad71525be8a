"""Rotary positions that aim a vertex of the polytope along a direction: closed form on a table C on A, else by Newton steps.

In positioned machining the joint rates are G v (see `machines.polytope`). The direction f meets a vertex where every
linear joint uses the same share of its limit, |G_j f| / l_j equal for all j (equation 6 of Grandguillaume, Lavernhe,
Tournier 2017 read row by row).
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.polytope import aim_table_ac, box_vertices, held_axis_rates
from toolpaths.arrays import Bools, Floats, Ints

_GRID = 24
"""seeds round each rotary joint"""
_STEPS = 30
_SAME = 1e-7
_STEP = 1e-6


def vertex_angles(kin: Kinematics, q: Floats, direction: Floats, limit: Floats) -> Floats:
    """Rotary positions (S, 2) in (-pi, pi], rad, at which `direction` (3,) meets a vertex; none where the machine has none.

    Args:
        q: (J,) joints there; its rotary entries do not matter
        limit: (J,) of joint rates, of any order
    """
    rotary = np.flatnonzero(kin.rotary)
    linear = np.flatnonzero(~np.array(kin.rotary))
    if len(rotary) != 2 or len(linear) != 3 or not kin.slides_affine:
        return np.zeros((0, 2))
    if is_table_ac(kin, q):
        return closed_form(direction, limit[linear])
    return numeric(kin, q, direction, limit)


def closed_form(direction: Floats, limit: Floats) -> Floats:
    """(A, C) (S, 2) of all eight vertices of the box `limit` (3,): at most 16 over a full turn of A."""
    found = [aim_table_ac(direction, vertex) for vertex in box_vertices(limit)]
    return _distinct(np.concatenate(found))


def is_table_ac(kin: Kinematics, q: Floats) -> bool:
    """True where slides and tip are related by Rz(C) Rx(A) (equation 7), rotary joints in the order A, C."""
    rotary, linear = np.flatnonzero(kin.rotary), np.flatnonzero(~np.array(kin.rotary))
    angles = np.array([[0.3, 0.7], [-0.8, 2.0]])
    found = held_axis_rates(kin, _turned(q, rotary, angles))[:, linear]
    (ca, cc), (sa, sc), zero = np.cos(angles).T, np.sin(angles).T, np.zeros(2)
    turn = np.array([[cc, -ca * sc, sa * sc], [sc, ca * cc, -sa * cc], [zero, sa, ca]])
    return bool(np.abs(found - turn.transpose(2, 1, 0)).max() < 1e-9)


def numeric(kin: Kinematics, q: Floats, direction: Floats, limit: Floats) -> Floats:
    """Rotary positions (S, 2) of vertices by damped Newton steps from a grid, for any two rotary joints."""
    rotary, linear = np.flatnonzero(kin.rotary), np.flatnonzero(~np.array(kin.rotary))
    ring = (np.arange(_GRID) + 0.5) * 2.0 * np.pi / _GRID - np.pi
    at = np.stack(np.meshgrid(ring, ring, indexing="ij"), axis=-1).reshape(-1, 2)

    def apart(angles: Floats) -> Floats:
        """(N, 2): differences of the shares of the limits that the slides use."""
        rates = held_axis_rates(kin, _turned(q, rotary, angles))[:, linear] @ direction
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
