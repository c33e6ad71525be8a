"""Why a part cannot stand somewhere, as values: sentences are made of them (`str`) where they are printed."""

from __future__ import annotations

from postproc.orientation.passes.reasons import Refusal, Touching
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic


@dataclass(frozen=True)
class RefusedPass:
    """A pass, by its line, that the machine cannot run there."""

    line: int
    refusal: Refusal

    def __str__(self) -> str:
        return f"line {self.line}: {self.refusal}"


@dataclass(frozen=True)
class NoSafePlane:
    """The safe plane above a pass, by its line where that is known, is outside travel."""

    line: int | None = None

    def __str__(self) -> str:
        which = "some pass" if self.line is None else "the pass"
        where = "" if self.line is None else f"line {self.line}: "
        return f"{where}no safe plane above {which} is inside travel"


@dataclass(frozen=True)
class NearSingular:
    """A parallel machine comes too near to a singular position: which, how near, and what is allowed, of its scale."""

    name: str
    distance: float
    least: float

    def __str__(self) -> str:
        return f"{self.name} comes to {self.distance:.4f} of a singular position, allowed at least {self.least:g}"


@dataclass(frozen=True)
class BeyondTable:
    """The part stands beyond its table, mm along one of its axes."""

    over: float
    along: str

    def __str__(self) -> str:
        return f"the part stands {self.over:.3f} mm beyond the table in {self.along}"


@dataclass(frozen=True)
class SmallTable:
    """The table is too small for the part turned so, mm."""

    over: float

    def __str__(self) -> str:
        return f"the table is too small by {self.over:.3f} mm"


@dataclass(frozen=True)
class StandsIn:
    """A part and the body that it stands in, by their names."""

    part: str
    body: str

    def __str__(self) -> str:
        return f"{self.part} stands in {self.body}"


@dataclass(frozen=True)
class NoOrientation:
    """No tool axes could be chosen there: the first error."""

    fault: Diagnostic

    def __str__(self) -> str:
        return self.fault.message


@dataclass(frozen=True)
class AxisLacks:
    """Travel that an axis lacks at the place of most margin, mm: at the end that lacks most, and at its other end."""

    axis: str
    missing: float
    other: float = 0.0

    def __str__(self) -> str:
        if self.other > 0.0:
            return f"axis {self.axis} lacks {self.missing + self.other:.3f} mm of travel, both ends together"
        return f"axis {self.axis} lacks {self.missing:.3f} mm at one end of its travel"


@dataclass(frozen=True)
class MarginLacks:
    """What a parallel machine lacks at the place of most margin: how much of which unit, None where it does not reach."""

    name: str
    missing: float | None
    unit: str

    def __str__(self) -> str:
        return self.name if self.missing is None else f"{self.name} lacks {self.missing:.4g} {self.unit}"


Lack = AxisLacks | MarginLacks
"""what a place of most margin still lacks"""
Obstacle = RefusedPass | NoSafePlane | NearSingular | BeyondTable | SmallTable | StandsIn | NoOrientation | Touching | Lack
