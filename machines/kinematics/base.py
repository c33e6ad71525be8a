"""What every kinematics promises. Points first, xyz last; mm and rad; NaN where there is no solution.

Kinematics work in the table frame (the frame that carries the part, at the machine origin when q = 0), at the
gauge point of the spindle unless `with_tool(length)` was asked for. The tool axis points from the tip to the spindle.

A kind of machine gives `inverse` and `forward`; everything else has a default that is safe: rates by
differences, blocks looked at in places instead of bounded (`jets_proved` is False: programs are checked, not
proved), no clearances, no geometric errors. A kind that knows more overrides more.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from machines.kinematics import by_samples
from machines.kinematics.chain import Joint
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceParts
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.leg_motion import LegMotion, LegParts
from machines.kinematics.rod_platform import RodPlatform, Transmission
from machines.kinematics.taylor import TaylorVector, straight
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, Ints, read_only

ErrorForm = TypeVar("ErrorForm", covariant=True)
UP = read_only([0.0, 0.0, 1.0])
SPIN = "spin"
"""the open parameter that is the turn of the tool about its own axis, rad as in `Kinematics.pose`"""
KEPT = 32
"""tools that a machine keeps its kinematics for"""


class PlatformPlaces(Protocol):
    """A machine whose workspace is that of its platform."""

    @property
    def workspace(self) -> Workspace:
        """Of the reference point and the tilt."""

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """Joints (N, J) of places and tilts of the platform (N, 4) and rotary axes (N, R)."""


class ErrorForms(Protocol[ErrorForm]):
    """The paths to give a machine its geometric errors; `Kinematics.with_errors` takes the one that is the machine's."""

    def chain(self, kinematics: Any) -> ErrorForm:
        """Of a chain of axes (`Kinematics.chain`)."""

    def translating_rods(self, kinematics: Any) -> ErrorForm:
        """Of a platform on rods that only translates."""

    def tilting_rods(self, kinematics: Any) -> ErrorForm:
        """Of one that tilts about x, with a rotary axis."""

    def legs(self, kinematics: Any) -> ErrorForm:
        """Of a platform on any legs."""

    def in_series(self, kinematics: Any) -> ErrorForm:
        """Of one in series with rotary axes."""


