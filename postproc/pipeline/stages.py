"""The journey of one toolpath as a table of stages; only reading and writing touch files.

Each stage is a pure function: what the one before has handed on, and progress, to that with more fields, and diagnostics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.base.progress import Progress
from postproc.compile.compile import compile_program, writing_of
from postproc.compile.cycle_refusals import only_canned
from postproc.compile.feed import PlannedTimes as PlannedFeeds
from postproc.compile.word_rows import block_tools
from postproc.job.job import Job, prepare
from postproc.job.places import at_place
from postproc.path.build import build_path
from postproc.path.model import JointPath
from postproc.path.reach import check_reach
from postproc.path.rewinds import drawing_of
from postproc.path.singular import check_singular
from postproc.path.travel import check_travel
from postproc.path.turn_steps import with_short_turns
from postproc.pipeline.free_spin import spun_machine
from postproc.pipeline.hooks import refused_hooks
from postproc.pipeline.program_header import header_lines
from postproc.pipeline.program_lines import cl_lines, section_lines
from postproc.pipeline.result import PostResult, StageName
from postproc.pipeline.smoothed_stages import ExcludedPasses, written_moves
from postproc.pipeline.stage_values import (
    BegunStage,
    CheckedStage,
    CompiledStage,
    CorrectedStage,
    PlacedStage,
    PlannedStage,
    PreparedStage,
    SharedStage,
    SolvedStage,
    VerifiedStage,
    WrittenStage,
    handed_on,
    without_path,
)
from postproc.pipeline.tolerance_shares import tolerance_shares
from postproc.pipeline.written_figures import is_summed_up, written_figures
from postproc.planning.planned_source import limits_not_kept, shifted_moves, source_of
from postproc.readback.comparison.slow_moves import with_fingerprint
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from postproc.setup.system import with_system
from postproc.verification.proof_text import with_statement
from postproc.verification.read_back import read_back
from postproc.verification.second_witness import second_witness
from postproc.verification.stated_numbers import check_header, stated_smoothing
from postproc.writing.unwritable import floating_taps, unwritable
from postproc.writing.writers import writer_for
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.planning.planned import PlannedMotion
    from postproc.planning.planned_errors import PlannedCorrection
    from postproc.readback.comparison.compare import Comparison

DiagnosticList = list[Diagnostic]
_STRETCH = 1_000_000
"""characters of a program that are looked at together"""


@dataclass(frozen=True)
class Stage:
    """One step of a conversion: its name, what it does, and the function.

    Where the function cannot make its value it hands back what it was given, with the errors that say why; an
    error ends the conversion in either direction.
    """

    name: StageName
    does: str
    run: Callable[[Any, Progress | None], tuple[BegunStage, DiagnosticList]]


def staged(result: PostResult, progress: Progress | None = None,
           left: ExcludedPasses = frozenset()) -> PostResult:
    """A conversion through all stages, up to the first that finds an error; `left`: passes that --smooth leaves."""
    made: Any = BegunStage(result.options, result.machine, result.controller, result.controller_name, result.setup,
                           result.diagnostics, result.toolpath, result.choice, result.turning, result.source,
                           result.asked, left, result.refused, result.control_plan)
    begun = result
    for number, stage in enumerate(STAGES):
        made, found = stage.run(made, _named(progress, stage.name, number))
        result = replace(_recorded(result, made, found), reached=stage.name)
        if not result.ok:
            return result if result.figures is None else staged(replace(begun, keep="all"), progress, left)
        made = replace(made, diagnostics=result.diagnostics)
        if stage.name == "write" and begun.keep == "summary" and is_summed_up(made.job, made.machine):
            figures = written_figures(made.job, made.toolpath, made.path, made.program, made.feeds)
            made, result = without_path(made), replace(result, figures=figures, path=None, program=None, feeds=None)
    return replace(result, text=made.text, files=made.files)


def _named(progress: Progress | None, name: StageName, number: int) -> Progress | None:
    """What a stage reports its progress to, by its own name; it begins."""
    if progress is None:
        return None
    progress(name, number, len(STAGES))
    return lambda part, at, total: progress(name, at, total)


def _recorded(result: PostResult, made: BegunStage, found: DiagnosticList) -> PostResult:
    """With what a stage has handed on; the text only stands in it at the end."""
    known = {one.name for one in fields(result)} - {"text", "files", "diagnostics"}
    return replace(result.with_found(found), **{name: value for name, value in vars(made).items() if name in known})


def prepared(begun: BegunStage, progress: Progress | None) -> tuple[BegunStage | PreparedStage, DiagnosticList]:
    """Records, tools, cycles, output modes and linking moves of the path, as the machine and the control take them."""
    options = begun.options
    job, found = prepare(begun.toolpath, spun_machine(begun.machine, begun.setup), begun.controller, begun.setup, options,
                         begun.refused)
    found = [*found, *_bad_meshes(begun.setup, options.setup)]
    if job is None:
        return begun, found
    found += refused_hooks(job)
    return handed_on(PreparedStage, begun, job=job, toolpath=begun.toolpath if has_errors(found) else job.toolpath), found


def _bad_meshes(setup: SetupFile, file: str) -> DiagnosticList:
    """Errors in the meshes of a set-up, reported before anything is planned."""
    if setup.bodies is None:
        return []
    from postproc.collision.bodies import mesh_errors

    return mesh_errors(setup, file)


def shared(made: PreparedStage, progress: Progress | None) -> tuple[SharedStage, DiagnosticList]:
    """The tolerance shared out."""
    shares, found = tolerance_shares(made.job)
    return handed_on(SharedStage, made, shares=shares), found


def placed(made: SharedStage, progress: Progress | None) -> tuple[PlacedStage, DiagnosticList]:
    """The moves that are written, with --smooth moved; how the tool is drawn back."""
    job = made.job
    moves, found = written_moves(job, made.shares, made.left)
    drawing, more = drawing_of(job.setup, job.placement, job.space, job.machine,
                               made.options.setup or made.toolpath.file)
    return handed_on(PlacedStage, made, moves=moves, drawing=drawing), [*found, *more]


def solved(made: PlacedStage, progress: Progress | None) -> tuple[PlacedStage | SolvedStage, DiagnosticList]:
    """Joints of every run, linking moves between them, points between."""
    job, shares = made.job, made.shares
    path, found = build_path(job.modes, job.kinematics, made.moves, job.space, job.home_rows(), job.operation,
                             shares["linearising"], shares["axis_linearising"] * DEG, made.toolpath.file, progress,
                             made.drawing, made.setup.output.rapids_as_feed, made.options.off_path)
    found = with_system(found, job.work_system, job.placement, job.moves.axis)
    if path is None:
        return made, found
    return handed_on(SolvedStage, made, path=with_short_turns(path, made.moves, job.control, job.kinematics)), found


def corrected(made: SolvedStage, progress: Progress | None) -> tuple[SolvedStage | CorrectedStage, DiagnosticList]:
    """The path on the machine with its geometric errors, where it is inside travel without."""
    job, path = made.job, made.path
    if job.errors is None or not job.corrects:
        return handed_on(CorrectedStage, made, nominal=None, compensation=None), []
    from postproc.correction.compensation import compensate

    options, file, moves = job.options, made.toolpath.file, made.moves
    far, _ = _beyond(job, path, file)
    if has_errors(far):
        return made, with_system(far, job.work_system, job.placement, job.moves.axis)
    better, report, found = compensate(path, moves, block_tools(path, moves), job.kinematics, job.errors, job.modes,
                                       options.tolerance, job.axis_tolerance, writing_of(job, moves),
                                       only_canned(job.toolpath, job.controller), options.error_beyond, file)
    if better is None:
        return made, found
    return handed_on(CorrectedStage, made, path=better, nominal=path, compensation=report), found


def _beyond(job: Job, path: JointPath, file: str) -> tuple[list[Diagnostic], dict[str, tuple[float, float]]]:
    """(where travel or reach end, extents of each axis)."""
    lower = job.setup.clearance.lower
    found, extents = check_travel(path, job.moves, job.control, job.kinematics, file,
                                  at_place(job.places, job.repeats, job.moves), lower)
    return [*found, *check_reach(path, job.moves, job.control, file, lower)], extents


def checked(made: CorrectedStage, progress: Progress | None) -> tuple[CheckedStage, DiagnosticList]:
    """Travel, reach, distance from singular positions."""
    job, path, file = made.job, made.path, made.toolpath.file
    found, extents = _beyond(job, path, file)
    found += check_singular(path, job.moves, job.control, job.setup.joints.singular_distance, file)
    return handed_on(CheckedStage, made, extents=extents), with_system(found, job.work_system, job.placement, job.moves.axis)


def planned(made: CheckedStage, progress: Progress | None) -> tuple[PlannedStage, DiagnosticList]:
    """What the passes allow under the limits of the axes, with --feed planned."""
    job = made.job
    if job.options.feed != "planned":
        return handed_on(PlannedStage, made, motion=None), limits_not_kept(job)
    from postproc.planning.planned_errors import planned_correction

    correction = planned_correction(job, made.compensation, made.path)
    motion, found = plan_motion(job, made.moves, made.nominal or made.path, correction)
    if motion is None or made.nominal is not None or not job.controller.feed.limited_jerk:
        return handed_on(PlannedStage, made, motion=motion), found
    motion = motion.with_points(job.machine.home, job.control.unit, shifted_moves(job, made.moves))
    if made.control_plan is not None and len(made.control_plan.needed) == len(motion.source.path):
        motion = replace(motion, by_control=made.control_plan.needed)
    return handed_on(PlannedStage, made, motion=motion, path=motion.source.path), found


def plan_motion(job: Job, moves: Moves, path: JointPath,
                correction: PlannedCorrection | None = None) -> tuple[PlannedMotion | None, DiagnosticList]:
    """The motion of a path within the limits of axes and tools; None without --feed planned."""
    if job.options.feed != "planned":
        return None, limits_not_kept(job)
    from postproc.planning.planned import planned_motion

    return planned_motion(source_of(job, moves, path, correction, limited_jerk=job.controller.feed.limited_jerk))


def compiled(made: PlannedStage, progress: Progress | None) -> tuple[CompiledStage, DiagnosticList]:
    """Canonical words, rounded, with feeds, commands, cycles and sections; what the control cannot write is refused."""
    job, motion, compensation = made.job, made.motion, made.compensation
    feeds_planned = None if motion is None else PlannedFeeds(_needed(made, motion), made.options.merge_feeds)
    program, feeds, found = compile_program(job, made.moves, made.path, feeds_planned,
                                            None if compensation is None else compensation.apart)
    found += unwritable(made.controller, program, made.toolpath.cycles, made.toolpath.file,
                        job.control.length_on_z)
    found += floating_taps(made.controller, program, made.toolpath.cycles, made.machine.options.absent("rigid_tapping"),
                           made.toolpath.file)
    return handed_on(CompiledStage, made, program=program, feeds=feeds), found


def written(made: CompiledStage, progress: Progress | None) -> tuple[WrittenStage, DiagnosticList]:
    """The text of the program, header with what made it, and of its subprograms in files of their own."""
    file, setup, shares = made.toolpath.file, made.setup, made.shares
    writer = writer_for(made.controller, made.program, made.toolpath.cycles, made.job.control.length_on_z,
                        made.job.smoothing.default.mm, [(place.name, place.code) for place in made.job.places],
                        axis_smoothing=shares["axis_smoothing"],
                        name=setup.output.program_name or made.options.name or FilePath(file).stem,
                        subprograms=setup.output.divided,
                        stock=made.job.stock, levels=made.job.smoothing.named)
    text = writer.text(header_lines(made))
    files = {name: "\n".join(blocks) + "\n" for name, blocks in writer.files.items()}
    text, most = with_fingerprint(text, files), made.controller.format.line_length
    return handed_on(WrittenStage, made, text=text, files=files, sections=section_lines(made.program)), [
        d for one in (text, *files.values()) for d in long_blocks(one, most, file)]


def long_blocks(text: str, most: int, file: str) -> DiagnosticList:
    """Blocks with more characters than the controller reads."""
    long, at, before = list[tuple[int, str]](), 0, 0
    while at < len(text):
        stop = text.find("\n", min(at + _STRETCH, len(text) - 1)) + 1 or len(text)
        some = text[at:stop]
        if has_longer(some, most):
            long += [(before + n, line) for n, line in enumerate(some.splitlines(), 1) if len(line) > most]
        at, before = stop, before + some.count("\n")
    if not long:
        return []
    number, line = long[0]
    return [error("write.line_length", f"block {number} of the program has {len(line)} characters, the controller reads "
                  f"{most}: {line[:60]}", file=file, count=len(long), hint="format.line_length of the controller file")]


def has_longer(text: str, most: int) -> bool:
    """Whether a line of a text has more than `most` characters."""
    data = text.encode() + b"\n"
    ends = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
    return bool((np.diff(ends, prepend=-1) > most + 1).any())


def verified(made: WrittenStage, progress: Progress | None) -> tuple[VerifiedStage, DiagnosticList]:
    """The text executed as the control would, held against the CL file; then by the second witness."""
    job, witness = made.job, None
    comparison, found = read_back(made.text, job, made.toolpath.file, progress,
                                  others={name: text.encode() for name, text in made.files.items()},
                                  of_cl=None if made.files else lambda line: cl_lines(line, made.text, made.sections,
                                                                                      made.controller), margins=True)
    found = [*found, *check_header(made.text, job, "")]
    found += [] if comparison is None else stated_smoothing(comparison, job, "")
    if comparison is not None and made.motion is not None and not has_errors(found):
        found = [*found, *_against_plan(made, made.motion, comparison)]
    if comparison is not None and made.path is None:  # let go of what nothing looks at any more (`PostResult.keep`)
        comparison = comparison.without_poses()
    if comparison is not None and not has_errors(found):
        witness, more = second_witness(made.source, made.asked or made.setup, made.options, job, comparison,
                                       b"" if made.files else made.text)
        found = [*found, *more]
    value = handed_on(VerifiedStage, made, comparison=comparison, witness=witness, after_formatting=None)
    if made.compensation is None:
        return value, found
    from postproc.verification.residual_errors import after_formatting, beyond_bound

    left = after_formatting(value)
    return replace(value, after_formatting=left), [*found, *beyond_bound(left, job)]


def _needed(made: PlannedStage, motion: PlannedMotion) -> Floats:
    """(K,) least s of each block that is written, by the plan."""
    from postproc.planning.planned_errors import on_written

    return on_written(made.compensation, motion.needed)


def _against_plan(made: WrittenStage, motion: PlannedMotion, comparison: Comparison) -> DiagnosticList:
    """Errors of F words that do not carry the plan."""
    from postproc.verification.planned_words import check_planned

    return check_planned(made.path, made.moves, _needed(made, motion), made.options.merge_feeds, comparison, made.job)


def stated(made: VerifiedStage, progress: Progress | None) -> tuple[VerifiedStage, DiagnosticList]:
    """What is proved, in the header of the program: another comment in the place of the one that was read back."""
    if made.comparison is None:
        return made, []
    text, found = with_statement(made.text, made.controller, made.comparison, made.witness, made.job)
    return replace(made, text=text), found


STAGES = (
    Stage("prepare", "records, tools, cycles, output modes: the moves that everything is compared with", prepared),
    Stage("share", "the tolerance shared out", shared),
    Stage("place", "the moves that are written, with --smooth moved; how the tool is drawn back", placed),
    Stage("solve", "joints, linking moves, points between", solved),
    Stage("correct", "geometric errors", corrected),
    Stage("check", "travel, reach, singular positions", checked),
    Stage("plan", "feeds within the limits of the axes", planned),
    Stage("compile", "canonical words, feeds, commands, cycles", compiled),
    Stage("write", "text in the control's dialect", written),
    Stage("verify", "read back, compared with the CL file, second witness", verified),
    Stage("state", "what is proved, in the header of the program", stated),
)
"""in order; each is given what the one before hands on"""
