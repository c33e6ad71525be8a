"""`[kinematics.rotary]`: a rotary axis under the part or at the spindle of a platform on legs that tilts about x or y."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Literal

import numpy as np

from machines.key_problem import KeyProblem
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.rotary_axis import HeadAxis, TableAxis, TiltAbout
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.models import Vector
from machines.user_model import UserModel
from toolpaths.arrays import Floats


class RotaryModel(UserModel):
    """The fifth axis."""

    letter: Literal["A", "B", "C"]
    """name of the axis"""
    carries: Literal["part", "spindle"]
    """part: a table about z through the machine origin; spindle: about the platform's y where it tilts about x, else about
    its x, between it and the spindle"""
    positive: Literal[1, -1] = 1
    """1 where growing values turn the tool, seen from the part, positively (ISO 841)"""
    pivot: Vector = (0.0, 0.0, 0.0)
    """spindle: a point of the axis relative to the platform's reference point, mm"""

    @property
    def place(self) -> str:
        """Where it stands, in words."""
        where = "table under the part" if self.carries == "part" else "axis between platform and spindle"
        return f"{self.letter} {where}"

    def on(self, legs: OnLegs, gauge: Floats) -> LegsWithAxis:
        """The machine: `legs` tilt about x or y, the gauge point at `gauge` (3,) mm from their reference point."""
        made = TableAxis if self.carries == "part" else HeadAxis
        tilt: TiltAbout = "a" if legs.loops.turns == "a" else "b"
        return LegsWithAxis(legs, made(tilt, gauge, float(self.positive), np.array(self.pivot)), self.letter)

    def problems(self, taken: Collection[str]) -> Iterator[KeyProblem]:
        """A pivot of a table, a letter that is `taken`."""
        if self.carries == "part" and self.pivot != (0.0, 0.0, 0.0):
            yield KeyProblem("machine.geometry", ("rotary", "pivot"), "a table turns about z through the machine origin",
                             "take pivot out and give the legs relative to the table's axis")
        if self.letter in taken:
            yield KeyProblem("machine.axis-letter", ("rotary", "letter"), f"{self.letter} drives a leg too",
                             "choose another letter")
