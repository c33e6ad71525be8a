"""The journey of one toolpath, stage by stage; only reading and writing touch files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np

import machines
import toolpaths
from machines.machine import Machine
from postproc.compile import compile_program, writing_of
from postproc.controllers import writer_for
from postproc.controllers.model import ControllerFile, load_controller
from postproc.controllers.unwritable import unwritable
from postproc.feed import Feeds, Planned
from postproc.job import Job, prepare
from postproc.moves import Moves
from postproc.not_canned import only_canned
from postproc.options import Options
from postproc.pass_geometry import stops_of
from postproc.path import build_path
from postproc.path_model import Path
from postproc.planned import PlannedMotion, Source, planned_motion
from postproc.planned_errors import PlannedCorrection, on_written, planned_correction
from postproc.program import Program
from postproc.program_header import header_lines
from postproc.reach import check_reach
from postproc.readback.compare import Comparison
from postproc.readback.files import Beside, unfinished
from postproc.readback.slow import with_fingerprint
from postproc.readback.verify import other_axes, other_setup, read_back
from postproc.rewinds import drawing_of
from postproc.rounding import rounding_problem
from postproc.second_witness import second_witness
from postproc.setup import SetupFile, load_setup
from postproc.setup_fingerprint import fingerprint
from postproc.setup_system import standing, with_system
from postproc.singular import check_singular
from postproc.smoothed_stages import Left, with_passes_taken_back, written_moves
from postproc.travel import check_travel
from postproc.word_rows import block_tools
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, has_errors
from toolpaths.input_files import read_input, unreadable
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.toolpath import ClSource, Toolpath
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.compensation import Compensation
    from postproc.corrected.proof import AfterFormatting
    from postproc.cycle_time.estimate import Estimate
    from postproc.orientation.orient import OrientationChoice
    from postproc.witness import Testimony

Progress = Callable[[str, int, int], None]
MARGIN = 0.85
"""of what is left for linearising: deviations are looked at in samples, the read-back looks at others"""
_STRETCH = 1_000_000
"""characters of a program that are looked at together"""
POINTS = 0.5
"""of the share for linearising that --smooth may move points by"""


@dataclass(frozen=True)
class PostResult:
    """A conversion with everything between: `text` is "" where a diagnostic is an ERROR."""

    text: str
    options: Options
    machine: Machine
    controller: ControllerFile
    controller_name: str
    setup: SetupFile
    diagnostics: tuple[Diagnostic, ...]
    toolpath: Toolpath | None = None
    job: Job | None = None
    moves: Moves | None = None
    """that are written: those of `job`, with --smooth moved"""
    path: Path | None = None
    nominal: Path | None = None
    compensation: Compensation | None = None
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
    source: ClSource | None = None
    """of the path as it was read, for the second witness"""
    asked: SetupFile | None = None
    """the set-up as the shop has it, before [part] is said in the absolute frame"""
    witness: Testimony | None = None
    """what the second witness says"""

    @property
    def ok(self) -> bool:
        """True where nothing stands against writing the text."""
        return not has_errors(self.diagnostics)

    @cached_property
    def estimate(self) -> Estimate | None:
        """How long the program takes under its controller, made when first asked for; None where nothing is written."""
        from postproc.cycle_time.conversion import estimate_of

        return estimate_of(self)

    @cached_property
    def after_formatting(self) -> AfterFormatting | None:
        """What is left of geometric errors at the CL points, made when first asked for; None where none are corrected."""
        from postproc.corrected.proof import after_formatting

        return after_formatting(self)


def convert(path: Toolpath, machine: Machine | str | FilePath, controller: str | FilePath = "linuxcnc",
            setup: SetupFile | str | FilePath | None = None, options: Options | None = None,
            diagnostics: list[Diagnostic] | None = None, progress: Progress | None = None) -> PostResult:
    """A Toolpath as G-code for a machine and a controller, read back and compared with the path.

    Args:
        machine: one that is loaded, or a built-in name or path of a machine file
        controller: built-in name or path of a controller file
        setup: one that is loaded, or its path; default: the file that the options name, else the default set-up
        diagnostics: what reading the path found; an ERROR among them, or among the path's own faults, stops the
            conversion

    Raises:
        DiagnosticError: where machine, controller or set-up cannot be loaded.
    """
    spec, machine, setup, options = _loaded(controller, machine, setup, options or Options())
    start = _begun(path, PostResult("", options, machine, spec, FilePath(controller).stem, setup,
                                    _reading(path, diagnostics)))
    start, done = _oriented(start, progress)
    return start if not start.ok else done or _stages(start, progress)


def _loaded(controller: str | FilePath, machine: Machine | str | FilePath, setup: SetupFile | str | FilePath | None,
            options: Options) -> tuple[ControllerFile, Machine, SetupFile, Options]:
    """Controller, machine and set-up from their files; the options with the name of the set-up's."""
    spec, found = load_controller(controller)
    toolpaths.diagnostics.require(found)
    machine = machine if isinstance(machine, Machine) else machines.load(machine)
    if not isinstance(setup, SetupFile):
        if setup is not None:
            options = replace(options, setup=str(setup))
        setup, more = load_setup(options.setup or None)
        toolpaths.diagnostics.require(more)
    assert spec is not None and setup is not None
    given = bool(options.setup) or setup != SetupFile()
    options = replace(options, setup_mark=fingerprint(setup, options.setup) if given else "")
    return spec.divided(setup.output.files), machine, setup, options


