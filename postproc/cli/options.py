"""Options and arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ClFile = Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")]
MachineName = Annotated[str, typer.Option("-m", "--machine", metavar="MACHINE",
                                         help="name from `postproc machine list`, or a TOML file")]
ToleranceOption = Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0,
                                                help="largest deviation of the tip")]
AxisToleranceOption = Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0,
                                               help="largest deviation of the tool axis")]
UnitsOption = Annotated[str, typer.Option("--units", metavar="{mm,inch}", help="units of a CL file that states none")]
DialectOption = Annotated[str, typer.Option("--dialect", metavar="NAME",
                                            help="read the CL file as this dialect instead of the recognised one: generic, "
                                            "nx, makino, creo, solidworks, solidworks-clt, catia, ncl, camplete, mfgsuite, "
                                            "autodesk-iso, hsmworks")]
ControllerName = Annotated[str, typer.Option("-c", "--controller", metavar="CONTROLLER",
                                             help="name from `postproc controller list`, or a TOML file")]
Beyond = Annotated[bool, typer.Option("--error-model-beyond", help="hold the end value outside the measured range")]
RequireProof = Annotated[bool, typer.Option("--require-proof", help="refuse a program in which the deviation of some "
                                            "block has no proved bound and is only sampled")]
ProofOption = Annotated[bool, typer.Option("--proof",
                                           help="write what was proved, and the hashes of all files that it rests on, "
                                           "next to the program: OUT.proof.json")]
ProofOf = Annotated[str, typer.Option("--proof", metavar="FILE", help="report what has changed since this proof was "
                                      "written; default: GCODE.proof.json, where it is there")]
Allow = Annotated[list[str] | None, typer.Option("--allow-unknown", metavar="WORD",
                                                 help="leave records with this word out instead of refusing them; may be "
                                                 "repeated")]


def figure_ending(figure: Path | None) -> str:
    """Ending of the file of --figure, "" without one; wrong use where nothing can be drawn with it."""
    if figure is None:
        return ""
    from toolpaths.drawing import FORMATS

    ending = figure.suffix.lower()
    if ending not in FORMATS:
        raise typer.BadParameter(f"{figure.name} is not a .png or .svg file", param_hint="--figure")
    return ending


def only_with_errors(beyond: bool, error_model: str) -> None:
    """Wrong use of --error-model-beyond without an error model."""
    if beyond and not error_model:
        raise typer.BadParameter("it needs --error-model", param_hint="--error-model-beyond")
