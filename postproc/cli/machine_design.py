"""The command `postproc machine design`: dimensions of a new machine.

Heavy packages are imported inside.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import typer

from machines.layouts.choices import Goal, SlideLayout
from postproc.cli.shared.console import Json, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending, word_option

DESIGNED = "Example: postproc machine design --layout parallel-z --box 500x500x400 --max bulk=1475 -o delta.toml"
LayoutOption = Annotated[SlideLayout, word_option("--layout", SlideLayout, "how the slides stand")]
BoxSides = Annotated[str, typer.Option("--box", metavar="XxYxZ", help="sides of the workspace, mm")]
PlatformOption = Annotated[float, typer.Option("--platform", metavar="MM", min=1.0, max=1e5, help="from the middle of the "
                                                 "platform to its joints")]
GoalOption = Annotated[Goal, word_option("--least", Goal, "what is to be least")]
MaxOption = Annotated[list[str] | None, typer.Option("--max", metavar="FIGURE=VALUE", help="largest condition, bulk (mm, "
                                                     "across z, of the contracted model), speed or rod (mm)")]
MachineFile = Annotated[Path | None, typer.Option("-o", "--output", metavar="MACHINE.toml", help="machine file to write")]
AgainstOption = Annotated[Goal | None, word_option("--front", Goal, "also the machines of which none is better in both")]
FrontFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the front drawn, .png or .svg")]


def machine_design(layout: LayoutOption = "parallel-z", box: BoxSides = "500x500x400", platform: PlatformOption = 100.0,
                   goal: GoalOption = "condition", most: MaxOption = None, output: MachineFile = None,
                   against: AgainstOption = None, figure: FrontFigure = None, json: Json = "") -> None:
    """Find radius or height and rods of three slides for a box within limits, and write the machine file."""
    import numpy as np

    from postproc.cli.catalogue import analysis_text
    from postproc.cli.error_files import pairs

    ending = figure_ending(figure)
    try:
        sides = np.array([float(v) for v in box.split("x")])
    except ValueError:
        sides = np.zeros(0)
    if sides.shape != (3,) or not (np.isfinite(sides).all() and (sides > 0.0).all() and (sides < 1e5).all()):
        raise typer.BadParameter(f"{box!r} is no box: write 500x500x400, mm", param_hint="--box")
    given = pairs("--max", most, get_args(Goal))
    if figure is not None and against is None:
        raise typer.BadParameter("it is of a front: --front FIGURE is missing", param_hint="--figure")
    if against == goal:
        raise typer.BadParameter(f"{goal} is the goal: name another figure", param_hint="--front")
    refuse_overwriting({"-o": str(output or ""), "--figure": str(figure or ""), "--json": json}, {})
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.layouts.design import design, front_figure
        from machines.layouts.search import LayoutQuestion

        asked = LayoutQuestion(layout, sides, platform, goal, {key: given[key] for key in get_args(Goal) if key in given})
        found = design(asked, against)
    if output is not None:
        outputs[output] = found.text
    if figure is not None and ending is not None and against is not None:
        outputs[figure] = front_figure(asked, against, found.front, ending)
    text = analysis_text({key: value for key, value in found.figures.items() if key != "front"})
    report((), json, found.figures, text if output is not None else f"{text}\n\n{found.text}", outputs)
