"""The measurement file: what was measured on which machine, with what, and what is to be found from it.

Lengths mm and angles degrees where a key has no unit in its name; CSV tables have units in their headers.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, field_validator

from machines.models import NotNegative, Positive, Vector
from machines.user_model import UserModel, schema

Sigma = Annotated[float, Field(ge=1e-6, le=1e6)]
StepCount = Annotated[int, Field(ge=3, le=360)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]


class TableColumn(NamedTuple):
    """A column of a table: its name, the kind of its unit ("length", "angle", "" none), what it says."""

    name: str
    unit: Literal["length", "angle", ""]
    meaning: str = ""


_PLACES = (TableColumn("setup", "", "number of the set-up: 0, 1, ..."),
           TableColumn("step", "", "0 .. steps - 1: where the axis stands, in steps of 360 / steps degrees from its 0"))
_SIX = (*(TableColumn(f"d{x}", "length", f"displacement along {x} of what the axis moves, + along {x}") for x in "xyz"),
        *(TableColumn(f"e{x}", "angle", f"turn about {x} of what the axis moves, + as a right-hand screw") for x in "xyz"))
COLUMNS: dict[str, tuple[TableColumn, ...]] = {
    "reversal": (*_PLACES,
                 TableColumn("reading", "angle", "actual less commanded angle, + in the direction the axis counts")),
    "rotary": (*_PLACES, *_SIX),
    "poses": tuple(TableColumn(f"d{x}", "length", f"actual less nominal place of the tip along {x} of the table frame")
                   for x in "xyz"),
    "ball_bar": (TableColumn("distance", "length", "whole length from the ball on the table to the ball in the spindle"),),
    "laser": (TableColumn("reading", "length", "actual less nominal displacement of the tip, + along `toward`"),),
}
"""what was read, by kind of measurement; poses, ball_bar and laser have a column for each axis of the machine too"""
JOINT = "commanded position of each axis of the machine, slides in a length, rotary axes in an angle"
DIRECTION = ("may be left out: approach direction of X (so for any axis), 1 from lesser values, -1 from greater ones, "
             "0 not known")


class ReversalModel(UserModel):
    """`[reversal]`: axis against indexer."""

    table: str
    """CSV file next to this one"""
    axis: Literal["A", "B", "C"]
    """rotary axis that was measured"""
    steps: StepCount
    """n, steps of a turn"""
    sigma_arcsec: Sigma
    """standard deviation of a reading"""
    shifts: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """increments by which the indexer was turned in each set-up: step i then meets its increment i + shift;
    default 0, 1, 2, ..."""
    zeroed: bool = True
    """the instrument was zeroed again at each set-up"""


class RotaryMeasurementModel(UserModel):
    """`[rotary]`: all six errors by reversal."""

    table: str
    """CSV file next to this one; empty cells are not allowed, leave whole rows out"""
    axis: Literal["A", "B", "C"]
    """rotary axis that was measured. Readings are of what it moves, tool or part: z where that turns to at
    positive commands, x along the machine's X (axis C), Y (A) or Z (B)"""
    steps: StepCount
    """n, steps of a turn"""
    harmonics: Annotated[int, Field(ge=1)]
    """of the series that are fitted"""
    sigma_um: Sigma
    """standard deviation of displacements"""
    sigma_arcsec: Sigma
    """standard deviation of turns"""
    axis_to_indexer: NotNegative = 80.0
    """mm along the axis from its reference point to the indexer"""
    indexer_to_reflector: NotNegative = 120.0
    """mm from there to the reflector"""
    shift: tuple[Coordinate, Coordinate, Coordinate] = (0.0, 0.0, 0.0)
    """mm, where the reflector stands from the indexer's axis"""


class PosesModel(UserModel):
    """`[poses]`: tips measured at commanded positions."""

    table: str
    """CSV file next to this one"""
    sigma_um: Sigma
    """standard deviation of a displacement"""
    tool_length: NotNegative = 0.0
    """mm from the gauge point to the point that was measured"""
    zeroed: bool = True
    """the place of the ball is not known and found along"""


class BarModel(UserModel):
    """`[ball_bar]`: distances at commanded positions."""

    table: str
    """CSV file next to this one"""
    sigma_um: Sigma
    """standard deviation of a distance"""
    centre: tuple[Coordinate, Coordinate, Coordinate]
    """mm, where the ball on the table is thought to be, in the table frame; where it really is, and how much
    the readings are too short, are found along"""
    tool_length: NotNegative = 0.0
    """mm from the gauge point to the point that was measured"""


class LaserModel(UserModel):
    """`[laser]`: displacements along a direction at commanded positions."""

    table: str
    """CSV file next to this one"""
    sigma_um: Sigma
    """standard deviation of a reading"""
    toward: Vector
    """direction in the table frame, of any length but 0"""
    tool_length: NotNegative = 0.0
    """mm from the gauge point to the point that was measured"""
    zeroed: bool = False
    """the laser's zero is not known and found along"""

    @field_validator("toward")
    @classmethod
    def _directed(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if not 1e-6 <= max(abs(v) for v in value) <= 1e6:
            raise ValueError("the direction has no usable length; write [1, 0, 0] for x")
        return value


class MeasurementModel(UserModel):
    """A measurement file: exactly one kind of measurement."""

    description: str = ""
    """one line"""
    machine: str
    """name or file of the machine"""
    model: str = ""
    """error model file to start from; its parameters are those that can be found (poses, ball_bar, laser)"""
    parameters: tuple[str, ...] = ()
    """names, or beginnings of names, of the parameters to find; all of the model without"""
    large: bool = False
    """true: errors above 1 mm or 0.5 degrees, and a ball or a bar as far from what the file says, are meant;
    they are warnings then"""
    robust: bool = False
    """let readings count less that do not fit (Huber)"""
    accept_residual: bool = False
    """true: take a fit that leaves more of the readings than their stated standard deviation explains; its
    covariance is scaled by what is left"""
    minutes_per_reading: Positive = 0.5
    """machine time, for what another set-up would cost"""
    minutes_per_setup: NotNegative = 20.0
    """machine time to turn the indexer and align"""
    reversal: ReversalModel | None = None
    """axis and indexer distinguished"""
    rotary: RotaryMeasurementModel | None = None
    """all six errors of a rotary axis"""
    poses: PosesModel | None = None
    """probe on ball, R-test, tracker"""
    ball_bar: BarModel | None = None
    """telescoping ball-bar"""
    laser: LaserModel | None = None
    """interferometer"""


def measurement_schema() -> dict[str, Any]:
    """The JSON schema of a measurement file; `table` of each kind says which columns it has."""
    result = schema("measurements", MeasurementModel)
    for kind, columns in COLUMNS.items():
        reference = result["properties"][kind]["anyOf"][0]["$ref"].split("/")[-1]
        found = [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in columns]
        if kind not in ("reversal", "rotary"):
            found += [{"name": "X, Y, ...", "unit": "length or angle", "meaning": JOINT},
                      {"name": "X way, ...", "unit": "", "meaning": DIRECTION}]
        result["$defs"][reference]["properties"]["table"]["columns"] = found
    return result
