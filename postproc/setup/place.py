"""The set-up's keys for `postproc place`: where the part may stand on the table, and how it may be turned."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from machines.user_model import UserModel
from postproc.setup.ranges import pair

PlacePoint = Annotated[tuple[float, float, float], Field(description="x, y, z")]
PlaceRange = Annotated[tuple[float, float], BeforeValidator(pair), Field(description="least, greatest")]


class PlaceBox(UserModel):
    """A box along its frame's axes, mm."""

    low: PlacePoint
    """its least x, y, z"""
    high: PlacePoint
    """its greatest x, y, z"""

    @model_validator(mode="after")
    def _ordered(self) -> PlaceBox:
        if any(a > b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError("low must not be above high")
        return self


class PlacementLimits(UserModel):
    """Limits of the part's place on the table; what has none stays as [part] has it.

    The part stands at Rz(turn) Ry(tilt_y) Rx(tilt_x), the axes those of the table frame, all three 0 where
    the part frame is parallel to it.
    """

    point: PlacePoint = (0.0, 0.0, 0.0)
    """the point of the part frame that x, y and z place and that turning leaves where it is, mm"""
    x: PlaceRange | None = None
    """of that point in the table frame, mm, e.g. x = [-100, 100]"""
    y: PlaceRange | None = None
    """the same, mm"""
    z: PlaceRange | None = None
    """the same, mm"""
    step: float | None = Field(default=None, gt=0.0)
    """x and y stand this far apart from their least values (bores of a plate, slots), mm; default: anywhere"""
    turn: PlaceRange | None = None
    """about the table's z, degrees, e.g. turn = [0, 360]"""
    turns: list[float] = Field(default_factory=list)
    """the only turns, degrees, e.g. turns = [0, 90, 180, 270]; instead of `turn`"""
    tilt_y: PlaceRange | None = None
    """about the table's y, degrees, before the turn"""
    tilt_x: PlaceRange | None = None
    """about the table's x, degrees, before the other two"""
    table: PlaceBox | None = None
    """box of the table frame that `part` must not leave; default: anywhere within travel"""
    part: PlaceBox | None = None
    """box of the part frame round blank and vise; default: what is cut"""

    @model_validator(mode="after")
    def _consistent(self) -> PlacementLimits:
        if self.turn is not None and self.turns:
            raise ValueError("turn and turns say the same thing twice: give one of them")
        for name in ("x", "y", "z", "turn", "tilt_y", "tilt_x"):
            found = getattr(self, name)
            if found is not None and found[0] > found[1]:
                raise ValueError(f"{name} = [{found[0]:g}, {found[1]:g}]: the first must not be above the second")
            if found is not None and name.startswith("t") and found[1] - found[0] > 360.0:
                raise ValueError(f"{name} = [{found[0]:g}, {found[1]:g}]: a full turn is 360 degrees")
        if self.step is not None and self.x is None and self.y is None:
            raise ValueError("step needs x or y")
        return self
