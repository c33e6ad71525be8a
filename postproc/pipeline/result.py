"""What a conversion and a verification come to: data only, with all that lies between CL file and text."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, Literal

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.program_time import ControlPlan, FeedTimes, Optimised
from postproc.compile.feed import Feeds
from postproc.compile.program import Program
from postproc.control.modes import Refused
from postproc.controllers.model import ControllerFile
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.pipeline.written_figures import Keep, WrittenFigures
from postproc.readback.comparison.compare import Comparison
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors, require
from toolpaths.toolpath import ClSource, Toolpath

if TYPE_CHECKING:
    from postproc.correction.compensation import ErrorCorrection
    from postproc.correction.written_deviation import AfterFormatting
    from postproc.orientation.plans.choice import OrientationChoice
    from postproc.orientation.turning.turning_choice import TurningChoice
    from postproc.planning.planned import PlannedMotion
    from postproc.verification.tool_table import MeasuredLength
    from postproc.witness.evidence import Testimony

StageName = Literal["prepare", "share", "place", "solve", "correct", "check", "plan", "compile", "write", "verify", "state"]


@dataclass(frozen=True)
class PostResult:
    """A conversion with everything between, but for what `keep` lets go: `text` is "" where a diagnostic is an ERROR."""

    text: str
    options: Options
    machine: Machine
    controller: ControllerFile
    controller_name: str
    setup: SetupFile
    diagnostics: tuple[Diagnostic, ...]
    toolpath: Toolpath
    """as it was read, oriented and, where it could be, with its records expanded"""
    job: Job | None = None
    moves: Moves | None = None
    """that are written: those of `job`, with --smooth moved"""
    path: JointPath | None = None
    nominal: JointPath | None = None
    """the path before geometric errors are corrected, where they are"""
    compensation: ErrorCorrection | None = None
    program: Program | None = None
    feeds: Feeds | None = None
    motion: PlannedMotion | None = None
    comparison: Comparison | None = None
    extents: dict[str, tuple[float, float]] | None = None
    shares: dict[str, float] | None = None
    files: dict[str, str] | None = None
    """texts of subprograms in files of their own, by file name"""
    choice: OrientationChoice | None = None
    """of the tool axes that `toolpath` has instead of the CL file's, where --orient asked for one"""
    turning: TurningChoice | None = None
    """of axes that turn along cuts, where the set-up has a cone"""
    source: ClSource | None = None
    """of the path as it was read, for the second witness"""
    asked: SetupFile | None = None
    """the set-up as the shop has it, before [part] is said in the absolute frame"""
    witness: Testimony | None = None
    """what the second witness says"""
    after_formatting: AfterFormatting | None = None
    """what is left of geometric errors at the CL points; None where none are corrected"""
    optimised: Optimised | None = None
    """what --optimise came to"""
    feed_times: FeedTimes | None = None
    """what planned feeds do on the control, where they were asked for and its clock is known"""
    control_plan: ControlPlan | None = None
    """what the control can do of the planned passes, where it is known: the words carry it"""
    refused: Refused = frozenset()
    """(operation, mode) that "auto" has passed over"""
    reached: StageName | Literal[""] = ""
    """name of the last stage that ran, "" where none did"""
    keep: Keep = "all"
    """"summary": path, program and feeds are let go once the text is written, and `figures` say what a summary needs of
    them, tips and axes of `comparison` are NaN; kept where a stage or a summary works on them still
    (`written_figures.is_summed_up`), or an ERROR is found"""
    figures: WrittenFigures | None = None
    """of path and program, where these are let go"""

    @property
    def ok(self) -> bool:
        """True where nothing stands against writing the text."""
        return not has_errors(self.diagnostics)

    def checked(self) -> PostResult:
        """The same, where a program was written.

        Raises:
            DiagnosticError: carries all diagnostics.
        """
        require(self.diagnostics)
        return self

    def with_found(self, found: list[Diagnostic]) -> PostResult:
        """With more diagnostics."""
        return replace(self, diagnostics=(*self.diagnostics, *found))


@dataclass(frozen=True)
class VerifyResult:
    """What reading a G-code file back showed."""

    gcode: str
    comparison: Comparison | None
    diagnostics: tuple[Diagnostic, ...]
    witness: Testimony | None = None
    options: Options = field(default_factory=Options)
    source: ClSource | None = None
    """of the path as it was read"""
    cl_file: str = ""
    sha256: str = ""
    """of the bytes of the program"""
    measured: tuple[MeasuredLength, ...] = ()
    """lengths at the machine, where a tool table was given: the program is verified with them"""

    @property
    def ok(self) -> bool:
        """True where the program does what the CL file says."""
        return self.comparison is not None and not has_errors(self.diagnostics)

    def checked(self) -> VerifyResult:
        """The same, where the program does what the CL file says.

        Raises:
            DiagnosticError: carries all diagnostics.
        """
        require(self.diagnostics)
        return self
