"""The measurement file: what was measured on which machine, with what, and what is to be found from it.

Lengths mm and angles degrees where a key has no unit in its name; CSV tables have units in their headers.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from machines.models import NotNegative, Positive, Vector
from machines.user_file import UserModel

Sigma = Annotated[float, Field(ge=1e-6, le=1e6)]
Steps = Annotated[int, Field(ge=3, le=360)]
Place = Annotated[float, Field(ge=-1e6, le=1e6)]


class ReversalModel(UserModel):
    """`[reversal]`: axis against indexer. Table: setup (0, 1, ...), step (0 .. n - 1), reading [arcsec]: actual less
    commanded, counted as the axis counts."""

    table: str
    """CSV file beside this one"""
    axis: Literal["A", "B", "C"]
    """rotary axis that was measured"""
    steps: Steps
    """n, steps of a turn"""
    sigma_arcsec: Sigma
    """standard deviation of a reading"""
    shifts: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """increments by which the indexer was turned in each set-up; default 0, 1, 2, ..."""
    zeroed: bool = True
    """the instrument was zeroed anew at each set-up"""


class RotaryModel(UserModel):
    """`[rotary]`: all six errors by reversal. Table: setup, step, dx dy dz [um], ex ey ez [arcsec]."""

    table: str
    """CSV file beside this one; empty cells are not allowed, leave whole rows out"""
    axis: Literal["A", "B", "C"]
    """rotary axis that was measured. Readings are of what it moves, tool or part: z where that turns to at positive
    commands, x along the machine's X (axis C), Y (A) or Z (B)"""
    steps: Steps
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
    shift: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)
    """mm, where the reflector stands from the indexer's axis"""


class PosesModel(UserModel):
    """`[poses]`: tips measured at commanded joints. Table: X [mm] ... C [deg], dx dy dz [um], actual less nominal."""

    table: str
    """CSV file beside this one"""
    sigma_um: Sigma
    """standard deviation of a displacement"""
    tool_length: NotNegative = 0.0
    """mm"""
    zeroed: bool = True
    """the place of the ball is not known and found along"""


class BarModel(UserModel):
    """`[ball_bar]`: distances at commanded joints. Table: X [mm] ... C [deg], distance [mm]."""

    table: str
    """CSV file beside this one"""
    sigma_um: Sigma
    """standard deviation of a distance"""
    centre: tuple[Place, Place, Place]
    """mm, nominal centre in the table frame; where it really is, and the bar's length error, are found along"""
    tool_length: NotNegative = 0.0
    """mm"""


class LaserModel(UserModel):
    """`[laser]`: displacements along a direction. Table: X [mm] ... C [deg], reading [um], actual less nominal."""

    table: str
    """CSV file beside this one"""
    sigma_um: Sigma
    """standard deviation of a reading"""
    toward: Vector
    """direction in the table frame, of any length but 0"""
    tool_length: NotNegative = 0.0
    """mm"""
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
    robust: bool = False
    """let readings count less that do not fit (Huber)"""
    minutes_per_reading: Positive = 0.5
    """machine time, for what another set-up would cost"""
    minutes_per_setup: NotNegative = 20.0
    """machine time to turn the indexer and align"""
    reversal: ReversalModel | None = None
    """axis and indexer told apart"""
    rotary: RotaryModel | None = None
    """all six errors of a rotary axis"""
    poses: PosesModel | None = None
    """probe on ball, R-test, tracker"""
    ball_bar: BarModel | None = None
    """telescoping ball-bar"""
    laser: LaserModel | None = None
    """interferometer"""
