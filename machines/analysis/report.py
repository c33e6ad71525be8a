"""Everything that the analysis knows about one machine, as plain data with the unit in each key."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from machines.analysis.box import Box, reachable_box
from machines.analysis.directions import tilts
from machines.analysis.transmission import (
    Measure,
    WorstValue,
    condition_number,
    force_transmission,
    lever,
    speed_acceleration,
    speed_transmission,
    worst,
)
from machines.kinematics.h4_linear import H4Linear
from machines.kinematics.linear_delta import LinearDelta
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.units import DEG


def analyse(machine: Machine) -> dict[str, Any]:
    """Figures of a machine; a serial one, whose slides pass their speed on as it is, has no transmission."""
    found: dict[str, Any] = {"machine": machine.name, "structure": machine.structure, "axes": list(machine.axis_names)}
    kinematics = machine.kinematics
    if isinstance(kinematics, LinearDelta | H4Linear):
        space = kinematics.workspace
        found["workspace_mm"] = _span(space.lower, space.upper)
        found["tilt_range_deg"] = [t / DEG for t in space.tilt]
        found |= _transmission(kinematics)
    every, largest = tilts(machine)
    found["tilt_in_every_direction_deg"] = every if np.isfinite(every) else None
    found["largest_tilt_deg"] = largest
    found["reachable_box_mm"] = _box(machine)
    return found


def _transmission(kinematics: LinearDelta | H4Linear) -> dict[str, Any]:
    def largest(measure: Any) -> dict[str, Any]:
        bound: Measure = partial(measure, kinematics)
        return _point(worst(bound, kinematics.workspace))

    found: dict[str, Any] = {
        "condition_number": largest(condition_number), "speed_transmission": largest(speed_transmission),
        "force_transmission": largest(force_transmission)}
    if isinstance(kinematics, LinearDelta):
        found["acceleration_per_speed_squared_per_mm"] = largest(speed_acceleration)
    else:
        found["turn_lever_mm"] = lever(kinematics)
    return found


def _point(value: WorstValue) -> dict[str, Any]:
    return {"worst": value.value, "least_on_grid": value.least, "at_mm": list(value.place),
            "at_tilt_deg": value.tilt / DEG}


def _box(machine: Machine) -> dict[str, list[float]] | None:
    """In the proportions of the workspace, of a serial machine those of its linear travel, around their middle."""
    kinematics = machine.kinematics
    if isinstance(kinematics, LinearDelta | H4Linear):
        space = kinematics.workspace
        tip = space.middle - (0.0 if isinstance(kinematics, LinearDelta) else kinematics.gauge) * np.array([0, 0, 1.0])
        box = reachable_box(machine, tip, space.upper - space.lower)
    else:
        linear = ~np.array(machine.rotary)
        lower, upper = machine.limits.lower[linear], machine.limits.upper[linear]
        q = machine.home.copy()
        q[linear] = 0.5 * (lower + upper)
        tip, axis = kinematics.forward(q[None])
        box = reachable_box(machine, tip[0], upper - lower, axis[0])
    return _sides(box)


def _sides(box: Box | None) -> dict[str, list[float]] | None:
    return None if box is None else _span(np.array(box.lower), np.array(box.upper))


def _span(lower: Floats, upper: Floats) -> dict[str, list[float]]:
    return {letter: [float(lo), float(hi)] for letter, lo, hi in zip("xyz", lower, upper, strict=True)}
