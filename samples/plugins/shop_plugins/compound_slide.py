"""A kind of machine: a mill whose cross slide stands at an angle to the long one, as on a compound table."""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from machines.kinematics.base import Kinematics
from machines.models import KinematicsModel


@dataclass(frozen=True, eq=False)
class CompoundSlide(Kinematics):
    angle: float  # rad from the y axis of the table to the cross slide, positive towards x
    axis_names = ("X", "Y", "Z")
    rotary = (False, False, False)

    def inverse(self, tip, axis, spin=0.0, near=None):
        upright = np.where(axis[:, 2] > 1.0 - 1e-12, 0.0, np.nan)
        across = tip[:, 1] / cos(self.angle)
        return np.stack([tip[:, 0] - across * sin(self.angle), across + upright, tip[:, 2] + self.tool_length], axis=1)[None]

    def forward(self, q, near=None):
        x, y = q[:, 0] + q[:, 1] * sin(self.angle), q[:, 1] * cos(self.angle)
        return np.stack([x, y, q[:, 2] - self.tool_length], axis=1), np.eye(3)[np.full(len(q), 2)]


class CompoundSlideModel(KinematicsModel):
    kind: Literal["compound-slide"]
    angle: Annotated[float, Field(gt=-80.0, lt=80.0)]
    """degrees from the y axis of the table to the cross slide, positive towards x"""

    def build(self):
        return CompoundSlide(radians(self.angle))
