"""Commands that study a machine: `postproc machine analyse`, `tolerance`, `stiffness`.

Heavy packages are imported inside.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from machines.analysis.choices import MapMeasure, MapNumber, SizeNumber
from postproc.cli.shared.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending, word_option

if TYPE_CHECKING:
    from machines.machine import Machine
    from toolpaths.choices import FigureEnding

ANALYSED = "Examples: postproc machine analyse uranesx --json -; " \
           "postproc machine analyse uranesx --map condition --along x --along y --at z=-100 --figure map.svg --csv map.csv"
SingularOption = Annotated[float | None, typer.Option("--singular-above", metavar="MM", min=0.0, max=1e6,
                                                      help="prove by a grid that the singular values of a linear Delta with "
                                                      "slides along z stay above this")]
MapOption = Annotated[MapMeasure | None, word_option("--map", MapMeasure, "measure of a map or a curve")]
AlongOption = Annotated[list[str] | None, typer.Option("--along", metavar="x|y|z|tilt|SIZE=LOW:HIGH", help=(
    "with --map: once a curve, twice a slice; left out: x and y. With a size (rod, radius or offset, mm) the extremes "
    "over the "
    "workspace against it"))]
AnalysedTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4,
                                             help="length of the tool whose tip is "
                                              "meant, of reach and of chains of axes")]
OffsetOption = Annotated[float, typer.Option("--offset", metavar="MM", min=-1e5, max=1e5,
                                             help="with --map rod-inertia: centre "
                                             "of mass above the platform's reference point")]
AtOption = Annotated[list[str] | None, typer.Option("--at", metavar="x|y|z|tilt=VALUE", help="with --map: the others, mm or "
                                                    "degrees; left out: the middle of the workspace")]
MapCsv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the map or curve as a table")]
MapFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the same drawn, .png or .svg; "
                                                      "without --map the condition number")]


def machine_analyse(name: Annotated[str, typer.Argument(help="name or TOML file")], singular_above: SingularOption = None,
                    measure: MapOption = None, along: AlongOption = None, at: AtOption = None, csv: MapCsv = None,
                    figure: MapFigure = None, offset: OffsetOption = 0.0, tool: AnalysedTool = 0.0, json: Json = "") -> None:
    """Condition number, transmission of speed and force over the workspace, reachable box and what ends it."""
    from postproc.cli.catalogue import analysis_text

    ending = figure_ending(figure)
    if measure is None and (along or at or csv):
        _along(along), _fixed(at)
        raise typer.BadParameter(f"this is of a map or curve; write --map with one of {', '.join(get_args(MapMeasure))} too",
                                 param_hint="--along" if along else "--at" if at else "--csv")
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    if measure is None:
        from machines.analysis.report import analyse

        with shown_errors(json):
            machine = machine_of(name)
            found = analyse(replace(machine, kinematics=machine.kinematics.with_tool(tool)), singular_above)
            if figure is not None and ending is not None:
                outputs[figure] = _condition_figure(machine, ending)
        report((), json, found, analysis_text(found), outputs)
        return
    if any("=" in one for one in along or ()):
        if at:
            raise typer.BadParameter("the whole workspace is looked at for each size: leave it out", param_hint="--at")
        ranges = _sizes(along or [])
        with shown_errors(json):
            from machines.analysis.sizes import over_sizes, size_figure

            study = over_sizes(machine_of(name), measure, ranges, offset)
        if csv is not None:
            outputs[csv] = study.csv
        if figure is not None and ending is not None:
            outputs[figure] = size_figure(study, ending)
        report((), json, study.figures, analysis_text(study.figures), outputs)
        return
    places, fixed = _along(along), _fixed(at)
    with shown_errors(json):
        from machines.analysis.maps import map_figure, measured

        values = measured(machine_of(name), measure, places, fixed, offset)
    if csv is not None:
        outputs[csv] = values.csv
    if figure is not None and ending is not None:
        outputs[figure] = map_figure(values, ending)
    figures = values.figures
    report((), json, figures, analysis_text(figures), outputs)


def _condition_figure(machine: Machine, ending: FigureEnding) -> bytes:
    """What stands first in the analysis, drawn: the condition number over x and y, of a chain over its rotary axes."""
    from machines.analysis.chain_map import chain_map_figure
    from machines.analysis.maps import map_figure, measured
    from toolpaths.diagnostics import DiagnosticError, error

    if machine.kinematics.transmits is not None:
        return map_figure(measured(machine, "condition", ("x", "y"), {}), ending)
    if not any(machine.rotary):
        raise DiagnosticError([error("analysis.map", f"{machine.name} has slides alone: its condition number is 1 "
                                     "everywhere, there is nothing to draw", file=machine.file, hint="leave --figure out")])
    return chain_map_figure(machine, ending)


def _along(given: list[str] | None) -> tuple[MapNumber, ...]:
    known: dict[str, MapNumber] = {name: name for name in get_args(MapNumber)}
    names = given or ["x", "y"]
    if len(names) > 2 or len(set(names)) < len(names) or not set(names) <= set(known):
        raise typer.BadParameter(f"{' '.join(names)}: write one or two of {', '.join(known)}", param_hint="--along")
    return tuple(known[name] for name in names)


def _sizes(given: list[str]) -> dict[SizeNumber, tuple[float, float]]:
    """mm, of --along rod=1000:2000; wrong use where it is none."""
    found: dict[SizeNumber, tuple[float, float]] = {}
    for text in given:
        name, _, ends = text.partition("=")
        try:
            low, high = (float(v) for v in ends.split(":"))
        except ValueError:
            low, high = 1.0, 0.0
        key: SizeNumber | None = next((one for one in get_args(SizeNumber) if one == name), None)
        least = -1e6 if key == "offset" else 0.0
        if key is None or key in found or not least <= low < high < 1e6 or len(given) > 2:
            raise typer.BadParameter(f"{text!r}: write one or two of {', '.join(get_args(SizeNumber))}, = and two lengths "
                                     "in mm "
                                     "with : between them, the smaller first", param_hint="--along")
        found[key] = low, high
    return found


def _fixed(given: list[str] | None) -> dict[MapNumber, float]:
    found: dict[MapNumber, float] = {}
    for text in given or ():
        name, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        key: MapNumber | None = next((one for one in get_args(MapNumber) if one == name), None)
        if key is None or key in found or not abs(value) < 1e9:
            raise typer.BadParameter(f"{text!r}: write x, y, z or tilt, = and a number, each once", param_hint="--at")
        found[key] = value
    return found


TOLERATED = "Example: postproc machine tolerance uranesx --tool 120 --error 0.02 --cost guide=3 --csv uranesx.csv"
TipTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4,
                                          help="length of the tool whose tip is meant")]
AdjustOption = Annotated[bool, typer.Option("--adjust", help="once the rods' lengths are set so that the middle of the "
                                            "workspace is exact")]
SpreadOption = Annotated[float, typer.Option("--spread", metavar="UM", min=1e-6, max=1e6,
                                              help="errors by chance, micrometres; "
                                             "microradians of guides")]
SamplesOption = Annotated[int, typer.Option("--samples", metavar="N", min=1, max=1_000_000, help="of errors by chance")]
ErrorOption = Annotated[float | None, typer.Option("--error", metavar="MM", min=1e-9, max=1e3,
                                                   help="budget: error of the tip that "
                                                   "the tolerances have to keep together")]
CostOption = Annotated[list[str] | None, typer.Option("--cost", metavar="WHAT=COST", help="budget: cost of a tolerance of "
                                                      "a part (rod, axis), a point (\"joint X1\") or a dimension "
                                                      "(\"joint X1 z\") of the table against the others, else 1")]
CsvFile = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the table by dimension")]
BarsFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="influence of each point, .png or .svg")]


def machine_tolerance(name: Annotated[str, typer.Argument(help="name or TOML file")], tool: TipTool = 0.0,
                      adjust: AdjustOption = False, spread: SpreadOption = 1.0, samples: SamplesOption = 1000,
                      allowed: ErrorOption = None, cost: CostOption = None, csv: CsvFile = None, figure: BarsFigure = None,
                      json: Json = "") -> None:
    """Influence of every dimension of a machine on its tool, by place and by chance; tolerance budget."""
    from postproc.cli.error_files import pairs

    ending = figure_ending(figure)
    prices = pairs("--cost", cost, [text.partition("=")[0] for text in cost or ()])
    if cost and allowed is None:
        raise typer.BadParameter("costs matter to a budget: give --error", param_hint="--cost")
    if any(value <= 0.0 for value in prices.values()):
        raise typer.BadParameter("a cost is more than 0", param_hint="--cost")
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.tolerances.report import MICRO, ToleranceQuestion, tolerance_figure, tolerances

        machine = machine_of(name)
        found = tolerances(machine, ToleranceQuestion(tool, adjust, spread * MICRO, samples, allowed, prices))
    if csv is not None:
        outputs[csv] = found.csv
    if figure is not None and ending is not None:
        outputs[figure] = tolerance_figure(machine, found, ending)
    from postproc.cli.catalogue import analysis_text

    rest = {key: value for key, value in found.figures.items() if key not in ("dimensions", "points", "of")}
    report((), json, found.figures, f"{found.text}\n{analysis_text(rest)}", outputs)


STIFF = "Example: postproc machine stiffness uranesx --rod 100 --joint 150 --drive 80 --tool 120 --force 300,0,-500"
RodOption = Annotated[float, typer.Option("--rod", metavar="N/UM", min=1e-9, max=1e9,
                                            help="stiffness of a rod's body along it")]
JointOption = Annotated[float | None, typer.Option("--joint", metavar="N/UM", min=1e-9, max=1e9,
                                                     help="of each joint along the rod; "
                                                   "left out: it does not yield")]
DriveOption = Annotated[float | None, typer.Option("--drive", metavar="N/UM", min=1e-9, max=1e9,
                                                     help="of a drive along its motion; "
                                                   "left out: it does not yield")]
ForceOption = Annotated[str, typer.Option("--force", metavar="FX,FY,FZ", help="at the tip, N, in the machine's directions")]
StiffnessMap = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="map of the middle slice, .png or .svg")]


def machine_stiffness(name: Annotated[str, typer.Argument(help="name or TOML file")], rod: RodOption,
                      joint: JointOption = None, drive: DriveOption = None, tool: TipTool = 0.0,
                      force: ForceOption = "0,0,1", figure: StiffnessMap = None, json: Json = "") -> None:
    """Stiffness of the tip over the workspace, deflection under a force, forces in rods and drives."""
    import numpy as np

    from postproc.cli.catalogue import analysis_text

    ending = figure_ending(figure)
    try:
        given = np.array([float(v) for v in force.split(",")])
    except ValueError:
        given = np.zeros(0)
    if given.shape != (3,) or not (np.abs(given) < 1e9).all():
        raise typer.BadParameter(f"{force!r} is no force: write FX,FY,FZ in N", param_hint="--force")
    refuse_overwriting({"--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.stiffness.report import StiffnessQuestion, stiffness, stiffness_map
        from machines.stiffness.statics import Springs

        per_mm = [np.inf if value is None else 1e3 * value for value in (rod, joint, drive)]
        asked = StiffnessQuestion(Springs(*per_mm), tool, given)
        machine = machine_of(name)
        found = stiffness(machine, asked)
        if figure is not None and ending is not None:
            outputs[figure] = stiffness_map(machine, asked, ending)
    report((), json, found, analysis_text(found), outputs)
