"""A platform that only translates on three slides, as clearances, errors of rods and transmission ask for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats


class RodMachine(Protocol):
    """The machine that they are of (`OnLegs`)."""

    @property
    def loops(self) -> Loops:
        """Its legs and platform joints."""

    @property
    def workspace(self) -> Workspace:
        """Of the reference point."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the slides."""

    @property
    def clearance(self) -> ClearanceSizes | None:
        """Sizes of the parts."""

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are."""

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace."""


@dataclass(frozen=True, eq=False)
class RodsOnSlides:
    """A `RodPlatform`."""

    machine: RodMachine
    platform_turns = False
    gauge_below = 0.0

    @cached_property
    def legs(self) -> Legs:
        """See `RodPlatform`."""
        drives: Drives = self.machine.loops.drives
        return Legs(drives.points, drives.directions, drives.lengths, drives.roots)

    @property
    def axis_names(self) -> tuple[str, ...]:
        """See `RodPlatform`."""
        return self.machine.axis_names

    @property
    def workspace(self) -> Workspace:
        """See `RodPlatform`."""
        return self.machine.workspace

    @property
    def clearance(self) -> ClearanceSizes | None:
        """See `RodPlatform`."""
        return self.machine.clearance

    @property
    def platform_joints(self) -> Floats:
        """See `RodPlatform`."""
        return self.machine.loops.joints

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """See `RodPlatform`."""
        return self.machine.rig(q, near)

    def middle_rig(self) -> ClearanceGeometry:
        """See `RodPlatform`."""
        return self.machine.middle_rig()

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """See `RodPlatform`."""
        return self.legs.inverse(platform[:, None, :3] + self.platform_joints)

    def loop_matrices(self, place: Floats, tilt: Floats) -> Floats:
        """See `RodPlatform`: the rods."""
        ends = place[:, None, :] + self.platform_joints
        return np.asarray(ends - self.legs.carriages(self.legs.inverse(ends)), dtype=np.float64)
