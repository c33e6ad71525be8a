"""The places of a job: where each stands, which register holds its work offset, which moves are made there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.control.control import Control
from postproc.control.modes import ASKED, OutputModes
from postproc.job.turned_places import turned
from postproc.reference.moves import Moves
from postproc.reference.repeated import Repeated, repeated
from postproc.setup.model import Placement, SetupFile, at_places, line_of, part_placement
from postproc.setup.places import PlaceOrder
from postproc.setup.system import standing
from toolpaths.arrays import Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Frame, Toolpath


@dataclass(frozen=True)
class Place:
    """One place: its name ("" where the set-up names none), its set-up without places, the part's frame on the table."""

    name: str
    setup: SetupFile
    placement: Placement
    standing: tuple[tuple[str, float], ...] = ()
    """degrees of rotary tables, by letter, with which its register is measured, where that is not with all at 0"""

    @property
    def code(self) -> str:
        """The register that holds its work offset, as the set-up names it."""
        return self.setup.work_offset_code


def at_place(places: tuple[Place, ...], repeats: Repeated | None, moves: Moves) -> Callable[[Ints], str]:
    """' at the place "left"', for people, of rows (K,) of `moves`: where they are made. "" where the part stands at one
    place alone; behind the last move the last one counts."""
    def said(rows: Ints) -> str:
        if repeats is None or len(places) < 2:
            return ""
        of = repeats.place[moves.row[np.minimum(rows, len(moves) - 1)]]
        names = [f'"{places[k].name}"' for k in np.unique(of).tolist()]
        return f" at the place{'s' if len(names) > 1 else ''} {', '.join(names)}"

    return said


def places_of(setup: SetupFile, toolpath: Toolpath, machine: Machine,
              options: Options) -> tuple[tuple[Place, ...], list[Diagnostic]]:
    """The places of a set-up, with the part of one that names none; none where one cannot be placed."""
    result, found = list[Place](), list[Diagnostic]()
    for k, here in enumerate(at_places(setup)):
        stood, more = standing(here, toolpath, options.setup)
        placement, wrong = part_placement(stood, options.setup)
        found += [*more, *wrong]
        if placement is None:
            continue
        if setup.places:
            placement, more = turned(machine, setup.places[k], placement, options.setup)
            stood, found = _standing_at(stood, placement), [*found, *more]
        given = setup.places[k] if setup.places else None
        result.append(Place(given.name if given else "", stood, placement, tuple(given.turned.items()) if given else ()))
    if setup.places and setup.clearance.centre is not None:
        found.append(error("places.centre", "clearance.centre is a point of one part, the set-up has [[places]]",
                           file=options.setup, lines=line_of(options.setup, ("clearance", "centre")),
                           hint="take it out: safe planes stand round all parts, clearance.margin off what is cut"))
    return tuple(result), found


def _standing_at(setup: SetupFile, placement: Placement) -> SetupFile:
    """The set-up with [part] as it stands with all axes at zero."""
    x, y, origin = (tuple((v + 0.0).tolist()) for v in (*placement.rotation.T[:2], placement.origin))
    return setup.model_copy(update={"part": setup.part.model_copy(update={
        "system": False, "origin": origin, "x_axis": x, "y_axis": y})})


def at_all(toolpath: Toolpath, places: Sequence[Place], order: PlaceOrder) -> tuple[Toolpath, Repeated | None]:
    """The path at all places, in the frame of the part as it stands at the first; None where there is one alone."""
    if len(places) < 2:
        return toolpath, None
    first = places[0].placement
    return repeated(toolpath, [_from(first, place.placement) for place in places], order)


def _from(first: Placement, there: Placement) -> Placement:
    """What takes the part's frame as it stands first to where it stands: without a turn where both stand alike, so that
    directions stay bit for bit."""
    if not (first.rotation == there.rotation).all():
        return first.inverse().behind(there)
    return Placement(np.eye(3), first.rotation.T @ (there.origin - first.origin))


def control_at(places: Sequence[Place], control: Control, frame: Frame, k: int) -> Control:
    """The control with the work offset of place k; `frame`: the system of the CL file that is the work offset."""
    origin = places[k].placement.points(np.array([frame.origin]))[0]
    return replace(control, origin=origin, place=k, standing=places[k].standing)


def modes_at(places: Sequence[Place], modes: OutputModes, frame: Frame, file: str) -> tuple[OutputModes, list[Diagnostic]]:
    """The output modes with the work offset of every place: where that is measured with the tables turned, machine
    coordinates alone."""
    axes, auto = ASKED.index("axes"), ASKED.index("auto")
    place = np.arange(len(modes.asked)) // (len(modes.asked) // len(places))
    turned = np.array([bool(one.standing) for one in places])[place]
    wrong = np.flatnonzero(turned & (modes.asked != axes) & (modes.asked != auto))
    found = [] if not len(wrong) else [error(
        "places.measured", f"place {places[int(place[wrong[0]])].name}: measured = \"turned\" is for machine coordinates, "
        f"output mode {ASKED[int(modes.asked[wrong[0]])]} is asked for", file=file, count=len(wrong),
        hint='measured = "zero", which holds for all modes, or output mode axes')]
    if turned.any():
        modes = replace(modes, asked=np.where(turned, axes, modes.asked).astype(np.int8))
    if len(places) < 2:
        return modes, found
    others = tuple(control_at(places, modes.control, frame, k) for k in range(1, len(places)))
    return replace(modes, others=others, place=place), found
