"""Five-axis machines on the asymmetric H4: what those with a C table and with a B axis at the spindle share.

The machines themselves are in `h4_axes`. The platform tilts about x by theta, which no axis shows: it follows
from the four slides. The machine frame is that of the slides. At theta = 0 and rotary axis = 0 the gauge
point is `gauge` below the platform's reference point C (h1 of the thesis); a tool lengthens it. Source:
Company 2000, V.5.2 (both machines), V.7 (model).
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.columns import blocks
from machines.kinematics.frames import spin_about
from machines.kinematics.h4_platform import H4Platform
from machines.kinematics.on_slides import OnSlides
from machines.kinematics.rod_loops import RodLoop
from machines.kinematics.sliders import Legs
from machines.kinematics.taylor import TaylorAngle, TaylorVector
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats
from toolpaths.rotations import unit

ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same"""
Pair = tuple[Floats, Floats]
"""(tilt (N,), rotary axis (N,)) rad"""


@dataclass(frozen=True, eq=False)
class H4Linear(OnSlides):
    """What both machines share. Joints: four slides, then the rotary axis.

    `inverse` gives the machine's own leg roots for each pair of tilt and rotary axis (`pairs`). With
    `all_roots` it gives every choice of the four leg roots for each pair: the own ones first, then in the
    order of `Legs.root_choices`. A leg cannot change its root without passing the position where the rod is
    square to its slide.
    """

    platform: H4Platform
    gauge: float
    """mm from C to the gauge point, against the tool axis"""
    sense: float = 1.0
    """+1 where growing values turn the tool, seen from the part, positively (ISO 841), else -1"""
    axis_names: tuple[str, ...] = ("X", "Y", "Z", "U", "C")
    tool_length: float = 0.0
    all_roots: bool = False
    clearance: ClearanceSizes | None = None
    rotary: tuple[bool, ...] = (False, False, False, False, True)

    pairs: ClassVar[int]
    """how many tilts take the tool to a direction"""
    at_spindle: ClassVar[bool]
    """True where the rotary axis stands between platform and spindle, False for a table under the part"""
    platform_turns = True

    @property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """`pairs`, times 16 with `all_roots`"""
        return self.pairs * (16 if self.all_roots else 1)

    @property
    def gauge_below(self) -> float:  # type: ignore[override]  # nothing assigns it
        """`gauge`"""
        return self.gauge

    @property
    def workspace(self) -> Workspace:  # type: ignore[override]  # nothing assigns it
        """of C and the tilt, in the machine frame"""
        return self.platform.workspace

    @property
    def legs(self) -> Legs:  # type: ignore[override]  # nothing assigns it
        """of the platform"""
        return self.platform.legs

    # ---- what differs --------------------------------------------------------------------------------------

    @abstractmethod
    def _pairs(self, axis: Floats, free: Floats) -> tuple[Pair, ...]:
        """The pairs that take the tool to the unit `axis` (N, 3); a free rotary axis stands at `free` (N,)."""

    @abstractmethod
    def _tool(self, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip from C, axis, x of the tool), each (N, 3), in platform coordinates at the rotary axis's value."""

    @abstractmethod
    def _to_part(self, v: Floats, turn: Floats) -> Floats:
        """Vectors (N, 3) or (N, 3, K) of the machine frame in the table frame."""

    @abstractmethod
    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        """(direction, point), each (N, 3), of the axis that the tool turns about, seen from the part."""

    @abstractmethod
    def _tool_jets(self, place: TaylorVector, tilt: TaylorAngle,
                   turn: TaylorAngle) -> tuple[TaylorVector, TaylorVector]:
        """(tip, axis) of a platform that moves, in the table frame."""

    # ---- inverse and forward -------------------------------------------------------------------------------

    def made_with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, 5), V-22; NaN where a rod does not reach or the tilt leaves the workspace's range."""
        tip, axis = as_points(tip, 3, "tip"), unit(as_points(axis, 3, "axis"))
        free = np.zeros(len(tip)) if near is None else np.broadcast_to(near, (len(tip), 5))[:, 4]
        q = np.empty((self.branches, len(tip), 5))
        for part in blocks(len(tip)):
            solved = [self._slides(tip[part], *pair) for pair in self._pairs(axis[part], free[part])]
            q[:, part] = [branch for roots in zip(*solved, strict=True) for branch in roots]
        return q

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
        return np.column_stack([self._to_part(tip, -turn) - tilted(reach, tilt), tilt])

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
        reach, axis, side = (tilted(v, p[:, 3]) for v in self._tool(turn))
        return self._to_part(p[:, :3] + reach, turn), self._to_part(axis, turn), self._to_part(side, turn)

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, 5): `pose` without the spin, which few ask for."""
        q = as_points(q, 5, "q")
        p, turn = self.solve_platform(q, near), q[:, 4]
        reach, axis, _ = self._tool(turn)
        return self._to_part(p[:, :3] + tilted(reach, p[:, 3]), turn), self._to_part(tilted(axis, p[:, 3]), turn)

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """The pose (N, 6) at joints q0 (N, 5) with the rotary axis where it is at q1 (N, 5), the platform as it is."""
        if bool((q0[:, 4] == q1[:, 4]).all()):
            return pose
        tip, axis, _ = self.place(self._platform_of(pose, q0[:, 4]), q1[:, 4])
        return np.hstack([tip, axis])

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, 5), see the base class."""
        tip, axis, side = self.place(self.solve_platform(q, near), as_points(q, 5, "q")[:, 4])
        return tip, axis, spin_about(axis, side)

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """All poses (tip, axis), each (8, N, 3), of joints q (N, 5): home mode first, NaN where there are fewer."""
        q = as_points(q, 5, "q")
        placed = [self.place(p, q[:, 4]) for p in self.platform.modes(q[:, :4])]
        return np.stack([tip for tip, _, _ in placed]), np.stack([axis for _, axis, _ in placed])

    def with_all_roots(self) -> Self:
        """See the base class."""
        return replace(self, all_roots=True)

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, 5), for the clearances."""
        p = self.solve_platform(q, near)
        reach, axis, _ = (tilted(v, p[:, 3]) for v in self._tool(q[:, 4]))
        gauge = p[:, :3] + reach + self.tool_length * axis
        return ClearanceGeometry(p[:, :3], p[:, 3], self.platform.legs.carriages(q[:, :4]), self.platform.ends(p), gauge,
                                 axis)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace, rotary axis at 0."""
        return self.rig(np.column_stack([self.platform.inverse(self.platform.home[None]), [0.0]]))

    # ---- platform ------------------------------------------------------------------------------------------

    @property
    def platform_joints(self) -> Floats:
        """See `RodPlatform`."""
        return self.platform.joints

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """See `RodPlatform`."""
        return np.column_stack([self.platform.inverse(platform), turn])

    def loop_matrices(self, place: Floats, tilt: Floats) -> Floats:
        """See `RodPlatform`."""
        p = np.column_stack([place, tilt])
        return self.platform.jx(p, self.platform.inverse(p))

    def loop_matrix_at(self, q: Floats) -> Floats:
        """See `OnSlides`."""
        return self.platform.jx(self.solve_platform(q), q[:, :4])

    def platform_jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See `OnSlides`."""
        middle, step = 0.5 * (q0 + q1), q1 - q0
        p = self.solve_platform(middle)
        arms = self.platform.ends(p) - p[:, None, :3]
        rods = p[:, None, :3] + arms - self.legs.carriages(middle[:, :4])
        place, tilt = RodLoop(rods, arms, self.legs, step[:, :4], True).jets(p[:, :3], p[:, 3])
        return self._tool_jets(place, tilt, TaylorAngle(middle[:, 4], step[:, 4]))

    def places_apart(self) -> Floats:
        """See the base class: in the middle of the workspace."""
        slides = self.platform.inverse(self.platform.home[None])
        return np.column_stack([np.repeat(slides, 2, axis=0), [0.0, 0.7]])

    # ---- errors --------------------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """The rotary axis."""
        return self.axis_names[4:]

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.tilting_rods(self)

    # ---- rates ---------------------------------------------------------------------------------------------

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
        arm = tilted(self._tool(turn)[0], p[:, 3])
        dp = self.platform.rates(p, q[:, :4])
        v, omega = np.zeros((len(q), 3, 5)), np.zeros((len(q), 3, 5))
        omega[:, 0, :4] = dp[:, 3]
        v[:, :, :4] = self._to_part(dp[:, :3] + np.cross(omega[:, :, :4], arm[:, :, None], axis=1), turn)
        omega[:, :, :4] = self._to_part(omega[:, :, :4], turn)
        direction, point = self._line(p)
        v[:, :, 4], omega[:, :, 4] = np.cross(direction, tip - point), direction
        return v, omega, axis


def tilted(v: Floats, tilt: Floats) -> Floats:
    """Rx(tilt) v (N, 3)."""
    c, s = np.cos(tilt), np.sin(tilt)
    turned = np.empty((len(tilt), 3))
    turned[:, 0], turned[:, 1], turned[:, 2] = v[:, 0] + 0.0 * c, c * v[:, 1] - s * v[:, 2], s * v[:, 1] + c * v[:, 2]
    return turned
