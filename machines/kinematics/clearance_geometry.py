"""The parts of a parallel machine that may touch each other or reach a stop, and where they are (thesis II.4.2)."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(leg="R", shift="R 3", rail_offset="K 3", rail_ends="K 2")
class ClearanceSizes:
    """Thickness and stops of rods, slides and spindle; a part that the machine file does not give is None.

    Attributes:
        leg: (R,) leg of each rod
        shift: (R, 3) mm, each rod's place next to its leg's line, at both ends
        rod_radius: mm
        spindle_radius: mm
        spindle: (from, to) mm above the gauge point along the tool axis
        rail_radius: mm, the fixed part of a slide as a round bar
        rail_offset: (K, 3) mm from the line of the carriage joint to the bar's axis
        rail_ends: (K, 2) mm of q, the ends of the bar
        carriage_angle, platform_angle: rad, largest swing of a rod's joint at either end from its direction
            in the middle of the workspace
    """

    leg: Ints
    shift: Floats
    rod_radius: float | None = None
    spindle_radius: float | None = None
    spindle: tuple[float, float] = (0.0, 0.0)
    rail_radius: float | None = None
    rail_offset: Floats | None = None
    rail_ends: Floats | None = None
    carriage_angle: float | None = None
    platform_angle: float | None = None


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", tilt="N", carriages="N K 3", ends="N K 3", gauge="N 3", axis="N 3", turn="N 3 3")
class ClearanceGeometry:
    """Where the parts are at N joints, in the machine frame, mm and rad.

    Attributes:
        place, tilt: reference point (N, 3) of the platform and its tilt (N,), about x where there is no `turn`
        carriages, ends: (N, K, 3) joints of the legs at the drives and at the platform
        gauge, axis: (N, 3) gauge point and tool axis
        turn: (N, 3, 3) of a platform that turns otherwise than about x
    """

    place: Floats
    tilt: Floats
    carriages: Floats
    ends: Floats
    gauge: Floats
    axis: Floats
    turn: Floats | None = None

    def level(self, v: Floats) -> Floats:
        """Vectors (N, 3) in the platform's own directions."""
        if self.turn is not None:
            return np.asarray(np.einsum("nij,ni->nj", self.turn, v), dtype=np.float64)
        c, s = np.cos(self.tilt), np.sin(self.tilt)
        return np.stack([v[:, 0], c * v[:, 1] + s * v[:, 2], c * v[:, 2] - s * v[:, 1]], axis=1)


class LegLines(Protocol):
    """Legs as lines: what of them does not move."""

    @property
    def points(self) -> Floats:
        """(K, 3) mm, of a slide its carriage's joint at 0."""

    @property
    def directions(self) -> Floats:
        """(K, 3) unit vectors, of a slide its travel."""


class ClearanceParts(Protocol):
    """A machine whose parts may touch each other."""

    @property
    def legs(self) -> LegLines:
        """K legs."""

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Letters of their drives."""

    @property
    def clearance(self) -> ClearanceSizes | None:
        """Sizes of the parts."""

    def middle_rig(self) -> ClearanceGeometry:
        """Where the parts are in the middle of the workspace, N = 1."""
