"""A CL file on a machine under a control: converted, verified, or its tool axes chosen."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath
from types import UnionType
from typing import TYPE_CHECKING, get_args

from machines.loader import load as load_machine
from machines.machine import Machine
from postproc.base.given import faults_of, wrong
from postproc.base.header_words import read_header
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.controllers.model import ControllerFile, load_controller
from postproc.job.job import prepare, with_shop
from postproc.pipeline.feeds_by_clock import ProgramClock, with_compared_feeds
from postproc.pipeline.free_spin import with_spin_needed
from postproc.pipeline.hooks import refused_hooks
from postproc.pipeline.native_splines import as_arcs, asked_splines, held_near, never_cubics, with_cubics
from postproc.pipeline.next_modes import with_next_modes
from postproc.pipeline.result import PostResult, VerifyResult
from postproc.pipeline.smoothed_stages import ExcludedPasses, with_passes_taken_back
from postproc.pipeline.stages import staged
from postproc.pipeline.written_figures import Keep
from postproc.readback.comparison.compare import Comparison
from postproc.setup.fingerprint import fingerprint
from postproc.setup.model import SetupFile, alone, load_setup
from postproc.setup.places import one_part
from postproc.setup.system import standing
from postproc.verification.neighbour_files import NeighbourFiles, unfinished
from postproc.verification.read_back import other_axes, other_setup, read_back
from postproc.verification.second_witness import second_witness
from postproc.verification.stated_numbers import check_header, stated_smoothing
from toolpaths.choices import CubicPieces
from toolpaths.diagnostics import Diagnostic, DiagnosticError, has_errors, read_value
from toolpaths.input_files import read_input, unreadable
from toolpaths.toolpath import Toolpath

if TYPE_CHECKING:
    from postproc.verification.tool_table import MeasuredLength


def convert(path: Toolpath, machine: Machine | str | FilePath, controller: str | FilePath = "linuxcnc",
            setup: SetupFile | str | FilePath | None = None, options: Options | None = None,
            diagnostics: list[Diagnostic] | None = None, progress: Progress | None = None,
            clock: ProgramClock | None = None, keep: Keep = "all") -> PostResult:
    """A Toolpath as G-code for a machine and a controller, read back and compared with the path.

    Args:
        machine: one that is loaded, or a built-in name or path of a machine file
        controller: built-in name or path of a controller file
        setup: one that is loaded, or its path; default: the file that the options name, else the default set-up
        diagnostics: what reading the path found; an ERROR among them, or among the path's own faults, stops
            the conversion
        clock: the time of programs on the control, by which tool axes are chosen and planned feeds compared
            (`cycle_time.conversion.program_clock`); without it tool axes are chosen by the plan alone
        keep: "summary" lets go of path, program and feeds once the text is written, a fifth of the memory of a long
            file: `PostResult.figures` then say what a summary needs of them

    Raises:
        DiagnosticError: where path, options or keep are none, or machine, controller or set-up cannot be loaded.
    """
    require_call(path, options)
    if faults := faults_of({"keep": (keep, "all")}, {"keep": get_args(Keep)}):
        raise DiagnosticError(faults)
    spec, machine, setup, options = _loaded(controller, machine, setup, options or Options())
    found = _reading(path, diagnostics)
    kind: CubicPieces = "uniform" if machine.options.control_points else "pieces"
    asked = asked_splines(path, machine)
    if asked and (never := never_cubics(path, machine, spec, options)) is not None:
        found, asked = (*found, never), False
    native = with_cubics(path, options, kind) if asked else path
    if native is not path or options.orient != "keep" or options.optimise or options.feed != "programmed":
        keep = "all"  # more programs than one are made and compared
    made = _converted(replace(_begun(native, machine, controller, spec, setup, options, found), keep=keep), progress, clock)
    held = made.ok and made.program is not None and len(made.program.curves) > 0
    if held or native is path:
        return made
    other = _converted(_begun(path, machine, controller, spec, setup, options, found), progress, clock)
    return other.with_found([as_arcs(path, made.diagnostics)]) if other.ok and not made.ok else other


def _converted(start: PostResult, progress: Progress | None, clock: ProgramClock | None) -> PostResult:
    """All that follows on the beginning of a conversion."""
    start, done = _oriented(start, progress, clock)
    if not start.ok or done is not None:
        return done or start

    def stages(begun: PostResult) -> PostResult:
        return _stages(begun, progress)
    if clock is None or not start.options.optimise:
        return with_compared_feeds(start, stages, clock)
    from postproc.pipeline.optimised import optimised

    return optimised(start, stages, clock)


def _loaded(controller: str | FilePath, machine: Machine | str | FilePath, setup: SetupFile | str | FilePath | None,
            options: Options) -> tuple[ControllerFile, Machine, SetupFile, Options]:
    """Controller, machine and set-up from their files; the options with the name of the set-up's."""
    spec = read_value(load_controller(controller))
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    if not isinstance(setup, SetupFile):
        if setup is not None:
            options = replace(options, setup=str(setup))
        setup = read_value(load_setup(options.setup or None, options.hooks))
    setup = alone(setup)
    given = bool(options.setup) or setup != SetupFile()
    options = replace(options, setup_mark=fingerprint(setup, options.setup) if given else "")
    return with_shop(spec.divided(setup.output.files), machine, setup), machine, setup, options


