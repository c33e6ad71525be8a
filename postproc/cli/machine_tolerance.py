"""`postproc machine tolerance`: what the errors of a machine's dimensions do to the tool, and which ones to tighten."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import typer

from postproc.cli.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.options import figure_ending

EXAMPLES = "Example: postproc machine tolerance uranesx --tool 120 --error 0.02 --cost guide=3 --csv uranesx.csv"
ToolOption = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, help="length of the tool whose tip is meant")]
AdjustOption = Annotated[bool, typer.Option("--adjust", help="once the rods' lengths are set so that the middle of the "
                                            "workspace is exact")]
SpreadOption = Annotated[float, typer.Option("--spread", metavar="UM", min=1e-6, help="errors by chance, micrometres; "
                                             "microradians of guides")]
SamplesOption = Annotated[int, typer.Option("--samples", min=1, max=1_000_000, help="of errors by chance")]
ErrorOption = Annotated[float | None, typer.Option("--error", metavar="MM", min=1e-9, help="budget: error of the tip that "
                                                   "the tolerances have to keep together")]
CostOption = Annotated[list[str] | None, typer.Option("--cost", metavar="PART=COST", help="budget: cost of a tolerance of "
                                                      "drive, guide, foot, joint or rod against the others, else 1")]
CsvFile = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the table by dimension")]
BarsFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="influence of each point, .png or .svg")]


def machine_tolerance(name: Annotated[str, typer.Argument(help="name or TOML file")], tool: ToolOption = 0.0,
                      adjust: AdjustOption = False, spread: SpreadOption = 1.0, samples: SamplesOption = 1000,
                      allowed: ErrorOption = None, cost: CostOption = None, csv: CsvFile = None, figure: BarsFigure = None,
                      json: Json = "") -> None:
    """Influence of every dimension of a machine on legs on its tool, over the workspace and by chance; tolerance budget."""
    from machines.tolerances.sensitivity import Part
    from postproc.cli.error_files import pairs

    ending = figure_ending(figure)
    prices = pairs("--cost", cost, get_args(Part))
    if cost and allowed is None:
        raise typer.BadParameter("costs matter to a budget: give --error", param_hint="--cost")
    if any(value <= 0.0 for value in prices.values()):
        raise typer.BadParameter("a cost is more than 0", param_hint="--cost")
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.tolerances.report import MICRO, ToleranceQuestion, tolerance_figure, tolerances

        machine = machine_of(name)
        found = tolerances(machine, ToleranceQuestion(tool, adjust, spread * MICRO, samples, allowed, {
            part: prices[part] for part in get_args(Part) if part in prices}))
    if csv is not None:
        outputs[csv] = found.csv
    if figure is not None and ending is not None:
        outputs[figure] = tolerance_figure(machine, found, ending)
    from postproc.cli.catalogue import analysis_text

    rest = {key: value for key, value in found.figures.items() if key not in ("dimensions", "points", "of")}
    report((), json, found.figures, f"{found.text}\n{analysis_text(rest)}", outputs)
