"""A rotary axis next to a platform that tilts about x or y: a table under the part, or an axis between platform and spindle.

With t the direction of the tilt, s = t x z: the level tool axis z tilted by theta is cos(theta) z + sin(theta) s. Source:
Company 2000, V.5.2 (both machines, tilt about x).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from machines.kinematics.columns import of_one
from machines.kinematics.taylor import ZERO, TaylorAngle, TaylorVector
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import unit, wrap
from toolpaths.shapes import arrays

ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same"""
UP = [0.0, 0.0, 1.0]
TiltAbout = Literal["a", "b"]
Pair = tuple[Floats, Floats]
"""(tilt (N,), rotary axis (N,)) rad"""


@dataclass(frozen=True, eq=False)
@arrays(gauge="3", pivot="3")
class RotaryAxis(ABC):
    """What both places have in common.

    Attributes:
        tilt: what the platform tilts about, x ("a") or y ("b")
        gauge: (3,) mm from the reference point of the level platform to the gauge point, the axis at 0
        sense: +1 where growing values turn the tool, seen from the part, positively (ISO 841), else -1
        pivot: (3,) mm, a point of an axis that the platform carries, from its reference point
    """

    tilt: TiltAbout
    gauge: Floats
    sense: float
    pivot: Floats
    pairs: ClassVar[int]
    """how many tilts take the tool to a direction"""
    at_spindle: ClassVar[bool]
    """True where the axis stands between platform and spindle, False for a table under the part"""

    @cached_property
    def about(self) -> list[float]:
        """t"""
        return [1.0, 0.0, 0.0] if self.tilt == "a" else [0.0, 1.0, 0.0]

    def parts(self, axis: Floats) -> tuple[Floats, Floats]:
        """Components (N,) of `axis` (N, 3) along s and along t."""
        return (-axis[:, 1], axis[:, 0]) if self.tilt == "a" else (axis[:, 0], axis[:, 1])

    def of_parts(self, ahead: Floats | float, aside: Floats | float, up: Floats | float) -> Floats:
        """Vectors (N, 3) of components (N,) along s, t and z: the inverse of `parts`."""
        ahead, aside, up = np.broadcast_arrays(ahead, aside, up)
        return np.column_stack([aside, -ahead, up] if self.tilt == "a" else [ahead, aside, up])

    @abstractmethod
    def take(self, axis: Floats, free: Floats) -> tuple[Pair, ...]:
        """The pairs that take the tool to the unit `axis` (N, 3); a free rotary axis stands at `free` (N,)."""

    @abstractmethod
    def tool(self, turn: Floats, length: float) -> tuple[Floats, Floats, Floats]:
        """(tip from C, axis, x of the tool), each (N, 3), in platform coordinates at the axis's value (N,)."""

    @abstractmethod
    def to_part(self, v: Floats, turn: Floats) -> Floats:
        """Vectors (N, 3) or (N, 3, K) of the machine frame in the table frame."""

    @abstractmethod
    def line(self) -> tuple[Floats, Floats]:
        """(direction (3,), point (3,)) of the axis, in the level platform or in the table frame."""

    @abstractmethod
    def tool_jets(self, place: TaylorVector, tilt: TaylorAngle, turn: TaylorAngle,
                  length: float) -> tuple[TaylorVector, TaylorVector]:
        """(tip, axis) of a platform that moves, in the table frame."""

    @abstractmethod
    def free(self, tilt: Floats, turn: Floats) -> Bools:
        """True (N,) where the axis, or the tilt, turns the tool about itself."""

    @abstractmethod
    def nearest(self, v: Floats, tilt: tuple[float, float]) -> tuple[Floats, Bools]:
        """(directions (N, 3) nearest to the unit v (N, 3) at the edges of the tilt's range, whether v is in it (N,))."""


class TableAxis(RotaryAxis):
    """The part on a table about z through the machine origin; seen from it, +C turns the tool by +C.

    Two pairs: theta >= 0, then theta <= 0, the table half a turn away. Where the tool is along the table's axis C is free.
    """

    pairs = 2
    at_spindle = False

    def take(self, axis: Floats, free: Floats) -> tuple[Pair, Pair]:
        """See the base class."""
        flat = np.hypot(axis[:, 0], axis[:, 1])
        tilt, along = np.arctan2(flat, axis[:, 2]), flat < ROUND_OFF
        ahead, aside = self.parts(axis)
        heading = np.arctan2(aside, ahead)
        both = [np.where(along, free, wrap(self.sense * h)) for h in (heading, heading + np.pi)]
        return (tilt, both[0]), (-tilt, both[1])

    def tool(self, turn: Floats, length: float) -> tuple[Floats, Floats, Floats]:
        """See the base class."""
        columns = np.zeros((3, len(turn), 3))
        columns[0], columns[1, :, 2], columns[2, :, 0] = self.gauge, 1.0, 1.0
        columns[0, :, 2] -= length
        return columns[0], columns[1], columns[2]

    def to_part(self, v: Floats, turn: Floats) -> Floats:
        """See the base class."""
        shape = (len(turn),) + (1,) * (v.ndim - 2)
        c, s = np.cos(turn).reshape(shape), self.sense * np.sin(turn).reshape(shape)
        turned = np.array(v)
        turned[:, 0], turned[:, 1] = c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]
        return turned

    def line(self) -> tuple[Floats, Floats]:
        """See the base class."""
        return np.array([0.0, 0.0, self.sense]), np.zeros(3)

    def tool_jets(self, place: TaylorVector, tilt: TaylorAngle, turn: TaylorAngle,
                  length: float) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        about, (x, y, z) = (0.0, 0.0, self.sense), self.gauge.tolist()
        tip = (TaylorVector((x, y, z - length)).turned(self.about, ZERO, tilt) + place).turned(about, ZERO, turn)
        return tip, TaylorVector(UP).turned(self.about, ZERO, tilt).turned(about, ZERO, turn)

    def free(self, tilt: Floats, turn: Floats) -> Bools:
        """See the base class: theta = 0."""
        return np.asarray(np.abs(np.sin(tilt)) < ROUND_OFF)

    def nearest(self, v: Floats, tilt: tuple[float, float]) -> tuple[Floats, Bools]:
        """See the base class: within the greater end of the range from z."""
        most = max(abs(t) for t in tilt)
        flat = np.hypot(v[:, 0], v[:, 1])
        level = self.of_parts(1.0, 0.0, 0.0)[0, :2]
        side = np.where((flat > 0.0)[:, None], v[:, :2] / np.where(flat > 0.0, flat, 1.0)[:, None], level)
        edge = np.column_stack([np.sin(most) * side, np.full(len(v), np.cos(most))])
        return edge, np.asarray(np.arctan2(flat, v[:, 2]) <= most + ROUND_OFF)