def _begun(path: Toolpath, machine: Machine, controller: str | FilePath, spec: ControllerFile, setup: SetupFile,
           options: Options, diagnostics: tuple[Diagnostic, ...]) -> PostResult:
    """The beginning of a conversion with its path, the part standing by the file's absolute frame."""
    stood, found = standing(setup, path, options.setup)
    machine = machine.on_control() if spec.kinematics.modules else machine
    return PostResult("", options, machine, spec, FilePath(controller).stem, stood, (*diagnostics, *found), path,
                      source=path.source, asked=setup)


def _oriented(start: PostResult, progress: Progress | None,
              clock: ProgramClock | None) -> tuple[PostResult, PostResult | None]:
    """With the tool axes that --orient asks for, where the path can be read at all; its program where that is known."""
    if start.options.orient == "keep" or not start.ok:
        return start, None
    start = start.with_found(one_part(start.setup.places, "--orient", start.options.setup))
    if not start.ok:
        return start, None
    from postproc.orientation.report.figures_of_choice import slower
    from postproc.pipeline.oriented import oriented, written

    start, program = oriented(start, _stages, progress, clock)
    if start.choice is not None:
        start = start.with_found(slower(start.choice, start.options.orient))
    return start, written(start, program)


def choose_axes(path: Toolpath, machine: Machine, controller: str | FilePath, options: Options,
                diagnostics: list[Diagnostic], progress: Progress | None = None,
                clock: ProgramClock | None = None) -> PostResult:
    """The tool axes of a path as `options.orient` has them, in `choice` (None where an ERROR stands against
    them), proved by the program for a controller; arguments and errors as of `convert`."""
    from postproc.pipeline.oriented import oriented

    require_call(path, options)
    spec, machine, setup, options = _loaded(controller, machine, None, options)
    start = _begun(path, machine, controller, spec, setup, options, _reading(path, diagnostics))
    start = start.with_found(one_part(start.setup.places, "the choice of tool axes", options.setup))
    return oriented(start, _stages, progress, clock)[0] if start.ok else start


def require_call(path: object, options: object = None, others: type | UnionType = Toolpath) -> None:
    """Refuse what is no Toolpath nor of `others`, and options that are none.

    Raises:
        DiagnosticError: says what was found, and what to give.
    """
    found = []
    if not isinstance(path, (Toolpath, others)):
        read = "path, diagnostics = toolpaths.read(FILE)"
        first = isinstance(path, tuple) and bool(path) and isinstance(path[0], Toolpath)
        found.append(wrong(f"path is of type {type(path).__name__}", f"give its first value: {read}" if first else
                           f"give a Toolpath: {read}, or Toolpath.from_arrays"))
    if not (options is None or isinstance(options, Options)):
        found.append(wrong(f"options is of type {type(options).__name__}", "give postproc.Options(tolerance=0.02, ...)"))
    if found:
        raise DiagnosticError(found)


def _reading(path: Toolpath, diagnostics: list[Diagnostic] | None) -> tuple[Diagnostic, ...]:
    """What reading found, with the faults that the path itself carries."""
    found = tuple(diagnostics or ())
    return (*found, *(d for d in path.faults if d not in found))


