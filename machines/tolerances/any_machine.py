"""Influence of every dimension of any machine, by its model of geometric errors: axes in a chain, carriers, rotary axes in
series with a platform, and the rods of platforms on bars, on hinges, on rings or round a passive leg.

Dimensions are those that an error model has as constants: the line of each axis (ISO 230-1, EX0C ... EB0C, and where it
counts from), the spindle's, and of legs rails, guides, joints, lengths and zeros of drives, hinges of bars and legs, rings,
and a passive leg. S is the model's own first-order sensitivity in the table frame (exact closure differentiated; Company
2000, E-15), adjusted as F.3.4 says by the lengths of the rods that together make the tool right in the middle.
"""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.axis_motion import effect
from machines.geometric_error.actual.bearings import ANGLES
from machines.geometric_error.actual.leg_frame import frame_of
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, gives_rods, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.tables.names import DIRECTIONS, SPINDLE, ErrorName
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from machines.tolerances.sensitivity import DimensionPart, LegDimension
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

GRID, TURNS, LOOKS = (5, 5, 3, 3), 4, 400
"""places and tilts of a platform, rotary axes at each; random positions of a chain of axes"""
PART_OF: dict[str, DimensionPart] = {"rail": "drive", "guide": "guide", "carriage": "foot", "platform": "joint",
                                     "length": "rod", "drive": "zero", "hinge": "joint", "hinge_turn": "guide",
                                     "ring": "joint", "point": "drive", "joint": "joint", "line_turn": "guide",
                                     "square": "guide"}
"""what an error model calls the dimensions of legs"""


@dataclass(frozen=True, eq=False)
@arrays(q="N J", pose="N 5")
class MachinePositions:
    """Joints of N positions, and where the tool then is: x, y, z of the tip, tilt and heading of its axis."""

    q: Floats
    pose: Floats

    def part(self, rows: slice) -> MachinePositions:
        """Some of them."""
        return MachinePositions(self.q[rows], self.pose[rows])


@dataclass(frozen=True, eq=False)
class AnyMachine:
    """A machine at the tip of a tool, with all of its dimensions, none of them off."""

    model: ErrorModel
    actual: Actual
    dimensions: tuple[LegDimension, ...]

    def off(self, dimension: int, size: float) -> Actual:
        """The machine with one dimension off by mm or rad, exactly."""
        return self.model.with_values(size * np.eye(len(self.dimensions))[dimension]).on(self.actual.kinematics)

    def influence(self, positions: MachinePositions) -> Floats:
        """S (N, 6, E): error of the tip (mm) and of the tool's turn (rad) per error of each dimension (mm, rad)."""
        return self.actual.sensitivity(self.actual.coordinates(positions.q))

    def adjusted(self, positions: MachinePositions, middle: MachinePositions, lever: float) -> Floats:
        """The same once the rods' lengths are set so that in the position `middle` as little as can be is off; a turn counts
        `lever` mm per rad there."""
        there, scale = self.influence(middle)[0], np.repeat([1.0, lever], 3)[:, None]
        rods = [k for k, one in enumerate(self.dimensions) if one.part == "rod"]
        lengths = -np.linalg.pinv(scale * there[:, rods], rcond=1e-9) @ (scale * there)
        s = self.influence(positions)
        return np.asarray(s + s[:, :, rods] @ lengths)


def any_machine(machine: Machine, tool: float) -> AnyMachine | None:
    """Its dimensions; None of a kind without errors."""
    kinematics = machine.kinematics.with_tool(tool)
    letters = [*kinematics.axes_with_errors, SPINDLE]
    names = [name for letter in letters for name in (ErrorName(part, True, letter) for part in range(len(DIRECTIONS)))
             if (letter == SPINDLE or not name.zero_position) and effect(name, kinematics)]
    names += [ErrorName(part, True, letter) for letter in letters for part in range(len(DIRECTIONS))
              if letter != SPINDLE and ErrorName(part, True, letter).zero_position]
    rods = _rods(kinematics)
    model = ErrorModel(SerialErrors(constants={str(name): 0.0 for name in names}), rods)
    try:
        actual = model.on(kinematics)
    except ValueError:
        return None
    own = () if rods is None else tuple(_of_rods(name, rods) for name in rods.names)
    return AnyMachine(model, actual, (*own, *(_of_axis(name) for name in names)))


def _rods(kinematics: Kinematics) -> RodErrors | None:
    if (own := frame_of(kinematics)) is not None:
        return own.zero
    if (rods := kinematics.on_rods) is None:
        return None
    slides = kinematics.axis_names[: len(rods.legs.points)]
    pairs = () if gives_rods(rods) else (1.0,) * len(slides)
    return RodErrors.none(slides, rod_names(rod_frame(rods, pairs), slides), pairs)


def _of_rods(name: str, rods: RodErrors) -> LegDimension:
    who, what, *axis = name.removeprefix("bars.").removeprefix("passive.").split(".")
    turns = what == "square" or (what == "drive" and who in rods.arms)
    letter = "abc"["xyz".index(axis[0])] if what in ANGLES else axis[0] if axis else "turn" if turns else ""
    return LegDimension(PART_OF[what], f"{who} {what}" if name in rods.bearing_names else who, letter)


def _of_axis(name: ErrorName) -> LegDimension:
    part: DimensionPart = "zero" if name.zero_position else "axis"
    return LegDimension(part, name.axis, DIRECTIONS[name.part].lower())


def positions_of(machine: Machine, tool: float) -> MachinePositions:
    """First the middle of the workspace, of a chain of axes home, then its edges and places all over it."""
    kinematics = machine.kinematics
    rng, low, high = np.random.default_rng(0), machine.limits.lower, machine.limits.upper
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    if (over := kinematics.over_workspace) is not None:
        place, tilt = over.workspace.grid(GRID)
        platform = np.column_stack([place, tilt])
        turning = [j for j in range(kinematics.joints) if kinematics.axis_names[j] in kinematics.axes_with_errors
                   and kinematics.rotary[j]]
        count = TURNS if turning else 1
        middle = np.append(over.workspace.middle, np.clip(0.0, *over.workspace.tilt))
        platform = np.vstack([middle, np.repeat(platform, count, axis=0)])
        turn = rng.uniform(low[turning], high[turning], (len(platform), len(turning)))
        turn[0] = np.clip(0.0, low[turning], high[turning])
        q = over.joints_at(platform, turn)
    else:
        q = np.vstack([machine.home[None], low[None], high[None], rng.uniform(low, high, (LOOKS, len(low)))])
    q = q[np.isfinite(q).all(axis=1)]
    tip, axis = kinematics.with_tool(tool).forward(q)
    flat = np.hypot(axis[:, 0], axis[:, 1])
    pose = np.column_stack([tip, np.arctan2(flat, axis[:, 2]), np.arctan2(axis[:, 1], axis[:, 0]) * (flat > 1e-12)])
    good = np.isfinite(pose).all(axis=1)
    return MachinePositions(q[good], pose[good])
