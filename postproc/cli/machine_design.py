"""The command `postproc machine design`: dimensions of a new machine.

Heavy packages are imported inside.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from machines.layouts.choices import Goal, SlideLayout
from postproc.cli.shared.console import Json, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending, word_option

if TYPE_CHECKING:
    from toolpaths.arrays import Floats

DESIGNED = "Examples: postproc machine design --layout parallel-z --box 500x500x400 --max bulk=1475 -o delta.toml; " \
           "postproc machine design --layout rotary-delta --arm 260 --rod 480 --box 420x420x100"
LayoutOption = Annotated[SlideLayout, word_option("--layout", SlideLayout, "how the slides stand")]
BoxSides = Annotated[str, typer.Option("--box", metavar="XxYxZ", help="sides of the workspace, mm; of cranks the cylinder "
                                       "round "
                                       "z, as wide as it is long")]
PlatformOption = Annotated[float, typer.Option("--platform", metavar="MM", min=1.0, max=1e5, help="from the middle of the "
                                                 "platform to its joints")]
GoalOption = Annotated[Goal, word_option("--least", Goal, "what is to be least")]
MaxOption = Annotated[list[str] | None, typer.Option("--max", metavar="FIGURE=VALUE",
                                                     help="largest condition, bulk and width "
                                                     "(mm, larger and smaller extent across z, of the contracted model), "
                                                     "speed "
                                                     "or rod (mm)")]
MachineFile = Annotated[Path | None, typer.Option("-o", "--output", metavar="MACHINE.toml", help="machine file to write")]
AgainstOption = Annotated[Goal | None, word_option("--front", Goal, "also the machines of which none is better in both")]
FrontFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the front drawn, .png or .svg")]
ArmOption = Annotated[float | None, typer.Option("--arm", metavar="MM", min=1.0, max=1e5,
                                                 help="cranks: length of the arms that "
                                                  "are there; the cylinder's width follows from its height. Left out: "
                                                  "arms and "
                                                  "rods for the cylinder")]
CrankRodOption = Annotated[float | None, typer.Option("--rod", metavar="MM", min=1.0, max=1e5,
                                                      help="cranks: with --arm, length "
                                                       "of the rods that are there")]


def machine_design(layout: LayoutOption = "parallel-z", box: BoxSides = "500x500x400", platform: PlatformOption = 100.0,
                   goal: GoalOption = "condition", most: MaxOption = None, output: MachineFile = None,
                   against: AgainstOption = None, figure: FrontFigure = None, arm: ArmOption = None,
                   rod: CrankRodOption = None, json: Json = "") -> None:
    """Find places of slides (or arms) and rods for a box within limits, and write the machine file."""
    import numpy as np

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
    if layout == "rotary-delta":
        if given or against is not None or goal != "condition":
            raise typer.BadParameter("cranks are sized by the angle between rod and arm alone: leave --max, --least and "
                                     "--front "
                                     "out", param_hint="--layout")
        _cranks(sides, platform, arm, rod, output, json)
        return
    if arm is not None or rod is not None:
        raise typer.BadParameter("of --layout rotary-delta; longest rods are --max rod=VALUE", param_hint="--arm, --rod")
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.layouts.design import design, front_figure
        from machines.layouts.search import LayoutQuestion

        asked = LayoutQuestion(layout, sides, platform, goal, {key: given[key] for key in get_args(Goal) if key in given})
        found = design(asked, against)
    if figure is not None and ending is not None and against is not None:
        outputs[figure] = front_figure(asked, against, found.front, ending)
    _say(found.figures, found.text, output, outputs, json)


def _cranks(sides: Floats, platform: float, arm: float | None, rod: float | None, output: Path | None, json: str) -> None:
    """Sizing of V.6.2.1: arms and rods for a cylinder, or the cylinder of arms and rods."""
    if (arm is None) != (rod is None):
        raise typer.BadParameter("one without the other: give both, or neither", param_hint="--arm, --rod")
    if arm is None and sides[0] != sides[1]:
        raise typer.BadParameter(f"{sides[0]:g} x {sides[1]:g} mm: a cylinder is as wide as it is long", param_hint="--box")
    with shown_errors(json):
        from machines.layouts.cranks import crank_file, of_bars, of_cylinder

        found = of_cylinder(float(sides[0]), float(sides[2])) if arm is None or rod is None else of_bars(arm, rod,
                                                                                                         float(sides[2]))
        text = crank_file(found, platform)
    _say(found.figures, text, output, {}, json)


def _say(figures: dict[str, Any], text: str, output: Path | None, outputs: dict[Path, str | bytes], json: str) -> None:
    from postproc.cli.catalogue import analysis_text

    if output is not None:
        outputs[output] = text
    words = analysis_text({key: value for key, value in figures.items() if key != "front"})
    report((), json, figures, words if output is not None else f"{words}\n\n{text}", outputs)
