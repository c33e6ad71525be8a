"""The command line. Heavy packages are imported inside the commands, so that --help is instant."""

from __future__ import annotations

import io
import sys
import threading
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from postproc.base.options import FeedModeChoice, FeedSource, OutputMode
from postproc.cli.batch import EXAMPLE as BATCHES
from postproc.cli.batch import batch
from postproc.cli.calibrate import calibrate
from postproc.cli.compare import EXAMPLE as DIFFERENCES
from postproc.cli.compare import compare
from postproc.cli.errors import errors_app
from postproc.cli.machines_controllers import SCHEMAS, controller_app, machine_app, schema, setup_app
from postproc.cli.orient import EXAMPLES
from postproc.cli.orient import orient as orient_command
from postproc.cli.place import EXAMPLES as PLACES
from postproc.cli.place import place
from postproc.cli.report import EXAMPLE as REPORTS
from postproc.cli.report import check_page, pages, report_command
from postproc.cli.shared.console import (
    Json,
    controller_of,
    machine_of,
    no_cl_file,
    no_program,
    own_files,
    progress_bar,
    read_cl,
    refuse_inputs,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.group import Group, only_called
from postproc.cli.shared.guard import guarded
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    Beyond,
    ClFile,
    ControllerName,
    DialectOption,
    HooksFile,
    MachineName,
    MaxBlocks,
    MaxTilt,
    ModelOfControl,
    Orient,
    ProofOf,
    ProofOption,
    RequireProof,
    ToleranceOption,
    UnitsOption,
    ending_of,
    only_with_errors,
    word_option,
)
from postproc.cli.shared.says import SAYS
from postproc.cli.time import time
from toolpaths.choices import FieldEnding, GivenDialect, GivenUnit

if TYPE_CHECKING:
    from postproc.base.options import Options
    from postproc.batch.run import Ran
    from postproc.pipeline.result import PostResult
    from toolpaths.diagnostics import Diagnostic
    from toolpaths.toolpath import Toolpath

app = typer.Typer(name="postproc", cls=Group, no_args_is_help=True, rich_markup_mode=None,
                  context_settings={"help_option_names": ["-h", "--help"]},
                  help="CL file in, proved G-code out: a toolpath post-processor that plans the machine's motion.")
app.add_typer(machine_app, name="machine")
app.add_typer(setup_app, name="setup")
app.add_typer(controller_app, name="controller")
app.add_typer(errors_app, name="errors")
app.command(short_help="Identify a machine's errors from measurements, each with its uncertainty.",
            epilog="Example: postproc calibrate reversal.toml -o errors.toml")(calibrate)
app.command(epilog="Example: postproc time part.cls -m mikron-ucp710 -c linuxcnc")(time)
app.command("orient", epilog=EXAMPLES)(orient_command)
app.command(epilog=PLACES)(place)
app.command("report", epilog=REPORTS)(report_command)
app.command(epilog=BATCHES)(batch)
app.command(epilog=SCHEMAS)(schema)
app.command(epilog=DIFFERENCES)(compare)

Setup = Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools, safe distances")]
Errors = Annotated[str, typer.Option("--error-model", metavar="E.toml", help="file of the machine's geometric errors: "
                                     "corrected, and proved on the machine with them")]
ToolTableOption = Annotated[str, typer.Option("--tool-table", metavar="FILE", help="the control's tool table: verify with "
                                              "the lengths of tools at the machine")]
ErrorsOfProgram = Annotated[str, typer.Option("--error-model", metavar="E.toml", help="file of the machine's geometric "
                                              "errors that the program corrects")]
FeedModeOption = Annotated[FeedModeChoice, word_option("--feed-mode", FeedModeChoice, "F in mm/min (G94), or one over the "
                                                       "time of the block (G93)")]
FeedOption = Annotated[FeedSource, word_option("--feed", FeedSource, "programmed: the feeds of the CL file; planned: lower "
                                               "where an axis or a tool would exceed its limits")]
MergeFeeds = Annotated[float, typer.Option("--merge-feeds", metavar="PERCENT", min=0.0, max=50.0, help="merge neighbouring "
                                           "F words that differ by up to PERCENT")]
Optimise = Annotated[bool, typer.Option("--optimise", help="choose output modes, shares of the tolerance and feed mode for "
                                        "the least time on the control; what is gained by what is printed")]
SmoothOption = Annotated[bool, typer.Option("--smooth", help="move points onto smooth curves inside the tolerance")]
ResidualFiles = Annotated[list[Path] | None, typer.Option("--residuals", metavar="FILE", help="errors at each CL point "
                                                          "before and after correction: .csv, or drawn: .png, .svg; may "
                                                          "be repeated")]
