"""The error model file: what each key may hold.

Lengths of errors are in `length_unit`, angles in `angle_unit`; positions (points, ranges, periods) in mm and
degrees. All errors are actual less commanded, of the tool's side relative to the part's side, along and about
x, y, z of the machine.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from machines.geometric_error.tables.choices import MapDirections, TableRule
from machines.geometric_error.tables.names import parse
from machines.models import Interval, Positive, Vector
from machines.user_model import UserModel

MatrixRows = tuple[Vector, ...]


class CurveModel(UserModel):
    """`[components.NAME]`: one of `table`, `polynomial`, or `mean` / `cosine` / `sine`."""

    table: str | None = None
    """CSV file next to this one: a column of positions named as the axis, e.g. X [mm], and one of values
    named as the component, EXX [um]; or two for both approach directions, EXX+ and EXX-"""
    interpolation: TableRule = "linear"
    """between the rows of the table"""
    repeats: Positive | None = None
    """table or series: mm or degrees after which it repeats; series of a rotary axis: 360 without it"""
    polynomial: tuple[float, ...] = ()
    """coefficients of ((position - origin) / scale)^0, ^1, ..."""
    mean: float | None = None
    """series: constant part"""
    cosine: tuple[float, ...] = ()
    """series: amplitudes of cos k phase, k = 1, 2, ...; phase is 0 at `origin`"""
    sine: tuple[float, ...] = ()
    """series: amplitudes of sin k phase"""
    origin: float = 0.0
    """mm or degrees"""
    scale: Positive = 1.0
    """polynomial: mm or degrees"""
    range: Interval | None = None
    """positions that were measured, mm or degrees; a table has its own, a series of a rotary axis needs none"""
    sign: Literal[1, -1] = 1
    """-1 where the numbers say how the part moves relative to the tool"""

    @property
    def kind(self) -> Literal["table", "polynomial", "series"]:
        """table, polynomial or series."""
        return "table" if self.table is not None else "polynomial" if self.polynomial else "series"

    @model_validator(mode="after")
    def _one_kind(self) -> CurveModel:
        given = [self.table is not None, bool(self.polynomial), self.mean is not None or bool(self.cosine or self.sine)]
        if sum(given) != 1:
            raise ValueError("give one of table, polynomial, or mean / cosine / sine")
        if self.kind == "polynomial" and self.range is None:
            raise ValueError("a polynomial needs range = [lower, upper], the positions it was measured at")
        if len(self.cosine) != len(self.sine) and self.cosine and self.sine:
            raise ValueError(f"{len(self.cosine)} cosines and {len(self.sine)} sines; give as many of each")
        return self


class ReferenceModel(UserModel):
    """`[reference.LETTER]`: what the turns of an axis act about."""

    point: Vector | None = None
    """mm in machine coordinates at zero; for slides it travels along. Default: machine origin; point of a rotary axis"""
    frame: Literal["bed", "fixed", "moving"] = "bed"
    """rotary axes: whose x, y, z the component errors are along and about: those of the bed, where a probe
    stands still (ISO 230-1, ISO 230-7); or those of the part's side of the axis ("fixed") or of its tool's
    side ("moving"). The bed is on the part's side of an axis that carries the tool, on the tool's side of one
    that carries the part"""


class LegErrorModel(UserModel):
    """`[legs.LETTER]` of a parallel machine: dimensional errors of a slide and its rods (Company 2000, annex E)."""

    pair: Positive | None = None
    """mm: half the distance of the two rods of the leg, where the machine file gives no rods; in every leg then"""
    rail: Vector = (0.0, 0.0, 0.0)
    """place of the rail's point, machine frame"""
    guide: Vector = (0.0, 0.0, 0.0)
    """turns of the slide about x, y, z of the machine frame"""
    carriage: MatrixRows = ()
    """per rod: joint on the carriage, guide frame (z along the slide, x from the rail to the joint)"""
    platform: MatrixRows = ()
    """per rod: joint on the platform, platform frame"""
    length: tuple[float, ...] = ()
    """per rod"""
    drive: float = 0.0
    """kind "legs": by how much the drive stands farther than it counts; of an arm an angle"""
    hinge_turn: Vector = (0.0, 0.0, 0.0)
    """of a leg on a hinge: turns of the hinge about x, y, z of the machine frame, on the guide as that is turned"""
    ring: float = 0.0
    """of a leg that ends on a ring: its radius"""


class BarErrorModel(UserModel):
    """`[bars.NAME]` of a platform with hinged bars."""

    hinge: Vector = (0.0, 0.0, 0.0)
    """place of the hinge on the platform"""
    hinge_turn: Vector = (0.0, 0.0, 0.0)
    """turns of its line about x, y, z of the platform"""


