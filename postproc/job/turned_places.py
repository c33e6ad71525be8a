"""Places that rotary tables turn to the spindle: where the part stands on the table, all axes at zero."""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from postproc.setup.model import Placement
from postproc.setup.places import PlaceSetup
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

STEP = 10.0
"""mm by which slides are moved to see how a table turns"""
SMALL = 1e-3
"""mm3 of what they span, below which nothing is seen"""
SQUARE = 1e-8
"""that a turn may be off a turn"""
SNAP = 1e-12
"""next to 0 or 1 that is one"""
SLACK = 1e-6
"""degrees"""


def turned(machine: Machine, place: PlaceSetup, placement: Placement, file: str) -> tuple[Placement, list[Diagnostic]]:
    """The placement (as the spindle sees it with the tables turned) with all axes at zero; as it is where tables stand."""
    said = f"place {place.name}: turn = {{ {', '.join(f'{a} = {v:g}' for a, v in place.turn.items())} }}"
    for letter, angle in place.turn.items():
        if letter not in machine.axis_names or _seen(machine, {letter: 90.0}) is None:
            tables = [a for a in machine.axis_names if a in "ABC" and _seen(machine, {a: 90.0}) is not None]
            return placement, [error(
                "places.turn", f"{said}: {letter} is no rotary table of {machine.name}", file=file, hint=f"its tables are "
                f"{', '.join(tables)}" if tables else "it has none: places differ by origin, x_axis, y_axis")]
        j = machine.axis_names.index(letter)
        low, high = float(machine.limits.lower[j]) / DEG, float(machine.limits.upper[j]) / DEG
        if not low - SLACK <= angle <= high + SLACK:
            return placement, [error("places.turn", f"{said} is outside the travel of {letter}, {low:g} to {high:g} degrees",
                                     file=file, hint="an angle inside travel, or another face")]
    turn = _seen(machine, place.turn) if any(place.turn.values()) else None
    return placement if turn is None else turn.behind(placement), []


def _seen(machine: Machine, turn: dict[str, float]) -> Placement | None:
    """What takes coordinates of the table at zero to those of the table turned (degrees), for what stands in the
    machine; None where that is nothing that a table does.

    Four places of the tool, the slides at home and each moved by STEP, are seen from the table at zero and turned.
    """
    rotary = np.array(machine.rotary)
    slides = np.flatnonzero(~rotary)
    q = np.tile(machine.home, (8, 1))
    q[:, rotary] = 0.0
    towards = np.where(machine.home + STEP > machine.limits.upper, -STEP, STEP)
    for k, j in enumerate(slides[:3].tolist(), 1):
        q[[k, k + 4], j] += towards[j]
    for letter, angle in turn.items():
        q[4:, machine.axis_names.index(letter)] = angle * DEG
    tips, axes = machine.kinematics.forward(q)
    before, after = (part[1:] - part[0] for part in (tips[:4], tips[4:]))
    if len(slides) < 3 or not np.isfinite(tips).all() or abs(np.linalg.det(before)) < SMALL:
        return None
    rotation: Floats = np.linalg.solve(before, after).T
    off = max(float(np.abs(rotation @ rotation.T - np.eye(3)).max()), float(np.abs(axes[:4] @ rotation.T - axes[4:]).max()))
    if off > SQUARE or np.allclose(rotation, np.eye(3), atol=SQUARE):
        return None
    rotation = np.where(np.abs(rotation - np.round(rotation)) < SNAP, np.round(rotation), rotation) + 0.0
    return Placement(rotation, tips[4] - rotation @ tips[0])
