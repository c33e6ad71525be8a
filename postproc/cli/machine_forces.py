"""The command `postproc machine forces`: what each motor gives in a motion of the tip at one place."""

from __future__ import annotations

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
