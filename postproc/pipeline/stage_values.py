"""What each stage of a conversion hands to the next: all that is known by then, nothing that comes later.

Each adds fields to the one before, so that a stage states by the type of its argument what must have been done.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from machines.machine import Machine
from postproc.base.options import Options
from postproc.compile.feed import Feeds
from postproc.compile.program import Program
from postproc.control.modes import Refused
from postproc.controllers.model import ControllerFile
from postproc.job.job import Job
from postproc.path.model import Path
from postproc.path.rewinds import Drawing
from postproc.pipeline.smoothed_stages import Left
from postproc.planning.planned import PlannedMotion
from postproc.readback.comparison.compare import Comparison
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import ClSource, Toolpath

if TYPE_CHECKING:
    from postproc.correction.compensation import Compensation
    from postproc.correction.formatted import AfterFormatting
    from postproc.orientation.plans.choice import OrientationChoice
    from postproc.witness.evidence import Testimony


@dataclass(frozen=True)
class Begun:
    """A conversion before its first stage; `left`: passes that --smooth leaves; `refused`: output
    modes that "auto" passes over; `diagnostics`: of all stages so far."""

    options: Options
    machine: Machine
    controller: ControllerFile
    controller_name: str
    setup: SetupFile
    diagnostics: tuple[Diagnostic, ...]
    toolpath: Toolpath
    choice: OrientationChoice | None
    source: ClSource | None
    asked: SetupFile | None
    left: Left
    refused: Refused


@dataclass(frozen=True)
class Prepared(Begun):
    """Records spelt out, output modes known: the moves that everything is compared with."""

    job: Job


@dataclass(frozen=True)
class Shared(Prepared):
    """The tolerance shared out: mm, `axis_` in degrees."""

    shares: dict[str, float]


@dataclass(frozen=True)
class Placed(Shared):
    """The moves that are written, and how the tool is drawn back for rewinds."""

    moves: Moves
    drawing: Drawing


@dataclass(frozen=True)
class Solved(Placed):
    """Joints, linking moves, points between: the path in blocks."""

    path: Path


@dataclass(frozen=True)
class Corrected(Solved):
    """`path` on the machine with its geometric errors; `nominal` as it was, both None where none are corrected."""

    nominal: Path | None
    compensation: Compensation | None


@dataclass(frozen=True)
class Checked(Corrected):
    """Least and greatest position by axis letter."""

    extents: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Planned(Checked):
    """Motion within the limits of the axes; None without --feed planned."""

    motion: PlannedMotion | None


@dataclass(frozen=True)
class Compiled(Planned):
    """Canonical words and feeds."""

    program: Program
    feeds: Feeds


@dataclass(frozen=True)
class Written(Compiled):
    """The text of the program, and of its subprograms in files of their own by file name."""

    text: str
    files: dict[str, str]


@dataclass(frozen=True)
class Verified(Written):
    """What the program does as it was read back; None where it could not be executed."""

    comparison: Comparison | None
    witness: Testimony | None
    after_formatting: AfterFormatting | None


_Value = TypeVar("_Value", bound=Begun)


def handed_on(kind: type[_Value], made: Begun, **more: object) -> _Value:
    """A stage's value: that of the stage before with more fields, or other ones."""
    return kind(**(vars(made) | more))
