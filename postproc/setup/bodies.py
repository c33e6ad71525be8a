"""The set-up's keys for collisions: part, table and fixtures as meshes or boxes, and the form of the tools."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from machines.user_model import UserModel
from postproc.setup.place import PlaceBox
from toolpaths.choices import LengthUnit


class SolidModel(UserModel):
    """A solid: a mesh file (STL, PLY, OBJ, OFF; paths are relative to the set-up file) or a box."""

    file: str | None = None
    """closed triangle mesh"""
    box: PlaceBox | None = None
    """instead of a file: a box along the axes of its frame, mm"""
    units: LengthUnit | None = None
    """of the numbers in the file; default: that of [bodies]"""

    @model_validator(mode="after")
    def _one(self) -> SolidModel:
        if (self.file is None) == (self.box is None):
            raise ValueError("give either file or box")
        return self


class Fixture(SolidModel):
    """A clamp, a vise, a fixture: what stands next to the part and is not cut."""

    name: str = Field(min_length=1)
    """as messages call it"""
    frame: Literal["part", "table"] = "table"
    """whose coordinates the file or the box has: "part" for what moves with the part's place"""


class BodiesModel(UserModel):
    """What the tool must not touch. Cutters may touch the part where they cut, nothing else."""

    part: str | None = None
    """mesh file of the finished part, in the part frame"""
    table: SolidModel | None = None
    """the machine's table, in the table frame"""
    fixtures: list[Fixture] = Field(default_factory=list)
    """[[bodies.fixtures]], one each"""
    units: LengthUnit = "mm"
    """of the numbers in the files"""
    clearance: float = Field(default=1.0, ge=0.0)
    """that the cutter keeps from table and fixtures, shank and holder from everything, mm"""
    gouge: float = Field(default=0.02, gt=0.0)
    """that the cutter may reach into the part's mesh, mm: the tolerances of the tool path and of the mesh together"""

    @model_validator(mode="after")
    def _names(self) -> BodiesModel:
        names = [one.name for one in self.fixtures]
        if len({*names, "part", "table"}) < len(names) + 2:
            raise ValueError("every fixture needs a name of its own, other than part and table")
        return self


class HolderSection(UserModel):
    """A stretch of a shank or holder: a cylinder, or a cone between two diameters."""

    diameter: float | None = Field(default=None, gt=0.0)
    """of a cylinder, mm"""
    lower: float | None = Field(default=None, gt=0.0)
    """diameter of a cone at its end towards the tip, mm"""
    upper: float | None = Field(default=None, gt=0.0)
    """diameter of a cone at its end towards the spindle, mm"""
    length: float = Field(gt=0.0)
    """along the tool axis, mm"""

    @model_validator(mode="after")
    def _sizes(self) -> HolderSection:
        if (self.diameter is None) == (self.lower is None) or (self.lower is None) != (self.upper is None):
            raise ValueError("give either diameter, or lower and upper")
        return self

    @property
    def radii(self) -> tuple[float, float]:
        """mm, at the end towards the tip and at that towards the spindle"""
        if self.lower is None or self.upper is None:
            return (0.5 * (self.diameter or 0.0),) * 2
        return 0.5 * self.lower, 0.5 * self.upper


class ToolBody(UserModel):
    """The form of a tool from its tip to the spindle. What the CL file says of the cutter need not be said again."""

    diameter: float | None = Field(default=None, gt=0.0)
    """of the cutter, mm; of a tapered one at its tip, as if it had no corner radius, or twice the radius of its ball;
    default: that of the CL file"""
    corner_radius: float | None = Field(default=None, ge=0.0)
    """of the cutter, half the diameter for a ball, mm; default: that of the CL file"""
    taper: float | None = Field(default=None, ge=0.0, lt=90.0)
    """between the cutter's side and its axis, degrees; default: that of the CL file"""
    tip_angle: float | None = Field(default=None, gt=0.0, le=180.0)
    """enclosed by a drill's lips, degrees; default: that of the CL file"""
    flute_length: float | None = Field(default=None, gt=0.0)
    """from the tip: what may touch the part, mm; default: that of the CL file"""
    shank: list[HolderSection] = Field(default_factory=list)
    """above the flutes, from there upwards, e.g. shank = [{diameter = 12, length = 40}]"""
    holder: list[HolderSection] = Field(default_factory=list)
    """above the shank, to the gauge point and beyond, e.g. holder = [{lower = 40, upper = 50, length = 60}]"""
    holder_mesh: str | None = None
    """instead: mesh file of the holder in the frame of the tool, tip at 0, +z to the spindle; spun about z"""
    holder_units: LengthUnit = "mm"
    """of the numbers in that file"""

    @model_validator(mode="after")
    def _one_holder(self) -> ToolBody:
        if self.holder and self.holder_mesh:
            raise ValueError("give either holder or holder_mesh")
        return self