class PassiveErrorModel(UserModel):
    """`[passive.NAME]` of a platform with a leg that has no drive."""

    point: Vector = (0.0, 0.0, 0.0)
    """place of the universal joint in the machine frame"""
    hinge_turn: Vector = (0.0, 0.0, 0.0)
    """turns of the joint's outer axis about x, y, z of the machine frame"""
    joint: Vector = (0.0, 0.0, 0.0)
    """place of the leg's line on the platform"""
    line_turn: Vector = (0.0, 0.0, 0.0)
    """turns of the line, and of the joint's inner axis with it, about x, y, z of the platform"""
    square: float = 0.0
    """angle by which the joint's axes are off a right angle"""


class MapModel(UserModel):
    """`[map]`: an error map, computed or measured."""

    table: str
    """CSV file: coordinates X [mm] ... C [deg] of axes, or x y z of the point in the table frame; dx dy dz,
    and rx ry rz if measured. One row per node of a full lattice, in any order"""
    tool_length: Annotated[float, Field(ge=0)] = 0.0
    """mm: the displacements are those of the tip of a tool this long; 0: of the gauge point"""
    directions: MapDirections = "table"
    """what dx ... rz are along and about: x, y, z of the table, which turns with the rotary axes under the
    part, or of the machine"""
    sign: Literal[1, -1] = 1
    """-1 where the numbers say how the part moves relative to the tool, or what the control is to add"""
    repeats: dict[str, Positive] = Field(default_factory=dict)
    """by coordinate that goes round: degrees (mm) after which it repeats, e.g. { C = 360 }"""
    zero: dict[str, float] = Field(default_factory=dict)
    """place, all coordinates in mm and degrees, at which the map is to be 0: what it says there is taken off
    everywhere; [sigma] and [covariance] are those of the table as it stands"""


class CovarianceModel(UserModel):
    """`[covariance]`: of the parameters, by their names as `postproc` prints them."""

    table: str
    """CSV file: first row and first column the parameters, in the units of this file; square"""


class ErrorFileModel(UserModel):
    """An error model file."""

    description: str = ""
    """one line"""
    machine: str = ""
    """machine that it was measured on; another one is then refused"""
    corrected_by: Literal["post", "control"] = "post"
    """who corrects: the post-processor, or the control with tables of its own; never both"""
    length_unit: Literal["um", "mm"] = "um"
    """of the numbers in this file; CSV tables have units in their headers"""
    angle_unit: Literal["arcsec", "urad", "deg"] = "arcsec"
    """of the numbers in this file"""
    large: bool = False
    """true: errors above 1 mm or 0.5 degrees are so; else they are refused, as most likely a wrong unit.
    Those above 100 mm or 10 degrees always are"""
    components: dict[str, CurveModel] = Field(default_factory=dict)
    """component errors by ISO 230-1 name, EXX, EYX, ... ECC"""
    location: dict[str, float] = Field(default_factory=dict)
    """location errors: lines of axes, EC0Y, EX0C, ...; zero positions, EX0X, EC0C, ...; of the spindle, EX0S, EA0S, ..."""
    reference: dict[str, ReferenceModel] = Field(default_factory=dict)
    """by axis letter"""
    legs: dict[str, LegErrorModel] = Field(default_factory=dict)
    """parallel machines, by axis letter"""
    bars: dict[str, BarErrorModel] = Field(default_factory=dict)
    """by the names of the machine file"""
    passive: dict[str, PassiveErrorModel] = Field(default_factory=dict)
    """by the names of the machine file"""
    map: MapModel | None = None
    """instead of all others"""
    sigma: dict[str, Annotated[float, Field(ge=0)]] = Field(default_factory=dict)
    """standard deviation of all parameters whose names begin with this; they count as independent"""
    covariance: CovarianceModel | None = None
    """instead of sigma"""

    @model_validator(mode="after")
    def _fits(self) -> ErrorFileModel:
        if self.map is not None and (self.components or self.location or self.legs or self.bars or self.passive):
            raise ValueError("[map] stands alone; take out components, location, legs, bars and passive")
        if self.sigma and self.covariance is not None:
            raise ValueError("give [sigma] or [covariance], not both")
        for name in self.components:
            _named(name, "components", location=False)
        for name in self.location:
            _named(name, "location", location=True)
        return self


def _named(name: str, table: str, location: bool) -> None:
    parts = parse(name)
    if parts is None or parts.location != location or (parts.axis == "S" and not location):
        wanted = "E + direction X Y Z A B C + 0 + axis or S, e.g. EC0Y" if location else \
            "E + direction X Y Z A B C + axis, e.g. EXX"
        raise ValueError(f"[{table}] {name!r} is not an ISO 230-1 name; write {wanted}")
