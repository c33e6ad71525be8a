"""What the `[kinematics]` tables of machines on legs share: legs on slides, workspace, clearances, a fifth axis."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Literal, Protocol

import numpy as np
from pydantic import Field

from machines.key_problem import KeyProblem
from machines.kinematics.chain import LINEAR, ROTARY, Joint
from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.rotary_axis import HeadAxis, TableAxis, TiltAbout
from machines.kinematics.legs.series_poses import meeting_point
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from machines.leg_layouts import UNIT, StarLayout, direction_problems
from machines.machine import ControlKinematics
from machines.models import Interval, KinematicsModel, NotNegative, Positive, Vector
from machines.user_model import UserModel
from toolpaths.arrays import Floats
from toolpaths.units import DEG

MOST_AXES, INDEPENDENT, MEETS = 2, 1e-3, 1e-6
"""rotary axes in series with a platform; least sine between two; mm by which lines may pass each other that meet"""


class LegModel(UserModel):
    """One `[kinematics.legs.LETTER]` table, mm; the order of the tables is the order of the joints."""

    slide: Vector
    """carriage joint at q = 0, in the machine frame"""
    direction: Vector
    """unit vector of positive q"""
    joint: Vector = (0.0, 0.0, 0.0)
    """platform joint relative to the platform's reference point"""
    rod: Positive
    """length of the rods"""
    root: Literal[1, -1] = 1
    """1 where the carriage stands on the positive side of the platform joint (larger q of two), -1 on the other"""
    rods: tuple[Vector, ...] = ()
    """each rod's place next to the leg's line, the same at both ends: two for a pair of parallel rods"""
    rail_offset: Vector = (0.0, 0.0, 0.0)
    """from the line of the carriage joint to the middle of the rail"""
    rail_ends: Interval | None = None
    """q of the rail's ends; without it the rail is left out of the clearances"""


class WorkspaceModel(UserModel):
    """`[kinematics.workspace]`: box of the platform's reference point in the machine frame, mm; tilt in degrees."""

    x: Interval
    """lower, upper"""
    y: Interval
    """lower, upper"""
    z: Interval
    """lower, upper"""
    tilt: tuple[float, float] = (0.0, 0.0)
    """range of the platform's tilt about x"""

    def build(self) -> Workspace:
        """In mm and rad."""
        low, high = zip(self.x, self.y, self.z, strict=True)
        return Workspace(np.array(low), np.array(high), (self.tilt[0] * DEG, self.tilt[1] * DEG))


class ClearanceModel(UserModel):
    """`[kinematics.clearance]`: what may touch, mm and degrees; a key left out is not checked."""

    rod_radius: Positive | None = None
    """of every rod"""
    spindle_radius: Positive | None = None
    """of the spindle round the tool axis"""
    spindle: Interval = (0.0, 1.0)
    """lower and upper end of the spindle above the gauge point along the tool axis"""
    rail_radius: NotNegative | None = None
    """of the fixed part of every slide, as a round bar"""
    carriage_angle: Positive | None = None
    """largest swing of a rod at its carriage from its direction in the middle of the workspace"""
    platform_angle: Positive | None = None
    """the same at its platform joint"""
    assumed: tuple[Literal["rod_radius", "spindle_radius", "spindle", "rail_radius", "carriage_angle",
                           "platform_angle"], ...] = ()
    """keys of this table whose figure no document states"""


