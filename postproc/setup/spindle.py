"""The set-up's keys for spindle and coolant of tools for which the CL file states none."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from machines.user_model import UserModel

CoolantKind = Literal["off", "flood", "mist", "through", "air"]
"""through: through the tool"""
Direction = Literal["clockwise", "anti-clockwise"]
_SPELLINGS = {"clw": "clockwise", "cw": "clockwise", "m3": "clockwise", "m03": "clockwise", "ccw": "anti-clockwise",
              "cclw": "anti-clockwise", "m4": "anti-clockwise", "m04": "anti-clockwise",
              "counter-clockwise": "anti-clockwise", "counterclockwise": "anti-clockwise", "anticlockwise": "anti-clockwise"}


def _spelt(value: Any) -> Any:
    """CLW and CCLW of the CL file, M3 and M4, as the words that they stand for."""
    return _SPELLINGS.get(value.lower(), value.lower()) if isinstance(value, str) else value


class SpindleSetup(UserModel):
    """Speed and direction of the spindle."""

    rpm: float = Field(gt=0.0)
    """rev/min"""
    direction: Annotated[Direction, BeforeValidator(_spelt)] = "clockwise"
    """seen from the spindle towards the part: clockwise (CLW, M3) or anti-clockwise (CCLW, M4)"""

    def __str__(self) -> str:
        return f"{self.rpm:g} rev/min {self.direction}"