def _begun(path: Toolpath, start: PostResult) -> PostResult:
    """The beginning of a conversion with its path, the part standing by the file's absolute frame."""
    setup, found = standing(start.setup, path, start.options.setup)
    return _with(start, found, toolpath=path, setup=setup, source=path.source, asked=start.setup)


def _oriented(start: PostResult, progress: Progress | None) -> tuple[PostResult, PostResult | None]:
    """With the tool axes that --orient asks for, where the path can be read at all; its program where that is known."""
    if start.options.orient == "keep" or not start.ok:
        return start, None
    from postproc.orientation.programs import oriented, written
    from postproc.orientation.report import slower

    start = oriented(start, _stages, progress)
    if start.choice is not None:
        start = _with(start, slower(start.choice, start.options.orient))
    return start, written(start)


def choose_axes(path: Toolpath, machine: Machine, controller: str | FilePath, options: Options,
                diagnostics: list[Diagnostic], progress: Progress | None = None) -> PostResult:
    """The tool axes of a path as `options.orient` has them, in `choice` (None where an ERROR stands against them), proved by
    the program for a controller; arguments and errors as of `convert`."""
    from postproc.orientation.programs import oriented

    spec, machine, setup, options = _loaded(controller, machine, None, options)
    start = _begun(path, PostResult("", options, machine, spec, FilePath(controller).stem, setup,
                                    _reading(path, diagnostics)))
    return oriented(start, _stages, progress) if start.ok else start


def _reading(path: Toolpath, diagnostics: list[Diagnostic] | None) -> tuple[Diagnostic, ...]:
    """What reading found, with the faults that the path itself carries."""
    found = tuple(diagnostics or ())
    return (*found, *(d for d in path.faults if d not in found))


def _stages(result: PostResult, progress: Progress | None) -> PostResult:
    """`_staged`; with --smooth passes that cannot be smoothed are taken back."""
    if result.options.smooth:
        return with_passes_taken_back(result, lambda begun, left: _staged(begun, progress, left))
    return _staged(result, progress)


def _staged(result: PostResult, progress: Progress | None, left: Left = frozenset()) -> PostResult:
    """prepare -> solve, link, linearise -> travel -> compile -> write -> read back."""
    assert result.toolpath is not None
    options, toolpath, file = result.options, result.toolpath, result.toolpath.file
    job, found = prepare(toolpath, result.machine, result.controller, result.setup, options)
    result = _with(result, [*found, *_bad_meshes(result.setup, options.setup)], job=job)
    if job is None or not result.ok:
        return result
    toolpath = job.toolpath
    result = _with(result, [], toolpath=toolpath)
    shares, found = tolerance_shares(job)
    result = _with(result, found, shares=shares)
    if not result.ok:
        return result
    moves, found = written_moves(job, shares, left)
    result = _with(result, found, moves=moves)
    drawing, found = drawing_of(job.setup, job.placement, job.space, job.machine, options.setup or file)
    result = _with(result, found)
    if not result.ok:
        return result
    path, found = build_path(job.modes, job.kinematics, moves, job.space, job.home_rows(), job.operation,
                             shares["linearising"], shares["axis_linearising"] * DEG, file, progress, drawing)
    result = _with(result, with_system(found, job.work_system, job.placement), path=path)
    if path is None:
        return result
    if job.errors is not None and job.errors.corrected_by == "post":
        result, path = _compensated(result, job, moves, path)
        if path is None:
            return result
    found, extents = check_travel(path, job.moves, job.control, job.kinematics, file)
    found += check_reach(path, job.moves, job.control, file)
    found += check_singular(path, job.moves, job.control, job.setup.joints.singular_distance, file)
    result = _with(result, with_system(found, job.work_system, job.placement), extents=extents)
    if not result.ok:
        return result
    motion, found = plan_motion(job, moves, result.nominal or path, planned_correction(result))
    result = _with(result, found, motion=motion)
    if not result.ok:
        return result
    planned = None if motion is None else Planned(on_written(result, motion.needed), options.merge_feeds)
    program, feeds, found = compile_program(job, moves, path, planned,
                                            None if result.compensation is None else result.compensation.apart)
    found += unwritable(result.controller, program, toolpath.cycles, file, job.control.length_on_z)
    result = _with(result, found, program=program, feeds=feeds)
    if not result.ok:
        return result
    text, files = write_text(result)
    most = result.controller.format.line_length
    result = _with(result, [d for t in (text, *files.values()) for d in long_blocks(t, most, file)])
    if not result.ok:
        return result
    comparison, found = read_back(text, job, file, progress,
                                  others={name: t.encode() for name, t in files.items()})
    result = _with(result, found, comparison=comparison)
    if result.ok and comparison is not None:
        said, found = second_witness(result.source, result.asked or result.setup, options, job, comparison)
        result = _with(result, found, witness=said)
    if result.compensation is not None:
        from postproc.corrected.proof import beyond_bound

        result = _with(result, beyond_bound(result))
    return replace(result, text=text, files=files) if result.ok else result


