"""Where a ball touches the surface at the poses of a cut: normals of the file, else of the part mesh."""

from __future__ import annotations

import numpy as np

from postproc.orientation.passes.contact import Contact, contact_of
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.passes.surface import mesh_normals
from toolpaths.arrays import Floats, Ints
from toolpaths.shape import Curves


def contact_along(work: PassContext, row: Ints, centre: Floats, radius: float) -> Contact:
    """Where the surface is known at poses whose balls of `radius` have their centres at `centre` (N, 3), rows (N,) of the
    Toolpath; its `line` is the number of the pose, its feed that of the centre."""
    normal = np.full((len(centre), 3), np.nan)
    if work.toolpath.normal is not None:
        normal = work.placement.directions(work.toolpath.normal[row])
    elif work.surface is not None:
        part = work.surface
        found = mesh_normals(part.mesh, part.placement.inverse().points(centre), radius, part.slack)
        normal = part.placement.directions(found)
    number, flat = np.arange(len(centre)), np.zeros((len(centre) - 1, 3))
    upright = np.tile([0.0, 0.0, 1.0], (len(flat), 1))
    chords = Curves(centre[:-1], centre[1:], upright, upright, np.zeros(len(flat), dtype=np.bool_), flat, flat,
                    np.zeros(len(flat)))
    ends = np.stack((number[:-1], number[1:]), axis=1)
    return contact_of(chords, normal[ends], ends)