CheckProgram = Annotated[Path | None, typer.Option("--check-program", metavar="FILE", help="write a program too that checks "
                                                   "the pivots at the machine: five poses of a ball or probe, with the "
                                                   "readings expected")]
PageFile = Annotated[Path | None, typer.Option("--report", metavar="R.html", help="write the report of the conversion too, "
                                              "a page that opens offline; also where the conversion has errors")]
OutputModeOption = Annotated[OutputMode, word_option("--output-mode", OutputMode, (
    "axes: machine coordinates, no RTCP; tcp: tool-centre-point control (G43.4, TRAORI, TCPM, G234); tilted: tilted work "
    "plane, 3+2 (G68.2, CYCLE800, PLANE SPATIAL, G254)"))]


def _version(wanted: bool) -> None:
    if wanted:
        from postproc.base.version import VERSION

        typer.echo(f"postproc {VERSION}")
        raise typer.Exit


@app.callback()
def options_of_all(context: typer.Context, version: Annotated[bool, typer.Option(
        "--version", is_eager=True, callback=_version, help="show the version")] = False) -> None:
    """Options before the command."""
    context.obj = run_command  # for commands that call others


@app.command(epilog="Example: postproc convert part.cls -m mikron-ucp710 -c linuxcnc -o part.ngc")
def convert(file: ClFile, machine: MachineName, controller: ControllerName,
            output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="G-code file to write")],
            feed_mode: FeedModeOption = "auto", output_mode: OutputModeOption = "auto",
            orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
            optimise: Optimise = False, feed: FeedOption = "programmed", merge_feeds: MergeFeeds = 0.0,
            smooth: SmoothOption = False,
            setup: Setup = "", hooks: HooksFile = "", tolerance: ToleranceOption = 0.01,
            axis_tolerance: AxisToleranceOption = 0.05,
            units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None,
            error_model: Errors = "", beyond: Beyond = False, residuals: ResidualFiles = None,
            check_program: CheckProgram = None, page: PageFile = None,
            require_proof: RequireProof = False, proof: ProofOption = False, model: ModelOfControl = "",
            json: Json = "") -> None:
    """Convert a CL file to G-code, read it back and prove it; nothing is written where a proof fails."""
    options = replace(_options(tolerance, axis_tolerance, feed_mode, setup, units, dialect, allow_unknown),
                      output=output_mode, feed=feed, merge_feeds=merge_feeds / 100.0, smooth=smooth, error_model=error_model,
                      hooks=hooks, error_beyond=beyond, orient=orient, max_tilt=max_tilt, name=output.stem,
                      optimise=optimise, require_proof=require_proof)
    only_with_errors(beyond, error_model)
    fields = _residual_files(residuals or [], error_model)
    if page is not None:
        check_page(page, "--report")
    refuse_overwriting({"-o": str(output), "--json": json, "--proof": f"{output}.proof.json" if proof else "",
                        "--check-program": str(check_program or ""), "--report": str(page or ""),
                        **{f"--residuals {name}": str(name) for name in fields}},
                       inputs := {"the CL file": str(file), "the set-up": setup, "the hooks": hooks,
                                  "the error model": error_model, **own_files(machine, controller)})
    from postproc.proof import command

    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json), progress_bar() as progress:
        known = command.hashed(machine, controller, options) if proof or page else None
        m, spec = machine_of(machine), controller_of(controller)
        from postproc.cycle_time.conversion import estimate_of, program_clock  # a misspelt name is said before all this
        from postproc.pipeline.convert import convert as run
        from postproc.report import summary
        from postproc.writing.program_files import program_files

        path, found = read_cl(file, options, progress, options.tolerance)
        result = run(path, m, spec, options=options, diagnostics=found, progress=progress,
                     clock=program_clock(model), keep="all" if page or fields or check_program else "summary")
        noted, why = _fields(result, fields) if fields else ([], [])
        result = replace(result, diagnostics=(*result.diagnostics, *why))
        # all before a file is written; under --quiet nobody asks for times, nor for figures without --json
        time = estimate_of(result, model, executed=bool(page)) if page or json or model or not SAYS.quiet else None
        values = summary.as_dict(result, str(output), time if json else None) if json or not SAYS.quiet else {}
        text = "" if SAYS.quiet else summary.as_text(result, str(output), time, values)
        more = [] if result.ok else _offers(result, path, machine, controller)
        shown, of_tabs = pages(page, path, result, known, output.name, time)
        outputs |= shown
        if result.ok:
            texts, more = program_files(output, result.text, result.files or {})
            refuse_inputs(list(texts)[:-1], inputs)
            kept, unlike = command.kept(result, machine, controller, proof, known, output)
            more += unlike
            check = _checked(result, spec, check_program)
            outputs = {**outputs, **dict(zip(fields, noted, strict=True)), **kept, **check, **texts}
    found = [*result.diagnostics, *more, *of_tabs]
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def _offers(result: PostResult, path: Toolpath, machine: str, controller: str) -> list[Diagnostic]:
    """What is offered where a conversion is refused: what searches for it is imported there alone."""
    from postproc.setup_sheet.offers import offers

    return offers(result, path, machine, controller)