def _bad_meshes(setup: SetupFile, file: str) -> list[Diagnostic]:
    """Errors in the meshes of a set-up, told before anything is planned."""
    if setup.bodies is None:
        return []
    from postproc.collision.bodies import mesh_errors

    return mesh_errors(setup, file)


def _with(result: PostResult, diagnostics: list[Diagnostic], **values: object) -> PostResult:
    return replace(result, diagnostics=(*result.diagnostics, *diagnostics), **values)  # type: ignore[arg-type]


def _compensated(result: PostResult, job: Job, moves: Moves, path: Path) -> tuple[PostResult, Path | None]:
    """The path on the machine with its geometric errors, where it is inside travel without; `nominal` keeps it as it was."""
    from postproc.compensation import compensate

    assert job.errors is not None
    options, file = job.options, job.toolpath.file
    far = check_travel(path, job.moves, job.control, job.kinematics, file)[0]
    far += check_reach(path, job.moves, job.control, file)
    if has_errors(far):
        return _with(result, with_system(far, job.work_system, job.placement), path=path), None
    corrected, report, found = compensate(path, moves, block_tools(path, moves), job.kinematics, job.errors, job.modes,
                                          options.tolerance, job.axis_tolerance, writing_of(job, moves),
                                          only_canned(job.toolpath, job.controller), options.error_beyond, file)
    return _with(result, found, path=corrected, nominal=path, compensation=report), corrected


def tolerance_shares(job: Job) -> tuple[dict[str, float], list[Diagnostic]]:
    """Where the tolerance goes (mm; axis_ in degrees): what the control's smoothing and rounding leave is linearising."""
    tolerance, axis = job.options.tolerance, job.options.axis_tolerance
    bound = job.rounding
    kinematics = job.controller.kinematics
    fixed = kinematics.smoothing_fixed
    smoothing = kinematics.smoothing_share * tolerance if fixed is None else fixed
    axis_smoothing = kinematics.axis_smoothing_share * axis
    shares = {"smoothing": smoothing, "axis_smoothing": axis_smoothing,
              "rounding": bound.tip, "axis_rounding": bound.axis / DEG,
              "linearising": MARGIN * (tolerance - smoothing - bound.tip),
              "axis_linearising": MARGIN * (axis - axis_smoothing - bound.axis / DEG)}
    if job.errors is not None and job.errors.corrected_by == "post":
        from postproc.compensation import SHARE

        shares |= {"geometric_errors": SHARE * tolerance, "axis_geometric_errors": SHARE * axis}
        for name in ("linearising", "axis_linearising"):
            shares[name] -= shares[name.replace("linearising", "geometric_errors")]
    if job.options.smooth:
        for name in ("linearising", "axis_linearising"):
            shares[name.replace("linearising", "points")] = POINTS * shares[name]
            shares[name] *= 1.0 - POINTS
    if smoothing >= tolerance:
        return shares, [error("tolerance.smoothing", f"the control's own smoothing takes {smoothing:g} mm, the tolerance is "
                              f"{tolerance:g} mm", hint="a wider --tolerance, or a smaller kinematics.smoothing_fixed in "
                              "the controller file")]
    return shares, rounding_problem(bound, tolerance - smoothing, job.axis_tolerance - axis_smoothing * DEG)


