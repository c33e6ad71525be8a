"""The set-up's keys for several parts in one program: where each stands, and the register that holds its work offset."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from machines.user_model import UserModel
from postproc.setup.place import PlacePoint
from toolpaths.diagnostics import Diagnostic, error

REGISTER = r"^(G[0-9]+(\.[0-9])?( P[0-9]+)?|preset [0-9]+)$"
"""a work offset as set-ups name it"""
PlaceOrder = Literal["tool", "part"]
"""tool: all that one tool cuts at every place, then the next tool; part: one place after the other"""


class PlaceSetup(UserModel):
    """A place of the part: on the table, or on a face of a tombstone. What it does not state is that of [part]."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_. -]{0,23}$")]
    """as the program and reports call it"""
    work_offset_code: Annotated[str, Field(pattern=REGISTER)]
    """register of the control that holds its work offset, as that of the set-up"""
    origin: PlacePoint | None = None
    """as [part] origin, mm"""
    x_axis: PlacePoint | None = None
    """as [part] x_axis"""
    y_axis: PlacePoint | None = None
    """as [part] y_axis"""
    turn: dict[Annotated[str, Field(pattern="^[ABC]$")], float] = Field(default_factory=dict)
    """degrees at which rotary tables stand when the part stands there, e.g. turn = { B = 90 } for a face of a
    tombstone: origin, x_axis and y_axis are then as the spindle sees them with the tables so"""

    measured: Literal["zero", "turned"] = "zero"
    """where tables stand for what the register of the work offset holds: all at zero, as every output mode takes it, or
    "turned" as `turn` says, as the face is touched off; all is then in machine coordinates ("axes") there"""

    @property
    def turned(self) -> dict[str, float]:
        """Degrees of the tables for which its register is measured, where they do not stand at zero."""
        return self.turn if self.measured == "turned" else {}

    @property
    def stated(self) -> dict[str, tuple[float, float, float]]:
        """What it states of [part]."""
        return {key: value for key, value in (("origin", self.origin), ("x_axis", self.x_axis), ("y_axis", self.y_axis))
                if value is not None}


def one_part(places: list[PlaceSetup], what: str, file: str) -> list[Diagnostic]:
    """An error where something is asked for that is for one part alone."""
    return [] if not places else [error("places.one", f"{what} is for one part, the set-up has {len(places)} [[places]]",
                                        file=file, hint="take [[places]] out of the set-up for it, and put them in again")]
