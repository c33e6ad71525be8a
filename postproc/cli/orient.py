"""The command `postproc orient`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.base.options import Orientation
from postproc.cli.shared.console import (
    Json,
    controller_of,
    machine_of,
    own_files,
    progress_bar,
    read_cl,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    ClFile,
    DialectOption,
    MachineName,
    MaxTilt,
    ModelOfControl,
    SchedulerOption,
    SearchWorkers,
    ToleranceOption,
    UnitsOption,
    figure_ending,
    word_option,
)

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.base.options import Options
    from postproc.base.progress import Progress
    from postproc.orientation.plans.choice import OrientationChoice
    from postproc.pipeline.result import PostResult
    from toolpaths.diagnostics import Diagnostic

EXAMPLES = """\b
Examples:
postproc orient part.cls -m mikron-ucp710 --max-tilt 45
postproc orient part.cls -m mikron-ucp710 --figure part.svg --pass 3

Then the program: postproc convert part.cls -m mikron-ucp710 -c linuxcnc --orient auto -o part.ngc"""
MOST = 6
"""passes drawn and listed in full"""


def orient(file: ClFile,
           machine: MachineName,
           controller: Annotated[str, typer.Option("-c", "--controller", metavar="CONTROLLER",
                                                   help="controller that the choice is for")] = "linuxcnc",
           max_tilt: MaxTilt = 60.0,
           plan: Annotated[Orientation, word_option("--orient", Orientation, "plan whose passes are shown")] = "auto",
           passes: Annotated[list[int] | None, typer.Option("--pass", metavar="N", min=0, help="show this pass in full "
                                                            "(number of the table; may be repeated)")] = None,
           figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="drawing of plans, passes and, of "
                                                       "--pass, polytopes, reach, candidates; .png or .svg")] = None,
           setup: Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools")] = "",
           tolerance: ToleranceOption = 0.01,
           axis_tolerance: AxisToleranceOption = 0.05,
           error_model: Annotated[str, typer.Option("--error-model", metavar="E.toml", help="file of the machine's "
                                                    "geometric errors: checked, not used for the choice")] = "",
           units: UnitsOption = "",
           dialect: DialectOption = "",
           allow_unknown: Allow = None,
           model: ModelOfControl = "",
           workers: SearchWorkers = 0,
           scheduler: SchedulerOption = "",
           json: Json = "") -> None:
    """Choose the tool orientation of 3+2 passes for the least planned time, and say why."""
    ending = figure_ending(figure)
    _check(passes or [])
    refuse_overwriting({"--figure": str(figure or ""), "--json": json},
                       {"the CL file": str(file), "the set-up": setup, "the error model": error_model,
                        **own_files(machine, controller)})
    from postproc.base.options import Options

    options = Options(tolerance, axis_tolerance, setup=setup, units=units, dialect=dialect, error_model=error_model,
                      allow_unknown=tuple(w.upper() for w in allow_unknown or ()), max_tilt=max_tilt,
                      orient=plan)
    values: dict[str, Any] = {}
    text = ""
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json), progress_bar() as progress, ExitStack() as stack:
        if workers or scheduler:
            from postproc.batch.cluster import spread
            from postproc.batch.run import Where

            stack.enter_context(spread(Where(workers, scheduler)))
        made = _chosen(file, machine_of(machine), controller_of(controller), options, progress, model)
        choice, turning, found = made.choice, made.turning, list(made.diagnostics)
        if choice is not None:
            from postproc.orientation.report.figures_of_choice import as_dict
            from postproc.orientation.report.text import as_text

            shown = _known(passes or [], choice)
            values, text = as_dict(choice, options.orient), as_text(choice, options.orient, shown)
            if turning is not None:
                from postproc.orientation.turning import turning_report

                values["turning"] = turning_report.as_dict(turning)
                text += "\n\n" + turning_report.as_text(turning)
            if figure is not None and ending is not None:
                from postproc.orientation.figures.sheet import draw

                outputs[figure] = draw(choice, options.orient, shown, ending, turning)
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def _check(passes: list[int]) -> None:
    """Wrong use."""
    if len(set(passes)) > MOST:
        raise typer.BadParameter(f"{len(set(passes))} passes at once, at most {MOST} are shown in full; all are in --json",
                                 param_hint="--pass")


def _chosen(file: Path, machine: Machine, controller: str, options: Options,
            progress: Progress, model: str) -> PostResult:
    """The choice for a file, none where a diagnostic is an ERROR."""
    from postproc.cycle_time.conversion import program_clock
    from postproc.pipeline.convert import choose_axes

    path, found = read_cl(file, options, progress)
    return choose_axes(path, machine, controller, options, [*found, *_errors(options, machine)], progress,
                       program_clock(model))


def _errors(options: Options, machine: Machine) -> list[Diagnostic]:
    """What is wrong with the error model; else that it changes nothing here."""
    if not options.error_model:
        return []
    from machines.geometric_error.files.loader import load_checked
    from toolpaths.diagnostics import info

    model, found = load_checked(options.error_model, machine)
    noted = info("orient.error_model", "times and travel are those of the machine without its geometric errors: corrections "
                 "of some micrometres change no choice", file=options.error_model,
                 hint="nothing is to be done: convert corrects and proves them")
    return [*found, noted] if model is not None else list(found)


def _known(passes: list[int], choice: OrientationChoice) -> list[int]:
    """Numbers of passes, each once, that the file has.

    Raises:
        DiagnosticError: for another number.
    """
    from toolpaths.diagnostics import DiagnosticError, error

    shown, count = list(dict.fromkeys(passes)), len(choice.tried)
    wrong = [number for number in shown if number >= count]
    if wrong:
        raise DiagnosticError([error("orient.pass", f"there is no pass {wrong[0]}", file=choice.work.toolpath.file,
                                     hint=f"passes are numbered 0 to {count - 1}")])
    return shown