def plan_motion(job: Job, moves: Moves, path: Path,
                correction: PlannedCorrection | None = None) -> tuple[PlannedMotion | None, list[Diagnostic]]:
    """What the passes allow under the limits of the axes, with --feed planned."""
    if job.options.feed != "planned":
        return None, []
    return planned_motion(Source(path, moves, job.machine, job.kinematics,
                                 Tolerance(job.options.tolerance, job.axis_tolerance), stops_of(job.toolpath, moves),
                                 job.toolpath.file, correction))


def write_text(result: PostResult) -> tuple[str, dict[str, str]]:
    """The text of the program, header with what made it, and of its subprograms in files of their own by file name."""
    assert result.program is not None and result.toolpath is not None and result.job is not None
    job = result.job
    header = header_lines(result)
    shares = result.shares or {}
    writer = writer_for(result.controller, result.program, result.toolpath.cycles, job.control.length_on_z,
                        shares["smoothing"], result.setup.work_offset_code, axis_smoothing=shares["axis_smoothing"],
                        name=result.options.name or FilePath(result.toolpath.file).stem,
                        subprograms=result.setup.output.divided)
    text = writer.text(header)
    files = {name: "\n".join(blocks) + "\n" for name, blocks in writer.files.items()}
    return with_fingerprint(text, files), files


def long_blocks(text: str, most: int, file: str) -> list[Diagnostic]:
    """Blocks with more characters than the controller reads."""
    long, at, before = list[tuple[int, str]](), 0, 0
    while at < len(text):
        stop = text.find("\n", min(at + _STRETCH, len(text) - 1)) + 1 or len(text)
        lines = text[at:stop].splitlines()
        long += [(before + n, line) for n, line in enumerate(lines, 1) if len(line) > most]
        at, before = stop, before + len(lines)
    if not long:
        return []
    number, line = long[0]
    return [error("write.line_length", f"block {number} of the program has {len(line)} characters, the controller reads "
                  f"{most}: {line[:60]}", file=file, count=len(long), hint="format.line_length of the controller file")]


def points_in(toolpath: Toolpath) -> int:
    """Commanded positions, without FROM and GOHOME."""
    return int(np.isin(toolpath.role, (0, 1)).sum())


@dataclass(frozen=True)
class VerifyResult:
    """What reading a G-code file back showed."""

    gcode: str
    comparison: Comparison | None
    diagnostics: tuple[Diagnostic, ...]
    witness: Testimony | None = None

    @property
    def ok(self) -> bool:
        """True where the program does what the CL file says."""
        return self.comparison is not None and not has_errors(self.diagnostics)


def verify(gcode: str | FilePath, path: Toolpath, machine: Machine | str | FilePath,
           controller: str | FilePath = "linuxcnc", setup: SetupFile | str | FilePath | None = None,
           options: Options | None = None, diagnostics: list[Diagnostic] | None = None,
           progress: Progress | None = None) -> VerifyResult:
    """A G-code file against a Toolpath on a machine; the arguments that `convert` has too are as there.

    Raises:
        DiagnosticError: where machine, controller or set-up cannot be loaded, or the G-code file not be opened.
    """
    spec, machine, setup, options = _loaded(controller, machine, setup, options or Options())
    try:
        data = read_input(gcode, standard_input=True)
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "gcode.open", gcode, "name the program that is checked")]) from fault
    known = (*_reading(path, diagnostics), *unfinished(FilePath(gcode)))
    if other := other_axes(data, options, str(gcode)):
        return VerifyResult(str(gcode), None, (*other, *known))
    begun = PostResult("", options, machine, spec, FilePath(controller).stem, setup, known)
    start, _ = _oriented(_begun(path, begun), progress)
    path, found = start.toolpath or path, list(start.diagnostics)
    if has_errors(found):
        return VerifyResult(str(gcode), None, tuple(found))
    job, more = prepare(path, machine, spec, start.setup, options)
    found += more
    if job is None or has_errors(found):
        return VerifyResult(str(gcode), None, tuple(found))
    comparison, more = read_back(data, job, path.file, progress, str(gcode), Beside(gcode))
    found = [*other_setup(data, options, has_errors(more), str(gcode)), *found, *more]
    said = None
    if comparison is not None and not has_errors(found):
        said, more = second_witness(start.source, start.asked or start.setup, options, job, comparison)
        found += more
    return VerifyResult(str(gcode), comparison, tuple(found), said)
