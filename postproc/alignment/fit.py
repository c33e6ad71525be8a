"""The place of a part by least squares from points that were touched, with its uncertainty.

Unknown are a shift of the middle of the nominal points (mm) and a turn about it (rotation vector, rad), along and about the
axes of the table frame. That the part was meant to stand where it should counts as six readings more, of `MEANT`: what the
others do not determine stays so. Their weight moves nothing that is determined.
"""

from __future__ import annotations

import numpy as np

from machines.calibration.noise import Noise, noise_of
from machines.calibration.problem import CalibrationProblem, solve
from postproc.alignment.readings import Readings
from postproc.setup.model import Placement
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, lengths
from toolpaths.shapes import arrays
from toolpaths.units import DEG

NAMES = ("x", "y", "z", "a", "b", "c")
"""shift along and turn about x, y, z of the table"""
MEANT = np.array([50.0] * 3 + [30.0 * DEG] * 3)
"""mm and rad: standard deviations of where the part was meant to stand"""
KNOWN = 0.1
"""share of them, below which an unknown counts as determined"""


@dataclass(frozen=True, eq=False)
@arrays(values="6", covariance="6 6", determined="6", centre="3", off="N 3")
class Alignment:
    """The place that was found.

    Attributes:
        readings: what it rests on
        values, covariance: of the shift (mm) and the turn (rad)
        determined: which of them the readings determine
        centre: the point of the table frame that the shift and the turn are about, mm
        move: what takes the part from where it was meant to where it stands, in the table frame
        off (N, 3): mm that each reading is off the part as it is placed, along its direction
        noise: what is left of the readings against their stated noise; None where none is to spare
        converged: False where no place was found
    """

    readings: Readings
    values: Floats
    covariance: Floats
    determined: Bools
    centre: Floats
    move: Placement
    off: Floats
    noise: Noise | None
    converged: bool

    @property
    def sigma(self) -> Floats:
        """(6,) standard uncertainties, mm and rad; infinite where an unknown is not determined."""
        return np.where(self.determined, np.sqrt(np.diag(self.covariance)), np.inf)

    @property
    def worst(self) -> tuple[float, int]:
        """(mm that a reading is off at most, its line)."""
        size = lengths(self.off)
        k = int(size.argmax())
        return float(size[k]), self.readings.lines[k]

    @property
    def undetermined(self) -> list[str]:
        """Names of the unknowns that stay as they were meant, wholly or in part."""
        return [name for name, known in zip(NAMES, self.determined.tolist(), strict=True) if not known]

    def uncertainty(self, points: Floats) -> Floats:
        """(K,) standard uncertainty of the place of points (K, 3), mm, by what the readings determine."""
        arm, known = points - self.centre, np.where(np.outer(self.determined, self.determined), self.covariance, 0.0)
        turned = np.stack([cross(np.broadcast_to(e, arm.shape), arm) for e in np.eye(3)], axis=2)
        jacobian = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), turned], axis=2)
        return np.asarray(np.sqrt(np.einsum("kij,jl,kil->k", jacobian, known, jacobian)))


def aligned(readings: Readings) -> Alignment:
    """The place of the part that fits the readings best."""
    centre, sigma = readings.nominal.mean(axis=0), readings.sigma[readings.owner]
    result = solve(CalibrationProblem(
        NAMES, np.zeros(6), np.ones(6, dtype=bool), np.append(_observed(readings), np.zeros(6)), np.append(sigma, MEANT),
        lambda v: np.append(_predicted(readings, centre, v), v),
        lambda v: np.concatenate([_jacobian(readings, centre, v), np.eye(6)])))
    covariance, count = result.covariance / result.scale, len(sigma)
    share = np.diag(covariance) / MEANT**2
    noise = noise_of(result.residuals[:count] / sigma, round(float(6.0 - share.sum())))
    move, off = _move(centre, result.values), np.zeros((len(readings), 3))
    off[:] = readings.measured - move.points(readings.nominal)
    along = ~readings.whole
    normal = move.directions(readings.normal)[along]
    off[along] = (off[along] * normal).sum(axis=1)[:, None] * normal
    return Alignment(readings, result.values, covariance * (1.0 if noise is None else noise.scale), share < KNOWN**2, centre,
                     move, off, noise, result.converged)


def turn_matrix(vector: Floats) -> Floats:
    """(3, 3) of a rotation vector (3,), rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-300:
        return np.eye(3)
    k = _skew(vector / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k))


def _move(centre: Floats, values: Floats) -> Placement:
    rotation = turn_matrix(values[3:])
    return Placement(rotation, centre + values[:3] - rotation @ centre)


def _observed(readings: Readings) -> Floats:
    """(R,) measured coordinates of whole points; 0 for the distance of the others from their surface."""
    return np.concatenate([p if whole else np.zeros(1)
                           for p, whole in zip(readings.measured, readings.whole.tolist(), strict=True)])


def _predicted(readings: Readings, centre: Floats, values: Floats) -> Floats:
    move = _move(centre, values)
    at, normal = move.points(readings.nominal), move.directions(readings.normal)
    inside = ((at - readings.measured) * normal).sum(axis=1)
    return np.concatenate([p if whole else np.array([d]) for p, d, whole in zip(
        at, inside.tolist(), readings.whole.tolist(), strict=True)])


def _jacobian(readings: Readings, centre: Floats, values: Floats) -> Floats:
    """(R, 6) d predicted / d values: a small turn d moves a point r of the turned part by d x r, d by `_left`."""
    move = _move(centre, values)
    arm, normal = (readings.nominal - centre) @ move.rotation.T, move.directions(readings.normal)
    rows = []
    for r, n, m, whole in zip(arm, normal, readings.measured - centre - values[:3], readings.whole.tolist(), strict=True):
        if whole:
            rows.append(np.concatenate([np.eye(3), -_skew(r)], axis=1))
        else:
            rows.append(np.concatenate([n, np.cross(m, n)])[None])
    jacobian = np.concatenate(rows)
    jacobian[:, 3:] = jacobian[:, 3:] @ _left(values[3:])
    return np.asarray(jacobian)


def _skew(v: Floats) -> Floats:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _left(vector: Floats) -> Floats:
    """(3, 3) turn of the fixed frame per change of a rotation vector (3,): the left Jacobian of the rotations."""
    angle, k = float(np.linalg.norm(vector)), _skew(vector)
    if angle < 1e-6:
        return np.asarray(np.eye(3) + 0.5 * k)
    return np.asarray(np.eye(3) + (1.0 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * k @ k)
