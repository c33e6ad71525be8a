"""`postproc machine analyse`: what a machine is good for, and maps and curves of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import typer

from machines.analysis.choices import Across, MapMeasure
from postproc.cli.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.options import figure_ending, word_option

EXAMPLES = "Examples: postproc machine analyse uranesx --json -; " \
           "postproc machine analyse uranesx --map condition --along x --along y --at z=-100 --figure map.svg --csv map.csv"
SingularOption = Annotated[float | None, typer.Option("--singular-above", metavar="MM", min=0.0,
                                                      help="prove by a grid that the singular values of a linear Delta with "
                                                      "slides along z stay above this")]
MapOption = Annotated[MapMeasure | None, word_option("--map", MapMeasure, "measure of a map or a curve")]
AlongOption = Annotated[list[str] | None, typer.Option("--along", metavar="x|y|z|tilt", help="with --map: once a curve, "
                                                       "twice a slice; left out: x and y")]
AtOption = Annotated[list[str] | None, typer.Option("--at", metavar="x|y|z|tilt=VALUE", help="with --map: the others, mm or "
                                                    "degrees; left out: the middle of the workspace")]
MapCsv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the map or curve as a table")]
MapFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the same drawn, .png or .svg")]


def machine_analyse(name: Annotated[str, typer.Argument(help="name or TOML file")], singular_above: SingularOption = None,
                    measure: MapOption = None, along: AlongOption = None, at: AtOption = None, csv: MapCsv = None,
                    figure: MapFigure = None, json: Json = "") -> None:
    """Condition number, transmission of speed and force over the workspace, reachable box and what ends it."""
    from postproc.cli.catalogue import analysis_text

    ending = figure_ending(figure)
    if measure is None and (along or at or csv or figure):
        raise typer.BadParameter("it is of a map or a curve: --map MEASURE is missing", param_hint="--map")
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    if measure is None:
        from machines.analysis.report import analyse

        with shown_errors(json):
            found = analyse(machine_of(name), singular_above)
        report((), json, found, analysis_text(found))
        return
    places, fixed = _along(along), _fixed(at)
    with shown_errors(json):
        from machines.analysis.maps import map_figure, measured

        values = measured(machine_of(name), measure, places, fixed)
    if csv is not None:
        outputs[csv] = values.csv
    if figure is not None and ending is not None:
        outputs[figure] = map_figure(values, ending)
    figures = values.figures
    report((), json, figures, analysis_text(figures), outputs)


def _along(given: list[str] | None) -> tuple[Across, ...]:
    known: dict[str, Across] = {name: name for name in get_args(Across)}
    names = given or ["x", "y"]
    if len(names) > 2 or len(set(names)) < len(names) or not set(names) <= set(known):
        raise typer.BadParameter(f"{' '.join(names)}: write one or two of {', '.join(known)}", param_hint="--along")
    return tuple(known[name] for name in names)


def _fixed(given: list[str] | None) -> dict[Across, float]:
    found: dict[Across, float] = {}
    for text in given or ():
        name, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        key: Across | None = next((one for one in get_args(Across) if one == name), None)
        if key is None or key in found or not abs(value) < 1e9:
            raise typer.BadParameter(f"{text!r}: write x, y, z or tilt, = and a number, each once", param_hint="--at")
        found[key] = value
    return found
