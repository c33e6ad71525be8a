"""Options and arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ClFile = Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")]
MachineName = Annotated[str, typer.Option("-m", "--machine", help="machine: a name from the list, or a TOML file")]
ToleranceOption = Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0,
                                                help="tolerance of the tip")]
AxisToleranceOption = Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0,
                                               help="tolerance of the axis")]
UnitsOption = Annotated[str, typer.Option("--units", help="units of a CL file that states none: mm or inch")]
DialectOption = Annotated[str, typer.Option("--dialect",
                                            help="read the CL file as this dialect instead of the recognised one")]
Beyond = Annotated[bool, typer.Option("--error-model-beyond", help="outside the range that was measured, take the error at "
                                      "its end")]
RequireProof = Annotated[bool, typer.Option("--require-proof", help="refuse a program where some block has no bound of its "
                                            "deviation and is only checked at places")]
ProofOption = Annotated[bool, typer.Option("--proof",
                                           help="write what was proved, and the hashes of all files that it rests on, "
                                           "next to the program: OUT.proof.json")]
ProofOf = Annotated[str, typer.Option("--proof", metavar="FILE", help="name what has changed since this proof was written; "
                                      "default: GCODE.proof.json, where it is there")]
Allow = Annotated[list[str] | None, typer.Option("--allow-unknown", metavar="WORD",
                                                 help="leave this word out although it looks like motion")]


def figure_ending(figure: Path | None) -> str:
    """Ending of the file of --figure, "" without one; wrong use where nothing can be drawn with it."""
    if figure is None:
        return ""
    from toolpaths.drawing import FORMATS

    ending = figure.suffix.lower()
    if ending not in FORMATS:
        raise typer.BadParameter(f"{figure.name} is no .png or .svg file", param_hint="--figure")
    return ending


def only_with_errors(beyond: bool, error_model: str) -> None:
    """Wrong use of --error-model-beyond without an error model."""
    if beyond and not error_model:
        raise typer.BadParameter("there is no range without --error-model", param_hint="--error-model-beyond")
