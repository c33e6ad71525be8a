"""What the joints allow at the tip: polytopes of velocity, acceleration and jerk.

In positioned (3+2) machining the rotary joints stand and the tool axis is kept, so that joint rates follow
the tip's linearly, dq = G v, and each limit |dq_j| <= l_j is a pair of half-spaces of the tip's rate v
(Grandguillaume, Lavernhe, Tournier 2017, equations 1, 2 and 6). The same G serves velocity, acceleration and jerk.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_SMALL = 1e-12
_HELD = 1e-9
"""largest change of the axis, rad per mm, that counts as none"""


@dataclass(frozen=True)
@arrays(normals="N H 3", offsets="N H", joint="H")
class Polytope:
    """Rates v of the tip with `normals @ v <= offsets` at N poses: the image of a box of joint rates, the axis kept.

    Attributes:
        normals (N, H, 3), offsets (N, H): half-spaces; row h and row h + H/2 bound the joint joint[h] from both sides
        joint (H,): the joint that each half-space belongs to
    """

    normals: Floats
    offsets: Floats
    joint: Ints

    def __len__(self) -> int:
        return len(self.normals)

    def reach(self, direction: Floats) -> Floats:
        """Largest rate (N,) along directions (N, 3) or (3,) of unit length; NaN where the pose has no polytope."""
        reach: Floats = self._reach(direction).min(axis=1)
        return reach

    def binding(self, direction: Floats) -> Ints:
        """The joint (N,) that ends the reach along the directions; -1 where the pose has no polytope."""
        reach = self._reach(direction)
        joint: Ints = self.joint[np.nan_to_num(reach, nan=np.inf).argmin(axis=1)]
        return np.where(np.isnan(reach).any(axis=1), -1, joint)

    def _reach(self, direction: Floats) -> Floats:
        along = np.einsum("nhi,ni->nh", self.normals, np.broadcast_to(direction, (len(self), 3)))
        free = along <= _SMALL * np.linalg.norm(self.normals, axis=2)
        result: Floats = np.where(free, np.inf, self.offsets / np.where(free, 1.0, along))
        result[np.isnan(along)] = np.nan
        return result

    def vertices(self, at: int = 0) -> Floats:
        """Corners (V, 3) of the polytope of pose `at`, in no set order.

        Raises:
            ValueError: where the pose has no polytope, or it is flat or unbounded.
        """
        from scipy.spatial import HalfspaceIntersection, QhullError

        normals, offsets = self.normals[at], self.offsets[at]
        if not np.isfinite(normals).all() or np.linalg.matrix_rank(normals) < 3:
            raise ValueError("no bounded polytope at this pose")
        normals = _distinct(normals / offsets[:, None])  # drives that bound the same: such planes meet anywhere
        offsets = np.ones(len(normals))
        scale = offsets.min() / np.linalg.norm(normals, axis=1).max()
        try:
            found = HalfspaceIntersection(np.column_stack([normals * scale, -offsets]), np.zeros(3)).intersections
        except QhullError as fault:
            raise ValueError(f"the half-spaces cannot be intersected: {fault}") from fault
        return _distinct(found * scale)


def _distinct(points: Floats) -> Floats:
    """Points (V, 3) without those that repeat another within 1e-9 of the largest."""
    grain = 1e-9 * np.abs(points).max()
    _, first = np.unique(np.round(points / grain).astype(np.int64), axis=0, return_index=True)
    kept: list[Floats] = []
    for point in points[first]:
        if all(np.abs(point - other).max() >= 4.0 * grain for other in kept):
            kept.append(point)
    return np.array(kept)


def held_axis_rates(kin: Kinematics, q: Floats, near: Floats | None = None) -> Floats:
    """G (N, J, 3): joint rates per rate of the tip, the tool axis kept and joints at rest that are not to move the tip.

    NaN where the others cannot move the tip in every direction without turning the axis.
    """
    linear = np.flatnonzero(kin.drives_tip)
    jacobian = kin.jacobian(q, near)[:, :, linear]
    good: Bools = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(q).all(axis=1))
    result = np.full((len(q), kin.joints, 3), np.nan)
    inverse = np.linalg.pinv(np.where(good[:, None, None], jacobian, 0.0), rcond=1e-10)[:, :, :3]
    made = jacobian @ inverse
    good &= np.abs(np.nan_to_num(made) - np.vstack([np.eye(3), np.zeros((3, 3))])).max(axis=(1, 2)) < _HELD
    rows = np.flatnonzero(good)
    result[rows] = 0.0
    result[np.ix_(rows, linear)] = inverse[rows]
    return result


def held_axis_polytope(kin: Kinematics, q: Floats, limit: Floats, near: Floats | None = None) -> Polytope:
    """Polytope of tip rates at joints q (N, J) under joint rates within +-`limit` (J,), the axis kept (equations 1, 2).

    `limit` in mm and rad per s, s2 or s3; infinite entries bound nothing.
    """
    rates = held_axis_rates(kin, q, near)
    joints = np.flatnonzero(np.isfinite(limit) & np.array(kin.drives_tip))
    normals = np.concatenate([rates[:, joints], -rates[:, joints]], axis=1)
    offsets = np.tile(np.concatenate([limit[joints], limit[joints]]), (len(q), 1))
    return Polytope(normals, offsets, np.concatenate([joints, joints]))


def box_vertices(limit: Floats) -> Floats:
    """The 2^J corners (2^J, J) of the box |q_j| <= limit_j."""
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * len(limit), indexing="ij")).reshape(len(limit), -1).T
    return np.asarray(signs * limit)
