"""`postproc machine certify`: a workspace proved, and the proof checked by code that shares nothing with what found it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.options import figure_ending

if TYPE_CHECKING:
    from machines.machine import Machine
    from toolpaths.arrays import Floats
    from toolpaths.diagnostics import Diagnostic

EXAMPLES = "Examples: postproc machine certify uranesx -o uranesx.certificate.json; " \
           "postproc machine certify --check uranesx.certificate.json"
Name = Annotated[str, typer.Argument(metavar="[NAME]", help="name or TOML file; with --check left out: that of the file")]
CertificateFile = Annotated[Path | None, typer.Option("-o", "--output", metavar="CERT.json", help="certificate to write")]
CheckFile = Annotated[Path | None, typer.Option("--check", metavar="CERT.json", help="check a certificate instead")]
BoxOption = Annotated[str, typer.Option("--box", metavar="BOX", help="of the tip, mm: 500x500x400 in the middle of the "
                                        "workspace or -250:250,-250:250,-200:200; left out: the declared workspace of the "
                                        "platform")]
ToolOption = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, help="length of the tool, with --box")]
MarginOption = Annotated[float | None, typer.Option("--margin", min=1e-6, max=1.0, help="distance from singular positions, "
                                                    "no unit; left out: half of the least that random poses have")]
TravelOption = Annotated[bool | None, typer.Option("--travel/--no-travel", help="whether drives must be inside their "
                                                   "travel; left out: only where they are everywhere")]
BoxesFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="boxes in two planes, .png or .svg")]


def machine_certify(name: Name = "", output: CertificateFile = None, check: CheckFile = None, box: BoxOption = "",
                    tool: ToolOption = 0.0, margin: MarginOption = None, travel: TravelOption = None,
                    figure: BoxesFigure = None, json: Json = "") -> None:
    """Prove that a machine on legs reaches its workspace, or a box, and is nowhere near a singular position."""
    if check is not None:
        _check(name, check, json, bool(output or box or figure or margin is not None or travel is not None))
        return
    if not name:
        raise typer.BadParameter("a machine, or --check CERT.json, is missing", param_hint="NAME")
    if tool and not box:
        raise typer.BadParameter("the length of a tool matters to a box of tips: give --box", param_hint="--tool")
    ending = figure_ending(figure)
    refuse_overwriting({"-o": str(output or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.analysis.certify import Wanted, certify

        machine = machine_of(name)
        found = certify(machine, Wanted(box_of(machine, box, tool) if box else None, tool, margin, travel))
    if output is not None:
        outputs[output] = found.text
    if figure is not None and ending is not None:
        from json import loads

        from machines.analysis.certificate_figure import certificate_figure

        outputs[figure] = certificate_figure(loads(found.text), ending)
    from postproc.cli.catalogue import analysis_text

    report((), json, found.figures, analysis_text(found.figures), outputs)


def box_of(machine: Machine, text: str, tool: float) -> tuple[Floats, Floats]:
    """(lower, upper), each (3,) mm, of --box; wrong use where it is none."""
    import numpy as np

    wrong = typer.BadParameter(f"{text!r} is no box: write 500x500x400, or -250:250,-250:250,-200:200", param_hint="--box")
    try:
        if ":" in text:
            ends = np.array([[float(v) for v in side.split(":")] for side in text.split(",")])
        else:
            size = np.array([float(v) for v in text.split("x")])
            legs = machine.kinematics.leg_geometry
            middle = np.zeros(3) if legs is None else legs.workspace.middle + legs.gauge - [0.0, 0.0, tool]
            ends = np.stack([middle - 0.5 * size, middle + 0.5 * size], axis=1)
    except ValueError:
        raise wrong from None
    if ends.shape != (3, 2) or not np.isfinite(ends).all() or not (ends[:, 0] <= ends[:, 1]).all():
        raise wrong
    return ends[:, 0], ends[:, 1]


def _check(name: str, file: Path, json: str, more: bool) -> None:
    if more:
        raise typer.BadParameter("a certificate is checked as it is: leave the other options out", param_hint="--check")
    refuse_overwriting({"--json": json}, {"the certificate": str(file)} | own_files(name))
    figures: dict[str, Any] = {}
    found: list[Diagnostic] = []
    with shown_errors(json):
        from postproc.certificate_check.run import checked

        figures, found = checked(file, name)
    from postproc.cli.catalogue import analysis_text

    report(tuple(found), json, figures | {"diagnostics": [d.as_dict() for d in found]}, analysis_text(figures))
