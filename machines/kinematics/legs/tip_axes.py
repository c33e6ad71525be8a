"""A platform on legs as a control sees it that runs its kinematics: axes X, Y, Z are the gauge point, A, B, C its turns.

LinuxCNC's modules take a pose x, y, z, a, b, c with R = Rz(c) Ry(b) Rx(a) (`pmRpyMatConvert`; genhexkins.c), straight in
these axes between two blocks. So the machine is a chain X Y Z C B A to the program, without pivots; its drives follow, and
their travel, their speeds, clearances and singular positions are those of the legs.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Self

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, as_points
from machines.kinematics.chain import Joint
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceParts
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.serial import Serial
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LOOKS = np.linspace(0.0, 1.0, 9)
"""of a block at which the distance from singular positions is looked at"""
STILL = 1e-9
"""mm or rad per mm or rad: of a drive that an axis does not move"""
STEP = 1e-4
"""mm or rad of the differences by which rates of drives are taken"""


@dataclass(frozen=True, eq=False)
@arrays(travel="K 2")
class TipAxes(Serial):
    """Attributes as of `Serial`.

    Attributes:
        legs: the machine by its drives, at the gauge point
        travel: (K, 2) of the drives, mm or rad
        workspace, clearance_parts, singular_names: of the legs
    """

    legs: OnLegs = field(kw_only=True)
    travel: Floats = field(kw_only=True)
    workspace: Workspace | None = field(init=False)
    clearance_parts: ClearanceParts | None = field(init=False)
    singular_names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("workspace", "clearance_parts", "singular_names"):
            object.__setattr__(self, name, getattr(self.legs, name))

    @classmethod
    def of(cls, legs: OnLegs) -> Self:
        """The axes of a platform that only translates, or turns in every direction; travel without ends."""
        turns = "" if not legs.loops.turns else "BA" if legs.loops.rings is not None else "CBA"
        directions = dict(zip("XYZABC", np.tile(np.eye(3), (2, 1)), strict=True))
        chain = tuple(Joint(name, name in "ABC", directions[name]) for name in "XYZ" + turns)
        return cls(chain=chain, axis_names=tuple("XYZ" + turns[::-1]), legs=legs,
                   travel=np.tile([-np.inf, np.inf], (legs.joints, 1)))

    # ---- drives --------------------------------------------------------------------------------------------

    def drives(self, q: Floats) -> Floats:
        """See the base class: joints (N, K) of the legs, NaN where they do not reach; with any tool."""
        gauge = as_points(q, self.joints, "q")
        tip, axis, spin = (self if self.tool_length == 0.0 else self.with_tool(0.0)).pose(gauge)
        asked = "c" in self.legs.loops.turns and self.legs.loops.holds is None
        return np.asarray(self.legs.inverse(tip, axis, spin if asked else 0.0)[0])

    def axes_at(self, drives: Floats) -> Floats:
        """Axes (N, J) of joints (N, K) of the legs."""
        tip, axis, spin = self.legs.pose(drives)
        return np.column_stack([tip, self._turns_of(axis, spin)])

    def drive_rates(self, q: Floats) -> Floats:
        """(N, K, J) how fast the drives go per axis at axes q (N, J), by differences."""
        ahead, back = (self.drives((q[:, None] + side * STEP * np.eye(self.joints)).reshape(-1, self.joints))
                       for side in (1.0, -1.0))
        return np.asarray(np.swapaxes((ahead - back).reshape(len(q), self.joints, -1), 1, 2) / (2.0 * STEP))

    @property
    def drive_margins(self) -> tuple[tuple[str, bool], ...]:
        """See the base class: both ends of travel of each drive at once."""
        return tuple((f"travel {name}", turns) for name, turns in zip(self.legs.axis_names, self.legs.rotary, strict=True))

    def drive_margins_at(self, q: Floats) -> Floats:
        """See the base class."""
        own = self.drives(q)
        return np.asarray(np.minimum(own - self.travel[:, 0], self.travel[:, 1] - own))

    def drive_seconds(self, q0: Floats, q1: Floats, velocity: Floats) -> Floats:
        """See the base class: by the fastest of the parts between LOOKS."""
        own = np.stack([self.drives(q0 + t * (q1 - q0)) for t in LOOKS])
        longest = np.nan_to_num(np.abs(np.diff(own, axis=0)) / velocity).max(axis=(0, 2), initial=0.0)
        return np.asarray((len(LOOKS) - 1) * longest)

    def _turns_of(self, axis: Floats, spin: Floats) -> Floats:
        """(N, 0 or 3) a, b, c of the platform that gives a tool its axis (N, 3) and spin (N,)."""
        if not self._turns:
            return np.empty((len(axis), 0))
        turn = self.legs.turn_of(axis, spin)
        found = [np.arctan2(turn[:, 2, 1], turn[:, 2, 2]), np.arcsin(np.clip(-turn[:, 2, 0], -1.0, 1.0)),
                 np.arctan2(turn[:, 1, 0], turn[:, 0, 0])]
        return np.column_stack(found[: len(self._turns)])

    # ---- kinematics ----------------------------------------------------------------------------------------

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0, near: Floats | None = None) -> Floats:
        """Axes (1, N, J); NaN where a leg does not reach or the platform cannot take the direction."""
        tip, axis = as_points(tip, 3, "tip"), as_points(axis, 3, "axis")
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
        spins = np.broadcast_to(np.asarray(spin, dtype=np.float64), len(tip))
        reached = np.isfinite(self.legs.with_tool(self.tool_length).inverse(tip, axis, spins)[0]).all(axis=1)
        q = np.column_stack([tip + self.tool_length * axis, self._turns_of(axis, spins)])
        return np.asarray(np.where(reached[:, None], q, np.nan)[None])

    @property
    def open_parameters(self) -> tuple[str, ...]:
        """See the base class: the spin, where the legs leave it open."""
        return self.legs.open_parameters

    @property
    def parameters_apart(self) -> Floats:
        """See the base class."""
        return self.legs.parameters_apart

    def parameters_at(self, q: Floats) -> Floats:
        """See the base class."""
        return self.pose(q)[2][:, None] if self.open_parameters else np.zeros((len(q), 0))

    def inverse_with(self, tip: Floats, axis: Floats, parameters: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return self.inverse(tip, axis, parameters[:, 0] if self.open_parameters else 0.0, near)

    def with_free_spin(self) -> Self:
        """See the base class."""
        return replace(self, legs=self.legs.with_free_spin())

    def nearest_axis(self, axis: Floats) -> Floats:
        """See the base class."""
        return self.legs.nearest_axis(axis)

    def singular(self, q: Floats) -> Bools:
        """False (N,): the spin is asked for, not free."""
        return np.zeros(len(q), dtype=np.bool_)

    def places_apart(self) -> Floats | None:
        """See the base class: no axis of the chain turns the tool about one direction."""
        return None

    # ---- singular positions, clearances, errors ------------------------------------------------------------

    def singular_distance(self, q: Floats) -> Floats:
        """See the base class."""
        return self.legs.singular_distance(self.drives(q))

    def singular_distance_between(self, q: Floats) -> Floats:
        """See the base class: the least at LOOKS of each move."""
        seen = [self.singular_distance(q[:-1] + t * (q[1:] - q[:-1])) for t in LOOKS]
        return np.asarray(np.min(seen, axis=0)) if len(q) > 1 else np.zeros((0, len(self.singular_names)))

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """See the base class."""
        return self.legs.rig(self.drives(q), near)

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """None: errors of the legs are the control's."""
        return ()

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class: refused."""
        raise ValueError("words of its program are the tip's, the control has the kinematics of its legs")


def axis_limits(axes: TipAxes, home: Floats, of_drives: Floats) -> list[Floats]:
    """(J,) for each row of limits (L, K) of the drives: what an axis alone may do at home (J,) with all inside theirs."""
    rates = np.maximum(np.abs(axes.drive_rates(home[None])[0]), STILL)
    return [np.asarray((row[:, None] / rates).min(axis=0)) for row in of_drives]

