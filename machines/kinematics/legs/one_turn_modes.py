"""All real assembly modes of a platform on four rods that moves by three translations and a turn about a fixed axis.

Written for a turn about x; of others x, y, z are taken in cyclic order. For a given turn the platform's reference
point C lies on four spheres around e_k = A_k - Rx(theta) b_k. The differences of the sphere equations are linear in C,
M(theta) C = r(theta); with C = adj(M) r / det M put into the first sphere, |adj(M) r - det M e_1|^2 - (l_1 det M)^2 = 0 is a
trigonometric polynomial in theta. Its coefficients come from equally spaced samples, its roots from the eigenvalues of the
companion matrix in w = exp(i theta); real turns are the roots on the unit circle.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from machines.kinematics.sliders import three_spheres
from toolpaths.arrays import Floats

Complex = npt.NDArray[np.complex128]

SAMPLES = 32
"""tilts at which the polynomial is sampled: more than twice its highest degree, 8"""
NEGLIGIBLE = 1e-11
"""coefficients below this part of the largest are round-off"""
CIRCLE = 1e-3
"""roots of modulus within this of 1 may be real tilts (a double root is found to half the digits only)"""


def candidates(feet: Floats, joints: Floats, lengths: Floats) -> Floats:
    """Starting points (M, N, 4) of (C, theta), NaN where there is none, for a Newton iteration.

    Args:
        feet: A (N, 4, 3) mm
        joints: b (4, 3) mm
        lengths: l (N, 4) mm
    """
    tilt = _real_tilts(_coefficients(feet, joints, lengths))
    count, n = tilt.shape
    every, spans = np.tile(feet, (count, 1, 1)), np.tile(lengths, (count, 1))
    found = [_points(every, joints, spans, tilt.ravel(), legs) for legs in ((0, 1, 2), (0, 2, 3))]
    return np.stack(found).reshape(2, 2, count, n, 4).transpose(2, 0, 1, 3, 4).reshape(-1, n, 4)


def _centres(feet: Floats, joints: Floats, tilt: Floats) -> Floats:
    """Sphere centres e (N, S, 4, 3) at tilts (N, S) or (1, S)."""
    c, s = np.cos(tilt)[..., None], np.sin(tilt)[..., None]
    x, y, z = joints.T
    turned = np.stack([np.broadcast_to(x, (*tilt.shape, 4)), c * y - s * z, s * y + c * z], axis=-1)
    result: Floats = feet[:, None] - turned
    return result


def _coefficients(feet: Floats, joints: Floats, lengths: Floats) -> Complex:
    """Coefficients (N, 2K+1) of the polynomial in w of degree 2K, highest power first."""
    scale = float(np.nanmax(lengths, initial=1.0))
    tilt = np.linspace(0.0, 2.0 * np.pi, SAMPLES, endpoint=False)
    e = _centres(feet, joints, tilt[None]) / scale
    rows = e[:, :, 1:] - e[:, :, :1]
    power = np.sum(e * e, axis=-1) - (lengths / scale)[:, None] ** 2
    right = 0.5 * (power[:, :, 1:] - power[:, :, :1])
    a, b, c = rows[:, :, 0], rows[:, :, 1], rows[:, :, 2]
    sides = (np.cross(b, c), np.cross(c, a), np.cross(a, b))
    det = np.sum(a * sides[0], axis=-1)
    top = sum(side * right[:, :, k, None] for k, side in enumerate(sides))
    value = np.sum((top - det[..., None] * e[:, :, 0]) ** 2, axis=-1) - (lengths[:, :1] / scale * det) ** 2
    spectrum = np.fft.fft(value, axis=1) / SAMPLES
    size = np.abs(spectrum[:, : SAMPLES // 2])
    degree = int(np.max(np.flatnonzero((size > NEGLIGIBLE * size.max(axis=1, keepdims=True)).any(axis=0)), initial=1))
    powers = np.arange(degree, -degree - 1, -1)
    result: Complex = spectrum[:, powers]
    return result


def _real_tilts(coefficients: Complex) -> Floats:
    """Tilts (2K, N) rad of the roots on the unit circle, NaN for the others."""
    n, width = coefficients.shape
    companion = np.zeros((n, width - 1, width - 1), dtype=np.complex128)
    companion[:, 1:, :-1] = np.eye(width - 2)
    lead = coefficients[:, :1]
    companion[:, 0, :] = -coefficients[:, 1:] / np.where(np.abs(lead) > 0.0, lead, 1e-300)
    roots = np.linalg.eigvals(np.nan_to_num(companion)).T
    result: Floats = np.where(np.abs(np.abs(roots) - 1.0) < CIRCLE, np.angle(roots), np.nan)
    return result


def _points(feet: Floats, joints: Floats, lengths: Floats, tilt: Floats,
            legs: tuple[int, int, int]) -> Floats:
    """Both meeting points (2, N, 4) of three of the spheres at tilts (N,), with the tilt; on a near miss their foot."""
    e = _centres(feet, joints, tilt[:, None])[:, 0]
    foot, out = three_spheres(e[:, legs], lengths[:, legs])
    out = np.nan_to_num(out)
    points = np.stack([foot + out, foot - out])
    return np.concatenate([points, np.broadcast_to(tilt[:, None], (2, len(tilt), 1))], axis=2)
