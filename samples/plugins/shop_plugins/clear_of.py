"""A limit of tool axes: the tool keeps an angle from a direction, that of a nozzle or a camera which stands at the table.

    [orientation.criteria.clear-of]
    direction = [0.0, -1.0, 0.3]    # in the table frame, from the part to what stands there
    least = 40.0                    # degrees
"""

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from postproc.setup.criteria import OrientationCriterion


class ClearOf(OrientationCriterion):
    direction: Annotated[list[float], Field(min_length=3, max_length=3)]
    """in the table frame, from the part to what stands there"""
    least: Annotated[float, Field(ge=0.0, le=180.0)]
    """degrees between it and the tool axis"""

    @field_validator("direction")
    @classmethod
    def _is_one(cls, value):
        if not np.linalg.norm(value) > 0.0:
            raise ValueError("three zeros are no direction")
        return value

    def title(self):
        return "angle to what stands at the table"

    def bounds(self):
        return np.radians(self.least), np.pi

    def angles(self, axes, normal, travel):
        to = np.asarray(self.direction) / np.linalg.norm(self.direction)
        return np.arccos(np.clip(axes @ to, -1.0, 1.0))[:, None]
