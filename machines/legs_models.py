"""`[kinematics] kind = "legs"`: any platform on legs, its drives and freedoms as data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from machines.key_problem import KeyProblem
from machines.kinematics.base import Kinematics
from machines.kinematics.chain import LINEAR, ROTARY
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.loops import FREEDOMS, Loops
from machines.kinematics.legs.module_pins import MODULES
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.tip_axes import TipAxes
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from machines.leg_layouts import (
    UNIT,
    BoundedVector,
    DriveModel,
    PassiveModel,
    StarLayout,
    direction_problems,
    held_by,
    hinge_problems,
    holds_of,
    stray_keys,
)
from machines.legs_mobility import leg_faults, travel_faults
from machines.machine import ControlKinematics
from machines.models import KinematicsModel, Vector
from machines.slider_models import (
    ClearanceModel,
    RotaryModel,
    SeriesAxisModel,
    WorkspaceModel,
    clearance_sizes,
    lineardeltakins,
    rail_problems,
    series_problems,
)
from machines.user_model import UserModel
from toolpaths.arrays import Floats

Freedom = Literal["x", "y", "z", "a", "b", "c"]
PLATFORMS = ("xy", "xyz", "xyza", "xyzb", "xyzc", "xyzabc")
"""freedoms that a platform on rods may have"""
COUPLED = ("zab", "xyz", "xyzab")
"""those of a platform that hinges, a passive leg or rings hold besides: its other motions follow"""


class CarrierModel(UserModel):
    """One `[kinematics.carriers.LETTER]` table: a slide that carries the legs with their platform, or the part."""

    direction: Vector
    """unit vector: how positive q moves the tool, seen from the part"""


class PlatformBarModel(UserModel):
    """One `[kinematics.bars.NAME]` table: a part of the platform, hinged to it about the direction of its one turn.

    The pairs of rods that hold it leave it its direction (Company 2000, V-5).
    """

    hinge: BoundedVector
    """mm, from the platform's reference point"""


