"""The command `postproc time`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.console import Json, machine_of, own_files, progress_bar, refuse_overwriting, report, shown_errors
from postproc.cli.options import (
    AxisToleranceOption,
    Beyond,
    ControllerName,
    DialectOption,
    HooksFile,
    MachineName,
    MaxBlocks,
    ToleranceOption,
    UnitsOption,
    only_with_errors,
)

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.base.options import Options
    from postproc.base.progress import Progress
    from postproc.cycle_time.blocks import MotionBlocks
    from postproc.cycle_time.model import CycleTimeModel
    from postproc.cycle_time.phases import BlockTimes
    from toolpaths.diagnostics import Diagnostic


UNKNOWN: dict[str, Any] = {"cycle_time_s": None, "lower_bound_s": None, "band_s": None, "feed_s": None,
                           "feed_override_percent": None, "operations": [], "limiting": {}}
"""what is reported of a file that is refused"""


def time(file: Annotated[Path, typer.Argument(metavar="FILE", help="CL file, or G-code file of the controller")],
         machine: MachineName,
         controller: ControllerName = "linuxcnc",
         model: Annotated[str, typer.Option("--model", metavar="{ideal,lookahead,control,linuxcnc,FILE}",
                                            help="model of the control, or a TOML file; default: the controller's")] = "",
         calibrate: Annotated[str, typer.Option("--calibrate", metavar="LOG.csv", help="fit the model to a measured run of "
                                                "FILE: columns nc_line, time_s")] = "",
         output: Annotated[str, typer.Option("-o", "--output", metavar="MODEL.toml", help="file for the fitted model")] = "",
         override: Annotated[float, typer.Option("--override", metavar="PERCENT", min=1.0, max=300.0, help="feed override: "
                                                 "feeds at PERCENT of what is programmed, rapids and taps as they are; "
                                                 "with --calibrate, at which the run was measured")] = 100.0,
         setup: Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools")] = "",
         hooks: HooksFile = "",
         tolerance: ToleranceOption = 0.01,
         axis_tolerance: AxisToleranceOption = 0.05,
         units: UnitsOption = "",
         dialect: DialectOption = "",
         error_model: Annotated[str, typer.Option("--error-model", metavar="E.toml", help="time a CL file with these "
                                                  "geometric errors of the machine corrected")] = "",
         beyond: Beyond = False,
         max_blocks: MaxBlocks = None,
         json: Json = "") -> None:
    """Estimate how long a program takes, with a band, and where the time goes."""
    _check(output, calibrate)
    only_with_errors(beyond, error_model)
    refuse_overwriting({"-o": output, "--json": json}, {"the file": str(file), "the set-up": setup, "the hooks": hooks,
                                                        "the log": calibrate,
                                                        "the error model": error_model, **own_files(machine, controller),
                                                        "the model": model if Path(model).suffix else ""})
    from postproc.base.options import Options
    from postproc.cycle_time import report as figures
    from postproc.cycle_time.estimate import estimate, measure_first

    options = Options(tolerance, axis_tolerance, "auto", setup, units, dialect, error_model=error_model, hooks=hooks,
                      error_beyond=beyond)
    share = override / 100.0
    values: dict[str, Any] = {}
    text = ""
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json), progress_bar() as progress:
        m = machine_of(machine)
        blocks, planner, times, found = _blocks(file, m, controller, model, options, share, progress)
        if blocks is not None and calibrate:
            fitted, values, more = _calibrated(blocks, m, planner, calibrate)
            found, times = [*found, *more], None
            blocks, planner = (None, planner) if fitted is None else (blocks, fitted)
            if output and fitted is not None:
                from postproc.cycle_time.calibrate import as_toml

                outputs[Path(output)] = as_toml(fitted)
        if blocks is not None:
            e = estimate(blocks, m, planner, times=times)
            first = measure_first(e, m)
            values = figures.as_dict(e, first) | {"feed_override_percent": override} | values
            text = figures.as_text(e, file.name, share, first)
    report(tuple(found), json, UNKNOWN | values | {"diagnostics": [d.as_dict() for d in found]},
           text, outputs)


def _check(output: str, calibrate: str) -> None:
    if output and not calibrate:
        raise typer.BadParameter("it writes the model that --calibrate fits: give --calibrate too",
                                 param_hint="-o")


def _blocks(file: Path, machine: Machine, controller: str, model: str, options: Options, override: float,
            progress: Progress) -> tuple[MotionBlocks | None, CycleTimeModel, BlockTimes | None, list[Diagnostic]]:
    """The blocks of a CL file (converted first) or of a program, the model of the control, and times that are planned."""
    from postproc.controllers.model import load_controller
    from postproc.cycle_time.model import load_model, model_name
    from postproc.cycle_time.source import from_conversion, from_gcode, read_file
    from postproc.setup.model import load_setup
    from postproc.verification.neighbour_files import NeighbourFiles
    from toolpaths.cl.text.kinds_of_file import looks_like_gcode
    from toolpaths.diagnostics import read_value

    spec = read_value(load_controller(controller))
    planner = read_value(load_model(model or model_name(controller, spec.writer))).of_machine(machine)
    data = read_file(file)
    if not options.dialect and looks_like_gcode(data):
        setup = read_value(load_setup(options.setup or None, options.hooks))
        blocks, found = from_gcode(data, machine, spec, setup, str(file), NeighbourFiles(file), override)
        return blocks, planner, None, found
    import toolpaths
    from postproc.pipeline.convert import convert

    path, found = toolpaths.read_bytes(data, file=str(file), units=options.units or None,
                                       dialect=options.dialect or None, tolerance=options.tolerance)
    del data
    result = convert(path, machine, controller, options=options, diagnostics=found, progress=progress)
    if not result.ok:
        return None, planner, None, list(result.diagnostics)
    blocks, times, found = from_conversion(result, override), None, []
    if planner.kind == "ideal":
        from postproc.cycle_time.planned import planned_times

        times, found = planned_times(result, blocks, planner, override)
    return blocks, planner, times, [*result.diagnostics, *found]


def _calibrated(blocks: MotionBlocks, machine: Machine, planner: CycleTimeModel,
                log: str) -> tuple[CycleTimeModel | None, dict[str, Any], list[Diagnostic]]:
    """The model fitted to a log (None where it cannot be), and its figures."""
    from postproc.cycle_time.calibrate import as_dict, calibrate
    from postproc.cycle_time.log import read_log

    read, found = read_log(log, machine.axis_names)
    if read is None:
        return None, {}, found
    fit, found = calibrate(blocks, read, planner.quick(), log, machine)
    if fit is None:
        return None, {}, found
    return fit.model, {"calibration": as_dict(fit)}, found
