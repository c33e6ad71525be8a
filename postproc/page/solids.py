"""Part, table and fixtures of the set-up as edges that the page draws, in the part frame or in the table's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from postproc.collision.mesh import load_mesh
from postproc.page.columns import Column, packed, text_of
from postproc.pipeline.result import PostResult
from postproc.setup.bodies import SolidModel
from toolpaths.arrays import Floats
from toolpaths.choices import LengthUnit

FLAT = 0.35
"""rad: edges between triangles that meet flatter than this are left out"""
EVEN = 1e-3
"""rad: triangles that meet flatter than this are one face"""
MOST = 20_000
"""edges of a solid at most: the sharpest"""
FEW, LEAST = 6, 600
"""sharp edges below which a solid is a round one, and how many edges of that are drawn, so that it is seen too"""


def solids(result: PostResult) -> list[dict[str, Any]]:
    """The sharp edges of each solid, (E, 6) mm deflated in 0.01 mm; all in the part frame; none without [bodies]."""
    bodies, job = result.setup.bodies, result.job
    if bodies is None or job is None:
        return []
    folder, back = Path(result.options.setup).parent, job.placement.inverse()
    found = [("part", "part", _edges(folder, bodies.part, bodies.units))] if bodies.part else []
    if bodies.table is not None:
        found.append(("table", "table", _of(folder, bodies.table, bodies.units)))
    found += [(one.name, one.frame, _of(folder, one, bodies.units)) for one in bodies.fixtures]
    made = []
    for name, frame, edges in found:
        if len(edges):
            ends = edges if frame == "part" else back.points(edges.reshape(-1, 3)).reshape(-1, 6)
            data, heads = packed([Column(f"edge {k}", ends[:, k], 0.01, "mm") for k in range(6)])
            made.append({"name": name, "count": len(ends), "columns": heads, "data": text_of(data)})
    return made


def _of(folder: Path, solid: SolidModel, units: LengthUnit) -> Floats:
    if solid.box is None:
        return _edges(folder, solid.file, solid.units or units)
    low, high = (np.array(corner, dtype=np.float64) for corner in (solid.box.low, solid.box.high))
    corner = np.array([[low, high][k >> j & 1][j] for k in range(8) for j in range(3)]).reshape(8, 3)
    pairs = [(k, k | 1 << j) for k in range(8) for j in range(3) if not k >> j & 1]
    return np.array([np.concatenate([corner[a], corner[b]]) for a, b in pairs])


def _edges(folder: Path, file: str | None, units: LengthUnit) -> Floats:
    """(E, 6) both ends of the sharp edges of a mesh file; none where it cannot be read, which the conversion has said."""
    mesh, _ = load_mesh(folder / file, units) if file else (None, [])
    if mesh is None:
        return np.zeros((0, 6))
    angle = np.asarray(mesh.face_adjacency_angles)
    order = np.argsort(-angle, kind="stable")[:MOST]
    drawn = angle[order] > FLAT
    if np.count_nonzero(drawn) < FEW:
        drawn = (np.arange(len(order)) < LEAST) & (angle[order] > EVEN)
    pairs = np.asarray(mesh.face_adjacency_edges)[order[drawn]]
    return np.asarray(np.asarray(mesh.vertices)[pairs].reshape(-1, 6), dtype=np.float64)
