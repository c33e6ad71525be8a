"""Meshes of part, fixtures, table and holders: read from files, refused where they are no solid."""

from __future__ import annotations

import warnings
from functools import lru_cache
from io import BytesIO
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np

from toolpaths.choices import LengthUnit
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.input_files import advice, check_input, read_input, reason, shown, unreadable
from toolpaths.units import MM_PER_INCH

if TYPE_CHECKING:
    from trimesh import Trimesh

FORMATS = (".stl", ".ply", ".obj", ".off")
"""by their ending; no other file is fetched or opened for them"""
_SMALL, _LARGE = 1.0, 20000.0
"""mm: a solid whose largest side is outside is likely in another unit"""

STL_HEAD, STL_TRIANGLE = 84, 50
"""bytes of a binary STL file before its triangles, and of each"""
_LARGEST = 1e7
"""mm or inches of a coordinate: merging vertices counts steps of 1e-8 in integers of 64 bits"""


def load_mesh(path: str | FilePath, units: LengthUnit = "mm",
              key: str = "") -> tuple[Trimesh | None, list[Diagnostic]]:
    """A closed triangle mesh in mm; None and why where the file holds none.

    Args:
        path: STL, PLY, OBJ or OFF
        units: "mm" or "inch": what the numbers of the file are
        key: what names the file in the set-up, for messages
    """
    path = FilePath(path)
    what = f"{key}: " if key else ""
    if path.suffix.lower() not in FORMATS:
        return None, [error("mesh.format", f"{what}{path.name}: a mesh is read from {', '.join(FORMATS)}", file=str(path),
                            hint="export the solid as STL, PLY, OBJ or OFF")]
    try:
        stat = check_input(path)
    except OSError as fault:
        return None, [error("mesh.open", f"{what}cannot be read: {reason(fault)}", file=shown(path),
                            hint=advice(fault, "paths are relative to the set-up file"))]
    mesh, found = _loaded(str(path), stat.st_mtime_ns, stat.st_size, units)
    return mesh, [Diagnostic(d.severity, d.code, what + d.message, d.file, hint=d.hint) for d in found]


@lru_cache(maxsize=32)
def _loaded(path: str, _changed: int, _size: int,
            units: LengthUnit) -> tuple[Trimesh | None, tuple[Diagnostic, ...]]:
    """The mesh of a file as it was at a moment."""
    import trimesh

    try:
        data = read_input(path)
        if cut := _cut_short(data, path):
            return None, (cut,)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            read = trimesh.load_mesh(BytesIO(data), file_type=path.rpartition(".")[2].lower(), process=False,
                                     **_reader(path))
    except OSError as fault:
        return None, (unreadable(fault, "mesh.open", path),)
    except Exception as fault:  # the readers of the formats raise what comes up
        why = "" if isinstance(fault, ImportError) else f" ({type(fault).__name__}: {fault})"
        return None, (error("mesh.format", f"is no {path.rpartition('.')[2].upper()} file that can be read{why}", file=path,
                            hint="export it again"),)
    faults = _broken(read, path)
    if faults:
        return None, faults
    scale = MM_PER_INCH if units == "inch" else 1.0
    mesh = trimesh.Trimesh(np.asarray(read.vertices, dtype=np.float64) * scale, read.faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces(height=0.0))
    mesh.remove_unreferenced_vertices()
    found = _no_solid(mesh, path)
    if has_errors(found):
        return None, found
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh, found + _odd_size(mesh, path, units)


def _cut_short(data: bytes, path: str) -> Diagnostic | None:
    """An error for an STL file that is neither text nor as long as its count of triangles says: what a reader makes of it
    depends on which packages it finds."""
    if not path.lower().endswith(".stl") or len(data) < STL_HEAD or data.lstrip()[:5].lower() == b"solid":
        return None
    due = STL_HEAD + STL_TRIANGLE * int.from_bytes(data[STL_HEAD - 4:STL_HEAD], "little")
    return None if len(data) >= due else error(
        "mesh.format", f"is no STL file that can be read (it has {len(data)} bytes, {due} by its count of triangles)",
        file=path, hint="export it again")


def _reader(path: str) -> dict[str, bool]:
    """Pictures and materials that an OBJ file names are not looked for."""
    return {"skip_materials": True} if path.lower().endswith(".obj") else {}


def _broken(mesh: Trimesh, path: str) -> tuple[Diagnostic, ...]:
    """What stands against reading the vertices at all."""
    if not hasattr(mesh, "faces") or not len(mesh.faces):
        return (error("mesh.empty", "holds no triangle", file=path, hint="export the solid as a triangle mesh"),)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if vertices.ndim != 2 or faces.ndim != 2 or vertices.shape[1] != 3 or faces.shape[1] != 3:
        return (error("mesh.format", "has vertices without three coordinates, or faces that are no triangles", file=path,
                      hint="export it again"),)
    if faces.min() < 0 or faces.max() >= len(vertices):
        return (error("mesh.format", f"has {len(vertices)} vertices, and a triangle names one that is none of them",
                      file=path, hint="export it again"),)
    bad = np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))
    if len(bad):
        return (error("mesh.number", f"{len(bad)} of {len(mesh.vertices)} vertices are not finite numbers", file=path,
                      hint="export it again"),)
    largest = float(np.abs(mesh.vertices).max())
    if largest > _LARGEST:
        return (error("mesh.number", f"a vertex lies at {largest:g}, at most {_LARGEST:g} is read", file=path,
                      hint="export it again"),)
    return ()


def _no_solid(mesh: Trimesh, path: str) -> tuple[Diagnostic, ...]:
    """Holes, and faces that do not agree which side is out."""
    open_edges, one_sided = _edge_faults(mesh)
    if open_edges:
        return (error("mesh.open_surface", f"is not a closed solid: {open_edges} edges are not shared by two "
                      "triangles", file=path, hint="close the holes, or export the body as a solid"),)
    with np.errstate(all="ignore"):
        flat = mesh.volume == 0.0
    if flat or one_sided:
        return (error("mesh.sides", "its triangles do not agree which side is out", file=path,
                      hint="export the body as a solid"),)
    if mesh.volume < 0.0:
        return (warning("mesh.inside_out", "is inside out: its triangles were turned round", file=path),)
    return ()


def _edge_faults(mesh: Trimesh) -> tuple[int, int]:
    """(edges with an odd number of triangles, edges that triangles do not pass as often one direction as the other).

    Bodies that touch along an edge share it: four triangles, two each path, are closed as well.
    """
    edges = np.asarray(mesh.edges)
    _, number, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    travel = np.bincount(number.ravel(), np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    return int((count % 2 != 0).sum()), int((travel != 0.0).sum())


def _odd_size(mesh: Trimesh, path: str, units: LengthUnit) -> tuple[Diagnostic, ...]:
    """Sizes that look like another unit."""
    size = float(mesh.extents.max())
    if _SMALL <= size <= _LARGE:
        return ()
    return (warning("mesh.size", f"is {size:g} mm long, read in {units}", file=path,
                    hint="state units = \"mm\" or \"inch\" where the file is in another unit"),)
