"""Surface normals where the CL file has none: from the mesh of the part, where the ball touches it."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np

from postproc.orientation.passes.contact import Contact, contact_of
from postproc.setup.model import Placement, SetupFile
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.extras import need
from toolpaths.shape import Curves
from toolpaths.units import DEG

if TYPE_CHECKING:
    from trimesh import Trimesh

_TURN = 5.0 * DEG
"""of an arc, from one place that is looked at to the next"""
_CHUNK = 20_000


@dataclass(frozen=True)
class Surface:
    """The part as a mesh in its own frame, closed, its faces outwards.

    Attributes:
        placement: that frame in that of the moves
        slack: mm by which a ball may miss the mesh, in either direction, and still touch it
    """

    mesh: Trimesh
    placement: Placement
    slack: float

    def contact(self, curves: Curves, line: Ints, radius: float) -> Contact:
        """Where a ball of `radius` mm touches along N cutting moves of CL lines (N,): at their ends, and
        between them at places no more than a radius, or 5 degrees of an arc, apart."""
        parts, owner = _parted(curves, radius)
        centres = np.stack((parts.start + radius * parts.axis0, parts.end + radius * parts.axis1), axis=1).reshape(-1, 3)
        places, back = np.unique(centres, axis=0, return_inverse=True)
        found = mesh_normals(self.mesh, self.placement.inverse().points(places), radius, self.slack)
        normal = self.placement.directions(found)[back.reshape(-1)].reshape(-1, 2, 3)
        return contact_of(parts, normal, np.repeat(line[owner], 2).reshape(-1, 2))


def surface_of(setup: SetupFile, placement: Placement, tolerance: float,
               file: str) -> tuple[Surface | None, list[Diagnostic]]:
    """The part that a set-up names in [bodies], None where it names none; `file` is that of the set-up,
    `tolerance` that of the CL points, mm."""
    if setup.bodies is None or setup.bodies.part is None:
        return None, []
    from postproc.collision.mesh import load_mesh

    bodies = setup.bodies
    mesh, found = load_mesh(FilePath(file).parent / setup.bodies.part, bodies.units, "bodies.part")
    return (None if mesh is None else Surface(mesh, placement, bodies.gouge + tolerance)), found


def mesh_normals(mesh: Trimesh, centres: Floats, radius: float, slack: float) -> Floats:
    """Unit normals (N, 3) of a part where balls of `radius` about `centres` (N, 3) touch it, NaN where they do not.

    The normal points from the nearest point of the part to the centre; the ball touches where that is
    `radius` away, `slack` more or less, and the centre is outside.
    """
    need("rtree", "normals of a mesh need")
    from trimesh.proximity import closest_point

    result = np.full((len(centres), 3), np.nan)
    for first in range(0, len(centres), _CHUNK):
        some = centres[first:first + _CHUNK]
        near, away, face = closest_point(mesh, some)  # type: ignore[no-untyped-call]  # trimesh states no types here
        gap = some - near
        outside = np.einsum("ni,ni->n", gap, mesh.face_normals[face]) > 0.0
        touching = np.flatnonzero((np.abs(away - radius) <= slack) & (away > 0.0) & outside)
        result[first + touching] = gap[touching] / away[touching, None]
    return result


def _parted(curves: Curves, step: float) -> tuple[Curves, Ints]:
    """(moves cut into parts of at most `step` mm, or 5 degrees of an arc; the move (P,) that each belongs to)."""
    size = np.where(curves.is_arc, curves.sweep / _TURN, curves.length() / step)
    count = np.maximum(np.ceil(size - 1e-9), 1).astype(np.int64)
    owner = np.repeat(np.arange(len(curves)), count)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    low, high = k / count[owner], np.where(k + 1 == count[owner], 1.0, (k + 1) / count[owner])
    picked = curves.take(owner)
    (start, axis0), (end, axis1) = picked.at(low), picked.at(high)
    return Curves(start, end, axis0, axis1, picked.is_arc, picked.center, picked.normal, picked.sweep * (high - low)), owner
