"""`[kinematics] kind = "legs"`: any platform on legs, its drives and freedoms as data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from machines.key_problem import KeyProblem
from machines.kinematics.chain import LINEAR, ROTARY
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import FREEDOMS, Loops
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from machines.leg_layouts import BoundedVector, DriveModel, StarLayout, stray_keys
from machines.legs_mobility import leg_faults, travel_faults
from machines.machine import ControlKinematics
from machines.models import KinematicsModel, Vector
from machines.slider_models import (
    UNIT,
    ClearanceModel,
    WorkspaceModel,
    clearance_sizes,
    lineardeltakins,
    rail_problems,
)
from machines.user_model import UserModel
from toolpaths.arrays import Floats

Freedom = Literal["x", "y", "z", "a", "b", "c"]
PLATFORMS = ("xy", "xyz", "xyza", "xyzb", "xyzabc")
"""freedoms that a platform may have"""


class CarrierModel(UserModel):
    """One `[kinematics.carriers.LETTER]` table: a slide that carries the legs with their platform, or the part."""

    direction: Vector
    """unit vector: how positive q moves the tool, seen from the part"""


class LegsModel(KinematicsModel):
    """A platform on legs; the gauge point stands at `gauge` from its reference point, the tool along its z."""

    kind: Literal["legs"]
    freedoms: tuple[Freedom, ...]
    """translations along x, y, z of the machine frame and turns about them that the legs leave the platform"""
    gauge: BoundedVector = (0.0, 0.0, 0.0)
    """mm from the reference point of the level platform"""
    layout: StarLayout | None = None
    """legs in a ring, so that nobody types their coordinates"""
    legs: dict[str, DriveModel] = Field(default_factory=dict)
    """by axis letter; where the layout has a leg of that letter, in its place"""
    carriers: dict[str, CarrierModel] = Field(default_factory=dict)
    """by axis letter"""
    workspace: WorkspaceModel
    """of the platform's reference point, carried; tilt: of a platform that turns in every direction [0, largest]"""
    clearance: ClearanceModel = ClearanceModel()

    @property
    def drives(self) -> dict[str, DriveModel]:
        """All legs: those of the layout, of which tables of `legs` take the place, then the others."""
        return (self.layout.legs() if self.layout else {}) | self.legs

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Legs in the file's order, then carriers; linear ones before arms."""
        arms = [name for name, leg in self.drives.items() if leg.drive == "arm"]
        return (*(name for name in self.drives if name not in arms), *self.carriers, *arms)

    def describe(self) -> str:
        """How many legs of what, freedoms, and the count of Gruebler (spherical joints, of hinges along z in the plane)."""
        drives = [leg.drive for leg in self.drives.values()]
        kinds = " and ".join(f"{drives.count(d)} legs {'of changing length' if d == 'length' else f'on {d}s'}"
                             for d in dict.fromkeys(drives))
        count = len(drives) + (6 if "z" in self.freedoms else 3) - sum(max(len(leg.rods), 1) for leg in self.drives.values())
        carried = f", carried along {' '.join(self.carriers)}" if self.carriers else ""
        return f"{kinds}, platform free in {' '.join(self.freedoms)} (Gruebler {count}){carried}"

    def build(self) -> OnLegs:
        """The kinematics at the gauge point."""
        names, legs = self.axis_names, list(self.drives.values())
        drives = Drives(
            np.array([leg.point for leg in legs]), np.array([leg.direction for leg in legs]),
            np.array([float(leg.rod) for leg in legs]), np.array([float(leg.root) for leg in legs]),
            np.array([leg.arm if leg.drive == "arm" else (0.0, 0.0, 0.0) for leg in legs]),
            np.array([leg.drive == "slide" for leg in legs]), np.array([leg.drive == "arm" for leg in legs]))
        return OnLegs(
            Loops(drives, np.array([leg.joint for leg in legs]), tuple(sorted(self.freedoms, key=FREEDOMS.index))),
            self._space(), np.array(self.gauge), names,
            tuple(name in self.drives and self.drives[name].drive == "arm" for name in names),
            np.array([names.index(name) for name in self.drives]),
            np.array([names.index(name) for name in self.carriers], dtype=np.int64),
            np.array([c.direction for c in self.carriers.values()], dtype=np.float64).reshape(-1, 3),
            clearance_sizes(legs, self.clearance))

    def _space(self) -> Workspace:
        """The workspace, without height where neither platform nor carriers move along z: there the platform stands at 0."""
        space = self.workspace.build()
        moves = "z" in self.freedoms or any(carrier.direction[2] for carrier in self.carriers.values())
        flat = np.array([1.0, 1.0, 0.0])
        return space if moves else replace(space, lower=space.lower * flat + 0.0, upper=space.upper * flat + 0.0)

    def control(self, module: str) -> ControlKinematics:
        """Pins of LinuxCNC's lineardeltakins, where the machine is one: three slides X, Y, Z and no carrier.

        Raises:
            ValueError: where it is none; the message says what the module needs.
        """
        legs = list(self.drives.values())
        if tuple(self.drives) != ("X", "Y", "Z") or self.carriers or {leg.drive for leg in legs} != {"slide"} \
                or set(self.freedoms) != set("xyz"):
            raise ValueError(f"module {module!r} is not known for this machine; a platform free in x y z on slides X, Y, Z "
                             "has lineardeltakins")
        rods = Legs(np.array([leg.point for leg in legs]), np.array([leg.direction for leg in legs]),
                    np.array([float(leg.rod) for leg in legs]), np.array([float(leg.root) for leg in legs]))
        return lineardeltakins(module, rods, np.array([leg.joint for leg in legs]) - np.array(self.gauge))

    def problems(self) -> Iterator[KeyProblem]:
        """Vectors that are no directions, letters, freedoms that do not go with the legs; faults over the workspace."""
        found = list(self.layout.problems() if self.layout else ()) or [*self._table_problems(), *self._freedom_problems()]
        yield from found
        if not found and not self.certificate:
            yield from leg_faults(self.build(), [_pair(leg) for leg in self.drives.values()])

    def travel_problems(self, travel: Floats, home: Floats) -> Iterator[KeyProblem]:
        """See the base class."""
        yield from travel_faults(self.build(), travel, home)

    def _table_problems(self) -> Iterator[KeyProblem]:
        for name, leg in self.legs.items():
            yield from stray_keys(leg, leg.drive, ("legs", name))
        yield from rail_problems(list(self.drives.values()), self.clearance)
        for name, leg in self.drives.items():
            yield from _letter(name, ("legs", name), ROTARY if leg.drive == "arm" else LINEAR, leg.drive)
            yield from _direction(leg.direction, ("legs", name, "direction"))
            if leg.drive == "arm" and not 0.0 < np.linalg.norm(leg.arm) < 1e6:
                yield KeyProblem("machine.geometry", ("legs", name), f"the arm of leg {name} is {list(leg.arm)}",
                                 "write arm = [x, y, z], from the axis to the rod's foot at 0")
            if abs(float(np.dot(leg.arm, leg.direction))) > UNIT * max(float(np.linalg.norm(leg.arm)), 1.0):
                yield KeyProblem("machine.geometry", ("legs", name, "arm"), f"{list(leg.arm)} is not square to the axis "
                                 f"{list(leg.direction)}", "move `point` along the axis")
            if leg.drive != "length" and leg.rod == 0.0:
                yield KeyProblem("machine.geometry", ("legs", name, "rod"), f"the rod of leg {name} has no length",
                                 "write it in mm")
            if (pair := _pair(leg)) is not None and np.linalg.norm(pair) < UNIT:
                yield KeyProblem("machine.geometry", ("legs", name, "rods"), f"the two rods of leg {name} coincide",
                                 "write the place of each, or one rod")
        for name, carrier in self.carriers.items():
            yield from _letter(name, ("carriers", name), LINEAR, "carrier")
            yield from _direction(carrier.direction, ("carriers", name, "direction"))
            if name in self.drives:
                yield KeyProblem("machine.axis-letter", ("carriers", name), f"{name} drives a leg too",
                                 "choose another letter")

    def _freedom_problems(self) -> Iterator[KeyProblem]:
        own = "".join(sorted(self.freedoms, key=FREEDOMS.index))
        if own not in PLATFORMS:
            yield KeyProblem("machine.geometry", ("freedoms",), f"{list(self.freedoms)} is none of "
                             + ", ".join(" ".join(p) for p in PLATFORMS), "write the freedoms that the legs leave "
                             "the platform")
            return
        if len(self.drives) != len(own):
            yield KeyProblem("machine.geometry", ("legs",), f"{len(self.drives)} legs for {len(own)} freedoms",
                             "write one [kinematics.legs.LETTER] table per freedom")
        moves = [np.eye(3)[i] for i in range(3) if "xyz"[i] in own] + [np.array(c.direction) for c in self.carriers.values()]
        if len(moves) > 3 or np.linalg.svd(np.array(moves), compute_uv=False)[-1] < 0.1:
            yield KeyProblem("machine.geometry", ("carriers",), f"carriers {', '.join(self.carriers)} move the tool "
                             "where the platform moves it already",
                             "a carrier adds a direction that the platform does not have")
        low, high = self.workspace.tilt
        least, most = (0.0, 0.0) if own in ("xy", "xyz") else (0.0 if own.endswith("abc") else -90.0, 90.0)
        if not (low == high == 0.0 or (least <= low <= 0.0 <= high < most and low > -90.0)):
            yield KeyProblem("machine.geometry", ("workspace", "tilt"), f"{[low, high]} degrees cannot be the tilt of "
                             f"this platform, free in {' '.join(own)}", "write tilt = [0, largest] with a b c, [lower, "
                             "upper] about one axis with a or b, less than 90 degrees; none without turns")


def _pair(leg: DriveModel) -> Floats | None:
    return np.subtract(leg.rods[0], leg.rods[1]) if len(leg.rods) == 2 else None


def _letter(name: str, path: tuple[str, ...], allowed: str, what: str) -> Iterator[KeyProblem]:
    if len(name) != 1 or name not in allowed:
        yield KeyProblem("machine.axis-letter", path, f"{name!r} is not a letter of {what}s", f"choose from "
                                                                                              f"{' '.join(allowed)}")


def _direction(vector: Vector, path: tuple[str, ...]) -> Iterator[KeyProblem]:
    length = float(np.linalg.norm(vector))
    if abs(length - 1.0) > UNIT:
        yield KeyProblem("machine.geometry", path, f"{list(vector)} has length {length:.6g}, not 1", "write a unit vector")
