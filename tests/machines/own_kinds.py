"""Kinds of machines that the project does not have, each with what no built-in one has, and machines of them.

polar: a table that turns the part and no tool; tilting: a screw along U that tilts the head, without a rotary axis.
The file is one for POSTPROC_KINDS.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal
from unittest.mock import patch

import numpy as np

import machines
from machines.kinds import FILES
from machines.kinematics.base import Kinematics
from machines.machine import ControlKinematics, Machine
from machines.models import KinematicsModel, Positive

SAMPLE = Path(__file__).parents[2] / "samples/my_machine.py"
UPRIGHT = 1.0 - 1e-12


@dataclass(frozen=True, eq=False)
class Polar(Kinematics):
    """The part turns on C about z, the tool stands at x = X."""

    axis_names = ("X", "Z", "C")
    rotary = (False, False, True)
    branches = 2
    turns_tool = (False, False, False)

    def inverse(self, tip, axis, spin=0.0, near=None):
        free = np.broadcast_to(0.0 if near is None else np.asarray(near, float)[..., 2], len(tip))
        radius = np.where(axis[:, 2] > UPRIGHT, np.hypot(tip[:, 0], tip[:, 1]), np.nan)
        heading = np.arctan2(tip[:, 1], tip[:, 0])
        other = np.where(heading > 0.0, heading - np.pi, heading + np.pi)
        middle, z = radius < 1e-12, tip[:, 2] + self.tool_length + 0.0 * radius
        return np.stack([np.stack([sign * radius, z, np.where(middle, free, c) + 0.0 * radius], axis=1)
                         for sign, c in ((1.0, heading), (-1.0, other))])

    def forward(self, q, near=None):
        x, z, c = np.asarray(q, float).T
        return np.stack([x * np.cos(c), x * np.sin(c), z - self.tool_length], axis=1), np.eye(3)[np.full(len(x), 2)]


class PolarModel(KinematicsModel):
    kind: Literal["polar"]

    def build(self):
        return Polar()


@dataclass(frozen=True, eq=False)
class Tilting(Kinematics):
    """A head on X, Y, Z that a screw along U tilts about x, `arm` mm from its pivot: U = arm sin(tilt); the
    gauge point hangs `below` mm under the pivot."""

    arm: float
    below: float
    axis_names = ("X", "Y", "Z", "U")
    rotary = (False, False, False, False)
    turns_tool = (False, False, False, True)

    def inverse(self, tip, axis, spin=0.0, near=None):
        tilt = np.where((np.abs(axis[:, 0]) < 1e-9) & (axis[:, 2] > 0.1),
                        np.arctan2(-axis[:, 1], axis[:, 2]), np.nan)
        slides = tip + (self.below + self.tool_length) * self._axis(tilt) - [0.0, 0.0, self.below]
        return np.column_stack([slides, self.arm * np.sin(tilt)])[None]

    def forward(self, q, near=None):
        share = np.asarray(q, float)[:, 3] / self.arm
        axis = self._axis(np.arcsin(np.where(np.abs(share) < 0.99, share, np.nan)))
        return q[:, :3] + [0.0, 0.0, self.below] - (self.below + self.tool_length) * axis, axis

    @staticmethod
    def _axis(tilt):
        return np.stack([0.0 * tilt, -np.sin(tilt), np.cos(tilt)], axis=1)


class TiltingModel(KinematicsModel):
    kind: Literal["tilting"]
    arm: Positive
    below: Positive

    def build(self):
        return Tilting(self.arm, self.below)

    def control(self, module):
        return ControlKinematics(module)


AXIS = "[axes.{}]\ntravel = [{}, {}]\nvelocity = 300\nacceleration = 2000\njerk = 20000\nhome = {}\n"
TIMING = "[timing]\ntool_change = 5\nclamp = 0\nunclamp = 0\n"
POLAR = ('description = "polar mill"\nretract_axis = "Z"\n[kinematics]\nkind = "polar"\n' + AXIS.format("X", -100, 600, 300)
         + AXIS.format("Z", -100, 500, 450) + AXIS.format("C", 0, 0, 0).replace("[0, 0]", '"unlimited"') + TIMING)
TILTING = ('description = "tilted by a screw"\nretract_axis = "Z"\n[kinematics]\nkind = "tilting"\narm = 200\nbelow = 60\n'
           + "".join(AXIS.format(name, -400, 500, home) for name, home in (("X", 0), ("Y", 0), ("Z", 400)))
           + AXIS.format("U", -150, 150, 0) + TIMING)
RUN_BY_CONTROL = TILTING.replace('retract_axis = "Z"\n', "") + '[control]\nmodule = "tilting-kins"\n'
OWN = {"scissors": SAMPLE.with_suffix(".toml").read_text(), "polar": POLAR, "tilting": TILTING,
       "tilting-by-control": RUN_BY_CONTROL}
NAMES = list(OWN)


@cache
def own_machine(name: str) -> Machine:
    """The machine of that name, loaded from its file as anybody's."""
    with TemporaryDirectory() as folder, patch.dict(os.environ,
                                                    {FILES: os.pathsep.join([str(SAMPLE), __file__])}):
        file = Path(folder) / f"{name}.toml"
        file.write_text(OWN[name])
        return machines.load(file)