def _stages(result: PostResult, progress: Progress | None) -> PostResult:
    """All stages; with --smooth passes that cannot be smoothed are taken back; a spin that is needed is planned; "auto"
    takes the next output mode where one cannot be written or proved."""
    def one(begun: PostResult, left: ExcludedPasses = frozenset()) -> PostResult:
        return with_spin_needed(begun, lambda spun: with_next_modes(spun, lambda again: staged(again, progress, left)))
    return with_passes_taken_back(result, one) if result.options.smooth else one(result)


def verify(gcode: str | FilePath, path: Toolpath, machine: Machine | str | FilePath,
           controller: str | FilePath = "linuxcnc", setup: SetupFile | str | FilePath | None = None,
           options: Options | None = None, diagnostics: list[Diagnostic] | None = None,
           progress: Progress | None = None, tool_table: str | FilePath = "",
           clock: ProgramClock | None = None) -> VerifyResult:
    """A G-code file against a Toolpath on a machine; the arguments that `convert` has too are as there.

    Args:
        tool_table: file of the control's tool table: the program is verified with these lengths of tools
        clock: by which tool axes were chosen, as of `convert`

    Raises:
        DiagnosticError: where machine, controller, set-up or tool table cannot be loaded, or the G-code file
            not be opened.
    """
    require_call(path, options)
    spec, machine, setup, options = _loaded(controller, machine, setup, options or Options())
    try:
        data = read_input(gcode, standard_input=True)
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "gcode.open", gcode, "name the program that is checked")]) from fault
    known = (*_reading(path, diagnostics), *unfinished(FilePath(gcode)))
    begun = VerifyResult(str(gcode), None, (), None, options, path.source, path.file,
                         hashlib.sha256(data).hexdigest())
    if other := other_axes(data, options, str(gcode)):
        return replace(begun, diagnostics=(*other, *known))
    path = with_cubics(path, options, held_near(data, NeighbourFiles(gcode), spec))
    start, _ = _oriented(_begun(path, machine, controller, spec, setup, options, known), progress, clock)
    path, found = start.toolpath, list(start.diagnostics)
    if has_errors(found):
        return replace(begun, diagnostics=tuple(found))
    options = replace(options, smoothing=options.smoothing or read_header(data).smoothing)
    job, more = prepare(path, machine, spec, start.setup, options)
    found += [*more, *(refused_hooks(job) if job is not None else [])]
    if job is None or has_errors(found):
        return replace(begun, diagnostics=tuple(found))
    asked, at_gauge = start.asked or start.setup, job.setup
    if tool_table:
        from postproc.verification.tool_table import lengths_at_machine, outside, with_measured

        measured, more = lengths_at_machine(tool_table, job)
        begun, found, asked = replace(begun, measured=tuple(measured)), [*found, *more], with_measured(asked, measured)
        if has_errors(more):
            return replace(begun, diagnostics=tuple(found))
        job = replace(job, setup=with_measured(job.setup, measured))
    comparison, more = read_back(data, job, path.file, progress, str(gcode), NeighbourFiles(gcode),
                                 margins=bool(begun.measured))
    if begun.measured:
        failed = has_errors(more)
        begun = replace(begun, measured=_with_allowed(begun.measured, comparison, failed, lambda: read_back(
            data, replace(job, setup=at_gauge), path.file, progress, str(gcode), NeighbourFiles(gcode), margins=True)))
        more = [*(outside(begun.measured, str(tool_table)) if failed else []), *more]
    found = [*other_setup(data, options, has_errors(more), str(gcode)), *found, *more,
             *check_header(data, replace(job, setup=at_gauge), str(gcode)),
             *([] if comparison is None else stated_smoothing(comparison, job, str(gcode)))]
    said = None
    if comparison is not None and not has_errors(found):
        said, more = second_witness(start.source, asked, options, job, comparison, data)
        found += more
    return replace(begun, comparison=comparison, diagnostics=tuple(found), witness=said)


def _with_allowed(measured: tuple[MeasuredLength, ...], comparison: Comparison | None, failed: bool,
                  with_gauge_lengths: Callable[[], tuple[Comparison | None, list[Diagnostic]]],
                  ) -> tuple[MeasuredLength, ...]:
    """Lengths at the machine with what the program takes: from what is proved with them, else with gauge lengths."""
    from postproc.verification.tool_table import with_allowed

    if comparison is not None and not failed:
        return tuple(with_allowed(list(measured), comparison.lengths, False))
    other, found = with_gauge_lengths()
    margins = other.lengths if other is not None and not has_errors(found) else ()
    return tuple(with_allowed(list(measured), margins, True))
