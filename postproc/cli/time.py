"""The command `postproc time`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from math import isnan
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from postproc.cli.shared.console import Json, own_files, progress_bar, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    Beyond,
    ControllerName,
    DialectOption,
    HooksFile,
    MachineName,
    MaxBlocks,
    ToleranceOption,
    UnitsOption,
    figure_ending,
    only_with_errors,
)

UNKNOWN: dict[str, Any] = {"cycle_time_s": None, "lower_bound_s": None, "band_s": None, "feed_s": None,
                           "feed_override_percent": None, "operations": [], "limiting": {}}
"""what is reported of a file that is refused"""


TimedFiles = Annotated[list[Path] | None, typer.Argument(
    metavar="FILE...", help="CL file, or G-code file of the controller; several stand side by side; with --plan-calibration "
    "none asks for a test of every kind of move")]
Logs = Annotated[list[str] | None, typer.Option(
    "--calibrate", metavar="LOG.csv", help="fit the model to a measured run of FILE: columns nc_line, time_s, or an export "
    "of MTConnect or OPC UA; or the time of the whole run alone, 812.4 or 0:13:32; once for each FILE")]
Changes = Annotated[list[str] | None, typer.Option(
    "--what-if", metavar="VALUE=FACTOR", help="side by side: the time with X.acceleration=1.3, tool_change=0.5, ...; "
    "together with commas")]
OtherMachines = Annotated[list[str] | None, typer.Option(
    "--with-machine", metavar="MACHINE", help="side by side: on this machine too")]
Setups = Annotated[list[str] | None, typer.Option(
    "--with-setup", metavar="S.toml", help="side by side: with this set-up too")]
Drawing = Annotated[Path | None, typer.Option(
    "--figure", metavar="FILE", help="drawing of speed and programmed feed along the path, of what limits: .png or .svg")]
HeldAgainst = Annotated[Literal["toppra"] | None, typer.Option(
    "--check", metavar="{toppra}", help="hold the planned passes of a CL file against toppra's least time under "
    "velocity and acceleration")]
Tables = Annotated[str, typer.Option("--csv", metavar="TABLES.csv", help="the tables by tool, operation and cause")]
TestProgram = Annotated[Path | None, typer.Option(
    "--plan-calibration", metavar="TEST.nc", help="write the test program, in air, whose measured run would narrow the band "
    "of FILE most, and its set-up TEST.setup.toml; run and log it, then --calibrate")]
TestSeconds = Annotated[float, typer.Option("--plan-seconds", metavar="S", min=5.0, max=3600.0,
                                            help="s that the test program may take")]


def time(machine: MachineName,
         files: TimedFiles = None,
         controller: ControllerName = "linuxcnc",
         model: Annotated[str, typer.Option("--model", metavar="{ideal,lookahead,control,linuxcnc,FILE}",
                                            help="model of the control, or a TOML file; default: the controller's")] = "",
         calibrate: Logs = None,
         output: Annotated[str, typer.Option("-o", "--output", metavar="MODEL.toml", help="file for the fitted model")] = "",
         override: Annotated[float, typer.Option("--override", metavar="PERCENT", min=1.0, max=300.0, help="feed override: "
                                                 "feeds at PERCENT of what is programmed, rapids and taps as they are; "
                                                 "with --calibrate, at which the run was measured")] = 100.0,
         what_if: Changes = None,
         with_machine: OtherMachines = None,
         setup: Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools")] = "",
         with_setup: Setups = None,
         figure: Drawing = None,
         csv: Tables = "",
         hooks: HooksFile = "",
         tolerance: ToleranceOption = 0.01,
         axis_tolerance: AxisToleranceOption = 0.05,
         units: UnitsOption = "",
         dialect: DialectOption = "",
         allow_unknown: Allow = None,
         error_model: Annotated[str, typer.Option("--error-model", metavar="E.toml", help="time a CL file with these "
                                                  "geometric errors of the machine corrected")] = "",
         beyond: Beyond = False,
         max_blocks: MaxBlocks = None,
         check: HeldAgainst = None,
         plan_calibration: TestProgram = None,
         plan_seconds: TestSeconds = 60.0,
         json: Json = "") -> None:
    """Estimate how long programs take, with a band, and where the time goes; several side by side."""
    files, logs, test, ending = files or [], calibrate or [], plan_calibration, figure_ending(figure)
    if not files and test is None:
        raise typer.BadParameter("name the program or CL file to be timed", param_hint="FILE")
    _check_factors(what_if or [])
    _check_against(check)
    _check(output, logs, len(files))
    _check_plan(test, len(files) * (1 + len(with_machine or []) + len(with_setup or []) + len(what_if or [])), bool(logs))
    only_with_errors(beyond, error_model)
    given = {f"the file {k}" if k else "the file": str(file) for k, file in enumerate(files)}
    refuse_overwriting({"-o": output, "--json": json, "--csv": csv, "--figure": str(figure or ""),
                        "--plan-calibration": str(test or ""),
                        "the test's set-up": str(test.with_suffix(".setup.toml")) if test else ""},
                       {**given, "the set-up": setup, "the hooks": hooks,
                        **{f"the log {log}": log for log in logs}, **{f"the set-up {one}": one for one in with_setup or []},
                        "the error model": error_model, **own_files(machine, controller),
                        "the model": model if Path(model).suffix else ""})
    from postproc.base.options import Options
    from postproc.cli.time_variants import Asked, answer, test_of_the_control

    unknown = tuple(w.upper() for w in allow_unknown or ())
    options = Options(tolerance, axis_tolerance, "auto", setup, units, dialect, unknown, error_model=error_model,
                      hooks=hooks, error_beyond=beyond)
    asked = Asked(tuple(files), (machine, *(with_machine or [])), controller, model, (setup, *(with_setup or [])),
                  tuple(what_if or ()), tuple(logs), output, override, options, csv, figure, check is not None, ending,
                  test, plan_seconds)
    with shown_errors(json), progress_bar() as progress:
        values, text, outputs, found = test_of_the_control(asked, test) if test and not files else answer(asked, progress)
    report(tuple(found), json, UNKNOWN | values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def _check_against(planner: str | None) -> None:
    """A package that is not there is said before anything is computed."""
    if planner:
        from toolpaths.extras import need

        need(planner, f"--check {planner} needs")


def _check(output: str, logs: list[str], files: int) -> None:
    if output and not logs:
        raise typer.BadParameter("it writes the model that --calibrate fits: give --calibrate too",
                                 param_hint="-o")
    if logs and len(logs) != files:
        raise typer.BadParameter(f"{len(logs)} given for {files} files: one for each FILE, in their order",
                                 param_hint="--calibrate")


def _check_plan(test: Path | None, variants: int, logs: bool) -> None:
    if test is not None and (variants > 1 or logs):
        raise typer.BadParameter("a test is planned for one file on one machine, before it is measured",
                                 param_hint="--plan-calibration")


def _check_factors(what_if: list[str]) -> None:
    """Wrong use where no factor stands behind a name; whether the machine has it is seen later."""
    from postproc.time_study.what_if import FACTOR, factor_of

    wrong = next((part.strip() for text in what_if for part in text.split(",") if isnan(factor_of(part)[1])), None)
    if wrong is not None:
        raise typer.BadParameter(f"{wrong!r}: {FACTOR}", param_hint="--what-if")
