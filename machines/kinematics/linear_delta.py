"""Linear Delta: three slides, three pairs of parallel rods, a platform that only translates.

Any place and direction of the slides. The table frame is the frame in which the slides are given; the gauge
point is the platform's reference point E. Source: Company 2000, chapter III (III-1 to III-5, III-10, III-11 corrected).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.columns import blocks, of_one
from machines.kinematics.on_slides import OnSlides
from machines.kinematics.rod_loops import RodLoop
from machines.kinematics.sliders import Legs, determinant, three_spheres
from machines.kinematics.taylor import TaylorVector
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.shapes import arrays

UP = np.array([0.0, 0.0, 1.0])
ROUND_OFF = 1e-12
"""rad: a tool axis nearer than this to +z is +z"""


@dataclass(frozen=True, eq=False)
@arrays(platform="3 3")
class LinearDelta(OnSlides):
    """Three legs whose platform joints are E + platform[k].

    `inverse` gives the machine's own roots (branches = 1): a leg cannot change its root without passing the
    position where the rod stands square to its slide. With `all_roots` it gives all 8 choices, the own one
    first, in the order of `Legs.root_choices`.
    """

    legs: Legs
    platform: Floats
    """(3, 3) mm: platform joints relative to E"""
    workspace: Workspace = field()
    """of E; its middle is where the home assembly mode is defined"""
    axis_names: tuple[str, ...] = ("X", "Y", "Z")
    tool_length: float = 0.0
    all_roots: bool = False
    clearance: ClearanceSizes | None = None
    rotary: tuple[bool, ...] = (False, False, False)
    side: float = field(init=False)
    """sign of det Jx in the home assembly mode"""
    platform_turns = False
    gauge_below = 0.0

    def __post_init__(self) -> None:
        home = self.workspace.middle[None] + self._gauge_to_tip()
        rods = self.rods(self.legs.inverse(self._joints(home)), home)
        object.__setattr__(self, "side", float(np.sign(determinant(rods)[0])))

    @property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """1, or 8 with `all_roots`"""
        return 8 if self.all_roots else 1

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Slides (B, N, 3), III-2; NaN where the rods do not reach or the tool axis is not +z."""
        tip, axis = as_points(tip, 3, "tip"), as_points(axis, 3, "axis")
        tilted = (np.hypot(axis[:, 0], axis[:, 1]) > ROUND_OFF * np.abs(axis[:, 2])) | (axis[:, 2] <= 0.0)
        tip = np.where(tilted[:, None], np.nan, tip)
        q = np.empty((self.branches, len(tip), 3))
        for part in blocks(len(tip)):
            joints = self._joints(tip[part])
            q[:, part] = self.legs.both(joints) if self.all_roots else self.legs.inverse(joints)
        return q

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """Both poses (tip, axis), each (2, N, 3), of slides q (N, 3): the home mode first.

        The centres q u + P - b of three spheres of the rods' lengths: their planes of intersection give the
        two points, which for slides parallel to z is III-11 as corrected. Mode by the sign of det Jx, which
        can only change where the platform is singular.
        """
        q = as_points(q, 3, "q")
        foot, out = three_spheres(self.legs.carriages(q) - self.platform, self.legs.lengths)
        tip = np.stack([foot + self.side * out, foot - self.side * out]) - self.tool_length * UP
        return tip, np.broadcast_to(UP, tip.shape) + 0.0 * tip

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip, axis) of slides q (N, 3), see the base class."""
        tip, axis, _ = self.pose(q, near)
        return tip, axis

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, spin = 0) of slides q (N, 3), see the base class."""
        tips, axes = self.assembly_modes(q)
        if near is None:
            return tips[0], axes[0], 0.0 * tips[0, :, 0]
        far = np.linalg.norm(tips - np.broadcast_to(near, (len(q), 6))[:, :3], axis=2)
        tip = np.where((far[0] <= far[1])[:, None], tips[0], tips[1])
        return tip, np.where(np.isnan(tip), np.nan, UP), 0.0 * tip[:, 0]

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, 3), II-17; the axis does not move."""
        q = as_points(q, 3, "q")
        tip, _, _ = self.pose(q, near)
        rods = self.rods(q, tip)
        result = np.zeros((len(q), 6, 3))
        result[:, :3] = _inverse_times_diagonal(rods, self.legs.along(rods))
        return result

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v, omega = 0) per slide rate (N, 6, 3)."""
        return self.jacobian(q, near)

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """None: the platform only translates."""
        return (False, False, False)

    def at_tip(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        """See the base class: the inverse."""
        return np.asarray(self.inverse(tip, np.broadcast_to(UP, tip.shape))[0])

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.translating_rods(self)

    # ---- platform ------------------------------------------------------------------------------------------

    @property
    def platform_joints(self) -> Floats:
        """See `RodPlatform`."""
        return self.platform

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """See `RodPlatform`."""
        return self.legs.inverse(platform[:, None, :3] + self.platform)

    def loop_matrices(self, place: Floats, tilt: Floats) -> Floats:
        """See `RodPlatform`: the rods."""
        ends = place[:, None, :] + self.platform
        return np.asarray(ends - self.legs.carriages(self.legs.inverse(ends)))

    def loop_matrix_at(self, q: Floats) -> Floats:
        """See `OnSlides`."""
        return self.rods(q, self.pose(q)[0])

    def platform_jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See `OnSlides`."""
        middle, step = 0.5 * (q0 + q1), q1 - q0
        tip, _, _ = self.pose(middle)
        rods = self.rods(middle, tip)
        place, _ = RodLoop(rods, np.zeros_like(rods), self.legs, step, False).jets(
            tip + self.tool_length * UP, np.zeros(len(tip)))
        return place - TaylorVector(of_one(self.tool_length * UP)), TaylorVector(of_one(UP))

    def rods(self, q: Floats, tip: Floats) -> Floats:
        """AB (N, 3, 3) mm, which is Jx (III-3)."""
        return self._joints(tip) - self.legs.carriages(q)

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at slides q (N, 3), for the clearances."""
        tip, axis, _ = self.pose(q, near)
        place = tip + self.tool_length * UP
        return ClearanceGeometry(place, np.zeros(len(q)), self.legs.carriages(q), place[:, None, :] + self.platform, place,
                                 axis)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace."""
        tip = (self.workspace.middle + self._gauge_to_tip())[None]
        return self.rig(self.legs.inverse(self._joints(tip)))

    def singular(self, q: Floats) -> Bools:
        """False (N,): there is no rotary axis."""
        return np.zeros(len(q), dtype=np.bool_)

    def with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def nearest_axis(self, axis: Floats) -> Floats:
        """+z (N, 3): the platform cannot tilt."""
        return np.broadcast_to(UP, as_points(axis, 3, "axis").shape).copy()

    def _gauge_to_tip(self) -> Floats:
        return -self.tool_length * UP

    def _joints(self, tip: Floats) -> Floats:
        result: Floats = (tip - self._gauge_to_tip())[:, None, :] + self.platform
        return result


def _inverse_times_diagonal(rods: Floats, along: Floats) -> Floats:
    """Jx^-1 Jq (N, 3, 3) by cross products; NaN where Jx is exactly singular."""
    r1, r2, r3 = rods[:, 0], rods[:, 1], rods[:, 2]
    columns = np.stack([np.cross(r2, r3), np.cross(r3, r1), np.cross(r1, r2)], axis=2)
    det = np.einsum("ni,ni->n", r1, columns[:, :, 0])
    det = np.where(det == 0.0, np.nan, det)
    result: Floats = columns * (along / det[:, None])[:, None, :]
    return result
