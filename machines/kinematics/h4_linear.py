"""Five-axis machines on the asymmetric H4: a C table under the part, or a B axis between platform and spindle.

The platform tilts about x by theta, which no axis shows: it follows from the four slides. The machine frame is that
of the slides. At theta = 0 and rotary axis = 0 the gauge point is `gauge` below the platform's reference point C (h1 of
the thesis); a tool lengthens it. Source: Company 2000, V.5.2 (both machines), V.7 (model); the tilt and table pairs
are those of J = Rz(C) Rx(A), axis = (sinA sinC, -sinA cosC, cosA).
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from machines.kinematics.base import Kinematics, as_points
from machines.kinematics.frames import spin_about
from machines.kinematics.h4_platform import H4Platform
from machines.kinematics.rig import Clearance, Rig
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, frozen

ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same"""
Pair = tuple[Floats, Floats]
"""(tilt (N,), rotary axis (N,)) rad"""


@dataclass(frozen=True, eq=False)
class H4Linear(Kinematics):
    """What both machines share. Joints: four slides, then the rotary axis.

    `inverse` gives the machine's own leg roots for each of the two tilt/rotary pairs (branches = 2). With `all_roots`
    every choice of the four leg roots for each pair (32): the two own ones first, then in the order of
    `Legs.root_choices`. A leg cannot change its root without passing the position where the rod is square to its slide.
    """

    platform: H4Platform
    gauge: float
    """mm from C to the gauge point, against the tool axis"""
    sense: float = 1.0
    """+1 where growing values turn the tool, seen from the part, positively (ISO 841), else -1"""
    axis_names: tuple[str, ...] = ("X", "Y", "Z", "U", "C")
    tool_length: float = 0.0
    all_roots: bool = False
    clearance: Clearance | None = None
    rotary: tuple[bool, ...] = (False, False, False, False, True)

    @property
    def branches(self) -> int:  # type: ignore[override]
        """2 tilt/rotary pairs, times 16 with `all_roots`"""
        return 32 if self.all_roots else 2

    @property
    def workspace(self) -> Workspace:
        """of C and the tilt, in the machine frame"""
        return self.platform.workspace

    @property
    def legs(self) -> Legs:
        """of the platform"""
        return self.platform.legs

    # ---- what differs ----------------------------------------------------------------------------------------------

    @abstractmethod
    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair, Pair]:
        """The two pairs that take the tool to the unit `axis` (N, 3); a free rotary axis stands at `free` (N,)."""

    @abstractmethod
    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip from C, axis, x of the tool), each (N, 3), in platform coordinates at the rotary axis's value."""

    @abstractmethod
    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        """Vectors (N, 3) or (N, 3, K) of the machine frame in the table frame."""

    @abstractmethod
    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        """(direction, point), each (N, 3), of the axis that the tool turns about, seen from the part."""

    # ---- inverse and forward ---------------------------------------------------------------------------------------

    def with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0, near: Floats | None = None) -> Floats:
        """Joints (B, N, 5), V-22; NaN where a rod does not reach or the tilt leaves the workspace's range.

        The first pair has theta >= 0 (C table) or B within +-90 degrees (B axis).
        """
        tip, axis = as_points(tip, 3, "tip"), _unit(as_points(axis, 3, "axis"))
        free = np.zeros(len(tip)) if near is None else np.broadcast_to(near, (len(tip), 5))[:, 4]
        pairs = [self._slides(tip, *pair) for pair in self._pairs(axis, free)]
        return np.stack([branch for roots in zip(*pairs, strict=True) for branch in roots])

    def _slides(self, tip: Floats, tilt: Floats, turn: Floats) -> list[Floats]:
        """Joints (N, 5) of one pair for each choice of roots asked for."""
        low, high = self.workspace.tilt
        p = self._platform_at(tip, np.where((tilt >= low - ROUND_OFF) & (tilt <= high + ROUND_OFF), tilt, np.nan), turn)
        legs, ends = self.platform.legs, self.platform.ends(p)
        slides = legs.both(ends) if self.all_roots else legs.inverse(ends)[None]
        return [np.column_stack([q, np.where(np.isnan(q[:, 0]), np.nan, turn)]) for q in slides]

    def _platform_at(self, tip: Floats, tilt: Floats, turn: Floats) -> Floats:
        """Platform (N, 4) that puts the tip (N, 3) there at that tilt and rotary axis."""
        reach, _, _ = self._tool(turn)
        return np.column_stack([self._to_part(tip, -turn) - _tilted(reach, tilt), tilt])

    def solve_platform(self, q: Floats, near: Floats | None = None) -> Floats:
        """Platform (N, 4) of joints (N, 5) in the mode nearest the pose `near` (6,) or (N, 6), else the home mode."""
        q = as_points(q, 5, "q")
        start = None if near is None else self._platform_of(np.broadcast_to(near, (len(q), 6)), q[:, 4])
        p = self.platform.forward(q[:, :4], start)
        return np.where(np.isfinite(q[:, 4:]), p, np.nan)

    def _platform_of(self, pose: Floats, turn: Floats) -> Floats:
        _, tool, _ = self._tool(turn)
        axis = self._to_part(pose[:, 3:], -turn)
        tilt = np.arctan2(tool[:, 1] * axis[:, 2] - tool[:, 2] * axis[:, 1],
                          tool[:, 1] * axis[:, 1] + tool[:, 2] * axis[:, 2])
        return self._platform_at(pose[:, :3], tilt, turn)

    def place(self, p: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, x of the tool), each (N, 3) in the table frame, of platform (N, 4) and rotary axis (N,)."""
        reach, axis, side = (_tilted(v, p[:, 3]) for v in self._tool(turn))
        return self._to_part(p[:, :3] + reach, turn), self._to_part(axis, turn), self._to_part(side, turn)

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, 5), see the base class."""
        tip, axis, side = self.place(self.solve_platform(q, near), as_points(q, 5, "q")[:, 4])
        return tip, axis, spin_about(axis, side)

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """All poses (tip, axis), each (8, N, 3), of joints q (N, 5): home mode first, NaN where there are fewer."""
        q = as_points(q, 5, "q")
        placed = [self.place(p, q[:, 4]) for p in self.platform.modes(q[:, :4])]
        return np.stack([tip for tip, _, _ in placed]), np.stack([axis for _, axis, _ in placed])

    def rig(self, q: Floats, near: Floats | None = None) -> Rig:
        """Where the parts are at joints q (N, 5), for the clearances."""
        p = self.solve_platform(q, near)
        reach, axis, _ = (_tilted(v, p[:, 3]) for v in self._tool(q[:, 4]))
        gauge = p[:, :3] + reach + self.tool_length * axis
        return Rig(p[:, :3], p[:, 3], self.platform.legs.carriages(q[:, :4]), self.platform.ends(p), gauge, axis)

    def middle_rig(self) -> Rig:
        """The same in the middle of the workspace, rotary axis at 0."""
        return self.rig(np.column_stack([self.platform.inverse(self.platform.home[None]), [0.0]]))

    # ---- rates -----------------------------------------------------------------------------------------------------

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) of the tool relative to the part per joint rate, (N, 6, 5), in the table frame."""
        v, omega, _ = self._rates(as_points(q, 5, "q"), near)
        return np.concatenate([v, omega], axis=1)

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, 5): the axis turns with omega."""
        v, omega, axis = self._rates(as_points(q, 5, "q"), near)
        return np.concatenate([v, np.cross(omega, axis[:, :, None], axis=1)], axis=1)

    def _rates(self, q: Floats, near: Floats | None) -> tuple[Floats, Floats, Floats]:
        """(v (N, 3, 5), omega (N, 3, 5), tool axis (N, 3)) in the table frame."""
        p, turn = self.solve_platform(q, near), q[:, 4]
        tip, axis, _ = self.place(p, turn)
        arm = _tilted(self._tool(turn)[0], p[:, 3])
        dp = self.platform.rates(p, q[:, :4])
        v, omega = np.zeros((len(q), 3, 5)), np.zeros((len(q), 3, 5))
        omega[:, 0, :4] = dp[:, 3]
        v[:, :, :4] = self._to_part(dp[:, :3] + np.cross(omega[:, :, :4], arm[:, :, None], axis=1), turn)
        omega[:, :, :4] = self._to_part(omega[:, :, :4], turn)
        direction, point = self._line(p)
        v[:, :, 4], omega[:, :, 4] = np.cross(direction, tip - point), direction
        return v, omega, axis


