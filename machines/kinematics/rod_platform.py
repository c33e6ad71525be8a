"""What the legs of a machine say to who asks for them: transmission of any legs, rods on slides for their errors."""

from __future__ import annotations

from typing import Protocol

from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats


class Transmission(Protocol):
    """Legs between K drives and a platform of K freedoms, all as lengths."""

    @property
    def workspace(self) -> Workspace:
        """Of the reference point and the tilt."""

    @property
    def lever(self) -> float:
        """mm by which the platform's turns count: half the largest distance of two platform joints (d in Company 2000); 0
        of a platform that only translates."""

    @property
    def headings(self) -> Floats:
        """(H,) rad into which a tilt may point."""

    def loops_at(self, place: Floats, tilt: Floats, heading: float) -> tuple[Floats, Floats]:
        """(Jx (N, K, K) with turns by the lever, diagonal of Jq (N, K)), mm, at places (N, 3) and tilts (N,)."""


class RodPlatform(Protocol):
    """A platform on K legs whose carriages run on straight slides; its place is its reference point, mm, and a tilt."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the slides in the order of the legs, then those of rotary axes."""

    @property
    def legs(self) -> Legs:
        """K legs."""

    @property
    def workspace(self) -> Workspace:
        """Of the reference point and the tilt."""

    @property
    def clearance(self) -> ClearanceSizes | None:
        """Sizes of the parts that must not touch."""

    @property
    def platform_joints(self) -> Floats:
        """(K, 3) mm from the reference point to the joints of the legs, platform level."""

    @property
    def platform_turns(self) -> bool:
        """False for a platform that only translates."""

    @property
    def gauge_below(self) -> float:
        """mm from the reference point of the level platform down to the gauge point, rotary axes at 0."""

    def rods_at(self, place: Floats) -> Floats:
        """Rods (N, K, 3) mm at places (N, 3) of the level platform."""
