"""The `[dynamics]` and `[stiffness]` tables of a machine file: kg, kg m2, N, N m, N/um."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Annotated, Literal

from pydantic import Field

from machines.figures import FigureSource, FigureTable, by_key
from machines.key_problem import KeyProblem
from machines.user_model import UserModel

Amount = Annotated[float, Field(ge=0.0, le=1e9)]
Limit = Annotated[float, Field(gt=0.0, le=1e12)]
MassCentre = tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=-1e6, le=1e6)],
              Annotated[float, Field(ge=-1e6, le=1e6)]]
Inertia = Amount | tuple[Amount, Amount, Amount]
MassFigure = Literal["mass", "centre", "inertia", "rotor", "force", "balance", "friction", "viscous", "rods", "joint",
                     "length"]
StiffnessFigure = Literal["rod", "joint", "drive", "turn"]
BodyFigure = Literal["mass", "centre", "inertia"]


class BodyModel(UserModel):
    """`[dynamics.platform]`, `head`, `part` or `tool`: a body that no axis has in its own table."""

    mass: Amount
    """kg; of a platform with its spindle, without what a rotary axis that it carries turns"""
    centre: MassCentre = (0.0, 0.0, 0.0)
    """mm, its centre of mass, all axes at 0: of platform and head from the reference point of the level platform, of the
    part in the frame of the table that carries it, of the tool from the gauge point, along the machine's x, y and z"""
    inertia: Inertia = 0.0
    """kg m2 about its centre of mass: one number, or three about the same x, y and z"""
    assumed: tuple[BodyFigure, ...] = ()
    """keys of this table whose figure no document states"""
    source: dict[BodyFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it"""


class AxisMassModel(UserModel):
    """One `[dynamics.axes.LETTER]` table: what an axis moves and what its motor can do."""

    mass: Amount = 0.0
    """kg of the body that this axis moves and no axis beyond it: slide, table, head, carriage, arm; of a leg of changing
    length the part that turns about the foot"""
    centre: MassCentre | None = None
    """mm, its centre of mass in machine coordinates, all axes at 0 (of an axis between platform and spindle from the
    reference point of the level platform); left out: on the line of a rotary axis or an arm's"""
    inertia: Inertia = 0.0
    """kg m2 of that body about its centre of mass: one number, or three about the machine's x, y and z, all axes at 0"""
    rotor: Amount = 0.0
    """kg or kg m2, inertia of motor and gear as the axis feels it"""
    force: Limit | None = None
    """N, of a rotary axis N m: what the motor can give, in both directions; left out: without limit"""
    balance: Annotated[float, Field(ge=-1e9, le=1e9)] = 0.0
    """N or N m that a counterbalance gives in the positive direction"""
    friction: Amount = 0.0
    """N or N m of dry friction of the drive, whatever its speed (Coulomb)"""
    viscous: Amount = 0.0
    """N per m/s, of a rotary axis N m per rad/s: friction of the drive in proportion to its speed"""
    rods: Amount = 0.0
    """kg of all rods of this leg, slender and even from joint to joint; of a leg of changing length from the platform joint
    on, `length` mm long"""
    joint: Amount = 0.0
    """kg at the platform's end of this leg: joints, half of a bar of the platform"""
    length: Limit | None = None
    """mm, of a leg of changing length: of its two parts, each even from its joint on; left out: its length at 0"""
    under_part: bool = False
    """a carrier moves the part, not legs and platform"""
    assumed: tuple[MassFigure, ...] = ()
    """keys of this table whose figure no document states"""
    source: dict[MassFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it"""


class StiffnessModel(UserModel):
    """The `[stiffness]` table: what the parts of the machine yield by; what is left out does not yield."""

    rod: Limit | None = None
    """N/um of a rod's body along it, of a machine on legs"""
    joint: Limit | None = None
    """N/um of each joint of a rod along it"""
    drive: Limit | None = None
    """N/um of each drive along its motion, of arms at their ends"""
    turn: Limit | None = None
    """N m per mrad of each rotary axis of a machine without legs"""
    assumed: tuple[StiffnessFigure, ...] = ()
    """keys of this table whose figure no document states"""
    source: dict[StiffnessFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it"""

    def problems(self, on_legs: bool) -> Iterator[KeyProblem]:
        """Keys of the other kind of machine; rods that do not yield."""
        for key in ("turn",) if on_legs else ("rod", "joint"):
            if getattr(self, key) is not None:
                yield KeyProblem("machine.stiffness", ("stiffness", key), f"{key} is of machines with"
                                 f"{'out' * on_legs} legs", f"take {key} out")
        if on_legs and self.rod is None:
            yield KeyProblem("machine.stiffness", ("stiffness",), "the stiffness of the rods is missing",
                             "write rod = ... in N/um")


OF_LEGS, OF_LENGTHS, OF_CARRIERS = ("rods", "joint"), ("length",), ("under_part",)
"""keys of `[dynamics.axes.LETTER]` by the axes that have them"""


class DynamicsModel(UserModel):
    """The `[dynamics]` table."""

    down: MassCentre = (0.0, 0.0, -1.0)
    """direction of gravity in machine coordinates, of length 1; [0, 0, 0]: without gravity"""
    platform: BodyModel | None = None
    """of a machine on legs"""
    head: BodyModel | None = None
    """what the rotary axis between platform and spindle turns"""
    part: BodyModel | None = None
    """the part with its fixture, on whatever carries it"""
    tool: BodyModel | None = None
    """the tool with its holder, in the spindle"""
    axes: dict[str, AxisMassModel] = Field(default_factory=dict)
    """by axis letter"""

    @property
    def limited(self) -> bool:
        """True where a motor has a limit."""
        return any(axis.force is not None for axis in self.axes.values())

    def figures(self) -> list[FigureTable]:
        """The tables that hold figures with a source, or assumed ones."""
        bodies = [FigureTable(("dynamics", name), body.assumed, by_key(body.source))
                  for name in ("platform", "head", "part", "tool") if (body := getattr(self, name)) is not None]
        return bodies + [FigureTable(("dynamics", "axes", name), axis.assumed, by_key(axis.source))
                         for name, axis in self.axes.items()]

    def problems(self, kinds: dict[str, Collection[str]], parts: Collection[str]) -> Iterator[KeyProblem]:
        """Tables and keys that the machine has no part for, nothing that moves.

        Args:
            kinds: by letter of the machine's axes: what it is, of "leg", "slide", "arm", "length", "carrier"
            parts: of "platform" and "head", those that the machine has
        """
        size = sum(x * x for x in self.down) ** 0.5
        if size and abs(size - 1.0) > 1e-6:
            yield KeyProblem("machine.dynamics", ("dynamics", "down"), f"{list(self.down)} has length {size:.6g}, not 1",
                             "write a unit vector, e.g. [0, 0, -1], or [0, 0, 0] without gravity")
        for name in ("platform", "head"):
            if getattr(self, name) is not None and name not in parts:
                yield KeyProblem("machine.dynamics", ("dynamics", name), f"this machine has no {name}",
                                 f"take [dynamics.{name}] out: [dynamics.axes.LETTER] holds what its axes move")
        for name, axis in self.axes.items():
            if name not in kinds:
                yield KeyProblem("machine.dynamics", ("dynamics", "axes", name), f"the machine has no axis {name!r}",
                                 f"its axes are {', '.join(kinds)}")
                continue
            yield from _stray(name, axis, kinds[name])
            moves = axis.mass or axis.rotor or axis.rods or _inert(axis.inertia) or parts or self.part or self.tool
            if axis.force is not None and not moves:
                yield KeyProblem("machine.dynamics", ("dynamics", "axes", name), f"axis {name} has a force and moves no "
                                 "mass", "write mass, inertia or rotor")


def _stray(name: str, axis: AxisMassModel, kind: Collection[str]) -> Iterator[KeyProblem]:
    """Keys that belong to another kind of axis."""
    for keys, needed, what in ((OF_LEGS, "leg", "legs"), (OF_LENGTHS, "length", "legs of changing length"),
                               (OF_CARRIERS, "carrier", "carriers")):
        for key in keys:
            if key in axis.model_fields_set and needed not in kind:
                yield KeyProblem("machine.dynamics", ("dynamics", "axes", name, key), f"axis {name}: {key} is of {what}",
                                 f"take {key} out")


def _inert(inertia: Inertia) -> bool:
    return inertia != 0.0 and inertia != (0.0, 0.0, 0.0)
