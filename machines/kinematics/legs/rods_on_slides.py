"""A platform on slides that translates, and may tilt about x, as errors of rods and the proof by a grid ask for it."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.legs.drives import Drives
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


class RodMachine(Protocol):
    """The machine that they are of (`OnLegs`, `LegsWithAxis`)."""

    @property
    def legs(self) -> Drives:
        """All on slides."""

    @property
    def workspace(self) -> Workspace:
        """Of the reference point."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the slides."""

    @property
    def clearance(self) -> ClearanceSizes | None:
        """Sizes of the parts."""


@dataclass(frozen=True, eq=False)
@arrays(platform_joints="K 3")
class RodsOnSlides:
    """A `RodPlatform`."""

    machine: RodMachine
    platform_joints: Floats
    platform_turns: bool = False
    gauge_below: float = 0.0

    @cached_property
    def legs(self) -> Legs:
        """See `RodPlatform`."""
        drives = self.machine.legs
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

    def rods_at(self, place: Floats) -> Floats:
        """See `RodPlatform`."""
        ends = place[:, None, :] + self.platform_joints
        return np.asarray(ends - self.legs.carriages(self.legs.inverse(ends)), dtype=np.float64)
