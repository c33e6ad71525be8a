"""What stays where it is while the part is placed: table and fixtures of the set-up, next to the part and next to the tool.

What moves with the part (its mesh, fixtures in its frame) stands to the tool as ever, wherever the part is
placed: that is looked at by the conversion alone.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.collision.bodies import Scene, scene
from postproc.collision.form import ToolForm
from postproc.collision.mesh import load_mesh
from postproc.collision.solid import TriangleSolid, solid
from postproc.orientation.passes.pass_bodies import PassBodies, forms_of
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.passes.reasons import Touching
from postproc.placement.reasons import StandsIn
from postproc.setup.bodies import BodiesModel
from postproc.setup.bodies import SolidModel as Given
from postproc.setup.model import Placement, SetupFile
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.extras import need

if TYPE_CHECKING:
    from trimesh import Trimesh

RESTS = 0.02
"""mm that the part may be within a body: it rests on the table and stands in its vise"""
_SHARP = 0.2
"""cosine between the normals of a corner and its faces, at least"""
_HERE = Placement(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class StationaryBodies:
    """Bodies that do not move, next to the part and the tools.

    Attributes:
        standing: bodies in the table frame, with what tools keep from them
        part: what moves with the part by name: as a mesh drawn in by RESTS, and as a solid in the part frame
        forms: of the tools, by index
    """

    standing: Scene
    part: dict[str, tuple[Trimesh, TriangleSolid]]
    forms: dict[int, ToolForm]

    def against(self, placement: Placement) -> StandsIn | None:
        """Which body the part stands in, None where it stands free."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = placement.rotation, placement.origin
        back = placement.inverse()
        for name in self.part:
            self._moving.set_transform(name, pose)
        hit, names = self._moving.in_collision_other(self._standing, return_names=True)
        if hit:
            part, body = min(names)
            return StandsIn(part, body)
        for name, (mesh, whole) in self.part.items():
            first = placement.points(np.asarray(mesh.vertices[:1]))[0]
            for body in self.standing.bodies:
                if body.solid.holds(first) or whole.holds(back.points(body.solid.corners[0, :1])[0]):
                    return StandsIn(name, body.name)
        return None

    def tool(self, work: PassContext) -> Touching | None:
        """What the tools would touch on the passes of `work` with the axes of the file, None where nothing."""
        adjacent = PassBodies(work, self.standing, self.forms)
        return next((why for one in work.passes if (why := adjacent.touching(one, one.axis))), None)

    @cached_property
    def _standing(self) -> Any:
        return _manager({body.name: _mesh(body.solid.corners) for body in self.standing.bodies})

    @cached_property
    def _moving(self) -> Any:
        return _manager({name: mesh for name, (mesh, _) in self.part.items()})


def _manager(meshes: dict[str, Trimesh]) -> Any:
    """Bodies for collision queries.

    Raises:
        DiagnosticError: where python-fcl is not installed.
    """
    need("fcl", "places next to meshes need")
    from trimesh import collision

    manager: Any = collision.CollisionManager()  # type: ignore[no-untyped-call]  # trimesh states no types here
    for name, mesh in meshes.items():
        manager.add_object(name, mesh)
    return manager


def adjacent(work: PassContext, file: str) -> tuple[StationaryBodies | None, list[Diagnostic]]:
    """The bodies of the set-up `file` that do not move with the part; None where there are none, or a mesh is no good."""
    given = work.setup.bodies
    if given is None:
        return None, []
    still = given.model_copy(update={"part": None, "fixtures": [one for one in given.fixtures if one.frame == "table"]})
    if still.table is None and not still.fixtures:
        return None, []
    standing, found = scene(_with(work.setup, still), [("", _HERE)], file)
    forms, more = forms_of(work, file)
    if standing is None or has_errors(more):
        return None, [*found, *more]
    moving, faults = _moving(given, Path(file).parent)
    if has_errors(faults):
        return None, faults
    part = {name: (_drawn_in(mesh), solid(mesh, _HERE)) for name, mesh in moving.items()}
    return StationaryBodies(standing, part, forms), []


def _with(setup: SetupFile, bodies: BodiesModel) -> SetupFile:
    return setup.model_copy(update={"bodies": bodies})


def _moving(given: BodiesModel, folder: Path) -> tuple[dict[str, Trimesh], list[Diagnostic]]:
    """Meshes in the part frame by name: the part, and the fixtures that stand with it."""
    import trimesh

    every = [("the part", Given(file=given.part))] if given.part is not None else []
    every += [(f"fixture {one.name}", one) for one in given.fixtures if one.frame == "part"]
    meshes, found = {}, []
    for name, one in every:
        if one.file is not None:
            mesh, more = load_mesh(folder / one.file, one.units or given.units, name)
            found += more
            if mesh is not None:
                meshes[name] = mesh
        elif one.box is not None:
            meshes[name] = trimesh.creation.box(bounds=[one.box.low, one.box.high])
    return meshes, found


def _mesh(corners: Floats) -> Trimesh:
    """Triangles (T, 3, 3) as a mesh."""
    import trimesh

    return trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)


def _drawn_in(mesh: Trimesh) -> Trimesh:
    """The mesh with each corner moved inwards until all of its faces are RESTS away, at sharp ones a little less."""
    import trimesh

    normal, faces = np.asarray(mesh.vertex_normals), np.asarray(mesh.faces)
    along = np.einsum("fki,fi->fk", normal[faces], np.asarray(mesh.face_normals))
    least = np.ones(len(normal))
    np.minimum.at(least, faces.ravel(), along.ravel())
    inwards = RESTS / np.maximum(least, _SHARP)
    return trimesh.Trimesh(np.asarray(mesh.vertices) - inwards[:, None] * normal, faces, process=False)
