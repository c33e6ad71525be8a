"""The command `postproc compare`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.shared.console import (
    Json,
    controller_file,
    machine_of,
    no_cl_file,
    own_files,
    progress_bar,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.options import AxisToleranceOption, ToleranceOption, figure_ending

if TYPE_CHECKING:
    from postproc.cycle_time.source import ExecutedProgram
    from toolpaths.diagnostics import Diagnostic

EXAMPLE = "Example: postproc compare old.nc new.nc -m mikron-ucp710 -c fanuc-30i --setup shop.toml --figure both.svg"
BothMachines = Annotated[list[str], typer.Option("-m", "--machine", metavar="MACHINE", help="machine of both programs; "
                                             "given twice: of A, then of B")]
BothControllers = Annotated[list[str], typer.Option("-c", "--controller", metavar="CONTROLLER", help="control of both "
                                                "programs; given twice: of A, then of B")]
BothSetups = Annotated[list[str] | None, typer.Option("--setup", metavar="S.toml", help="set-up file of both: placement, "
                                                  "tools; given twice: of A, then of B")]


def compare(a: Annotated[Path, typer.Argument(metavar="A.nc", help="program")],
            b: Annotated[Path, typer.Argument(metavar="B.nc", help="the other program")],
            machine: BothMachines, controller: BothControllers, setup: BothSetups = None,
            tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
            figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="cuts of both over each other: "
                                                        ".png or .svg")] = None,
            json: Json = "") -> None:
    """Say what two programs do differently: paths of the tool on the part, feeds, states, time."""
    sides = [_two(machine, "-m"), _two(controller, "-c"), _two(setup or [""], "--setup")]
    of_b = {f"{what} of B": name for what, name in own_files(sides[0][1], sides[1][1]).items()}
    inputs = {"program A": str(a), "program B": str(b), **{f"the set-up {name}": name for name in sides[2] if name},
              **own_files(sides[0][0], sides[1][0]), **of_b}
    ending = figure_ending(figure)
    refuse_overwriting({"--figure": str(figure or ""), "--json": json}, inputs)
    values: dict[str, Any] = {}
    text, outputs, found = "", dict[Path, str | bytes](), list["Diagnostic"]()
    with shown_errors(json), progress_bar() as progress:
        from postproc.differences.compare import compare as run
        from postproc.differences.report import as_dict, as_text, overlay
        from toolpaths.units import DEG

        programs, seconds = [], []
        for number, file in enumerate((a, b)):
            progress("executing", number, 2)
            program, time, more = _executed(file, *(side[number] for side in sides))
            programs.append(program)
            seconds.append(time)
            found += more
        both = programs[0], programs[1]
        differences = run(*both)
        names, times, allowed = (a.name, b.name), (seconds[0], seconds[1]), (tolerance, axis_tolerance * DEG)
        values, text = as_dict(differences, names, times, allowed), as_text(differences, names, times, allowed)
        if figure is not None and ending is not None:
            outputs[figure] = overlay(both, names, ending)
    report(tuple(dict.fromkeys(found)), json, values | {"diagnostics": [d.as_dict() for d in found]}, text, outputs)


def _two(given: list[str], option: str) -> tuple[str, str]:
    """What A and B have."""
    if len(given) > 2:
        raise typer.BadParameter("once for both programs, or twice", param_hint=option)
    return given[0], given[-1]


def _executed(file: Path, machine: str, controller: str, setup: str) -> tuple[ExecutedProgram, float, list[Diagnostic]]:
    """A program as its control runs it, with the seconds that it takes.

    Raises:
        DiagnosticError: where it cannot be executed.
    """
    from postproc.cycle_time.estimate import estimate
    from postproc.cycle_time.model import load_model, model_name
    from postproc.cycle_time.source import executed_program, program_blocks, read_file
    from postproc.setup.model import load_setup
    from postproc.verification.neighbour_files import NeighbourFiles
    from toolpaths.diagnostics import DiagnosticError, read_value

    no_cl_file(file)
    m, spec = machine_of(machine), controller_file(controller)
    program, found = executed_program(read_file(file, "a program of the control"), m, spec,
                                      read_value(load_setup(setup or None)), str(file), NeighbourFiles(file))
    blocks, more = program_blocks(program, str(file)) if program is not None else (None, [])
    if program is None or blocks is None:
        raise DiagnosticError([*found, *more])
    model = read_value(load_model(model_name(controller, spec.writer))).of_machine(m)
    return program, estimate(blocks, m, model).seconds, [*found, *more]
