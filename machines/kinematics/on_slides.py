"""What machines on slides and rods share: bounds along straight moves, singular distance, where the platform is."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.rod_loops import by_parts
from machines.kinematics.singular_distance import NAMES, distance, distance_between, unit_free
from machines.kinematics.sliders import Legs
from machines.kinematics.taylor import TaylorVector
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats


class OnSlides(Kinematics):
    """Carriages on straight slides, rods of fixed length, a platform; a `RodPlatform`."""

    jets_proved = True
    singular_names = NAMES
    legs: Legs
    workspace: Workspace
    clearance: ClearanceSizes | None
    platform_turns: bool
    gauge_below: float

    @property
    def transmits(self) -> OnSlides:  # type: ignore[override]  # nothing assigns it
        """Itself."""
        return self

    @property
    def lever(self) -> float:
        """See `Transmission`."""
        joints = self.platform_joints
        return 0.5 * float(np.linalg.norm(joints[:, None] - joints[None], axis=2).max())

    @property
    def headings(self) -> Floats:
        """See `Transmission`: it tilts about x."""
        return np.zeros(1)

    def loops_at(self, place: Floats, tilt: Floats, heading: float) -> tuple[Floats, Floats]:
        """See `Transmission`."""
        jx = self.loop_matrices(place, tilt)
        jx[:, :, 3] /= self.lever
        return jx, self.legs.along(jx[:, :, :3])

    @property
    def on_rods(self) -> OnSlides:  # type: ignore[override]  # nothing assigns it
        """Itself."""
        return self

    @property
    def clearance_parts(self) -> OnSlides:  # type: ignore[override]  # nothing assigns it
        """Itself."""
        return self

    @property
    def leg_names(self) -> tuple[str, ...]:
        """See `ClearanceParts`."""
        return self.axis_names[: len(self.legs.lengths)]

    @property
    @abstractmethod
    def platform_joints(self) -> Floats:
        """See `RodPlatform`."""

    @abstractmethod
    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """See `RodPlatform`."""

    @abstractmethod
    def middle_rig(self) -> ClearanceGeometry:
        """See `RodPlatform`."""

    @abstractmethod
    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """See `RodPlatform`."""

    @abstractmethod
    def loop_matrices(self, place: Floats, tilt: Floats) -> Floats:
        """See `RodPlatform`."""

    @abstractmethod
    def loop_matrix_at(self, q: Floats) -> Floats:
        """The same at joints q (N, J), home mode; NaN without a pose."""

    @abstractmethod
    def platform_jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """`jets` of whole moves, `UNBOUNDED` where they are too long."""

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        return by_parts(self.platform_jets, q0, q1)

    def singular_distance(self, q: Floats) -> Floats:
        """See the base class, and `singular_distance.py`."""
        return distance(self._unit_free, q)

    def singular_distance_between(self, q: Floats) -> Floats:
        """See the base class."""
        return distance_between(self._unit_free, q)

    def _unit_free(self, q: Floats) -> tuple[Floats, Floats]:
        return unit_free(self.loop_matrix_at(q), self.legs, self.platform_joints)
