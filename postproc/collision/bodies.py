"""Part, table and fixtures where they stand, and what of a tool comes too near to them on its path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.collision.form import CUTTER, HOLDER, SHANK, ToolForm, stacked
from postproc.collision.mesh import load_mesh
from postproc.collision.search import nearest
from postproc.collision.solid import TriangleSolid, solid
from postproc.collision.swept import Swept
from postproc.collision.touch_words import touch_words
from postproc.setup.bodies import BodiesModel
from postproc.setup.bodies import SolidModel as Given
from postproc.setup.model import Placement, SetupFile
from toolpaths.arrays import Floats
from toolpaths.choices import LengthUnit
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors

PART = "the part"
_APART = 1e-3
"""mm between the end of a piece of the path and the beginning of the next: another stretch"""
_TABLE = Placement(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class Body:
    """A solid in the table frame, `name` as messages call it."""

    name: str
    solid: TriangleSolid

    @property
    def is_part(self) -> bool:
        """True for what is cut."""
        return self.name == PART or self.name.startswith(f"{PART} at ")


@dataclass(frozen=True)
class Scene:
    """All bodies of a set-up, with what tools keep from them: `clearance`, and `gouge` that a cutter may
    reach into the part, mm."""

    bodies: tuple[Body, ...]
    clearance: float
    gouge: float

    def pairs(self, form: ToolForm) -> Iterator[tuple[int, Body, float]]:
        """(CUTTER, SHANK or HOLDER, body, least distance in mm) of all pairs that are checked."""
        for part in (CUTTER, SHANK, HOLDER):
            if len(form.of(part)):
                for body in self.bodies:
                    gouging = part == CUTTER and body.is_part
                    if form.exact or not gouging:
                        yield part, body, -self.gouge if gouging else self.clearance


@dataclass(frozen=True)
class Touch:
    """A pair that is nearer than allowed: `distance`, `limit` in mm; -inf where the tool is inside altogether.

    `place` is a piece of the path.
    """

    tool: int
    part: int
    body: Body
    distance: float
    limit: float
    place: int

    def __str__(self) -> str:
        return touch_words(self.tool, self.part, self.body.name, self.distance, self.limit)


def scene(setup: SetupFile, places: Sequence[tuple[str, Placement]],
          file: str) -> tuple[Scene | None, list[Diagnostic]]:
    """The bodies that a set-up names, part and what moves with it at each of `places` (name, where it stands); None where
    it names none or one is no good. `file` is that of the set-up.
    """
    given = setup.bodies
    if given is None:
        return None, []
    part = Given(file=given.part) if given.part is not None else None
    named = [(PART + _at(place), "bodies.part", part, where) for place, where in places]
    named.append(("the table", "bodies.table", given.table, _TABLE))
    for k, one in enumerate(given.fixtures):
        stands = places if one.frame == "part" else [("", _TABLE)]
        named += [(f"fixture {one.name}{_at(at)}", f"bodies.fixtures[{k}]", one, where) for at, where in stands]
    folder, found, bodies = Path(file).parent, [], []
    for name, key, each, where in named:
        if each is not None:
            body, more = _solid(each, where, folder, given.units, key)
            found += more
            bodies += [] if body is None else [Body(name, body)]
    if not bodies and not has_errors(found):
        found.append(error("collision.no_bodies", "[bodies] names no part, table or fixture", file=file,
                           hint="part = \"part.stl\", [bodies.table] or [[bodies.fixtures]]"))
    return (None if has_errors(found) else Scene(tuple(bodies), given.clearance, given.gouge)), found


def _at(place: str) -> str:
    return place and f" at {place}"


def described(setup: SetupFile, placement: Placement, file: str) -> tuple[str, list[Diagnostic]]:
    """(lines that say what stands where, what is wrong with the meshes of a set-up)."""
    bodies, found = scene(setup, [("", placement)], file)
    found += _holders(setup, file)
    found += [replace(d, file=file) for number, tool in setup.tools.items()
              for d in stacked(number, tool, tool.flute_length)]
    return "".join(f"\n{_where(body)}" for body in (bodies.bodies if bodies else ())), found


def mesh_errors(setup: SetupFile, file: str) -> list[Diagnostic]:
    """What stands against reading the meshes that a set-up names."""
    given = setup.bodies
    if given is None:
        return []
    folder = Path(file).parent
    files = [("bodies.part", given.part, given.units)]
    files += [(key, one.file, one.units or given.units) for key, one in _others(given)]
    found = [d for key, name, units in files if name is not None for d in load_mesh(folder / name, units, key)[1]]
    return [d for d in [*found, *_holders(setup, file)] if has_errors([d])]


def _holders(setup: SetupFile, file: str) -> list[Diagnostic]:
    return [d for number, tool in setup.tools.items() if tool.holder_mesh is not None
            for d in load_mesh(Path(file).parent / tool.holder_mesh, tool.holder_units, f"tools.{number}.holder_mesh")[1]]


def _others(given: BodiesModel) -> list[tuple[str, Given]]:
    """Table and fixtures with the keys that name them."""
    table = [] if given.table is None else [("bodies.table", given.table)]
    return [*table, *((f"bodies.fixtures[{k}]", one) for k, one in enumerate(given.fixtures))]


def _where(body: Body) -> str:
    """The place of a body in the table frame."""
    low, high = body.solid.corners.min(axis=(0, 1)), body.solid.corners.max(axis=(0, 1))
    spans = ", ".join(f"{name} {a:g} to {b:g}" for name, a, b in zip("xyz", low.round(3), high.round(3), strict=True))
    return f"{body.name}: {len(body.solid)} triangles, {spans} mm of the table frame"


def _solid(given: Given, where: Placement, folder: Path, units: LengthUnit,
           key: str) -> tuple[TriangleSolid | None, list[Diagnostic]]:
    """A mesh or box in the table frame."""
    if given.box is not None:
        import trimesh

        return solid(trimesh.creation.box(bounds=[given.box.low, given.box.high]), where), []
    mesh, found = load_mesh(folder / (given.file or ""), given.units or units, key)
    return (None if mesh is None else solid(mesh, where)), found


def touches(all_bodies: Scene, form: ToolForm, travel: Swept, cutting: Swept | None = None) -> list[Touch]:
    """What of a tool comes too near to what on a path; a pair once, at its worst.

    Args:
        cutting: the path on which the cutter is compared with the part, where it is not the whole
    """
    result = []
    for part, body, limit in all_bodies.pairs(form):
        gouging = part == CUTTER and body.is_part
        on = cutting if gouging and cutting is not None else travel
        if not len(on):
            continue
        found = nearest(body.solid, on, form.of(part), limit)
        if found.place >= 0:
            result.append(Touch(form.number, part, body, found.distance, limit, int(on.row[found.place])))
    if not result and len(travel):
        result = [Touch(form.number, part, body, -np.inf, limit, int(travel.row[k]))
                  for part, body, limit in all_bodies.pairs(form) for k in _inside(body, form.of(part), travel)[:1]]
    return result


def _inside(body: Body, pieces: Floats, travel: Swept) -> list[int]:
    """Places where a stretch of the path begins with a tool that is inside: what no surface passes it never leaves there."""
    apart = np.linalg.norm(travel.tip[1:, 0] - travel.tip[:-1, 1], axis=1) > _APART
    first = np.append(0, np.flatnonzero(apart) + 1)
    core = travel.tip[first, 0] + 0.5 * (pieces[0, 1] + pieces[0, 3]) * travel.axis[first, 0]
    return [k for k, point in zip(first.tolist(), core, strict=True) if body.solid.holds(point)]
