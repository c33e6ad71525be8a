"""A mesh as the search sees it: triangles in the table frame, in an order that keeps near ones together, in a tree."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from postproc.collision.tree import Tree, tree, z_order
from postproc.setup.model import Placement
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from trimesh import Trimesh


@dataclass(frozen=True)
@arrays(corners="T 3 3", normal="T 3")
class TriangleSolid:
    """Closed surface of T triangles.

    Attributes:
        corners (T, 3, 3): mm
        normal (T, 3): unit, out of the material
        tree: boxes round the triangles
    """

    corners: Floats
    normal: Floats
    tree: Tree

    def __len__(self) -> int:
        return len(self.corners)

    @cached_property
    def packed(self) -> tuple[Floats, Floats]:
        """Nodes (2 L - 1, 11): centre, half, normal, least and largest height of `slabs`; corners (T, 9)."""
        normal, low, high = self.slabs
        nodes = np.hstack((self.tree.centre, self.tree.half, normal, low[:, None], high[:, None]))
        return nodes, self.corners.reshape(-1, 9)

    @cached_property
    def slabs(self) -> tuple[Floats, Floats, Floats]:
        """Per node of the tree the mean normal (2 L - 1, 3) of its triangles, and between which heights (2 L - 1,) along it
        they lie: how flat a surface is does not show in boxes along x, y and z."""
        leaves, count = self.tree.leaves, len(self)
        area = np.zeros((leaves, 3))
        area[:count] = np.cross(self.corners[:, 1] - self.corners[:, 0],
                                self.corners[:, 2] - self.corners[:, 0])
        normals, lows, highs = [], [], []
        for size in 2 ** np.arange(leaves.bit_length()):
            total = area.reshape(-1, size, 3).sum(axis=1)
            length = np.linalg.norm(total, axis=1, keepdims=True)
            normal = np.where(length > 0.0, total / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
            first = np.arange(0, count, size)
            height = np.einsum("tki,ti->tk", self.corners, normal[np.arange(count) // size])
            none = np.zeros(len(normal) - len(first))
            normals.append(normal)
            lows.append(np.append(np.minimum.reduceat(height.min(axis=1), first), none))
            highs.append(np.append(np.maximum.reduceat(height.max(axis=1), first), none))
        return np.concatenate(normals[::-1]), np.concatenate(lows[::-1]), np.concatenate(highs[::-1])

    def holds(self, point: Floats) -> bool:
        """True where a point (3,) lies inside: the solid angles of all triangles add up to 4 pi.

        Van Oosterom and Strackee, The solid angle of a plane triangle (1983), equation 8.
        """
        low, high = self.tree.centre[0] - self.tree.half[0], self.tree.centre[0] + self.tree.half[0]
        if bool(((point < low) | (point > high)).any()):
            return False
        a, b, c = np.moveaxis(self.corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ti,ti->t", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        return bool(abs(2.0 * np.arctan2(volume, below).sum()) > 2.0 * np.pi)


def solid(mesh: Trimesh, placement: Placement) -> TriangleSolid:
    """A closed mesh where `placement` puts it."""
    corners = placement.points(np.asarray(mesh.vertices, dtype=np.float64))[np.asarray(mesh.faces)]
    corners = corners[z_order(corners.mean(axis=1))]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    corners, normal = corners[size > 0.0], normal[size > 0.0] / size[size > 0.0, None]
    return TriangleSolid(corners, normal, tree(corners.min(axis=1), corners.max(axis=1)))
