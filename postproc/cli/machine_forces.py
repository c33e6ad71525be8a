"""The commands `postproc machine forces`, what each motor gives in a motion of the tip at one place, and `machine star`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from postproc.cli.machine_study import TipTool
from postproc.cli.shared.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors

if TYPE_CHECKING:
    from toolpaths.arrays import Floats

FORCES = "Example: " \
         "postproc machine forces my.toml --tip 100,0,-250 --acceleration 2e4,0,0 --force 0,0,300"
TipOption = Annotated[str, typer.Option("--tip", metavar="X,Y,Z", help="where the tip is, mm; left out: at home")]
AxisOption = Annotated[str, typer.Option("--axis", metavar="I,J,K", help="tip to spindle; left out: as at home")]
SpeedOption = Annotated[str, typer.Option("--speed", metavar="X,Y,Z", help="of the tip on the part, mm/s")]
AccelerationOption = Annotated[str, typer.Option("--acceleration", metavar="X,Y,Z", help="of the tip on the part, mm/s2")]
PushOption = Annotated[str, typer.Option("--force", metavar="FX,FY,FZ", help="that pushes the tool, N")]


def machine_forces(name: Annotated[str, typer.Argument(help="name or TOML file")], tip: TipOption = "",
                   axis: AxisOption = "", speed: SpeedOption = "0,0,0", acceleration: AccelerationOption = "0,0,0",
                   force: PushOption = "0,0,0", tool: TipTool = 0.0, json: Json = "") -> None:
    """Forces of motors and in rods while the tip moves so, by parts: inertia, speed, gravity, force at the tip."""
    import numpy as np

    from postproc.cli.catalogue import analysis_text

    moved, faster, push = (vector(text, option) for text, option in (
        (speed, "--speed"), (acceleration, "--acceleration"), (force, "--force")))
    given = [vector(text, option) if text else None for text, option in ((tip, "--tip"), (axis, "--axis"))]
    if given[1] is not None and not given[1].any():
        raise typer.BadParameter("it has no direction: write 0,0,1", param_hint="--axis")
    refuse_overwriting({"--json": json}, own_files(name))
    with shown_errors(json):
        from machines.dynamics.report import MotionAsked, forces_at

        machine = machine_of(name)
        at, along = (v[0] for v in machine.kinematics.with_tool(tool).forward(machine.home[None]))
        along = along if given[1] is None else given[1] / np.linalg.norm(given[1])
        found = forces_at(machine, MotionAsked(at if given[0] is None else given[0], along, moved, faster, push, tool))
    report((), json, found, analysis_text(found))


def vector(text: str, option: str) -> Floats:
    """(3,) of "x,y,z".

    Raises:
        typer.BadParameter: where it is none.
    """
    import numpy as np

    try:
        found = np.array([float(v) for v in text.split(",")])
    except ValueError:
        found = np.zeros(0)
    if found.shape != (3,) or not (np.abs(found) < 1e9).all():
        raise typer.BadParameter(f"{text!r} is no vector: write X,Y,Z", param_hint=option)
    return found


STARS = "Example: " \
        "postproc machine star hexaslide-parallel-z hexaslide-cone --tool 100 --rod 1400 --rod 1500 --figure star.svg"
StarTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4, help="length of the tool")]
StarNames = Annotated[list[str], typer.Argument(help="names or TOML files of machines on legs")]
RodsOption = Annotated[list[float] | None, typer.Option("--rod", metavar="MM", min=1.0, max=1e5,
                                                        help="also with all rods of "
                                                         "that length, in place of their own; several times")]
RapidOption = Annotated[float, typer.Option("--rapid", metavar="MM/S", min=0.0, max=1e6, help="speed of the tip in rapids")]
CutOption = Annotated[float, typer.Option("--feed", metavar="MM/S", min=0.0, max=1e6, help="of the tip while cutting")]
TurnSpeed = Annotated[float, typer.Option("--turn", metavar="REV/MIN", min=0.0, max=1e4,
                                          help="of the spindle across its axis")]
StartOption = Annotated[float, typer.Option("--acceleration", metavar="MM/S2", min=0.0, max=1e7,
                                            help="of the tip in rapids")]
CuttingOption = Annotated[float, typer.Option("--cutting", metavar="N", min=0.0, max=1e7,
                                              help="each component of the cutting "
                                               "force across and along the spindle")]
DiameterOption = Annotated[float, typer.Option("--diameter", metavar="MM", min=0.0, max=1e4, help="of the tool, at whose "
                                               "circumference the force acts")]
PlatformMass = Annotated[float, typer.Option("--platform-mass", metavar="KG", min=0.0, max=1e6,
                                             help="at the reference point, "
                                             "with half of the rods")]
DriveMass = Annotated[float, typer.Option("--drive-mass", metavar="KG", min=0.0, max=1e6,
                                          help="of each drive, with half of its "
                                          "rods")]
StarCsv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the figures as a table")]
StarFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the diagram, .png or .svg")]


def machine_star(names: StarNames, tool: StarTool = 100.0, rod: RodsOption = None, rapid: RapidOption = 1250.0,
                 feed: CutOption = 833.333, turn: TurnSpeed = 40.0, acceleration: StartOption = 10000.0,
                 cutting: CuttingOption = 4500.0, diameter: DiameterOption = 20.0, platform_mass: PlatformMass = 250.0,
                 drive_mass: DriveMass = 210.0, csv: StarCsv = None, figure: StarFigure = None, json: Json = "") -> None:
    """Compare machines on legs by one task: speeds, forces and power of drives and rods, as a star diagram."""
    from math import pi

    from postproc.cli.catalogue import analysis_text
    from postproc.cli.shared.options import figure_ending

    ending = figure_ending(figure)
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json},
                       {key: value for name in names for key, value in own_files(name).items()})
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.analysis.star import MachiningTask, star_csv, star_figure, star_of

        lengths: list[float | None] = [*rod] if rod else [None]
        task = MachiningTask(rapid, feed, turn * 2.0 * pi / 60.0, acceleration, cutting, cutting, 0.5 * diameter, tool,
                             platform_mass, drive_mass)
        stars = [star_of(machine_of(name), task, length) for name in names for length in lengths]
    if csv is not None:
        outputs[csv] = star_csv(stars)
    if figure is not None and ending is not None:
        outputs[figure] = star_figure(stars, ending)
    found = {"tool_mm": tool, "of": "largest on a grid of the workspace; speeds and forces at the tip", "machines": [
        one.figures for one in stars]}
    report((), json, found, "\n\n".join(analysis_text(one.figures) for one in stars), outputs)
