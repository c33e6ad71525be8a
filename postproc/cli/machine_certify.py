"""The command `postproc machine certify`: workspaces and boxes proved, certificates checked.

Heavy packages are imported inside.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.shared.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending

if TYPE_CHECKING:
    from machines.analysis.certify import Certified
    from machines.analysis.certify_chain import CertifiedChain
    from machines.machine import Machine
    from toolpaths.arrays import Floats
    from toolpaths.diagnostics import Diagnostic

CERTIFIED = "Examples: postproc machine certify uranesx -o uranesx.certificate.json; " \
           "postproc machine certify mikron-ucp710 --tool 120 --turn A=-30:60; " \
           "postproc machine certify --check uranesx.certificate.json"
Name = Annotated[str, typer.Argument(metavar="[NAME]", help="name or TOML file; with --check left out: that of the file")]
CertificateFile = Annotated[Path | None, typer.Option("-o", "--output", metavar="CERT.json", help="certificate to write")]
CheckFile = Annotated[Path | None, typer.Option("--check", metavar="CERT.json", help="check a certificate instead")]
BoxOption = Annotated[str, typer.Option("--box", metavar="BOX", help="of the tip, mm: 500x500x400 in the middle of the "
                                        "workspace (of a chain: where it has most room) or -250:250,-250:250,-200:200; left "
                                        "out: the declared workspace of the platform, of a chain the largest cube")]
BoxTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4,
                                          help="length of the tool; of a machine on legs with --box")]
MarginOption = Annotated[float | None, typer.Option("--margin", metavar="SHARE", min=1e-6, max=1.0, help=(
    "distance from singular positions, no unit; left out: half of the least that random poses have, of a chain none where "
    "it "
    "is singular inside"))]
ClearanceOption = Annotated[bool | None, typer.Option("--clearance/--no-clearance", help="whether rods, spindle and slides "
                                                      "must clear each other and joints their stops; left out: only where "
                                                      "they do everywhere")]
TurnOption = Annotated[list[str] | None, typer.Option("--turn", metavar="LETTER=LOW:HIGH",
                                                      help="of a chain of axes: degrees "
                                                      "of a rotary axis; left out: its travel, or the part of it at which a "
                                                      "box is in reach")]
TravelOption = Annotated[bool | None, typer.Option("--travel/--no-travel", help="whether drives must be inside their "
                                                   "travel; left out: only where they are everywhere")]
BoxesFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="boxes in two planes, .png or .svg")]


def machine_certify(name: Name = "", output: CertificateFile = None, check: CheckFile = None, box: BoxOption = "",
                    tool: BoxTool = 0.0, margin: MarginOption = None, travel: TravelOption = None,
                    clearance: ClearanceOption = None, turn: TurnOption = None, figure: BoxesFigure = None,
                    json: Json = "") -> None:
    """Prove that a machine reaches its workspace, or a box, far from singular positions, no parts touching."""
    if check is not None:
        given = (output, box, turn, figure, margin, travel, clearance)
        _check(name, check, json, any(one is not None and one != "" for one in given))
        return
    if not name:
        raise typer.BadParameter("a machine, or --check CERT.json, is missing", param_hint="NAME")
    ending = figure_ending(figure)
    refuse_overwriting({"-o": str(output or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        machine = machine_of(name)
        found: CertifiedChain | Certified
        if machine.kinematics.chain:
            found = _chain_certified(machine, box, tool, margin, turn, travel, clearance)
        else:
            found = _legs_certified(machine, box, tool, margin, turn, travel, clearance)
    if output is not None:
        outputs[output] = found.text
    if figure is not None and ending is not None:
        from json import loads

        from machines.analysis.certificate_figure import certificate_figure

        outputs[figure] = certificate_figure(loads(found.text), ending)
    from postproc.cli.catalogue import analysis_text

    report((), json, found.figures, analysis_text(found.figures), outputs)


def _legs_certified(machine: Machine, box: str, tool: float, margin: float | None, turn: list[str] | None,
                    travel: bool | None, clearance: bool | None) -> Certified:
    from machines.analysis.certify import Wanted, certify

    if turn:
        raise typer.BadParameter(f"{machine.name} is no chain of axes: its poses are those of the workspace or the --box",
                                 param_hint="--turn")
    if tool and not box:
        raise typer.BadParameter("the length of a tool matters to a box of tips: give --box", param_hint="--tool")
    return certify(machine, Wanted(box_of(machine, box, tool) if box else None, tool, margin, travel, clearance))


def _chain_certified(machine: Machine, box: str, tool: float, margin: float | None, turn: list[str] | None,
                     travel: bool | None, clearance: bool | None) -> CertifiedChain:
    from machines.analysis.certify_chain import WantedOfChain, certify_chain

    for option, value in (("--travel", travel), ("--clearance", clearance)):
        if value is not None:
            raise typer.BadParameter(f"of a chain of axes the travel is what is proved, and it states no parts: leave "
                                     f"{option} "
                                     "out", param_hint=option)
    ends, size = None, None
    if box:
        low, high = box_of(machine, box, tool)
        ends, size = ((low, high), None) if ":" in box else (None, high - low)
    return certify_chain(machine, WantedOfChain(ends, size, tool, _ranges(machine, turn), margin))


def _ranges(machine: Machine, given: list[str] | None) -> dict[str, tuple[float, float]]:
    """rad, of --turn A=-30:30; wrong use where it is none."""
    from toolpaths.units import DEG

    letters = [letter for letter, turns in zip(machine.axis_names, machine.rotary, strict=True) if turns]
    found: dict[str, tuple[float, float]] = {}
    for text in given or ():
        name, _, ends = text.partition("=")
        try:
            low, high = (float(v) for v in ends.split(":"))
        except ValueError:
            low, high = 1.0, 0.0
        if name not in letters or name in found or not -1e6 < low <= high < 1e6 or high - low > 360.0:
            raise typer.BadParameter(f"{text!r}: write {', '.join(letters) or 'no axis: there is no rotary one'}, =, and "
                                     "two "
                                     "angles with : between them, at most a turn apart, each axis once", param_hint="--turn")
        found[name] = low * DEG, high * DEG
    return found


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
