"""Signed distance to a body of revolution, and planes that part it from what lies next to it.

A piece is a frustum of a cone about the tool axis, rounded by a ball: (r0, z0, r1, z1, c), radius r0 at
height z0 and r1 at z1 >= z0 over the tip, all grown by c. Cylinder, cone, disc (z0 = z1), torus bottom (disc
with c), ball (r0 = r1 = 0, z0 = z1) are such pieces; each is convex.

The signed distance of a convex body is the largest of n . p - h(n) over all unit directions n, with its
support function h (Rockafellar, Convex Analysis, section 13; inside as well as outside): every n gives a
lower bound, and the n that is the body's normal at the point nearest to p gives the distance itself.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats


def signed(piece: Floats, rho: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
    """Distance (N,) mm of points from the piece, negative inside, and the normal there: its radial and axial part.

    Args:
        piece: (5,)
        rho, z: (N,) distance from the axis and height over the tip, mm
    """
    r0, z0, r1, z1, c = piece.tolist()
    slope, rise = r1 - r0, z1 - z0
    length = float(np.hypot(slope, rise))
    dr, dz = (slope / length, rise / length) if length > 0.0 else (0.0, 1.0)
    along = np.clip((rho - r0) * dr + (z - z0) * dz, 0.0, length)
    near = [(np.minimum(rho, r0), np.full_like(z, z0)), (np.minimum(rho, r1), np.full_like(z, z1)),
            (r0 + along * dr, z0 + along * dz)]
    away = [np.hypot(rho - at_r, z - at_z) for at_r, at_z in near]
    nearest = np.argmin(away, axis=0)
    distance = np.choose(nearest, away)
    outside = ~_inside((rho, z), piece, (dr, dz)) & (distance > 0.0)
    scale = np.where(outside, distance, 1.0)
    radial = (rho - np.choose(nearest, [at[0] for at in near])) / scale
    axial = (z - np.choose(nearest, [at[1] for at in near])) / scale
    faces = np.stack((z0 - z, z - z1, (rho - r0) * dz - (z - z0) * dr))
    face = faces.argmax(axis=0)
    radial = np.where(outside, radial, np.array([0.0, 0.0, dz])[face])
    axial = np.where(outside, axial, np.array([-1.0, 1.0, -dr])[face])
    return np.where(outside, distance, faces.max(axis=0)) - c, radial, axial


def _inside(at: tuple[Floats, Floats], piece: Floats, along: tuple[float, float]) -> Bools:
    """(N,) True within bottom, top and side of the frustum."""
    (rho, z), (r0, z0, _, z1, _) = at, piece.tolist()
    return np.asarray((z >= z0) & (z <= z1) & ((rho - r0) * along[1] - (z - z0) * along[0] <= 0.0))


def support(piece: Floats, axial: Floats) -> Floats:
    """h (N,) mm of unit directions by their axial part (N,): how far the piece reaches there from the tip."""
    r0, z0, r1, z1, c = piece.tolist()
    radial = np.sqrt(np.maximum(1.0 - axial**2, 0.0))
    return np.asarray(np.maximum(radial * r0 + axial * z0, radial * r1 + axial * z1) + c)


def around(piece: Floats, offset: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """(distance (N,), unit normal (N, 3)) of points at `offset` (N, 3) from the tip of a tool along `axis` (N, 3)."""
    z = np.einsum("ni,ni->n", offset, axis)
    across = offset - z[:, None] * axis
    rho = np.linalg.norm(across, axis=1)
    distance, radial, axial = signed(piece, rho, z)
    unit = np.where(rho[:, None] > 0.0, across / np.where(rho > 0.0, rho, 1.0)[:, None], 0.0)
    return distance, radial[:, None] * unit + axial[:, None] * axis


def lever(piece: Floats) -> float:
    """mm by which the piece moves at most where its axis turns about the tip by one unit of chord."""
    r0, z0, r1, z1, _ = piece.tolist()
    return float(max(np.hypot(r0, z0), np.hypot(r1, z1)))


def bend(piece: Floats) -> float:
    """mm: largest r + |z| of the corners, which bounds how their reach along a direction curves as the axis turns."""
    r0, z0, r1, z1, _ = piece.tolist()
    return float(max(r0 + abs(z0), r1 + abs(z1)))


def middle(piece: Floats) -> float:
    """Height of the piece's middle over the tip, mm."""
    return float(0.5 * (piece[1] + piece[3]))


def raised(piece: Floats, height: float) -> Floats:
    """The piece (5,) as seen from a point `height` mm over the tip."""
    return np.asarray(piece - np.array([0.0, height, 0.0, height, 0.0]))
