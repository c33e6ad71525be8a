"""Everything that the analysis knows about one machine, as plain data with the unit in each key."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from machines.analysis.box import Box, reachable_box
from machines.analysis.chain import chain_figures
from machines.analysis.directions import tilts
from machines.analysis.extremes import MEASURES, largest_over, rates_over, slide_acceleration
from machines.analysis.limits_of_box import ends_of_box, extents, least_margins
from machines.analysis.singularity import grid_step_that_proves
from machines.analysis.transmission import (
    Measure,
    WorstValue,
    condition_number,
    conditioning_factor,
    force_transmission,
    heading_of,
    manipulability,
    speed_acceleration,
    speed_transmission,
    worst,
)
from machines.dynamics.report import dynamics_figures
from machines.kinematics.base import Kinematics
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.rod_platform import RodPlatform, Transmission
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.units import DEG

_WHERE = {True: "the tip of a tool of tool_mm, directions and turns by a lever (lever_mm)",
          False: "transmission and condition: the platform's reference point, turns by half the largest distance of its "
                 "joints; reach: the tip of a tool of tool_mm"}
GRID, COARSE = (11, 11, 11, 7), (5, 5, 5, 3)
"""places and tilts at which a worst value is first looked for; coarse where a tilt has several directions"""


def analyse(machine: Machine, singular_above: float | None = None) -> dict[str, Any]:
    """Figures of a machine; a serial one, whose slides pass their speed on as it is, has no transmission.

    Args:
        singular_above: mm; of a Delta with slides along z also the step of a grid that proves all singular
            values of a slice to be above it

    Raises:
        DiagnosticError: where that proof is asked for and the machine is of another kind.
    """
    found: dict[str, Any] = {"machine": machine.name, "structure": machine.structure, "axes": list(machine.axis_names),
                             "tool_mm": machine.kinematics.tool_length, "of": _WHERE[machine.kinematics.transmits is None]}
    if machine.kinematics.leg_geometry is not None:
        found["workspace_examined"] = "proved" if machine.certificate else "sampled"
    kinematics = machine.kinematics
    if (space := kinematics.workspace) is not None:
        found["workspace_mm"] = _span(space.lower, space.upper)
        found["tilt_range_deg"] = [t / DEG for t in space.tilt]
    if kinematics.transmits is not None:
        found |= _transmission(kinematics.transmits, kinematics.leg_geometry) | _roots(machine)
    if kinematics.on_rods is not None and not kinematics.on_rods.platform_turns:
        found["acceleration_per_speed_squared_per_mm"] = _largest(speed_acceleration, kinematics.on_rods) | _bent(kinematics)
    if kinematics.workspace is not None:
        found["least_margins"] = least_margins(machine)
        found |= extents(machine)
    if kinematics.transmits is None:
        found |= chain_figures(machine)
    found |= dynamics_figures(machine)
    box = _box(machine)
    every, largest = tilts(machine)
    found["tilt_in_every_direction_deg"] = every if np.isfinite(every) else None
    found["largest_tilt_deg"] = largest
    found["reachable_box_mm"] = _sides(box)
    found["reachable_box_ends_at"] = ends_of_box(machine, box)
    if singular_above is not None:
        found["singular_values_above_mm"] = singular_above
        found["proved_by_grid_step_mm"] = _proof_step(machine, singular_above)
    return found


def _proof_step(machine: Machine, floor: float) -> float | None:
    """mm; None where no grid down to the finest proves it."""
    rods = machine.kinematics.on_rods
    if rods is None or rods.platform_turns or not np.allclose(np.abs(rods.legs.directions[:, 2]), 1.0):
        raise DiagnosticError([error(
            "analysis.singular", f"the proof by a grid is for a linear Delta with slides along z, not for {machine.name}",
            hint="leave --singular-above out: convert keeps the distances from singular positions of the machine file")])
    return grid_step_that_proves(rods, floor)


def _transmission(kinematics: Transmission, legs: LegGeometry | None) -> dict[str, Any]:
    several = len(kinematics.headings) > 1
    found: dict[str, Any] = {
        "condition_number": _largest(condition_number, kinematics, several),
        "speed_transmission": _largest(speed_transmission, kinematics, several),
        "force_transmission": _largest(force_transmission, kinematics, several),
        "manipulability": _largest(manipulability, kinematics, several),
        "conditioning_factor": _least(conditioning_factor, kinematics, several)}
    over = None if legs is None or legs.holds is not None else rates_over(legs, kinematics.lever)
    for key, measure in MEASURES.items():
        if over is None:
            break
        extreme = largest_over(over, measure)
        if key == "conditioning_lost":
            factor = found["conditioning_factor"]
            factor |= {"nowhere_less_than": min(1.0 / extreme.most, factor["worst"]), "boxes_of_the_proof": extreme.boxes}
            continue
        most = max(extreme.most, found[key]["worst"]) if np.isfinite(extreme.most) else None
        found[key] |= {"nowhere_more_than": most, "boxes_of_the_proof": extreme.boxes}
    return found | ({"turn_lever_mm": kinematics.lever} if kinematics.lever else {})


def _bent(kinematics: Kinematics) -> dict[str, Any]:
    """What the acceleration per speed squared exceeds nowhere."""
    legs = kinematics.leg_geometry
    extreme = None if legs is None else largest_over(rates_over(legs, 0.0), slide_acceleration(legs))
    known = extreme is not None and np.isfinite(extreme.most)
    return {"nowhere_more_than": extreme.most, "boxes_of_the_proof": extreme.boxes} if known and extreme is not None else {}


def _roots(machine: Machine) -> dict[str, Any]:
    """How many poses the joints of home have, and how many joints the pose there: roots of the loops."""
    tip, axis = machine.kinematics.forward(machine.home[None])
    every = machine.kinematics.assembly_modes(machine.home[None])[0][:, 0]
    joints = machine.kinematics.with_all_roots().inverse(tip, axis)[:, 0]
    return {"assembly_modes_at_home": int(np.isfinite(every).all(axis=1).sum()),
            "inverse_branches_at_home": int(np.isfinite(joints).all(axis=1).sum())}


def _largest(measure: Any, parts: Transmission | RodPlatform, several: bool = False) -> dict[str, Any]:
    bound: Measure = partial(measure, parts)
    found = worst(bound, parts.workspace, COARSE if several else GRID)
    return _point(found) | _heading(measure, parts, found, several)


def _least(measure: Any, parts: Transmission, several: bool) -> dict[str, Any]:
    """The least value in the place of the largest."""
    found = worst(lambda place, tilt: -measure(parts, place, tilt), parts.workspace, COARSE if several else GRID)
    place = {key: value for key, value in _point(replace(found, value=-found.value)).items() if key != "least_on_grid"}
    return place | _heading(measure, parts, found, several, True) | {"best_on_grid": -found.least}


def _heading(measure: Any, parts: Any, at: WorstValue, several: bool, least: bool = False) -> dict[str, Any]:
    """Where a tilt has several directions, the one that is meant."""
    return {"at_heading_deg": heading_of(measure, parts, at, least) / DEG} if several else {}


def _point(value: WorstValue) -> dict[str, Any]:
    return {"worst": value.value, "least_on_grid": value.least, "at_mm": list(value.place),
            "at_tilt_deg": value.tilt / DEG}


def _box(machine: Machine) -> Box | None:
    """In the proportions of the workspace, of straight slides those of their travel, around their middle; else a cube."""
    kinematics = machine.kinematics
    if kinematics.on_rods is not None:
        space = kinematics.on_rods.workspace
        tip = space.middle - kinematics.on_rods.gauge_below * np.array([0, 0, 1.0])
        box = reachable_box(machine, tip, space.upper - space.lower)
    else:
        linear = ~np.array(machine.rotary)
        lower, upper = machine.limits.lower[linear], machine.limits.upper[linear]
        q = machine.home.copy()
        q[linear] = 0.5 * (lower + upper)
        tip, axis = kinematics.forward(np.stack([q, machine.home]))
        k = 0 if np.isfinite(tip[0]).all() else 1
        box = reachable_box(machine, tip[k], upper - lower if kinematics.straight_slides else np.ones(3), axis[k])
    return box


def _sides(box: Box | None) -> dict[str, list[float]] | None:
    return None if box is None else _span(np.array(box.lower), np.array(box.upper))


def _span(lower: Floats, upper: Floats) -> dict[str, list[float]]:
    return {letter: [float(lo), float(hi)] for letter, lo, hi in zip("xyz", lower, upper, strict=True)}