class Kinematics(ABC):
    """Inverse and forward of one machine, vectorised; frozen: `with_tool` gives a changed copy."""

    axis_names: tuple[str, ...]
    """one letter per joint, the order of q"""
    rotary: tuple[bool, ...]
    """True for joints in rad"""
    tool_length: float = 0.0
    """mm from the gauge point to the tip, along the tool axis"""
    branches: int = 1
    """B of `inverse`"""
    tool_axis: Floats = UP
    """(3,) from the tip to the spindle when all joints are 0"""
    straight_slides: bool = False
    """True where, at fixed rotary joints, the tip is an affine function of the linear joints, which turn no tool"""
    slides_square: bool = False
    """True where the slides besides are square to each other and no turning axis lies between them"""
    jets_proved: bool = False
    """True where `jets` bounds the third derivative, False where it only looks at places: then no block has a bound"""
    chain: tuple[Joint, ...] = ()
    """the axes from the workpiece to the tool, their motions one after the other (`Serial`); () of any other machine"""
    on_rods: RodPlatform | None = None
    """the platform and its rods, where rods carry the tool"""
    transmits: Transmission | None = None
    """how legs pass motion and force on to a platform; None where none carry the tool"""
    clearance_parts: ClearanceParts | None = None
    """rods, spindle and slides that may touch each other (`machines.reach`)"""
    workspace: Workspace | None = None
    """where the machine is declared to work: of the platform's reference point, of the gauge point without a platform"""
    singular_names: tuple[str, ...] = ()
    """what `singular_distance` measures; () where it measures nothing"""

    @property
    def leg_parts(self) -> LegParts | None:
        """What moves of a platform on legs; None where none carry the tool."""
        return None

    @property
    def plane(self) -> Floats | None:
        """(3,) unit normal of the plane that the tip never leaves; None where it moves in every direction."""
        return None

    # ---- what a kind gives ---------------------------------------------------------------------------------

    @abstractmethod
    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J) that put the tip and axis (N, 3) there; NaN rows where a branch has no solution.

        Rotary joints come as principal values (-pi, pi], branches in a fixed order. Where the solution is a
        family (`singular`), the free joint takes the value in `near` (N, J) or (J,), 0 without it.
        `spin` only matters to machines that can turn the tool about itself under command.
        """

    @abstractmethod
    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J); see `pose` for `near`."""

    # ---- redundancy ----------------------------------------------------------------------------------------

    @property
    def open_parameters(self) -> tuple[str, ...]:
        """What a pose leaves open besides branches and the family of `singular`: SPIN, or letters of joints that may stand
        anywhere; () where the joints follow."""
        return ()

    @property
    def parameters_apart(self) -> Floats:
        """(F,) how far each open parameter may be from what `inverse` takes for it, rad or mm."""
        return np.zeros(len(self.open_parameters))

    def parameters_at(self, q: Floats) -> Floats:
        """The open parameters (N, F) at joints q (N, J)."""
        return np.zeros((len(q), 0))

    def inverse_with(self, tip: Floats, axis: Floats, parameters: Floats, near: Floats | None = None) -> Floats:
        """As `inverse`, with the open parameters (N, F) as they are given; `inverse` itself takes them as it likes."""
        return self.inverse(tip, axis, near=near)

    def inverse_like(self, tip: Floats, axis: Floats, near: Floats) -> Floats:
        """As `inverse`, with the open parameters that joints `near` (N, J) have."""
        return self.inverse_with(tip, axis, self.parameters_at(near) if self.open_parameters else near[:, :0], near)

    def with_free_spin(self) -> Self:
        """The same machine with the turn of the tool about itself among the open parameters; as it is where it has none."""
        return self

    # ---- poses ---------------------------------------------------------------------------------------------

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J).

        Spin is the angle about the axis from the reference (the x direction carried by the least rotation
        that takes z to the axis) to the tool's own x direction; NaN of a kind that does not say it. Parallel
        machines take the assembly mode nearest `near`, a pose (N, 6) or (6,) as (tip, axis); without it the home mode.
        """
        tip, axis = self.forward(q, near)
        return tip, axis, np.full(len(tip), np.nan)

    def with_tool(self, length: float) -> Self:
        """The same kinematics at the tip of a tool of that length (mm): tip = gauge point - length * axis.

        The last few are kept, with what they have worked out."""
        kept = self._with_tools
        if length not in kept:
            if len(kept) >= KEPT:
                kept.clear()
            kept[length] = self.made_with_tool(float(length))
        return kept[length]

    @cached_property
    def _with_tools(self) -> dict[float, Self]:
        return {}

    def made_with_tool(self, length: float) -> Self:
        """What `with_tool` keeps."""
        made = copy.copy(self)
        for name in [name for name in vars(made) if isinstance(getattr(type(made), name, None), cached_property)]:
            del made.__dict__[name]
        object.__setattr__(made, "tool_length", float(length))
        return made

    def nearest_axis(self, axis: Floats) -> Floats:
        """The tool directions (N, 3) in reach nearest to `axis` (N, 3); the same where the kind does not know: `inverse`
        then says what it cannot take."""
        return as_points(axis, 3, "axis")

    def singular(self, q: Floats) -> Bools:
        """True (N,) where joints may turn while the tool stands, mostly with it along a rotary axis (families)."""
        return by_samples.free(self.jacobian(q), self.rotary)

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """Every pose (tip, axis), each (M, N, 3), that the machine has at joints q (N, J), its own first; NaN where a point
        has fewer. Without a platform one."""
        tip, axis = self.forward(q)
        return tip[None], axis[None]

    def with_all_roots(self) -> Self:
        """The same machine with every choice of roots of its legs among the branches of `inverse`, its own first, also those
        to which it is not assembled."""
        return self

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """The pose (N, 6) at joints q0 (N, J) as the joints outside the closed loops take it on the path to q1 (N, J).

        On parallel machines it is what `forward` at q1 takes as `near`: what is left is the part of the legs."""
        return pose

    def at_tip(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        """q (N, J) with the joints `solved` (3,) as they bring the tip (N, 3) there, the others as they are:
        what a control does that runs the kinematics. NaN where there are none near q."""
        if not self.straight_slides:
            return by_samples.at_tip(self.forward, self.jacobian, tip, q, solved)
        result = q.copy()
        result[:, solved] = 0.0
        at_zero, _ = self.forward(result)
        columns = self.slide_directions(result, solved)
        result[:, solved] = np.linalg.solve(columns, (tip - at_zero)[..., None])[..., 0]
        return result

    # ---- rates, motion along straight joint moves ----------------------------------------------------------

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """(J,) True for joints, linear ones too, that may change the direction of the tool axis seen from the part."""
        return (True,) * self.joints

    @property
    def drives_tip(self) -> tuple[bool, ...]:
        """(J,) True for joints that move the tip while the others rest: linear ones, and cranks of platforms."""
        return tuple(not rotary for rotary in self.rotary)

    @property
    def in_loops(self) -> tuple[bool, ...]:
        """(J,) True for joints that may bring a platform from one assembly mode to another; `carried` follows others."""
        return tuple(not rotary or drives for rotary, drives in zip(self.rotary, self.drives_tip, strict=True))

    @property
    def slides_turn_tool(self) -> bool:
        """True where a linear joint may turn the tool: standing rotary joints then do not hold its axis."""
        return any(turns and not rotary for turns, rotary in zip(self.turns_tool, self.rotary, strict=True))

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq as (N, 6, J)."""
        return by_samples.rates(lambda some: self.forward(some, near), q, self.rotary)

    def slide_directions(self, q: Floats, slides: Ints) -> Floats:
        """d(tip)/dq (N, 3, K) of the K joints `slides`: where slides are straight, how they run in the table frame."""
        return self.jacobian(q)[:, :3, :][:, :, slides]

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v, omega) of the tool relative to the part per joint rate, (N, 6, J), v at the tip, in the table frame.

        Turns about the tool axis count only where the kind knows them.
        """
        return by_samples.twists(self.jacobian(q, near), self.forward(q, near)[1])

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """(tip in mm, tool axis) in the table frame along the straight moves q0 -> q1 (N, J).

        Machines of several assembly modes: home mode. Where `jets_proved` the third derivative is a bound over the whole
        move (`rod_loops.UNBOUNDED` where none was found), else what was seen of it.
        """
        return by_samples.jets(self.forward, q0, q1)

    def tip_jets(self, q0: Floats, q1: Floats, tip0: Floats, tip1: Floats,
                 solved: Ints) -> tuple[TaylorVector, TaylorVector]:
        """(tip, tool axis) where the control runs the kinematics: tips straight from `tip0` to `tip1` (N, 3),
        the joints but those it solves for (`solved`) even from q0 to q1 (N, J). A bound where `tip_jets_proved`."""
        tip = straight(list(tip0.T), list(tip1.T))
        turning = np.array(self.turns_tool)
        if not turning.any():
            _, axis = self.forward(q0)
            return tip, TaylorVector(list(axis.T))
        if not turning[solved].any():
            return tip, self.jets(q0, q1)[1]
        return tip, by_samples.axis_jet(self._followed, q0, q1, tip0, tip1, solved)

    def _followed(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        return self.forward(self.at_tip(tip, q, solved))[1]

    def tip_jets_proved(self, solved: Ints) -> bool:
        """Whether `tip_jets` bounds the third derivative: not where the joints that the control solves for turn the tool."""
        return self.jets_proved and not np.array(self.turns_tool)[solved].any()

    # ---- singular positions, clearances --------------------------------------------------------------------

    def singular_distance(self, q: Floats) -> Floats:
        """(N, S) how far joints q (N, J) stand from `singular_names`, between 0 and 1, home mode; NaN without a pose."""
        return np.zeros((len(q), 0))

    def singular_distance_between(self, q: Floats) -> Floats:
        """(N - 1, S) the same at least on the straight joint moves between consecutive q (N, J)."""
        return np.zeros((max(len(q) - 1, 0), 0))

    def places_apart(self) -> Floats | None:
        """(2, J) joints in reach, rotary ones apart, for `postproc/joints/poles.py`; None of a kind that knows of none."""
        return None

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, J) that `machines.reach` looks at; without a platform the gauge point."""
        tip, axis = self.forward(q, near)
        gauge = tip + self.tool_length * axis
        none = np.zeros((len(q), 0, 3))
        return ClearanceGeometry(gauge, np.zeros(len(q)), none, none, gauge, axis)

    @property
    def drive_margins(self) -> tuple[tuple[str, bool], ...]:
        """Names of drives whose travel is none of a joint, each with True for rad: where joints are the control's axes."""
        return ()

    def drive_margins_at(self, q: Floats) -> Floats:
        """(N, D) what is left of the travel of those drives at joints q (N, J)."""
        return np.zeros((len(q), 0))

    def drives(self, q: Floats) -> Floats:
        """Joints of those drives at joints q (N, J); without them q itself."""
        return q

    def drive_seconds(self, q0: Floats, q1: Floats, velocity: Floats) -> Floats:
        """(N,) s that those drives take at least at their velocities (D,) along even moves q0 -> q1 (N, J)."""
        return np.zeros(len(q0))

    @property
    def leg_geometry(self) -> LegGeometry | None:
        """The legs as plain numbers, of a platform that hangs on legs; None of any other machine."""
        return None

    @property
    def over_workspace(self) -> PlatformPlaces | None:
        """The joints at places of its platform, of a machine whose `workspace` is about those."""
        return None

    # ---- geometric errors, pivots --------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """Letters whose own motion may have geometric errors; those of carriages are errors of rods."""
        return ()

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """The machine with geometric errors, by the form that is its own.

        Raises:
            ValueError: where the kind has none.
        """
        raise ValueError(f"errors of {type(self).__name__} machines cannot be modelled")

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """(direction (3,), point (3,) mm, 0 of slides) of an axis, joints at 0, in the frame that carries it.

        Raises:
            ValueError: where the kind does not know it.
        """
        raise ValueError(f"the line of axis {letter} is not known")

    def leg_motion(self, q: Floats, rate: Floats, acceleration: Floats) -> LegMotion:
        """Legs and platform at joints (N, J) with their rates and accelerations, home mode; where there are `leg_parts`.

        Raises:
            ValueError: where none carry the tool.
        """
        raise ValueError(f"{type(self).__name__} machines have no legs")

    def carries_part(self, letter: str) -> bool:
        """True for a rotary axis that stands between the part and the bed, where no structure code says so."""
        return False

    def with_pivots(self, points: Mapping[str, Floats]) -> Self:
        """The same machine with other points (3,) of the lines of rotary axes, by letter.

        Raises:
            ValueError: where the kind cannot move them.
        """
        raise ValueError(f"{type(self).__name__} machines have no pivots that could be moved")

    @property
    def joints(self) -> int:
        """J"""
        return len(self.axis_names)


def as_points(values: Floats, width: int, name: str) -> Floats:
    """`values` as float64 (N, width).

    Raises:
        ValueError: where the shape differs.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} has shape {array.shape}, expected (N, {width})")
    return array
