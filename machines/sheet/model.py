"""The data sheet of a machine as its user writes it down: figures with units, the control's own pivot numbers, jogs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from machines.models import Vector
from machines.user_model import UserModel

Jog = Literal["right up", "right down", "front up", "front down", "clockwise", "anti-clockwise", "tip left", "tip right",
              "tip back", "tip front"]
"""what is seen when a rotary axis is jogged by +10 degrees from 0"""
_SPELLINGS = {"counterclockwise": "anti-clockwise", "counter-clockwise": "anti-clockwise", "anticlockwise": "anti-clockwise",
              "ccw": "anti-clockwise", "cw": "clockwise"}

_PASSED_OVER = ("the", "side", "edge", "goes", "moves", "turns", "to")
"""words of the questions that an answer may repeat"""


def spelt(text: str) -> str:
    """A jog in other spellings as the word that it stands for."""
    words = " ".join(word for word in text.lower().split() if word not in _PASSED_OVER)
    return _SPELLINGS.get(words, words)


ZeroEnd = Literal["upper", "lower", "middle"]
PivotForm = Literal["machine", "haas", "siemens", "heidenhain", "fanuc"]


class AxisSheet(UserModel):
    """One `[X]` table: an axis as the brochure has it."""

    travel: str | tuple[str, str]
    """length of the travel, "762 mm", or both ends, ["-35 deg", "120 deg"]; "endless" for a rotary axis without ends"""
    rapid: str
    """"22.9 m/min", "900 in/min", "50 rpm": always with its unit"""
    acceleration: str = ""
    """"5 m/s2", "0.5 g"; left out: assumed"""
    zero: ZeroEnd = "upper"
    """where the control counts from, of a travel that is stated by its length: its upper end, as most do, or others"""
    home: str = ""
    """where programs begin and tools change; left out: the machine's zero, or the nearest that travel allows"""
    jog: Annotated[Jog | None, BeforeValidator(lambda said: spelt(said) if isinstance(said, str) else said)] = None
    """rotary axes: what a jog by +10 degrees showed; left out: the sense of ISO 841 is assumed"""


class PivotSheet(UserModel):
    """The `[pivots]` table: numbers of the control, mm, in machine coordinates, all axes at 0."""

    form: PivotForm
    """whose names: haas (MRZP, settings 255 to 257 and 300 to 305), siemens (I1 to I4 of the swivel data set, what CYCLE996
    measures), heidenhain (rows Trans of the kinematics from the tool on, what cycle 451 measures), fanuc (19700 to 19714,
    by hand or G10 L52), machine (points of the lines themselves)"""
    points: dict[str, Vector] = Field(default_factory=dict)
    """by the control's name: "MRZP", "I2", "Trans 1", "19700"; with form "machine" by letter of the axis"""
    text: str = ""
    """the same as the control puts it out: fanuc, blocks of G10 L52 or the list of parameters; siemens, lines of $TC_CARR"""


class TouchReading(UserModel):
    """One reading: where the rotary axes stood, and what the control showed."""

    A: float = 0.0
    """degrees"""
    B: float = 0.0
    """degrees"""
    C: float = 0.0
    """degrees"""
    at: Vector
    """machine coordinates X, Y, Z of the gauge point, mm"""


class TouchedSheet(UserModel):
    """The `[touched]` table: one ball on the table, touched by a probe with the rotary axes turned differently."""

    probe_length: float = Field(ge=0.0)
    """mm from the gauge point to the middle of the probe's ball"""
    readings: tuple[TouchReading, ...] = Field(min_length=2)
    """each rotary axis is turned in one of them at least"""


class TableTopSheet(UserModel):
    """The `[table_top]` table: what brochures print next to travel; it proves travel and pivots, nothing is made of it."""

    spindle_to_table: tuple[str, str] | None = None
    """from the spindle's nose to the table's top at both ends of Z, ["102 mm", "610 mm"], all axes at 0"""
    size: str = ""
    """of the table: its diameter, or its longer side; "500 mm"."""


class TimingSheet(UserModel):
    """The `[times]` table."""

    tool_change: str = ""
    """chip to chip, "4.2 s"; left out: assumed"""
    clamp: str = ""
    """of a rotary axis; left out: assumed"""


class DataSheet(UserModel):
    """A sheet."""

    description: str
    """one line"""
    source: str
    """the document that the figures are from: maker, title, edition, page"""
    table: tuple[Literal["A", "B", "C"], ...] = ()
    """rotary axes that carry the part, the one next to the bed first: ["B", "C"] for a trunnion B with a table C on it"""
    head: tuple[Literal["A", "B", "C"], ...] = ()
    """rotary axes that carry the tool, the one next to the slides first"""
    table_slides: tuple[Literal["X", "Y", "Z"], ...] = ()
    """linear axes that move the table, the one next to the bed first; the others move the spindle"""
    spindle: str = ""
    """its largest speed, "8100 rpm"; left out: not known"""
    X: AxisSheet
    """axis X"""
    Y: AxisSheet
    """axis Y"""
    Z: AxisSheet
    """axis Z"""
    A: AxisSheet | None = None
    """axis A"""
    B: AxisSheet | None = None
    """axis B"""
    C: AxisSheet | None = None
    """axis C"""
    pivots: PivotSheet | None = None
    """where the rotary axes lie"""
    touched: TouchedSheet | None = None
    """readings that prove pivots and signs: by them one point of the table must stay one point"""
    table_top: TableTopSheet = TableTopSheet.unstated()
    """distances that prove travel and pivots"""
    times: TimingSheet = TimingSheet.unstated()
    """times that no axis gives"""

    @property
    def axes(self) -> dict[str, AxisSheet]:
        """Tables of the axes that the machine has."""
        known = {"X": self.X, "Y": self.Y, "Z": self.Z, "A": self.A, "B": self.B, "C": self.C}
        return {letter: axis for letter, axis in known.items() if axis is not None}

    @property
    def rotary(self) -> tuple[str, ...]:
        """Letters of the rotary axes that `table` and `head` name."""
        return (*self.table, *self.head)
