"""The places of a job: where each stands, which register holds its work offset, which moves are made there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.control.modes import OutputModes
from postproc.job.turned_places import turned
from postproc.reference.repeated import Repeated, repeated
from postproc.setup.model import Placement, SetupFile, at_places, part_placement
from postproc.setup.places import PlaceOrder
from postproc.setup.system import standing
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Frame, Toolpath


@dataclass(frozen=True)
class Place:
    """One place: its name ("" where the set-up names none), its set-up without places, the part's frame on the table."""

    name: str
    setup: SetupFile
    placement: Placement

    @property
    def code(self) -> str:
        """The register that holds its work offset, as the set-up names it."""
        return self.setup.work_offset_code


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
        result.append(Place(setup.places[k].name if setup.places else "", stood, placement))
    if setup.places and setup.clearance.centre is not None:
        found.append(error("places.centre", "clearance.centre is a point of one part, the set-up has [[places]]",
                           file=options.setup, hint="take it out: safe planes stand round all parts, clearance.margin off "
                           "what is cut"))
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


def modes_at(places: Sequence[Place], modes: OutputModes, frame: Frame) -> OutputModes:
    """The output modes with the work offset of every place; `frame`: the system of the CL file that is the work offset."""
    if len(places) < 2:
        return modes
    origin, each = np.array([frame.origin]), len(modes.asked) // len(places)
    others = tuple(replace(modes.control, origin=place.placement.points(origin)[0], place=k)
                   for k, place in enumerate(places[1:], 1))
    return replace(modes, others=others, place=np.arange(len(modes.asked)) // each)