class LegsModel(KinematicsModel):
    """A platform on legs; the gauge point stands at `gauge` from its reference point, the tool along its z."""

    kind: Literal["legs"]
    freedoms: tuple[Freedom, ...]
    """translations along x, y, z of the machine frame and turns about them that the legs leave the platform"""
    gauge: BoundedVector = (0.0, 0.0, 0.0)
    """mm from the reference point of the level platform"""
    layout: StarLayout | None = None
    """legs in a ring, so that nobody types their coordinates"""
    rings: dict[str, StarLayout] = Field(default_factory=dict)
    """further rings, each a layout of its own drives and sizes, by any name"""
    legs: dict[str, DriveModel] = Field(default_factory=dict)
    """by axis letter; where the layout has a leg of that letter, in its place"""
    bars: dict[str, PlatformBarModel] = Field(default_factory=dict)
    """jointed parts of the platform, by name"""
    passive: dict[str, PassiveModel] = Field(default_factory=dict)
    """legs without a drive, by name"""
    carriers: dict[str, CarrierModel] = Field(default_factory=dict)
    """by axis letter"""
    table_axes: dict[str, SeriesAxisModel] = Field(default_factory=dict)
    """rotary axes under the part, by letter, from the part to the bed"""
    spindle_axes: dict[str, SeriesAxisModel] = Field(default_factory=dict)
    """rotary axes between platform and spindle, by letter, from the platform to the spindle"""
    rotary: RotaryModel | None = None
    """rotary axis under the part or at the spindle, of a platform that tilts about x or y"""
    workspace: WorkspaceModel
    """of the platform's reference point, carried; tilt: range of its one turn, of one that turns in every direction [0,
    largest] from z"""
    clearance: ClearanceModel = ClearanceModel.unstated()

    @property
    def drives(self) -> dict[str, DriveModel]:
        """All legs: those of the layout and the rings, of which tables of `legs` take the place, then the others."""
        found = dict[str, DriveModel]()
        for _, layout in self._layouts():
            found |= layout.legs()
        return found | self.legs

    def _layouts(self) -> list[tuple[tuple[str, ...], StarLayout]]:
        """With their paths in the table."""
        first = [] if self.layout is None else [(("layout",), self.layout)]
        return [*first, *((("rings", name), ring) for name, ring in self.rings.items())]

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Legs in the file's order, then carriers; linear ones before arms; last the rotary axis."""
        return (*self._leg_axes, *self.in_series, *(() if self.rotary is None else (self.rotary.letter,)))

    @property
    def _leg_axes(self) -> tuple[str, ...]:
        arms = [name for name, leg in self.drives.items() if leg.drive == "arm"]
        return (*(name for name in self.drives if name not in arms), *self.carriers, *arms)

    def describe(self) -> str:
        """How many legs of what, freedoms, and the count of Gruebler."""
        drives = [leg.drive for leg in self.drives.values()]
        kinds = " and ".join(f"{drives.count(d)} legs {'of changing length' if d == 'length' else f'on {d}s'}"
                             for d in dict.fromkeys(drives))
        redundant = ", which it moves along by itself too" if {"x", "y", "z"} <= set(self.freedoms) else ""
        carried = f", carried along {' '.join(self.carriers)}{redundant}" if self.carriers else ""
        where = "" if self.rotary is None else f", {self.rotary.place}"
        for names, place in ((self.table_axes, "under the part"), (self.spindle_axes, "between platform and spindle")):
            where += f", {' '.join(names)} {place}" if names else ""
        rest = [letter for letter in FREEDOMS if letter not in self.freedoms] if self.held else []
        follow = f", {' '.join(rest)} follow" if rest and "abc"[-1] in rest and not self.ringed else ""
        return f"{kinds}, platform free in {' '.join(self.freedoms)} (Gruebler {self.gruebler}){follow}{carried}{where}"

    @property
    def held(self) -> int:
        """Freedoms that hinges, rings and passive legs take."""
        return held_by(self.drives.values(), self.passive.values())

    @property
    def in_series(self) -> tuple[str, ...]:
        """Rotary axes before and behind the platform, from the part to the spindle."""
        return (*self.table_axes, *self.spindle_axes)

    @property
    def ringed(self) -> bool:
        """True where every leg ends on a ring about the tool: its turn about itself is nobody's."""
        return bool(self.drives) and all(leg.ring is not None for leg in self.drives.values())

    @property
    def gruebler(self) -> int:
        """Freedoms by the count of Gruebler: rods with spherical joints, in the plane hinges; 1 more for the hinge of a bar.

        Of a platform whose pairs hold it twice it is less than what moves.
        """
        rods = sum(max(len(leg.rods), 1) + (leg.hinge is not None) for leg in self.drives.values())
        return len(self.drives) + (6 if "z" in self.freedoms else 3) + len(self.bars) - rods - 3 * len(self.passive)

    def build(self) -> Kinematics:
        """The kinematics at the gauge point."""
        if self.in_series:
            tables, head = (tuple(one.joint(name) for name, one in axes.items())
                            for axes in (self.table_axes, self.spindle_axes))
            return LegsInSeries(self._on_legs(), tables, head)
        return self._on_legs() if self.rotary is None else self.rotary.on(self._on_legs(), np.array(self.gauge))

    def _on_legs(self) -> OnLegs:
        names, legs = self._leg_axes, list(self.drives.values())
        drives = Drives(
            np.array([leg.point for leg in legs]), np.array([leg.direction for leg in legs]),
            np.array([float(leg.rod) for leg in legs]), np.array([float(leg.root) for leg in legs]),
            np.array([leg.arm if leg.drive == "arm" else (0.0, 0.0, 0.0) for leg in legs]),
            np.array([leg.drive == "slide" for leg in legs]), np.array([leg.drive == "arm" for leg in legs]))
        joints, kept, on = np.array([leg.joint for leg in legs]), None, tuple[int, ...]()
        if self.bars:
            on_bar = np.array([leg.bar is not None for leg in legs])[:, None]
            hinges = np.array([(0.0, 0.0, 0.0) if leg.bar is None else self.bars[leg.bar].hinge for leg in legs])
            joints, kept = np.where(on_bar, hinges, joints), np.where(on_bar, joints, 0.0)
            on = tuple(-1 if leg.bar is None else list(self.bars).index(leg.bar) for leg in legs)
        own = tuple(sorted(self.freedoms, key=FREEDOMS.index))
        holds = holds_of(legs, self.passive.values())
        rings = np.array([leg.ring or 0.0 for leg in legs]) if any(leg.ring for leg in legs) else None
        loops = Loops(drives, joints, own if holds is None else FREEDOMS, kept, holds, () if holds is None else own, rings,
                      on, tuple(self.bars), tuple(self.passive),
                      tuple(k for k, leg in enumerate(legs) if leg.hinge is not None))
        return OnLegs(
            loops,
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
        """Pins of LinuxCNC's genhexkins or rotarydeltakins, or of lineardeltakins, where the machine is one: three slides
        X, Y, Z and no carrier.

        Raises:
            ValueError: where it is none; the message says what the module needs.
        """
        legs = list(self.drives.values())
        if (made := MODULES.get(module)) is not None:
            if self.carriers or self.rotary is not None or self.in_series:
                raise ValueError(f"{module} has no other axes than those of the legs")
            machine = self._on_legs()
            found = made(machine.loops, machine.gauge)
            at = machine.legs_at[list(found.order)].tolist()
            zero = found.zero[list(found.order)]
            found = replace(found, order=tuple(at), zero=zero)
            return ControlKinematics(module, found.pins, found.tool_length_pin, legs=found, axes=TipAxes.of(machine))
        others = self.carriers or self.in_series or {leg.drive for leg in legs} != {"slide"}
        if tuple(self.drives) != ("X", "Y", "Z") or others or set(self.freedoms) != set("xyz"):
            raise ValueError(f"module {module!r} is not known for this machine; a platform free in x y z on slides X, Y, Z "
                             "has lineardeltakins")
        rods = Legs(np.array([leg.point for leg in legs]), np.array([leg.direction for leg in legs]),
                    np.array([float(leg.rod) for leg in legs]), np.array([float(leg.root) for leg in legs]))
        return lineardeltakins(module, rods, np.array([leg.joint for leg in legs]) - np.array(self.gauge))

    def problems(self) -> Iterator[KeyProblem]:
        """Vectors that are no directions, letters, freedoms that do not go with the legs; faults over the workspace."""
        found = [fault for path, layout in self._layouts() for fault in layout.problems(path)] or [
            *self._table_problems(), *self._freedom_problems()]
        yield from found
        if not found and not self.examined:
            legs = list(self.drives.values())
            yield from leg_faults(self._on_legs(), [_pair(leg) for leg in legs], [leg.bar for leg in legs])

    def travel_problems(self, travel: Floats, home: Floats) -> Iterator[KeyProblem]:
        """See the base class."""
        count = len(self._leg_axes)
        yield from travel_faults(self._on_legs(), travel[:count], home[:count])

    def _table_problems(self) -> Iterator[KeyProblem]:
        for name, leg in self.legs.items():
            yield from stray_keys(leg, leg.drive, ("legs", name))
        yield from rail_problems(list(self.drives.values()), self.clearance)
        for name, leg in self.drives.items():
            yield from _letter(name, ("legs", name), ROTARY + LINEAR, leg.drive)
            yield from hinge_problems(leg, ("legs", name))
            yield from direction_problems(leg.direction, ("legs", name, "direction"))
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
        for name, passive in self.passive.items():
            yield from passive.problems(("passive", name))
        for name, carrier in self.carriers.items():
            yield from _letter(name, ("carriers", name), LINEAR, "carrier")
            yield from direction_problems(carrier.direction, ("carriers", name, "direction"))
            if name in self.drives:
                yield KeyProblem("machine.axis-letter", ("carriers", name), f"{name} drives a leg too",
                                 "choose another letter")

    def _jointed_problems(self) -> Iterator[KeyProblem]:
        turns = "".join(sorted(set(self.freedoms) & set("abc")))
        if self.bars and len(turns) != 1:
            yield KeyProblem("machine.geometry", ("bars",), f"bars are hinged about the one turn of a platform; freedoms = "
                             f"{list(self.freedoms)} has {len(turns)} turns", "take bars out, or write the freedoms that "
                             "the legs leave the platform")
        held = [leg.bar for leg in self.drives.values()]
        for name, leg in self.legs.items():
            if leg.bar is not None and leg.bar not in self.bars:
                yield KeyProblem("machine.geometry", ("legs", name, "bar"), f"{leg.bar!r} is none of the bars "
                                 f"{', '.join(self.bars) or '(there are none)'}", "write a [kinematics.bars.NAME] table for "
                                 "it, or its name as there")
        for name in self.bars:
            if name not in held:
                yield KeyProblem("machine.geometry", ("bars", name), f"no leg holds the bar {name!r}",
                                 f"write bar = {name!r} in the tables of its legs, or take the bar out")
        if self.in_series:
            yield from self._series_problems(turns)
        if self.rotary is not None:
            yield from self.rotary.problems((*self.drives, *self.carriers))
            if self.carriers:
                yield KeyProblem("machine.geometry", ("carriers",), "a platform with a rotary axis is carried by no slides: "
                                 "it moves along x, y and z by itself", "take [kinematics.carriers] out, or "
                                 "[kinematics.rotary]")
            if turns not in ("a", "b"):
                yield KeyProblem("machine.geometry", ("rotary",), "a rotary axis goes with a platform that tilts about "
                                 f"x or y; this one is free in {' '.join(self.freedoms)}", "take [kinematics.rotary] "
                                 "out, or write the freedoms x y z a, or x y z b, where legs leave them")

    def _series_problems(self, turns: str) -> Iterator[KeyProblem]:
        """Rotary axes in series that do not go with the platform."""
        yield from series_problems(self.table_axes, self.spindle_axes, self._leg_axes, bool(self.held), np.array(self.gauge))
        if turns or self.rotary is not None:
            yield KeyProblem("machine.geometry", ("table_axes" if self.table_axes else "spindle_axes",), "rotary axes in "
                             "series go with a platform that moves along x, y and z alone; this one is free in "
                             f"{' '.join(self.freedoms)}" + ", and has [kinematics.rotary]" * (self.rotary is not None),
                             "take them out, or write [kinematics.rotary] of a platform that tilts about x or y")
        moves = np.array([*(np.eye(3)["xyz".index(f)] for f in self.freedoms if f in "xyz"),
                          *(np.array(c.direction) for c in self.carriers.values())])
        if len(moves) != 3 or (self.held and self.carriers):
            yield KeyProblem("machine.geometry", ("carriers",), "rotary axes in series need a tip that legs and carriers "
                             f"bring to one place in one position; these move it in {len(moves)} directions",
                             "write carriers for what the platform lacks, and no others")

    def _freedom_problems(self) -> Iterator[KeyProblem]:
        yield from self._jointed_problems()
        own = "".join(sorted(self.freedoms, key=FREEDOMS.index))
        known = COUPLED if self.held else PLATFORMS
        if own not in known:
            yield KeyProblem("machine.geometry", ("freedoms",), f"{list(self.freedoms)} is none of "
                             + ", ".join(" ".join(p) for p in known) + (" of a platform with hinges, rings or a passive leg"
                             if self.held else ""), "write the freedoms that the legs leave the platform")
            return
        if len(self.drives) != len(own):
            yield KeyProblem("machine.geometry", ("legs",), f"{len(self.drives)} legs for {len(own)} freedoms",
                             "write one [kinematics.legs.LETTER] table per freedom")
        if self.held:
            yield from self._held_problems(own)
        yield from self._carrier_problems(own)
        low, high = self.workspace.tilt
        about_all = own.endswith(("abc", "zab"))
        least, most = (0.0, 0.0) if own in ("xy", "xyz") else (0.0 if about_all else -90.0, 90.0)
        if not (low == high == 0.0 or (least <= low <= 0.0 <= high < most and low > -90.0)):
            yield KeyProblem("machine.geometry", ("workspace", "tilt"), f"{[low, high]} degrees cannot be the tilt of "
                             f"this platform, free in {' '.join(own)}", "write tilt = [0, largest] with a b c, [lower, "
                             "upper] about one axis with a, b or c, less than 90 degrees; none without turns")

    def _held_problems(self, own: str) -> Iterator[KeyProblem]:
        """Hinges, rings and passive legs that do not go with the freedoms."""
        if self.held + len(own) != len(FREEDOMS):
            yield KeyProblem("machine.geometry", ("freedoms",), f"hinges, rings and passive legs take {self.held} of six "
                             f"freedoms, {list(self.freedoms)} has {len(own)}", "a leg on a hinge takes one, a passive leg "
                             "three, rings the turn of the tool about itself; write the freedoms that are left")
        free = set(self.freedoms)
        if (free == set("xyzab")) != self.ringed:
            yield KeyProblem("machine.geometry", ("freedoms",), "x y z a b are the freedoms of a platform all of whose legs "
                             "end on rings about the tool", "write ring = mm of every leg, or of none")
        if free == set("zab") and len(self.carriers) != 2:
            yield KeyProblem("machine.geometry", ("carriers",), f"{len(self.carriers)} carriers: a platform free in z a b "
                             "goes aside as it tilts, and has nothing of its own to bring the tip back",
                             "write two [kinematics.carriers.LETTER] tables, of slides along x and y")
        if free == set("xyz") and not self.in_series:
            yield KeyProblem("machine.geometry", ("freedoms",), "the platform turns as it goes aside, and nothing turns the "
                             "tool back", "write the axes of its wrist as [kinematics.spindle_axes.LETTER]")

    def _carrier_problems(self, own: str) -> Iterator[KeyProblem]:
        """Carriers add what the platform lacks; under one that moves along x, y and z they are redundant, all of them."""
        carriers = [np.array(c.direction) for c in self.carriers.values()]
        whole = set("xyz") <= set(own)
        moves = carriers if whole else [np.eye(3)[i] for i in range(3) if "xyz"[i] in own] + carriers
        if moves and (len(moves) > 3 or np.linalg.svd(np.array(moves), compute_uv=False)[-1] < 0.1):
            where = "one another" if whole else "the platform"
            yield KeyProblem("machine.geometry", ("carriers",), f"carriers {', '.join(self.carriers)} move the tool where "
                             f"{where} move{'s' * (not whole)} it already", "a carrier adds a direction to those of the "
                             "other carriers, and of a platform that does not move along x, y and z by itself")


def _pair(leg: DriveModel) -> Floats | None:
    return np.subtract(leg.rods[0], leg.rods[1]) if len(leg.rods) == 2 else None


def _letter(name: str, path: tuple[str, ...], allowed: str, what: str) -> Iterator[KeyProblem]:
    if len(name) != 1 or name not in allowed:
        yield KeyProblem("machine.axis-letter", path, f"{name!r} is not a letter of {what}s", f"choose from "
                                                                                              f"{' '.join(allowed)}")
