"""Small displacements as homogeneous transforms and as transport matrices.

A torsor is (dx, dy, dz, ex, ey, ez): a displacement of a frame in mm and rad, along and about its own x, y, z. Two
orders of its three turns are in use, both after the displacement: x y z for errors of axes and of mounting (C
1.12 to 1.18) and z y x for placing one frame in another (C 1.2, 1.10 with entry (1, 2) as cos c sin a sin b - cos a sin c).
Source: Oueslati, calibration of rotary axes (2004), "C" below.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from toolpaths.arrays import Floats

Order = Literal["xyz", "zyx"]
_ELEMENTARY = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


def turns(angles: Floats, order: Order = "xyz") -> Floats:
    """Rotation matrices (N, 3, 3) of turns `angles` (N, 3) rad about x, y, z, composed left to right in `order`."""
    result = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for letter in order:
        result = result @ _elementary(letter, angles[:, "xyz".index(letter)])
    return np.array(result)


def _elementary(letter: str, angle: Floats) -> Floats:
    """Rot(i, a), Rot(j, b), Rot(k, c) of C 1.7 to 1.9, (N, 3, 3)."""
    j, k = _ELEMENTARY[letter]
    result = np.tile(np.eye(3), (len(angle), 1, 1))
    c, s = np.cos(angle), np.sin(angle)
    result[:, j, j], result[:, k, k], result[:, j, k], result[:, k, j] = c, c, -s, s
    return result


def homogeneous(torsor: Floats, order: Order = "xyz") -> Floats:
    """Exact transforms (N, 4, 4) of torsors (N, 6): displaced, then turned (C 1.1, 1.2 or 1.12)."""
    result = np.zeros((len(torsor), 4, 4))
    result[:, :3, :3] = turns(torsor[:, 3:], order)
    result[:, :3, 3] = torsor[:, :3]
    result[:, 3, 3] = 1.0
    return result


def inverse(transform: Floats) -> Floats:
    """Inverse (N, 4, 4) of rigid transforms (N, 4, 4)."""
    result = np.array(transform, dtype=np.float64)
    turned = np.swapaxes(transform[:, :3, :3], 1, 2)
    result[:, :3, :3] = turned
    result[:, :3, 3] = -np.einsum("nij,nj->ni", turned, transform[:, :3, 3])
    return result


def carried(turned: Floats, arm: Floats) -> Floats:
    """Matrices (N, 6, 6): the displacement, in the axes of the base, of a point at `arm` from a frame's origin.

    C 1.25 turned back into the base (C 1.24, 1.26): dp = R d + (R e) x arm, turn = R e.

    Args:
        turned: (N, 3, 3) frame to base
        arm: (N, 3) mm, from the frame's origin to the point, in the base
    """
    result = np.zeros((len(arm), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = turned
    result[:, :3, 3:] = -cross_matrix(arm) @ turned
    return result


def cross_matrix(v: Floats) -> Floats:
    """[v x] (N, 3, 3) of vectors (N, 3)."""
    result = np.zeros((len(v), 3, 3))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        result[:, k, j], result[:, j, k] = v[:, i], -v[:, i]
    return result