def _checked(result: PostResult, controller: str, file: Path | None) -> dict[Path, str]:
    """The program that checks the pivots, where it is asked for."""
    if file is None:
        return {}
    from postproc.pipeline.check_program import checked_file

    return checked_file(result, controller, file)


@app.command(epilog="Example: postproc verify part.ngc part.cls -m mikron-ucp710 -c linuxcnc")
def verify(gcode: Annotated[Path, typer.Argument(metavar="GCODE", help="G-code file")], file: ClFile,
           machine: MachineName, controller: ControllerName, setup: Setup = "", hooks: HooksFile = "",
           tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
           units: UnitsOption = "", dialect: DialectOption = "",
           allow_unknown: Allow = None,
           error_model: ErrorsOfProgram = "", beyond: Beyond = False, orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
           require_proof: RequireProof = False, proof: ProofOf = "", tool_table: ToolTableOption = "",
           max_blocks: MaxBlocks = None, model: ModelOfControl = "",
           json: Json = "") -> None:
    """Read a G-code file back and compare its motion with a CL file."""
    options = replace(_options(tolerance, axis_tolerance, "auto", setup, units, dialect, allow_unknown),
                      error_model=error_model, hooks=hooks, error_beyond=beyond, orient=orient, max_tilt=max_tilt,
                      require_proof=require_proof)
    only_with_errors(beyond, error_model)
    refuse_overwriting({"--json": json}, {"the CL file": str(file), "the G-code file": str(gcode), "the set-up": setup,
                                         "the hooks": hooks, "the error model": error_model, "the tool table": tool_table,
                                         "the proof file": proof or f"{gcode}.proof.json",
                                         **own_files(machine, controller)})
    from postproc.base.header_words import HEADER, read_header
    from postproc.cycle_time.conversion import program_clock
    from postproc.pipeline.convert import verify as run
    from postproc.proof import command
    from postproc.report import summary
    from toolpaths.input_files import first_bytes

    with shown_errors(json), progress_bar() as progress:
        m, spec = machine_of(machine), controller_of(controller)
        stated = read_header(first_bytes(gcode, HEADER)).tolerance
        no_cl_file(gcode)
        path, found = read_cl(file, options, progress, stated or tolerance)
        result = run(gcode, path, m, spec, options=options, diagnostics=found, progress=progress,
                     tool_table=tool_table, clock=program_clock(model))
        kept, more = command.compared_with(result, machine, controller, proof)
    text = summary.verify_text(result) + (f"\n{kept.line()}" if kept else "")
    found = [*result.diagnostics, *more]
    report(tuple(found), json, summary.verify_dict(result) | {"proof": kept.as_dict() if kept else None,
                                                              "diagnostics": [d.as_dict() for d in found]}, text)


@app.command(epilog="Example: postproc trace part.cls --line 120 -m mikron-ucp710 -c linuxcnc")
def trace(file: ClFile, line: Annotated[int, typer.Option("--line", metavar="L", min=1, help="line of the CL file")],
          machine: MachineName, controller: ControllerName, setup: Setup = "", hooks: HooksFile = "",
          tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
          units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None,
          error_model: Errors = "", beyond: Beyond = False, orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
          model: ModelOfControl = "", json: Json = "") -> None:
    """Show one point of a CL file through every stage, from its record to its blocks and back."""
    only_with_errors(beyond, error_model)
    options = replace(_options(tolerance, axis_tolerance, "auto", setup, units, dialect, allow_unknown),
                      error_model=error_model, hooks=hooks, error_beyond=beyond, orient=orient,
                      max_tilt=max_tilt)
    refuse_overwriting({"--json": json}, {"the CL file": str(file), "the set-up": setup, "the hooks": hooks,
                                         "the error model": error_model, **own_files(machine, controller)})
    from postproc.cycle_time.conversion import program_clock
    from postproc.pipeline.convert import convert as run
    from postproc.report.trace import as_text, trace_line

    with shown_errors(json), progress_bar() as progress:
        m, spec = machine_of(machine), controller_of(controller)
        path, found = read_cl(file, options, progress, options.tolerance)
        result = run(path, m, spec, options=options, diagnostics=found, progress=progress, clock=program_clock(model))
        stages, more = trace_line(result, line)
    report((*result.diagnostics, *more), json, stages, as_text(stages))