class SliderModel(KinematicsModel):
    """What these kinds share."""

    layout: StarLayout | None = None
    """legs in a ring, so that nobody types their coordinates; as of kind "legs", of slides"""
    legs: dict[str, LegModel] = Field(default_factory=dict)
    """by axis letter; where the layout has a leg of that letter, in its place"""
    workspace: WorkspaceModel
    clearance: ClearanceModel = ClearanceModel.unstated()

    @property
    def slides(self) -> dict[str, LegModel]:
        """All legs: those of the layout, of which tables of `legs` take the place, then the others."""
        ring = {} if self.layout is None else self.layout.legs()
        return {name: LegModel(slide=leg.point, direction=leg.direction, joint=leg.joint, rod=leg.rod, root=leg.root,
                               rods=leg.rods, rail_offset=leg.rail_offset, rail_ends=leg.rail_ends)
                for name, leg in ring.items()} | self.legs

    def _layout_problems(self) -> Iterator[KeyProblem]:
        if self.layout is None:
            return
        yield from self.layout.problems(("layout",))
        if self.layout.drive != "slide":
            yield KeyProblem("machine.geometry", ("layout", "drive"), f"the legs of kind {self.kind!r} are on slides",
                             'write drive = "slide", or kind = "legs"')
        if self.layout.rod <= 0.0:
            yield KeyProblem("machine.geometry", ("layout", "rod"), "the rods have no length", "write it in mm")

    def build_legs(self) -> Legs:
        """The leg law's numbers."""
        legs = self.slides.values()
        return Legs(np.array([leg.slide for leg in legs]), np.array([leg.direction for leg in legs]),
                    np.array([leg.rod for leg in legs]), np.array([float(leg.root) for leg in legs]))

    def platform_joints(self) -> Floats:
        """(K, 3) mm"""
        return np.array([leg.joint for leg in self.slides.values()])

    def build_clearance(self) -> ClearanceSizes:
        """In mm and rad."""
        return clearance_sizes(list(self.slides.values()), self.clearance)

    def gruebler(self, legs: int) -> str:
        """The count of Gruebler in words, of rods with spherical joints; "" where a leg does not say what its rods are."""
        rods = [len(leg.rods) for leg in self.slides.values()]
        return f" (Gruebler {legs + 6 - sum(rods)})" if all(rods) else ""

    @property
    @abstractmethod
    def leg_count(self) -> int:
        """Legs that this kind has."""

    def problems(self) -> Iterator[KeyProblem]:
        """Vectors that are no directions, a workspace out of reach, a platform that moves otherwise than the kind."""
        found = list(self._layout_problems()) or [
            *self._leg_problems(), *rail_problems(list(self.slides.values()), self.clearance)]
        yield from found
        if not found and not self.examined:
            yield from self.mobility_problems()

    def _leg_problems(self) -> Iterator[KeyProblem]:
        if len(self.slides) != self.leg_count:
            yield KeyProblem("machine.geometry", ("legs",),
                          f"{len(self.slides)} legs; kind {self.kind!r} has {self.leg_count}",
                          "write one [kinematics.legs.LETTER] table per leg")
        for name, leg in self.slides.items():
            length = float(np.linalg.norm(leg.direction))
            if abs(length - 1.0) > UNIT:
                yield KeyProblem("machine.geometry", ("legs", name, "direction"),
                                 f"{list(leg.direction)} has length {length:.6g}, not 1", "write a unit vector")
            if len(name) != 1 or name not in LINEAR:
                yield KeyProblem("machine.axis-letter", ("legs", name), f"{name!r} is not a letter of a linear axis",
                                 "choose from X Y Z U V W P Q R")
            if len(leg.rods) > 2:
                yield KeyProblem("machine.geometry", ("legs", name, "rods"),
                                 f"{len(leg.rods)} rods; a leg has one or two")

    @abstractmethod
    def mobility_problems(self) -> Iterator[KeyProblem]:
        """Faults that show over the workspace."""


class RodsOfLeg(Protocol):
    """What clearances need of a leg's table."""

    rods: tuple[Vector, ...]
    rail_offset: Vector
    rail_ends: Interval | None


def clearance_sizes(legs: Sequence[RodsOfLeg], given: ClearanceModel) -> ClearanceSizes:
    """Of the tables of the legs, in mm and rad."""
    shifts = [(k, shift) for k, leg in enumerate(legs) for shift in leg.rods or ((0.0, 0.0, 0.0),)]
    rails = all(leg.rail_ends is not None for leg in legs) and given.rail_radius is not None
    return ClearanceSizes(
        leg=np.array([k for k, _ in shifts]), shift=np.array([s for _, s in shifts]), rod_radius=given.rod_radius,
        spindle_radius=given.spindle_radius, spindle=given.spindle, rail_radius=given.rail_radius if rails else None,
        rail_offset=np.array([leg.rail_offset for leg in legs]),
        rail_ends=np.array([leg.rail_ends or (0.0, 0.0) for leg in legs]),
        carriage_angle=_radians(given.carriage_angle), platform_angle=_radians(given.platform_angle))


def rail_problems(legs: Sequence[RodsOfLeg], given: ClearanceModel) -> Iterator[KeyProblem]:
    """Rails that are to be kept clear of, where not every leg says where its rail ends."""
    if given.rail_radius is not None and any(leg.rail_ends is None for leg in legs):
        yield KeyProblem("machine.geometry", ("clearance", "rail_radius"), "rail_radius is stated, and not every leg has "
                         "rail_ends: no rail would be looked at", "write rail_ends of each slide, or take rail_radius out")


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else degrees * DEG


def lineardeltakins(module: str, legs: Legs, joints: Floats) -> ControlKinematics:
    """Pins L and R of LinuxCNC's lineardeltakins: three slides along z at R from the z axis, 120 degrees apart.

    Its joints stand at 90, 210 and 330 degrees, equal rods above the platform, whose size is taken off R.

    Args:
        joints: (3, 3) mm, of the platform seen from the gauge point

    Raises:
        ValueError: where the legs are others, or the module; the message says what it needs.
    """
    if module != "lineardeltakins":
        raise ValueError(f"module {module!r} is not known for linear Deltas; known: lineardeltakins")
    feet = legs.points - joints
    radius = float(np.hypot(*feet[0, :2]))
    turn = np.array([90.0, 210.0, 330.0]) * DEG
    wanted = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1)
    if not np.allclose(feet, wanted, atol=1e-9):
        raise ValueError(f"{module} needs slide - joint of the legs at 90, 210, 330 degrees and z = 0")
    if not np.allclose(legs.directions, np.tile([0.0, 0.0, 1.0], (3, 1)), atol=1e-12, rtol=0.0):
        raise ValueError(f"{module} needs slides along [0, 0, 1]")
    if len(set(legs.lengths)) > 1 or np.any(legs.roots < 0):
        raise ValueError(f"{module} needs rods of one length and root = 1")
    return ControlKinematics(module, {"lineardeltakins.L": float(legs.lengths[0]), "lineardeltakins.R": radius})


