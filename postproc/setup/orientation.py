"""Keys of a set-up file that limit the tool axes which re-oriented passes may take."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from machines.user_model import UserModel
from postproc.setup.criteria import CriterionValue, criteria_of
from postproc.setup.ranges import pair

LimitAngle = Annotated[float, Field(ge=-90.0, le=90.0)]


def _ordered(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] > values[1]:
        raise ValueError(f"the least, {values[0]:g}, is above the greatest, {values[1]:g}: write [least, greatest]")
    return values


CriterionTables = dict[str, dict[str, CriterionValue]]


def _checked(tables: CriterionTables) -> CriterionTables:
    criteria_of(tables)
    return tables


AngleRange = Annotated[tuple[LimitAngle, LimitAngle], BeforeValidator(pair), AfterValidator(_ordered)]


class AxisLimits(UserModel):
    """Tool axes that a cut may take, at every point of it; --max-tilt holds besides.

    The angles are those between axis and surface normal, looked at against the feed direction (LEAD and TILT
    as in Siemens, SINUMERIK 840D programming guide Advanced, "tool orientation with LEAD and TILT"). They
    need surface normals: those of the CL file, or of the part mesh ([bodies] part).
    """

    lead: AngleRange | None = None
    """[least, greatest] degrees in the plane of feed and surface normal, positive where the axis leans towards the feed"""
    tilt: AngleRange | None = None
    """[least, greatest] degrees in the plane square to the feed, positive where the axis leans to the right,
    seen along the feed with the surface normal upwards"""
    off_centre: float | None = Field(default=None, ge=0.0, lt=90.0)
    """least angle between axis and surface normal, degrees, so that a ball does not cut with its dead centre"""
    contact_radius: float | None = Field(default=None, gt=0.0)
    """the same as least distance of the contact from the tool axis, mm"""
    cone: float | None = Field(default=None, ge=0.0, le=45.0)
    """degrees by which the axis of a ball may be turned at each point of a cut, differently from point to point, away from
    where it stands there: that of the CL file, or the one chosen for the pass; of toroids and flat ends where the file
    states surface normals; without it no axis turns along a cut"""

    @model_validator(mode="after")
    def _one_centre(self) -> AxisLimits:
        if self.off_centre is not None and self.contact_radius is not None:
            raise ValueError("off_centre and contact_radius say the same: give one of them")
        return self

    @property
    def need_normals(self) -> bool:
        """True where surface normals must be known."""
        return any(value is not None for value in (self.lead, self.tilt, self.off_centre, self.contact_radius))


class OrientationLimits(AxisLimits):
    """Tool axes that `orient` and --orient may choose: of all operations, of some of their own, and which keep theirs."""

    fixed_operations: tuple[str, ...] = ()
    """names of operations that keep the axes of the CL file"""
    operations: dict[str, AxisLimits] = Field(default_factory=dict)
    """limits of single operations, a table for each by its name: what it states goes before what holds for all"""
    criteria: Annotated[CriterionTables, AfterValidator(_checked)] = Field(default_factory=dict)
    """limits of installed packages, a table for each by its name, with the keys that the package says"""

    @property
    def turns(self) -> bool:
        """True where the axis of some cut may turn along it."""
        return bool(self.cone) or any(own.cone for own in self.operations.values())

    def of(self, operation: str) -> OrientationLimits:
        """The limits of one operation."""
        own = self.operations.get(operation)
        if own is None:
            return self
        stated = {name: getattr(own, name) for name in own.model_fields_set}
        centre = {"off_centre": None, "contact_radius": None} if {"off_centre", "contact_radius"} & set(stated) else {}
        return self.model_copy(update=centre | stated)
