"""What each stage of a conversion hands to the next: all that is known by then, nothing that comes later.

Each adds fields to the one before, so that a stage states by the type of its argument what must have been done.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.program_time import ControlPlan
from postproc.compile.feed import Feeds
from postproc.compile.program import Program
from postproc.control.control import InterpolationMode
from postproc.control.modes import Refused
from postproc.controllers.model import ControllerFile
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.path.rewinds import RetractPlan
from postproc.pipeline.smoothed_stages import ExcludedPasses
from postproc.readback.comparison.compare import Comparison
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import ClSource, Toolpath

if TYPE_CHECKING:
    from postproc.correction.compensation import ErrorCorrection
    from postproc.correction.written_deviation import AfterFormatting
    from postproc.orientation.plans.choice import OrientationChoice
    from postproc.orientation.turning.turning_choice import TurningChoice
    from postproc.planning.planned import PlannedMotion
    from postproc.witness.evidence import Testimony


@dataclass(frozen=True)
class BegunStage:
    """A conversion before its first stage; `left`: passes that --smooth leaves; `refused`: output
    modes that "auto" passes over; `control_plan`: the feeds that planned words carry, where they are known already;
    `diagnostics`: of all stages so far."""

    options: Options
    machine: Machine
    controller: ControllerFile
    controller_name: str
    setup: SetupFile
    diagnostics: tuple[Diagnostic, ...]
    toolpath: Toolpath
    choice: OrientationChoice | None
    turning: TurningChoice | None
    source: ClSource | None
    asked: SetupFile | None
    left: ExcludedPasses
    refused: Refused
    control_plan: ControlPlan | None


@dataclass(frozen=True)
class PreparedStage(BegunStage):
    """Records spelt out, output modes known: the moves that everything is compared with."""

    job: Job


@dataclass(frozen=True)
class SharedStage(PreparedStage):
    """The tolerance shared out: mm, `axis_` in degrees."""

    shares: dict[str, float]


@dataclass(frozen=True)
class PlacedStage(SharedStage):
    """The moves that are written, and how the tool is drawn back for rewinds."""

    moves: Moves
    drawing: RetractPlan


@dataclass(frozen=True)
class SolvedStage(PlacedStage):
    """Joints, linking moves, points between: the path in blocks."""

    path: JointPath


@dataclass(frozen=True)
class CorrectedStage(SolvedStage):
    """`path` on the machine with its geometric errors; `nominal` as it was, both None where none are corrected."""

    nominal: JointPath | None
    compensation: ErrorCorrection | None


@dataclass(frozen=True)
class CheckedStage(CorrectedStage):
    """Least and greatest position by axis letter."""

    extents: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class PlannedStage(CheckedStage):
    """Motion within the limits of the axes; None without --feed planned."""

    motion: PlannedMotion | None


@dataclass(frozen=True)
class CompiledStage(PlannedStage):
    """Canonical words and feeds."""

    program: Program
    feeds: Feeds


@dataclass(frozen=True)
class WrittenStage(CompiledStage):
    """The text of the program, and of its subprograms in files of their own by file name; law and first line of the CL
    file of its sections. Path, program and feeds may have been let go by then (`PostResult.keep`)."""

    text: str
    files: dict[str, str]
    sections: list[tuple[InterpolationMode, int]]


@dataclass(frozen=True)
class VerifiedStage(WrittenStage):
    """What the program does as it was read back; None where it could not be executed."""

    comparison: Comparison | None
    witness: Testimony | None
    after_formatting: AfterFormatting | None


_Value = TypeVar("_Value", bound=BegunStage)


def handed_on(kind: type[_Value], made: BegunStage, **more: object) -> _Value:
    """A stage's value: that of the stage before with more fields, or other ones."""
    return kind(**(vars(made) | more))


def without_path(made: _Value) -> _Value:
    """A written stage's value without path, program and feeds, where nothing looks at them any more."""
    return handed_on(type(made), made, path=None, program=None, feeds=None)