class SeriesAxisModel(UserModel):
    """`[kinematics.table_axes.LETTER]`, `[kinematics.spindle_axes.LETTER]`: a rotary axis in series with a platform.

    Tables come from the part to the bed, axes of the spindle from the platform to the spindle, in the order of the file.
    """

    direction: Vector
    """unit vector: how positive values turn the tool, seen from the part; all axes at 0"""
    point: Vector = (0.0, 0.0, 0.0)
    """a point of the axis, mm: of a table in the machine frame, else from the platform's reference point"""

    def joint(self, name: str) -> Joint:
        """As an axis of a chain."""
        return Joint(name, True, np.array(self.direction), np.array(self.point))


def series_problems(tables: Mapping[str, SeriesAxisModel], head: Mapping[str, SeriesAxisModel], taken: Collection[str],
                    follows: bool, gauge: Floats) -> Iterator[KeyProblem]:
    """Letters, directions, axes that turn the tool about itself; a head that a platform which turns cannot have."""
    axes = [(("table_axes", name), name, one) for name, one in tables.items()]
    axes += [(("spindle_axes", name), name, one) for name, one in head.items()]
    for path, name, one in axes:
        yield from direction_problems(one.direction, (*path, "direction"))
        if name not in ROTARY or name in taken or (name in tables and name in head):
            yield KeyProblem("machine.axis-letter", path, f"{name!r} is no letter of a rotary axis, or another axis has it",
                             "choose from A B C what no leg, carrier or other axis has")
    if len(axes) > MOST_AXES:
        yield KeyProblem("machine.geometry", axes[MOST_AXES][0], f"{len(axes)} rotary axes in series with the platform",
                         "two turn the tool in every direction: take one out")
        return
    ends = [*(one.direction for _, _, one in axes), (0.0, 0.0, 1.0)]
    for (path, name, one), other in zip(axes, ends[1:], strict=True):
        if np.linalg.norm(np.cross(one.direction, other)) < INDEPENDENT and not (len(axes) == 1 and name in tables):
            yield KeyProblem("machine.geometry", path, f"{name} turns about the same direction as what comes behind it",
                             "an axis of a pair is not parallel to the other, the one at the tool not to the tool")
    if not follows:
        return
    if tables or len(head) < MOST_AXES:
        yield KeyProblem("machine.geometry", ("spindle_axes",), "a platform that turns as it goes aside needs two axes "
                         "between it and the spindle, and no table", "write two [kinematics.spindle_axes.LETTER] tables")
        return
    lines = [(np.array(one.direction), np.array(one.point)) for one in head.values()]
    at = meeting_point([one.joint(name) for name, one in head.items()])
    off = max(float(np.linalg.norm(np.cross(along, at - point))) for along, point in
              [*lines, (np.array([0.0, 0.0, 1.0]), gauge)])
    if off > MEETS:
        yield KeyProblem("machine.geometry", ("spindle_axes",), f"the axes and the line of the tool pass each other by "
                         f"{off:.4g} mm; under a platform that turns as it goes aside they meet in one point",
                         "correct `point` and `gauge`")


class RotaryModel(UserModel):
    """`[kinematics.rotary]`: a rotary axis under the part or at the spindle of a platform that tilts about x or y."""

    letter: Literal["A", "B", "C"]
    """name of the axis"""
    carries: Literal["part", "spindle"]
    """part: a table about z through the machine origin; spindle: about the platform's y where it tilts about x, else about
    its x, between it and the spindle"""
    positive: Literal[1, -1] = 1
    """1 where growing values turn the tool, seen from the part, positively (ISO 841)"""
    pivot: Vector = (0.0, 0.0, 0.0)
    """spindle: a point of the axis relative to the platform's reference point, mm"""

    @property
    def place(self) -> str:
        """Where it stands, in words."""
        where = "table under the part" if self.carries == "part" else "axis between platform and spindle"
        return f"{self.letter} {where}"

    def on(self, legs: OnLegs, gauge: Floats) -> LegsWithAxis:
        """The machine: `legs` tilt about x or y, the gauge point at `gauge` (3,) mm from their reference point."""
        made = TableAxis if self.carries == "part" else HeadAxis
        tilt: TiltAbout = "a" if legs.loops.turns == "a" else "b"
        return LegsWithAxis(legs, made(tilt, gauge, float(self.positive), np.array(self.pivot)), self.letter)

    def problems(self, taken: Collection[str]) -> Iterator[KeyProblem]:
        """A pivot of a table, a letter that is `taken`."""
        if self.carries == "part" and self.pivot != (0.0, 0.0, 0.0):
            yield KeyProblem("machine.geometry", ("rotary", "pivot"), "a table turns about z through the machine origin",
                             "take pivot out and give the legs relative to the table's axis")
        if self.letter in taken:
            yield KeyProblem("machine.axis-letter", ("rotary", "letter"), f"{self.letter} drives a leg too",
                             "choose another letter")
