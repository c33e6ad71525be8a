"""Tips along other axes that touch the surface where they did: ball, corner of a toroid, edge of a flat end.

The corner of a cutter is a tube of radius r round a circle of radius R about its axis a, its centre r above the tip. Where
the surface has the normal n, the centre of the tube next to the contact is

    Q = tip + r a + R e,   e = -(n - (n . a) a) / |n - (n . a) a|,   and the contact  P = Q - r n,

so that the tip along another axis a' is tip + r (a - a') + R (e - e'). A ball has R = 0 and needs no normal; a flat end
has r = 0. Square to the surface (a = n) a flat touches with no one point, and along it (a . n = 0) the flank begins.
"""

from __future__ import annotations

import numpy as np

from postproc.reference.cutter import CutterEnd
from toolpaths.arrays import Floats


def kept_tip(tip: Floats, axis: Floats, turned: Floats, end: CutterEnd, normal: Floats) -> Floats:
    """(N, 3) tips along axes `turned` (N, 3) that touch where `tip`, `axis` (N, 3) do; `normal` (N, 3) of the surface."""
    return np.asarray(tip + corner_centre(axis, end, normal) - corner_centre(turned, end, normal))


def corner_centre(axis: Floats, end: CutterEnd, normal: Floats) -> Floats:
    """(N, 3) mm from the tip to the centre of the corner next to the contact: Q - tip; of a ball, to its centre."""
    centre = end.corner * axis
    if end.flat == 0.0:
        return np.asarray(centre)
    across = np.einsum("ni,ni->n", normal, axis)[:, None] * axis - normal
    return np.asarray(centre + end.flat * across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12))


def bend(axis: Floats, end: CutterEnd, normal: Floats) -> Floats:
    """(N - 1, 3) mm by which the corner's centre is off its chord in the middle between two of N poses.

    The tip goes straight there while the axis turns evenly, and the normal with it.
    """
    return _bend(axis[:-1], axis[1:], end, normal[:-1], normal[1:])


def bend_slopes(axis: Floats, end: CutterEnd, normal: Floats, step: float) -> tuple[Floats, Floats]:
    """(N - 1, 3, 3) each: derivatives of `bend` by the axis of the pose before and of the one behind, by differences."""
    a, b, n, m = axis[:-1], axis[1:], normal[:-1], normal[1:]
    before, behind = np.zeros((len(a), 3, 3)), np.zeros((len(a), 3, 3))
    for k, nudge in enumerate(step * np.eye(3)):
        before[:, :, k] = (_bend(a + nudge, b, end, n, m) - _bend(a - nudge, b, end, n, m)) / (2.0 * step)
        behind[:, :, k] = (_bend(a, b + nudge, end, n, m) - _bend(a, b - nudge, end, n, m)) / (2.0 * step)
    return before, behind


def _bend(a: Floats, b: Floats, end: CutterEnd, n: Floats, m: Floats) -> Floats:
    """Of poses with axes a, b and normals n, m (N, 3)."""
    middle = corner_centre(_half(a, b), end, _half(n, m) if end.flat else n)
    return np.asarray(middle - 0.5 * (corner_centre(a, end, n) + corner_centre(b, end, m)))


def _half(a: Floats, b: Floats) -> Floats:
    """(N, 3) unit directions half between unit directions."""
    both = a + b
    return np.asarray(both / np.linalg.norm(both, axis=1, keepdims=True))
