"""`[kinematics] kind = "linear-delta"` and `"h4-linear"`: shorter tables of two forms of machines on legs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from machines.key_problem import KeyProblem
from machines.kinematics.legs.drives import on_slides
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.machine import ControlKinematics
from machines.mobility import delta_faults, h4_faults, reach_faults
from machines.models import NotNegative, blanks
from machines.slider_models import RotaryModel, SliderModel, lineardeltakins
from toolpaths.arrays import Floats


class LinearDeltaModel(SliderModel):
    """Three slides, a platform that only translates; the gauge point is the platform's reference point."""

    kind: Literal["linear-delta"]

    @property
    def leg_count(self) -> int:
        """3"""
        return 3

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the slides in the file's order."""
        return tuple(self.slides)

    def describe(self) -> str:
        """The kind, and the count of Gruebler where the file says where its rods are."""
        return "linear Delta" + self.gruebler(3)

    def build(self) -> OnLegs:
        """The kinematics at the gauge point: a machine on legs whose platform is free in x, y and z."""
        loops = Loops(on_slides(self.build_legs()), self.platform_joints(), ("x", "y", "z"))
        return OnLegs(loops, self.workspace.build(), np.zeros(3), self.axis_names, (False,) * 3, np.arange(3),
                      np.zeros(0, dtype=np.int64), np.zeros((0, 3)), self.build_clearance())

    def mobility_problems(self) -> Iterator[KeyProblem]:
        """Workspace out of reach or singular; pairs of rods that leave the platform a turn."""
        yield from reach_faults(self.build_legs(), self.platform_joints(), self.workspace.build(),
                                self.axis_names)
        pairs = [leg.rods for leg in self.slides.values()]
        if all(len(pair) == 2 for pair in pairs):
            across = np.array([np.subtract(pair[0], pair[1]) for pair in pairs])
            yield from delta_faults(self.build_legs(), self.platform_joints(), self.workspace.build(), across)

    def linuxcnc_keys(self) -> dict[str, str]:
        """The workspace; the legs are pins of lineardeltakins."""
        return {f"WORKSPACE_{letter}": blanks(span) for letter, span in zip(
            "XYZ", (self.workspace.x, self.workspace.y, self.workspace.z), strict=True)}

    def control(self, module: str) -> ControlKinematics:
        """Pins L and R of LinuxCNC's lineardeltakins: three slides along z at R from the z axis, 120 degrees apart.

        Its joints stand at 90, 210 and 330 degrees, equal rods above the platform, whose size is taken off R.
        """
        return lineardeltakins(module, self.build_legs(), self.platform_joints())


class H4LinearModel(SliderModel):
    """Asymmetric H4 on four slides with a rotary axis: tilt about x, two legs with pairs of rods, two with one rod."""

    kind: Literal["h4-linear"]
    gauge: NotNegative
    """mm from the platform's reference point (spindle: from the pivot) down to the gauge point"""
    rotary: RotaryModel = Field(...)

    @property
    def leg_count(self) -> int:
        """4"""
        return 4

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the slides in the file's order, then the rotary axis."""
        return (*self.slides, self.rotary.letter)

    def describe(self) -> str:
        """The kind, where the fifth axis is, and the count of Gruebler of the platform."""
        return f"H4a, {self.rotary.place}" + self.gruebler(4)

    def build(self) -> LegsWithAxis:
        """The kinematics at the gauge point: a machine on legs whose platform is free in x, y, z and the turn about x."""
        return self.rotary.on(self._on_legs(), self._gauge())

    def _on_legs(self) -> OnLegs:
        loops = Loops(on_slides(self.build_legs()), self.platform_joints(), ("x", "y", "z", "a"))
        return OnLegs(loops, self.workspace.build(), self._gauge(), tuple(self.slides), (False,) * 4, np.arange(4),
                      np.zeros(0, dtype=np.int64), np.zeros((0, 3)), self.build_clearance())

    def _gauge(self) -> Floats:
        """(3,) mm from the reference point."""
        pivot = self.rotary.pivot if self.rotary.carries == "spindle" else (0.0, 0.0, 0.0)
        return np.array([pivot[0], pivot[1], pivot[2] - self.gauge])

    def _leg_problems(self) -> Iterator[KeyProblem]:
        yield from super()._leg_problems()
        if sorted(len(leg.rods) for leg in self.slides.values()) != [1, 1, 2, 2]:
            count = ", ".join(f"{name} {len(leg.rods)}" for name, leg in self.slides.items())
            yield KeyProblem("machine.geometry", ("legs",), f"rods per leg: {count}; an H4a has two pairs and two single "
                             "rods", "write rods = [[x, 0, 0], [-x, 0, 0]] for a pair, [[x, 0, 0]] for a single rod")
        low, high = self.workspace.tilt
        if not -90.0 < low <= 0.0 <= high < 90.0:
            yield KeyProblem("machine.geometry", ("workspace", "tilt"), f"{[low, high]} does not hold 0 or reaches "
                             "90 degrees", "write tilt = [lower, upper] about the level platform, degrees")
        yield from self.rotary.problems(())

    def mobility_problems(self) -> Iterator[KeyProblem]:
        """Workspace out of reach or singular; condition V-4."""
        yield from h4_faults(self._on_legs(), [leg.rods for leg in self.slides.values()])
