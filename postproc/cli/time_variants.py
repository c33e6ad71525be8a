"""What `postproc time` answers: one estimate in full, or several side by side."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.cli.shared.console import machine_of
from postproc.cycle_time import report as figures
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate, measure_first, timed, total
from postproc.cycle_time.model import CycleTimeModel, load_model, model_name
from postproc.cycle_time.phases import BlockTimes
from postproc.cycle_time.shares import shares
from postproc.cycle_time.source import from_conversion, from_gcode, read_file
from postproc.time_fit.calibrate import CalibratedModel, calibrate
from postproc.time_fit.fit_text import as_dict as fit_figures
from postproc.time_fit.fit_text import as_text as fit_text
from postproc.time_fit.fit_text import as_toml
from postproc.time_fit.log import read_log
from postproc.time_fit.runs import MeasuredRun, run_of_log, run_of_total, seconds_of
from postproc.time_study import side_by_side
from postproc.time_study.tables import TimeTables, as_csv, tables
from postproc.time_study.tables import as_text as tables_text
from postproc.time_study.what_if import AS_IS, WhatIf, machine_with, model_with, parsed
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, read_value
from toolpaths.input_files import there_is

if TYPE_CHECKING:
    from postproc.cycle_time.toppra_check import ToppraCheck
    from toolpaths.choices import FigureEnding

GAUGE_LENGTHS = (60.0, 240.0)
"""mm between which gauge lengths lie that nobody states"""


@dataclass(frozen=True)
class Asked:
    """What the command line asks for: every file with every machine, set-up and what-if."""

    files: tuple[Path, ...]
    machines: tuple[str, ...]
    controller: str
    model: str
    setups: tuple[str, ...]
    what_if: tuple[str, ...]
    logs: tuple[str, ...]
    output: str
    override: float
    options: Options
    csv: str
    figure: Path | None
    check: bool
    ending: FigureEnding | None
    plan: Path | None = None
    plan_seconds: float = 60.0


@dataclass(frozen=True)
class Timed:
    """One file on one machine: blocks (None where it is refused), the model of the control, times that are planned."""

    file: Path
    machine: Machine
    setup: str
    what_if: WhatIf
    blocks: MotionBlocks | None
    model: CycleTimeModel
    times: BlockTimes | None
    found: tuple[Diagnostic, ...]
    check: ToppraCheck | None = None
    otherwise: tuple[MotionBlocks, ...] = ()
    """the same program with other gauge lengths, where the set-up does not state them"""


TimeAnswer = tuple[dict[str, Any], str, dict[Path, str | bytes], list[Diagnostic]]
"""figures, text, files, diagnostics"""


def answer(asked: Asked, progress: Progress) -> TimeAnswer:
    """The estimates that were asked for.

    Raises:
        DiagnosticError: where a file, machine, set-up or model cannot be read.
    """
    known = [machine_of(name) for name in asked.machines]
    changes = [AS_IS, *(parsed(text, *known) for text in asked.what_if)]
    all_timed = [
        _timed(file, machine_with(m, change), change, setup, asked, progress)
        for file, m, setup, change in product(asked.files, known, asked.setups, changes)
    ]
    found = [d for one in all_timed for d in one.found]
    if any(one.blocks is None for one in all_timed):
        return {}, "", {}, list(dict.fromkeys(found))
    values: dict[str, Any] = {}
    text, outputs = "", dict[Path, str | bytes]()
    if asked.logs:
        fit, more = _fitted(asked, all_timed)
        found += more
        if fit is None:
            return {}, "", {}, found
        all_timed = [replace(one, model=model_with(fit.model, one.what_if), times=None) for one in all_timed]
        values, text = {"calibration": fit_figures(fit)}, fit_text(fit)
        if asked.output:
            outputs[Path(asked.output)] = as_toml(fit.model)
    estimates = [_estimated(one, one.blocks) for one in all_timed if one.blocks is not None]
    found += [replace(d, file=str(one.file)) for one, e in zip(all_timed, estimates, strict=True) for d in e.timed.found]
    made, variants = [tables(e, shares(e)) for e in estimates], _variants(all_timed, estimates)
    if len(all_timed) == 1:
        table, words = _alone(asked, all_timed[0], estimates[0], made[0])
        if (checked := all_timed[0].check) is not None:
            table, words = table | {"check": checked.as_dict()}, f"{words}\n{checked.line()}"
    else:
        table, words = _several(variants, made)
    found += side_by_side.without_effect(variants)
    if asked.plan is not None and (blocks := all_timed[0].blocks) is not None:
        values, text, outputs = _planned_test(asked, all_timed[0], blocks, asked.plan)
    outputs |= _files(asked, [one.name for one in variants], estimates, made)
    return table | values, words + (f"\n{text}" if text else ""), outputs, list(dict.fromkeys(found))


def _timed(file: Path, machine: Machine, change: WhatIf, setup: str, asked: Asked, progress: Progress) -> Timed:
    """The blocks of a CL file (converted first) or of a program, the model of the control, and times that are planned."""
    from postproc.controllers.model import load_controller
    from postproc.setup.model import load_setup
    from postproc.verification.neighbour_files import NeighbourFiles
    from toolpaths.cl.text.kinds_of_file import looks_like_gcode

    options, override = replace(asked.options, setup=setup), asked.override / 100.0
    spec = read_value(load_controller(asked.controller))
    planner = read_value(load_model(asked.model or model_name(asked.controller, spec.writer))).of_machine(machine)
    planner = model_with(planner, change)
    data = read_file(file)
    if not options.dialect and looks_like_gcode(data):
        shop = read_value(load_setup(options.setup or None, options.hooks))
        near = NeighbourFiles(file)
        blocks, found = from_gcode(data, machine, spec, shop, str(file), near, override)
        lengths = GAUGE_LENGTHS if any(d.code == "time.length" for d in found) else ()
        others = [from_gcode(data, machine, spec, shop, str(file), near, override, length)[0] for length in lengths]
        if asked.check:
            found = [*found, error("time.check", "a program has no plan to check: name the CL file that it was made from",
                                   file=str(file))]
        return Timed(file, machine, setup, change, blocks, planner, None, tuple(found), None,
                     tuple(one for one in others if one is not None))
    import toolpaths
    from postproc.cycle_time.conversion import program_clock
    from postproc.pipeline.convert import convert

    path, found = toolpaths.read_bytes(
        data, file=str(file), units=options.units or None, dialect=options.dialect or None, tolerance=options.tolerance,
        allow_unknown=options.allow_unknown)
    del data
    result = convert(path, machine, asked.controller, options=options, diagnostics=found, progress=progress,
                     clock=program_clock(asked.model))
    if not result.ok:
        from postproc.setup_sheet.offers import offers

        name = next(one for one in asked.machines if machine_of(one).name == machine.name)
        more = offers(result, path, name, asked.controller) if change == AS_IS else []
        return Timed(file, machine, setup, change, None, planner, None, (*result.diagnostics, *more))
    blocks, times, found = from_conversion(result, override), None, []
    if planner.kind == "ideal":
        from postproc.cycle_time.planned import planned_times

        times, found = planned_times(result, blocks, planner, override)
    held = None
    if asked.check:
        from postproc.cycle_time.toppra_check import check

        held, more = check(result)
        found = [*found, *more]
    return Timed(file, machine, setup, change, blocks, planner, times, (*result.diagnostics, *found), held)


def _estimated(one: Timed, blocks: MotionBlocks) -> Estimate:
    """The estimate; its band holds the program with any usual gauge length where they are not known."""
    e = estimate(blocks, one.machine, one.model, times=one.times)
    if not one.otherwise:
        return e
    moved = [total(other, timed(other, e.model)) - e.seconds for other in one.otherwise]
    low, high = min(0.0, *moved), max(0.0, *moved)
    return replace(e, band=(max(e.band[0] + low, 0.0), e.band[1] + high),
                   uncertainties=e.uncertainties | {"gauge lengths not known": (high - low) / 2.0})


def _fitted(asked: Asked, all_timed: list[Timed]) -> tuple[CalibratedModel | None, list[Diagnostic]]:
    """The model fitted to the runs of all files as they are, on the first machine with the first set-up."""
    step = len(all_timed) // len(asked.files)
    runs, found = list[MeasuredRun](), list[Diagnostic]()
    for one, log in zip(all_timed[::step], asked.logs, strict=True):
        if one.blocks is not None:
            run, more = _run(one.blocks, one.machine, log)
            found += more
            runs += [] if run is None else [run]
    if len(runs) < len(asked.logs):
        return None, found
    fit, more = calibrate(runs, all_timed[0].model, ", ".join(asked.logs), all_timed[0].machine)
    return fit, [*found, *more]


def _run(blocks: MotionBlocks, machine: Machine, log: str) -> tuple[MeasuredRun | None, list[Diagnostic]]:
    """The run of a log, or of the time of the whole run."""
    seconds = None if there_is(log) else seconds_of(log)
    if seconds is not None:
        return run_of_total(blocks, seconds), []
    read, found = read_log(log, machine.axis_names)
    if read is None:
        return None, found
    run, more = run_of_log(blocks, read, log)
    return run, [*found, *more]


def _alone(asked: Asked, one: Timed, e: Estimate, made: TimeTables) -> tuple[dict[str, Any], str]:
    """One estimate in full."""
    first = measure_first(e, one.machine)
    values = figures.as_dict(e, first) | {
        "feed_override_percent": asked.override,
        "tools": made.tools,
        "losses": made.losses,
    }
    return values, figures.as_text(e, one.file.name, asked.override / 100.0, first, tables_text(made))


def _several(variants: list[side_by_side.Variant], made: list[TimeTables]) -> tuple[dict[str, Any], str]:
    """Estimates side by side, with their tables."""
    rows = [
        {**row, "tools": t.tools, "operations": t.operations, "losses": t.losses}
        for row, t in zip(side_by_side.as_dict(variants), made, strict=True)
    ]
    return {"variants": rows}, side_by_side.as_text(variants)


def _variants(all_timed: list[Timed], estimates: list[Estimate]) -> list[side_by_side.Variant]:
    files = side_by_side.short([one.file for one in all_timed])
    setups = side_by_side.short([Path(one.setup) for one in all_timed])
    names = side_by_side.names(
        [(file, one.machine.name, setup, one.what_if.text)
         for file, setup, one in zip(files, setups, all_timed, strict=True)]
    )
    return [
        side_by_side.Variant(name, str(one.file), one.machine.name, one.setup, one.what_if.text, e)
        for name, one, e in zip(names, all_timed, estimates, strict=True)
    ]


def test_of_the_control(asked: Asked, test: Path) -> TimeAnswer:
    """The test program that narrows the band of every kind of move on a machine and control, for no program at hand.

    Raises:
        DiagnosticError: where machine, controller, set-up or model cannot be read, or no test is found.
    """
    from postproc.controllers.model import load_controller

    machine, spec = machine_of(asked.machines[0]), read_value(load_controller(asked.controller))
    planner = read_value(load_model(asked.model or model_name(asked.controller, spec.writer))).of_machine(machine)
    one = Timed(Path(), machine, asked.setups[0], AS_IS, None, planner, None, ())
    values, text, files = _planned_test(asked, one, None, test)
    return values, text, files, []


def _planned_test(asked: Asked, one: Timed, blocks: MotionBlocks | None,
                  test: Path) -> tuple[dict[str, Any], str, dict[Path, str | bytes]]:
    """The test program that narrows the band of one program, or of all kinds of moves: figures, text, its files."""
    from postproc.setup.model import load_setup
    from postproc.time_fit.plan_calibration import plan_calibration
    from postproc.time_fit.plan_text import as_dict, as_text

    shop = read_value(load_setup(one.setup or None, asked.options.hooks))
    plan = plan_calibration(blocks, one.machine, asked.controller, one.model, shop, asked.plan_seconds,
                            test.name)
    files: dict[Path, str | bytes] = {test: plan.text, test.with_suffix(".setup.toml"): plan.setup}
    return {"plan_calibration": as_dict(plan)}, as_text(plan, test.name), files


def _files(asked: Asked, names: list[str], estimates: list[Estimate], made: list[TimeTables]) -> dict[Path, str | bytes]:
    """The tables as CSV, and the drawing: of the first estimate."""
    outputs = dict[Path, str | bytes]()
    if asked.csv:
        outputs[Path(asked.csv)] = as_csv(list(zip(names, estimates, made, strict=True)))
    if asked.figure is not None and asked.ending is not None:
        from postproc.time_study.time_figure import time_figure

        outputs[asked.figure] = time_figure(estimates[0], shares(estimates[0]), names[0], asked.ending)
    return outputs
