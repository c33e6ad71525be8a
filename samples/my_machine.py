"""A kind of machine of your own: a mill whose spindle hangs on two arms, scissors on a rail along x, with a slide along z.

    export POSTPROC_KINDS=samples/my_machine.py
    postproc convert samples/pocket.cls -m samples/my_machine.toml --setup samples/tools.setup.toml -c linuxcnc -o out/p.ngc
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from machines.kinematics.base import Kinematics
from machines.models import KinematicsModel, Positive


@dataclass(frozen=True, eq=False)
class Scissors(Kinematics):
    arm: float
    rail: float
    axis_names = ("X", "Y", "Z")  # carriages left and right, both along x; slide
    rotary = (False, False, False)

    def inverse(self, tip, axis, spin=0.0, near=None):
        reach = self.arm**2 - (self.rail - tip[:, 1]) ** 2
        half = np.sqrt(np.where((reach > 0.0) & (tip[:, 1] < self.rail) & (axis[:, 2] > 1.0 - 1e-12), reach, np.nan))
        return np.stack([tip[:, 0] - half, tip[:, 0] + half, tip[:, 2] + self.tool_length + 0.0 * half], axis=1)[None]

    def forward(self, q, near=None):
        reach = self.arm**2 - 0.25 * (q[:, 1] - q[:, 0]) ** 2
        y = self.rail - np.sqrt(np.where((reach > 0.0) & (q[:, 1] > q[:, 0]), reach, np.nan))
        return np.stack([0.5 * (q[:, 0] + q[:, 1]), y, q[:, 2] - self.tool_length], axis=1), np.eye(3)[np.full(len(q), 2)]


class ScissorsModel(KinematicsModel):
    kind: Literal["scissors"]
    arm: Positive  # mm from a carriage to the spindle
    rail: float  # mm, y of the rail

    def build(self):
        return Scissors(self.arm, self.rail)