@app.command(epilog="Example: postproc explain travel.exceeded")
def explain(code: Annotated[str, typer.Argument(metavar="CODE", help="as in the brackets of a message")] = "",
            json: Json = "") -> None:
    """Explain a code of a message: what it is about, what to do, an example; without one list all codes."""
    from dataclasses import asdict

    from postproc.explain.pages import pages, unknown
    from toolpaths.diagnostics import DiagnosticError, error

    known = pages()
    with shown_errors(json):
        if code and code.strip("[]") not in known:
            raise DiagnosticError([error("file.no-code", f"there is no code {code!r}", hint=unknown(code.strip("[]")))])
    if not code:
        report((), json, {"codes": list(known)}, "\n".join(known))
        return
    page = known[code.strip("[]")]
    report((), json, asdict(page), page.text())


@app.command(epilog="Example: postproc inspect part.cls --json -")
def inspect(file: ClFile, units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None,
            json: Json = "") -> None:
    """Show what a CL file holds: operations, tools, points, extents, unknown words."""
    options = _options(0.01, 0.05, "auto", "", units, dialect, allow_unknown)
    refuse_overwriting({"--json": json}, {"the CL file": str(file)})
    from toolpaths.cl.inspect import inspect as figures
    from toolpaths.cl.inspect import summary as text_of
    from toolpaths.cl.read import read_file

    with shown_errors(json), progress_bar() as progress:
        no_program(file, dialect)
        result = read_file(file, units=options.units or None, dialect=options.dialect or None,
                           allow_unknown=options.allow_unknown, progress=lambda at, total: progress("reading", at, total))
    found = figures(result)
    report(tuple(result.diagnostics), json, found, text_of(result) if result.lines else "")


_CALLED = threading.Lock()
"""held by the command that runs: streams, words and how much is said are the process's, and a worker may have threads"""


def run_command(arguments: Sequence[str]) -> Ran:
    """A command line called within a process that goes on, under the guard: what a worker of a batch does, one at a time."""
    from postproc.batch.run import Ran

    said = io.StringIO()
    with _CALLED:
        own, sys.argv = sys.argv, ["postproc", *arguments]
        try:
            with redirect_stderr(said), redirect_stdout(io.StringIO()):
                code = guarded(lambda: only_called(app, arguments)(list(arguments), prog_name="postproc"))
        finally:
            sys.argv = own
    return Ran(code, tuple(line for line in said.getvalue().splitlines() if line.strip()))


def main() -> None:
    """The command line under its guard, for callers that have imported it already."""
    raise SystemExit(guarded(app))


def _residual_files(files: list[Path], error_model: str) -> list[Path]:
    """The files of --residuals; wrong use without an error model, or where one is neither table nor drawing."""
    if not files:
        return []
    if not error_model:
        raise typer.BadParameter("residuals need --error-model", param_hint="--residuals")
    for name in files:
        _field_ending(name)
    return files


def _field_ending(file: Path) -> FieldEnding:
    ending: FieldEnding = ending_of(file, FieldEnding, "--residuals",
                                    "ends neither in .csv nor in .png or .svg")
    return ending


def _fields(result: PostResult, files: list[Path]) -> tuple[list[str | bytes], list[Diagnostic]]:
    from postproc.report.residual_files import contents

    return contents(result, [_field_ending(name) for name in files])


def _options(tolerance: float, axis_tolerance: float, feed_mode: FeedModeChoice, setup: str, units: GivenUnit,
             dialect: GivenDialect, allow_unknown: list[str] | None) -> Options:
    from postproc.base.options import Options

    for option, value in (("--tolerance", tolerance), ("--axis-tolerance", axis_tolerance)):
        if not 1e-6 <= value <= 10.0:
            raise typer.BadParameter(f"{value} is not between 1e-6 and 10", param_hint=option)
    return Options(tolerance, axis_tolerance, feed_mode, setup, units, dialect,
                   tuple(w.upper() for w in allow_unknown or ()))



if __name__ == "__main__":
    main()