class HeadAxis(RotaryAxis):
    """The spindle on an axis that the platform carries: through C + pivot, about the platform's y (tilt about x), or x.

    One pair, the axis within +-90 degrees: the other, tilt and axis over 180 degrees, turns the platform upside down, which
    its tilt range never allows.
    """

    pairs = 1
    at_spindle = True

    @property
    def _side(self) -> float:
        """Of the tool axis turned by a small positive angle, along t."""
        return 1.0 if self.tilt == "a" else -1.0

    @property
    def _direction(self) -> list[float]:
        return [0.0, 1.0, 0.0] if self.tilt == "a" else [1.0, 0.0, 0.0]

    def take(self, axis: Floats, free: Floats) -> tuple[Pair]:
        """See the base class."""
        ahead, aside = self.parts(axis)
        turn = np.arctan2(self._side * aside, np.hypot(ahead, axis[:, 2]))
        return ((np.arctan2(ahead, axis[:, 2]), self.sense * turn),)

    def tool(self, turn: Floats, length: float) -> tuple[Floats, Floats, Floats]:
        """See the base class."""
        c, s, zero = np.cos(turn), self.sense * np.sin(turn), 0.0 * turn
        one = zero + 1.0
        if self.tilt == "a":
            x, y, axis = np.stack([c, zero, -s], axis=1), np.stack([zero, one, zero], axis=1), np.stack([s, zero, c], axis=1)
        else:
            x, y, axis = np.stack([one, zero, zero], axis=1), np.stack([zero, c, s], axis=1), np.stack([zero, -s, c], axis=1)
        arm = self.gauge - self.pivot
        return self.pivot + (arm[0] * x + arm[1] * y + (arm[2] - length) * axis), axis, x

    def to_part(self, v: Floats, turn: Floats) -> Floats:
        """See the base class."""
        return v

    def line(self) -> tuple[Floats, Floats]:
        """See the base class."""
        return self.sense * np.array(self._direction), self.pivot

    def tool_jets(self, place: TaylorVector, tilt: TaylorAngle, turn: TaylorAngle,
                  length: float) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        about, (x, y, z) = self.line()[0].tolist(), (self.gauge - self.pivot).tolist()
        reach = TaylorVector((x, y, z - length)).turned(about, ZERO, turn) + TaylorVector(of_one(self.pivot))
        axis = TaylorVector(UP).turned(about, ZERO, turn)
        return reach.turned(self.about, ZERO, tilt) + place, axis.turned(self.about, ZERO, tilt)

    def free(self, tilt: Floats, turn: Floats) -> Bools:
        """See the base class: the tool is along the direction of the tilt, the axis at +-90 degrees."""
        return np.asarray(np.abs(np.cos(turn)) < ROUND_OFF)

    def nearest(self, v: Floats, tilt: tuple[float, float]) -> tuple[Floats, Bools]:
        """See the base class: those whose tilt is in the range."""
        low, high = tilt
        here = np.arctan2(self.parts(v)[0], v[:, 2])
        edges = np.stack([self._onto(v, t) for t in tilt])
        cosine = np.sum(edges * v, axis=2)
        best = np.where((cosine[0] >= cosine[1])[:, None], edges[0], edges[1])
        return best, np.asarray((here >= low - ROUND_OFF) & (here <= high + ROUND_OFF))

    def _onto(self, v: Floats, tilt: float) -> Floats:
        """Directions (N, 3) nearest to `v` on the half circle that the axis within +-90 degrees sweeps at that tilt."""
        level = self.of_parts(np.sin(tilt), 0.0, np.cos(tilt))[0]
        along, aside = np.maximum(v @ level, 0.0), self.parts(v)[1]
        across = np.where((along == 0.0) & (aside == 0.0), 1.0, aside)
        return unit(self.of_parts(0.0, across, 0.0) + along[:, None] * level)