@dataclass(frozen=True, eq=False)
class H4TableAxis(H4Linear):
    """The part on a C table about z through the machine origin; seen from it, +C turns the tool by +C."""

    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair, Pair]:
        flat = np.hypot(axis[:, 0], axis[:, 1])
        tilt, along = np.arctan2(flat, axis[:, 2]), flat < ROUND_OFF
        heading = np.arctan2(axis[:, 0], -axis[:, 1])
        both = [np.where(along, free, wrap(self.sense * h)) for h in (heading, heading + np.pi)]
        return (tilt, both[0]), (-tilt, both[1])

    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        n = len(turn)
        return (np.tile([0.0, 0.0, -self.gauge - self.tool_length], (n, 1)), np.tile([0.0, 0.0, 1.0], (n, 1)),
                np.tile([1.0, 0.0, 0.0], (n, 1)))

    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        shape = (len(turn),) + (1,) * (v.ndim - 2)
        c, s = np.cos(turn).reshape(shape), self.sense * np.sin(turn).reshape(shape)
        return np.stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1], v[:, 2]], axis=1)

    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        return np.tile([0.0, 0.0, self.sense], (len(p), 1)), np.zeros((len(p), 3))

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool is along the table's axis: theta = 0."""
        tilt = self.solve_platform(q)[:, 3]
        result: Bools = np.abs(np.sin(tilt)) < ROUND_OFF
        return result

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`: within the greater end of the tilt range from z."""
        unit = _unit(as_points(axis, 3, "axis"))
        most = max(abs(t) for t in self.workspace.tilt)
        flat = np.hypot(unit[:, 0], unit[:, 1])
        side = np.where((flat > 0.0)[:, None], unit[:, :2] / np.where(flat > 0.0, flat, 1.0)[:, None], [0.0, -1.0])
        edge = np.column_stack([np.sin(most) * side, np.full(len(unit), np.cos(most))])
        inside = np.arctan2(flat, unit[:, 2]) <= most + ROUND_OFF
        result: Floats = np.where(inside[:, None], axis, edge)
        return result


@dataclass(frozen=True, eq=False)
class H4SpindleAxis(H4Linear):
    """The spindle on a B axis that the platform carries: about the platform's y through C + pivot."""

    pivot: Floats = field(default_factory=lambda: np.zeros(3))
    """(3,) mm in the platform; the gauge point is `gauge` below it"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pivot", frozen(self.pivot, np.float64, (3,), "H4SpindleAxis.pivot"))

    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair, Pair]:
        flat = np.hypot(axis[:, 1], axis[:, 2])
        turn = np.arctan2(axis[:, 0], flat)
        tilt = np.arctan2(-axis[:, 1], axis[:, 2])
        other = np.arctan2(axis[:, 1], -axis[:, 2])
        return (tilt, wrap(self.sense * turn)), (other, wrap(self.sense * (np.pi - turn)))

    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        c, s, zero = np.cos(turn), self.sense * np.sin(turn), 0.0 * turn
        axis = np.stack([s, zero, c], axis=1)
        return self.pivot - (self.gauge + self.tool_length) * axis, axis, np.stack([c, zero, -s], axis=1)

    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        return v

    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        n = len(p)
        return (_tilted(np.tile([0.0, self.sense, 0.0], (n, 1)), p[:, 3]),
                p[:, :3] + _tilted(np.tile(self.pivot, (n, 1)), p[:, 3]))

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool is along x, the platform's tilt axis: B = +-90 degrees."""
        result: Bools = np.abs(np.cos(as_points(q, 5, "q")[:, 4])) < ROUND_OFF
        return result

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`: those whose tilt, with B or its other value, is in range."""
        unit = _unit(as_points(axis, 3, "axis"))
        low, high = self.workspace.tilt
        tilt = np.arctan2(-unit[:, 1], unit[:, 2])
        inside = [(t >= low - ROUND_OFF) & (t <= high + ROUND_OFF) for t in (tilt, wrap(tilt + np.pi))]
        edges = np.stack([_onto_tilt(unit, t) for t in (low, high)])
        cosine = np.sum(edges * unit, axis=2)
        best = np.where((cosine[0] >= cosine[1])[:, None], edges[0], edges[1])
        result: Floats = np.where((inside[0] | inside[1])[:, None], axis, best)
        return result


def _onto_tilt(unit: Floats, tilt: float) -> Floats:
    """Directions (N, 3) nearest to `unit` on the great circle that B sweeps at that tilt."""
    normal = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    return _unit(unit - (unit @ normal)[:, None] * normal)


def _tilted(v: Floats, tilt: Floats) -> Floats:
    """Rx(tilt) v (N, 3)."""
    c, s = np.cos(tilt), np.sin(tilt)
    return np.stack([v[:, 0] + 0.0 * c, c * v[:, 1] - s * v[:, 2], s * v[:, 1] + c * v[:, 2]], axis=1)


def _unit(v: Floats) -> Floats:
    norm = np.linalg.norm(v, axis=1, keepdims=True)
    result: Floats = v / np.where(norm > 0.0, norm, np.nan)
    return result


def wrap(angle: Floats) -> Floats:
    """The same angles in (-pi, pi]."""
    result: Floats = angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))
    return result
