"""Where a cutter touches the surface: its normal there and the feed, and how a tool axis stands to both."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.smoothing.tangents import rates

_ALONG = 1e-3
"""sine of the angle between feed and normal below which the feed gives the lead no plane"""
_MANY = 4_000_000
"""pairs of point and axis that are looked at at a time"""


@dataclass(frozen=True)
@arrays(normal="K 3", travel="K 3", line="K")
class Contact:
    """Points of a pass where the surface is known, one row for each direction of feed: K rows in the table frame.

    Attributes:
        normal (K, 3): unit surface normal, out of the material
        travel (K, 3): unit direction of the feed in the tangent plane, NaN where the tool feeds along the normal
        line (K,): of the CL file
        unknown: places that were looked at and have no normal
    """

    normal: Floats
    travel: Floats
    line: Ints
    unknown: int = 0

    def __len__(self) -> int:
        return len(self.line)

    @staticmethod
    def none() -> Contact:
        """No point is known."""
        return Contact(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=np.int64))

    def turned(self, rotation: Floats) -> Contact:
        """The same in a frame turned by `rotation` (3, 3)."""
        return Contact(self.normal @ rotation.T, self.travel @ rotation.T, self.line, self.unknown)

    def inclination(self, axes: Floats) -> Floats:
        """Angle (M, K) rad between unit axes (M, 3) and the normals; of a ball of radius R the contact is R
        sin of it away from the tool axis."""
        return np.asarray(np.arccos(np.clip(axes @ self.normal.T, -1.0, 1.0)))

    def lead(self, axes: Floats) -> Floats:
        """Lead (M, K) rad of unit axes (M, 3): in the plane of feed and normal, positive towards the feed;
        NaN without a feed direction."""
        return np.asarray(np.arctan2(axes @ self.travel.T, axes @ self.normal.T))

    def tilt(self, axes: Floats) -> Floats:
        """Tilt (M, K) rad of unit axes (M, 3): in the plane square to the feed, positive to its right; NaN likewise."""
        return np.asarray(np.arctan2(axes @ self.right.T, axes @ self.normal.T))

    @cached_property
    def right(self) -> Floats:
        """(K, 3) unit directions to the right of the feed, the normal upwards; NaN likewise."""
        return np.cross(self.travel, self.normal)

    def parts(self, axes: int) -> int:
        """Axes to look at at a time, of so many."""
        return max(1, min(axes, _MANY // max(1, len(self))))


def contact_of(curves: Curves, normal: Floats, line: Ints) -> Contact:
    """The contact at both ends of N cutting moves: unit normals (N, 2, 3), NaN where none is known, and CL lines (N, 2)."""
    begin, end = (each[:, :3] for each in rates(curves, 0.0))
    normal0, line = normal.reshape(-1, 3), line.reshape(-1)
    travel = np.stack((begin, end), axis=1).reshape(-1, 3)
    known = np.isfinite(normal0).all(axis=1) & (np.abs(travel).max(axis=1, initial=0.0) > 0.0)
    normal, travel = normal0[known], travel[known]
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    across = travel - np.einsum("ni,ni->n", travel, normal)[:, None] * normal
    size = np.linalg.norm(across, axis=1, keepdims=True)
    level = size > _ALONG * np.linalg.norm(travel, axis=1, keepdims=True)
    return Contact(normal, np.where(level, across / np.where(level, size, 1.0), np.nan), line[known],
                   int((~np.isfinite(normal0).all(axis=1)).sum()))
