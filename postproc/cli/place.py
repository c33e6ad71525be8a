"""The command `postproc place`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.shared.console import (
    Json,
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
    Beyond,
    ClFile,
    DialectOption,
    MachineName,
    MaxTilt,
    ModelOfControl,
    Orient,
    SchedulerOption,
    SearchWorkers,
    ToleranceOption,
    UnitsOption,
    figure_ending,
    only_with_errors,
)

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.base.options import Options
    from postproc.base.progress import Progress
    from postproc.placement.place import PlacementChoice
    from toolpaths.diagnostics import Diagnostic

EXAMPLES = """Example: postproc place part.cls -m mill-3axis --setup shop.toml -o placed.toml

\b
shop.toml says where the part may stand:
[placement]
x = [-100, 100]
y = [-100, 100]
turns = [0, 90, 180, 270]"""


def place(file: ClFile,
          machine: MachineName,
          setup: Annotated[Path, typer.Option("--setup", metavar="S.toml", help="set-up file; [placement] says where the "
                                              "part may stand")],
          output: Annotated[Path, typer.Option("-o", "--output", metavar="S2.toml", help="set-up file to write: the same "
                                               "with [part] replaced")],
          controller: Annotated[str, typer.Option("-c", "--controller", metavar="CONTROLLER",
                                                   help="controller for which the place is proved")] = "linuxcnc",
          orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
          tolerance: ToleranceOption = 0.01,
          axis_tolerance: AxisToleranceOption = 0.05,
          error_model: Annotated[str, typer.Option("--error-model", metavar="E.toml", help="file of the machine's geometric "
                                                   "errors, corrected where the place is proved")] = "",
          beyond: Beyond = False,
          units: UnitsOption = "",
          dialect: DialectOption = "",
          allow_unknown: Allow = None,
          figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="map of the places, .png or "
                                                      ".svg")] = None,
          model: ModelOfControl = "", workers: SearchWorkers = 0,
          scheduler: SchedulerOption = "",
          json: Json = "") -> None:
    """Place and turn the part on the table for the least planned time, inside the limits of the set-up."""
    ending = figure_ending(figure)
    _check(setup)
    only_with_errors(beyond, error_model)
    refuse_overwriting({"-o": str(output), "--json": json, "--figure": str(figure or "")},
                       {"the CL file": str(file), "the set-up": str(setup), "the error model": error_model,
                        **own_files(machine, controller)})
    from postproc.base.options import Options
    from postproc.placement import report as figures
    from postproc.placement.write import placed_text

    options = Options(tolerance, axis_tolerance, setup=str(setup), units=units, dialect=dialect, error_model=error_model,
                      error_beyond=beyond, allow_unknown=tuple(w.upper() for w in allow_unknown or ()), max_tilt=max_tilt,
                      orient=orient)
    values: dict[str, Any] = {}
    text = ""
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json), progress_bar() as progress, ExitStack() as stack:
        if workers or scheduler:
            from postproc.batch.cluster import spread
            from postproc.batch.run import Where

            stack.enter_context(spread(Where(workers, scheduler)))
        choice, found = _chosen(file, machine_of(machine), controller, options, progress, model)
        if choice is not None:
            if figure is not None and ending is not None:
                from postproc.placement.figure import placement_figure

                outputs[figure] = placement_figure(choice, ending)
            outputs[output] = placed_text(setup, output, choice.part)
            values = figures.as_dict(choice) | {"output": str(output)}
            text = figures.as_text(choice) + f"\nwritten: {output}"
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def _check(setup: Path) -> None:
    """Wrong use.

    Raises:
        typer.BadParameter: says what there is to choose from.
    """
    from toolpaths.input_files import is_regular, there_is

    if there_is(setup) and not is_regular(setup):
        raise typer.BadParameter(f"{setup} is not a regular file: its text is read twice",
                                 param_hint="--setup")


def _chosen(file: Path, machine: Machine, controller: str, options: Options,
            progress: Progress, model: str) -> tuple[PlacementChoice | None, list[Diagnostic]]:
    """The choice for a file; None where a diagnostic is an ERROR."""
    from postproc.placement.place import place as run
    from postproc.setup.model import load_setup
    from toolpaths.diagnostics import has_errors, read_value

    settings = read_value(load_setup(options.setup))
    path, found = read_cl(file, options, progress)
    found = [*found, *(d for d in path.faults if d not in found)]
    if has_errors(found):
        return None, found
    choice, more = run(path, machine, settings, options, controller, progress, model)
    return choice, found + more
