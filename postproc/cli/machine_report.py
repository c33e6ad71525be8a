"""The command `postproc machine report`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.report import check_page
from postproc.cli.shared.console import (
    Json,
    controller_file,
    machine_of,
    own_files,
    refuse_overwriting,
    report,
    shown_errors,
)

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.dossier.content import ErrorsOf
    from postproc.dossier.figures import DossierFigure
    from toolpaths.choices import FigureEnding
    from toolpaths.diagnostics import Diagnostic

REPORTED = "Example: postproc machine report mikron-ucp710 -c siemens-840d -o mikron.html"
PivotNamesOf = Annotated[list[str] | None, typer.Option("-c", "--controller", metavar="CONTROLLER", help="whose names of "
                                                        "the pivots are shown; may be repeated; left out: all built-in")]
ErrorFile = Annotated[Path | None, typer.Option("--error-model", metavar="E.toml", help="file of the machine's geometric "
                                                "errors")]
ErrorsAt = Annotated[float, typer.Option("--tool-length", metavar="MM", min=0.0, max=10_000.0,
                                           help="gauge length of the tool at whose tip errors are given")]
FigureFolder = Annotated[Path | None, typer.Option("--figures", metavar="DIR", help="write its figures into this folder "
                                                   "too, as PNG and SVG")]
Page = Annotated[Path, typer.Option("-o", "--output", metavar="R.html", help="page to write")]


def machine_report(name: Annotated[str, typer.Argument(help="name or TOML file")], output: Page,
                   controller: PivotNamesOf = None, error_model: ErrorFile = None, tool_length: ErrorsAt = 100.0,
                   figures: FigureFolder = None, json: Json = "") -> None:
    """Show a machine as one page: drawing, limits with sources, pivots, workspace, condition, proof, errors."""
    check_page(output, "-o")
    inputs = {"the error model": str(error_model or ""), **own_files(name)}
    for one in controller or ():
        inputs |= {f"{what} {one}": place for what, place in own_files("", one).items()}
    refuse_overwriting({"-o": str(output), "--json": json}, inputs)
    values: dict[str, Any] = {}
    outputs: dict[Path, str | bytes] = {}
    found: list[Diagnostic] = []
    with shown_errors(json):
        from postproc.dossier.content import dossier
        from postproc.dossier.figures import figures as figures_of
        from postproc.dossier.page import page
        from postproc.proof.hashes import error_model_hashes, machine_hashes

        machine, errors, found = _read(name, error_model, tool_length)
        hashes = (*machine_hashes(name), *(error_model_hashes(str(error_model)) if error_model is not None else ()))
        values = dossier(machine, {one: controller_file(one) for one in controller or _builtin()}, errors, hashes, found)
        drawn = figures_of(machine, errors)
        outputs[output] = page(values, [(one.section, one.title, one.make(".svg")) for one in drawn])
        outputs |= {} if figures is None else _files(figures, drawn)
    refuse_overwriting({f"--figures {place.name}": str(place) for place in outputs if place != output}, inputs)
    report(tuple(found), json, values, f"{output}: {len(outputs[output]) / 1e6:.2f} MB, {len(drawn)} figures", outputs)


def _read(name: str, error_model: Path | None, tool_length: float) -> tuple[Machine, ErrorsOf | None, list[Diagnostic]]:
    """(machine, its errors, what was said of both files)."""
    import machines
    from postproc.cli.error_files import loaded
    from postproc.dossier.content import ErrorsOf

    machine = machine_of(name)
    found = [*machines.load_checked(name)[1], *machines.implausible(name)]
    if error_model is None:
        return machine, None, found
    model, said = loaded(error_model, machine)
    return machine, ErrorsOf(model, error_model.name, tool_length), [*found, *said]


def _builtin() -> list[str]:
    from postproc.controllers.model import builtin_files

    return sorted(builtin_files())


def _files(folder: Path, drawn: list[DossierFigure]) -> dict[Path, str | bytes]:
    endings: tuple[FigureEnding, ...] = (".png", ".svg")
    return {folder / f"{one.name}{ending}": one.make(ending) for one in drawn
            for ending in (endings[1:] if one.only_svg else endings)}
