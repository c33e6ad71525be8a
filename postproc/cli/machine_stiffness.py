"""`postproc machine stiffness`: how far the tool of a machine on legs yields, and what its rods and drives carry."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from postproc.cli.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.options import figure_ending

EXAMPLES = "Example: postproc machine stiffness uranesx --rod 100 --joint 150 --drive 80 --tool 120 --force 300,0,-500"
RodOption = Annotated[float, typer.Option("--rod", metavar="N/UM", min=1e-9, help="stiffness of a rod's body along it")]
JointOption = Annotated[float | None, typer.Option("--joint", metavar="N/UM", min=1e-9, help="of each joint along the rod; "
                                                   "left out: it does not yield")]
DriveOption = Annotated[float | None, typer.Option("--drive", metavar="N/UM", min=1e-9, help="of a drive along its motion; "
                                                   "left out: it does not yield")]
TipTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, help="length of the tool")]
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
