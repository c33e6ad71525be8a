"""The two five-axis machines on the asymmetric H4: part on a C table, or spindle on a B axis that the platform carries.

Source: Company 2000, V.5.2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from machines.kinematics.base import as_points
from machines.kinematics.columns import of_one
from machines.kinematics.h4_linear import ROUND_OFF, H4Linear, Pair, tilted
from machines.kinematics.taylor import ZERO, TaylorAngle, TaylorVector
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import unit, wrap
from toolpaths.shapes import arrays

X, UP = (1.0, 0.0, 0.0), [0.0, 0.0, 1.0]


@dataclass(frozen=True, eq=False)
class H4TableAxis(H4Linear):
    """The part on a C table about z through the machine origin; seen from it, +C turns the tool by +C.

    Directions are axis = (sin(theta) sin(C), -sin(theta) cos(C), cos(theta)). Two pairs: theta >= 0, then
    theta <= 0. Where the tool is along the table's axis C is free.
    """

    pairs = 2
    at_spindle = False

    def carries_part(self, letter: str) -> bool:
        """See the base class."""
        return letter == self.axis_names[4]

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class; of the table."""
        if letter != self.axis_names[4]:
            return super().axis_line(letter)
        return np.array([0.0, 0.0, self.sense]), np.zeros(3)

    def _tool_jets(self, place: TaylorVector, tilt: TaylorAngle,
                   turn: TaylorAngle) -> tuple[TaylorVector, TaylorVector]:
        about, down = (0.0, 0.0, self.sense), -(self.gauge + self.tool_length)
        tip = (TaylorVector((0.0, 0.0, down)).turned(X, ZERO, tilt) + place).turned(about, ZERO, turn)
        return tip, TaylorVector(list(UP)).turned(X, ZERO, tilt).turned(about, ZERO, turn)

    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair, Pair]:
        flat = np.hypot(axis[:, 0], axis[:, 1])
        tilt, along = np.arctan2(flat, axis[:, 2]), flat < ROUND_OFF
        heading = np.arctan2(axis[:, 0], -axis[:, 1])
        both = [np.where(along, free, wrap(self.sense * h)) for h in (heading, heading + np.pi)]
        return (tilt, both[0]), (-tilt, both[1])

    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        columns = np.zeros((3, len(turn), 3))
        columns[0, :, 2], columns[1, :, 2], columns[2, :, 0] = -self.gauge - self.tool_length, 1.0, 1.0
        return columns[0], columns[1], columns[2]

    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        shape = (len(turn),) + (1,) * (v.ndim - 2)
        c, s = np.cos(turn).reshape(shape), self.sense * np.sin(turn).reshape(shape)
        turned = np.array(v)
        turned[:, 0], turned[:, 1] = c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]
        return turned

    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        return np.tile([0.0, 0.0, self.sense], (len(p), 1)), np.zeros((len(p), 3))

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool is along the table's axis: theta = 0."""
        tilt = self.solve_platform(q)[:, 3]
        result: Bools = np.abs(np.sin(tilt)) < ROUND_OFF
        return result

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`: within the greater end of the tilt range from z."""
        v = unit(as_points(axis, 3, "axis"))
        most = max(abs(t) for t in self.workspace.tilt)
        flat = np.hypot(v[:, 0], v[:, 1])
        side = np.where((flat > 0.0)[:, None], v[:, :2] / np.where(flat > 0.0, flat, 1.0)[:, None],
                        [0.0, -1.0])
        edge = np.column_stack([np.sin(most) * side, np.full(len(v), np.cos(most))])
        inside = np.arctan2(flat, v[:, 2]) <= most + ROUND_OFF
        result: Floats = np.where(inside[:, None], axis, edge)
        return result


@dataclass(frozen=True, eq=False)
@arrays(pivot="3")
class H4SpindleAxis(H4Linear):
    """The spindle on a B axis that the platform carries: about the platform's y through C + pivot.

    Directions are axis = (sin(B), -sin(theta) cos(B), cos(theta) cos(B)). One pair, B within +-90 degrees:
    the other, theta and B over 180 degrees, turns the platform upside down, which its tilt range never allows.
    """

    pairs = 1
    at_spindle = True
    pivot: Floats = field(default_factory=lambda: np.zeros(3))
    """(3,) mm in the platform; the gauge point is `gauge` below it"""

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class; in the level platform."""
        if letter != self.axis_names[4]:
            return super().axis_line(letter)
        return np.array([0.0, self.sense, 0.0]), self.pivot

    def _tool_jets(self, place: TaylorVector, tilt: TaylorAngle,
                   turn: TaylorAngle) -> tuple[TaylorVector, TaylorVector]:
        about, down = (0.0, self.sense, 0.0), -(self.gauge + self.tool_length)
        reach = TaylorVector((0.0, 0.0, down)).turned(about, ZERO, turn) + TaylorVector(of_one(self.pivot))
        axis = TaylorVector(list(UP)).turned(about, ZERO, turn)
        return reach.turned(X, ZERO, tilt) + place, axis.turned(X, ZERO, tilt)

    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair]:
        turn = np.arctan2(axis[:, 0], np.hypot(axis[:, 1], axis[:, 2]))
        return ((np.arctan2(-axis[:, 1], axis[:, 2]), self.sense * turn),)

    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        c, s, zero = np.cos(turn), self.sense * np.sin(turn), 0.0 * turn
        axis = np.stack([s, zero, c], axis=1)
        return self.pivot - (self.gauge + self.tool_length) * axis, axis, np.stack([c, zero, -s], axis=1)

    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        return v

    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        n = len(p)
        return (tilted(np.tile([0.0, self.sense, 0.0], (n, 1)), p[:, 3]),
                p[:, :3] + tilted(np.tile(self.pivot, (n, 1)), p[:, 3]))

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool is along x, the platform's tilt axis: B = +-90 degrees."""
        result: Bools = np.abs(np.cos(as_points(q, 5, "q")[:, 4])) < ROUND_OFF
        return result

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`: those whose tilt is in range."""
        v = unit(as_points(axis, 3, "axis"))
        low, high = self.workspace.tilt
        tilt = np.arctan2(-v[:, 1], v[:, 2])
        edges = np.stack([_onto_tilt(v, t) for t in (low, high)])
        cosine = np.sum(edges * v, axis=2)
        best = np.where((cosine[0] >= cosine[1])[:, None], edges[0], edges[1])
        inside = (tilt >= low - ROUND_OFF) & (tilt <= high + ROUND_OFF)
        result: Floats = np.where(inside[:, None], axis, best)
        return result


def _onto_tilt(v: Floats, tilt: float) -> Floats:
    """Directions (N, 3) nearest to `v` on the half circle that B within +-90 degrees sweeps at that tilt."""
    level = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    along = np.maximum(v @ level, 0.0)
    across = np.where((along == 0.0) & (v[:, 0] == 0.0), 1.0, v[:, 0])
    return unit(np.column_stack([across, along * level[1], along * level[2]]))
