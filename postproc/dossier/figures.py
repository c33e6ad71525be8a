"""The figures of a dossier: the machine from three sides, its condition and transmission, certificate, errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from machines.analysis.certificate_figure import certificate_figure
from machines.analysis.chain_map import chain_map_figure
from machines.analysis.choices import MapMeasure, MapNumber
from machines.analysis.lever_map import lever_figure, moved_by_slides
from machines.analysis.machine_figure import machine_figure
from machines.analysis.maps import map_figure, measured
from machines.analysis.measures import WORDS
from machines.geometric_error.exchange.figures import model_figure
from machines.machine import Machine
from machines.sheet.drawing import drawing
from postproc.dossier.content import ErrorsOf
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass

SLICES: tuple[tuple[MapNumber, MapNumber], ...] = (("x", "y"), ("x", "z"))
MEASURES: tuple[MapMeasure, ...] = ("condition", "speed", "force")


@dataclass(frozen=True)
class DossierFigure:
    """A picture: name of its file without ending, the section of the page, what it shows, its maker."""

    name: str
    section: str
    title: str
    make: Callable[[FigureEnding], bytes]
    only_svg: bool = False


def figures(machine: Machine, errors: ErrorsOf | None) -> list[DossierFigure]:
    """Those that a machine has, in the order of the page."""
    legs = machine.kinematics.clearance_parts is not None
    made = [DossierFigure("machine", "drawing", "the machine from three sides at home", partial(machine_figure, machine))
            if legs else DossierFigure("machine", "drawing", "axes, travel of the gauge point and pivots from three sides",
                                       lambda _: drawing(machine).encode(), only_svg=True)]
    if machine.kinematics.transmits is not None:
        made += [_map(machine, measure, along) for measure in MEASURES for along in SLICES]
        if machine.kinematics.transmits.workspace.tilt[1] > machine.kinematics.transmits.workspace.tilt[0]:
            made.append(_map(machine, "condition", ("x", "tilt")))
    elif any(machine.rotary):
        made.append(DossierFigure("condition", "condition", "condition number over the rotary axes",
                                  partial(chain_map_figure, machine)))
        if moved_by_slides(machine):
            made.append(DossierFigure("force", "condition", "torque of the rotary axes under the part per force at the tip",
                                      partial(lever_figure, machine)))
    if machine.certificate:
        content = json.loads(Path(machine.certificate).read_text("utf-8"))
        made.append(DossierFigure("certificate", "certificate", "boxes of the certificate in two planes",
                                  partial(certificate_figure, content)))
    if errors is not None:
        title = f"errors over the axes, and at the tip of a tool of {errors.tool_length:g} mm"
        made.append(DossierFigure("errors", "errors", title,
                                  partial(model_figure, errors.model, machine, errors.tool_length)))
    return made


def _map(machine: Machine, measure: MapMeasure, along: tuple[MapNumber, MapNumber]) -> DossierFigure:
    return DossierFigure(f"{measure}-{'-'.join(along)}", "condition", f"{WORDS[measure]} over {' and '.join(along)}",
                         lambda ending: map_figure(measured(machine, measure, along, {}), ending))
