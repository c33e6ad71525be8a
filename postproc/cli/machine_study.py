"""Commands that study a machine: `postproc machine analyse`, `certify`, `tolerance`, `stiffness`, `design`.

Heavy packages are imported inside.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from machines.analysis.choices import MapMeasure, MapNumber
from machines.layouts.choices import Goal, SlideLayout
from postproc.cli.shared.console import Json, machine_of, own_files, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending, word_option

if TYPE_CHECKING:
    from machines.machine import Machine
    from toolpaths.arrays import Floats
    from toolpaths.choices import FigureEnding
    from toolpaths.diagnostics import Diagnostic

ANALYSED = "Examples: postproc machine analyse uranesx --json -; " \
           "postproc machine analyse uranesx --map condition --along x --along y --at z=-100 --figure map.svg --csv map.csv"
SingularOption = Annotated[float | None, typer.Option("--singular-above", metavar="MM", min=0.0, max=1e6,
                                                      help="prove by a grid that the singular values of a linear Delta with "
                                                      "slides along z stay above this")]
MapOption = Annotated[MapMeasure | None, word_option("--map", MapMeasure, "measure of a map or a curve")]
AlongOption = Annotated[list[str] | None, typer.Option("--along", metavar="x|y|z|tilt", help="with --map: once a curve, "
                                                       "twice a slice; left out: x and y")]
AtOption = Annotated[list[str] | None, typer.Option("--at", metavar="x|y|z|tilt=VALUE", help="with --map: the others, mm or "
                                                    "degrees; left out: the middle of the workspace")]
MapCsv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the map or curve as a table")]
MapFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the same drawn, .png or .svg; "
                                                      "without --map the condition number")]


def machine_analyse(name: Annotated[str, typer.Argument(help="name or TOML file")], singular_above: SingularOption = None,
                    measure: MapOption = None, along: AlongOption = None, at: AtOption = None, csv: MapCsv = None,
                    figure: MapFigure = None, json: Json = "") -> None:
    """Condition number, transmission of speed and force over the workspace, reachable box and what ends it."""
    from postproc.cli.catalogue import analysis_text

    ending = figure_ending(figure)
    if measure is None and (along or at or csv):
        _along(along), _fixed(at)
        raise typer.BadParameter(f"this is of a map or curve; write --map with one of {', '.join(get_args(MapMeasure))} too",
                                 param_hint="--along" if along else "--at" if at else "--csv")
    refuse_overwriting({"--csv": str(csv or ""), "--figure": str(figure or ""), "--json": json}, own_files(name))
    outputs: dict[Path, str | bytes] = {}
    if measure is None:
        from machines.analysis.report import analyse

        with shown_errors(json):
            machine = machine_of(name)
            found = analyse(machine, singular_above)
            if figure is not None and ending is not None:
                outputs[figure] = _condition_figure(machine, ending)
        report((), json, found, analysis_text(found), outputs)
        return
    places, fixed = _along(along), _fixed(at)
    with shown_errors(json):
        from machines.analysis.maps import map_figure, measured

        values = measured(machine_of(name), measure, places, fixed)
    if csv is not None:
        outputs[csv] = values.csv
    if figure is not None and ending is not None:
        outputs[figure] = map_figure(values, ending)
    figures = values.figures
    report((), json, figures, analysis_text(figures), outputs)


def _condition_figure(machine: Machine, ending: FigureEnding) -> bytes:
    """What stands first in the analysis, drawn: the condition number over x and y, of a chain over its rotary axes."""
    from machines.analysis.chain_map import chain_map_figure
    from machines.analysis.maps import map_figure, measured
    from toolpaths.diagnostics import DiagnosticError, error

    if machine.kinematics.transmits is not None:
        return map_figure(measured(machine, "condition", ("x", "y"), {}), ending)
    if not any(machine.rotary):
        raise DiagnosticError([error("analysis.map", f"{machine.name} has slides alone: its condition number is 1 "
                                     "everywhere, there is nothing to draw", file=machine.file, hint="leave --figure out")])
    return chain_map_figure(machine, ending)


def _along(given: list[str] | None) -> tuple[MapNumber, ...]:
    known: dict[str, MapNumber] = {name: name for name in get_args(MapNumber)}
    names = given or ["x", "y"]
    if len(names) > 2 or len(set(names)) < len(names) or not set(names) <= set(known):
        raise typer.BadParameter(f"{' '.join(names)}: write one or two of {', '.join(known)}", param_hint="--along")
    return tuple(known[name] for name in names)


def _fixed(given: list[str] | None) -> dict[MapNumber, float]:
    found: dict[MapNumber, float] = {}
    for text in given or ():
        name, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        key: MapNumber | None = next((one for one in get_args(MapNumber) if one == name), None)
        if key is None or key in found or not abs(value) < 1e9:
            raise typer.BadParameter(f"{text!r}: write x, y, z or tilt, = and a number, each once", param_hint="--at")
        found[key] = value
    return found


CERTIFIED = "Examples: postproc machine certify uranesx -o uranesx.certificate.json; " \
           "postproc machine certify --check uranesx.certificate.json"
Name = Annotated[str, typer.Argument(metavar="[NAME]", help="name or TOML file; with --check left out: that of the file")]
CertificateFile = Annotated[Path | None, typer.Option("-o", "--output", metavar="CERT.json", help="certificate to write")]
CheckFile = Annotated[Path | None, typer.Option("--check", metavar="CERT.json", help="check a certificate instead")]
BoxOption = Annotated[str, typer.Option("--box", metavar="BOX", help="of the tip, mm: 500x500x400 in the middle of the "
                                        "workspace or -250:250,-250:250,-200:200; left out: the declared workspace of the "
                                        "platform")]
BoxTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4,
                                          help="length of the tool, with --box")]
MarginOption = Annotated[float | None, typer.Option("--margin", metavar="SHARE", min=1e-6, max=1.0, help=(
    "distance from singular positions, no unit; left out: half of the least that random poses have"))]
TravelOption = Annotated[bool | None, typer.Option("--travel/--no-travel", help="whether drives must be inside their "
                                                   "travel; left out: only where they are everywhere")]
BoxesFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="boxes in two planes, .png or .svg")]


def machine_certify(name: Name = "", output: CertificateFile = None, check: CheckFile = None, box: BoxOption = "",
                    tool: BoxTool = 0.0, margin: MarginOption = None, travel: TravelOption = None,
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


TOLERATED = "Example: postproc machine tolerance uranesx --tool 120 --error 0.02 --cost guide=3 --csv uranesx.csv"
TipTool = Annotated[float, typer.Option("--tool", metavar="MM", min=0.0, max=1e4,
                                          help="length of the tool whose tip is meant")]
AdjustOption = Annotated[bool, typer.Option("--adjust", help="once the rods' lengths are set so that the middle of the "
                                            "workspace is exact")]
SpreadOption = Annotated[float, typer.Option("--spread", metavar="UM", min=1e-6, max=1e6,
                                              help="errors by chance, micrometres; "
                                             "microradians of guides")]
SamplesOption = Annotated[int, typer.Option("--samples", metavar="N", min=1, max=1_000_000, help="of errors by chance")]
ErrorOption = Annotated[float | None, typer.Option("--error", metavar="MM", min=1e-9, max=1e3,
                                                   help="budget: error of the tip that "
                                                   "the tolerances have to keep together")]
CostOption = Annotated[list[str] | None, typer.Option("--cost", metavar="PART=COST", help="budget: cost of a tolerance of "
                                                      "drive, guide, foot, joint or rod against the others, else 1")]
CsvFile = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="the table by dimension")]
BarsFigure = Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="influence of each point, .png or .svg")]


def machine_tolerance(name: Annotated[str, typer.Argument(help="name or TOML file")], tool: TipTool = 0.0,
                      adjust: AdjustOption = False, spread: SpreadOption = 1.0, samples: SamplesOption = 1000,
                      allowed: ErrorOption = None, cost: CostOption = None, csv: CsvFile = None, figure: BarsFigure = None,
                      json: Json = "") -> None:
    """Influence of every dimension of a machine on legs on its tool, by place and by chance; tolerance budget."""
    from machines.tolerances.sensitivity import DimensionPart
    from postproc.cli.error_files import pairs

    ending = figure_ending(figure)
    prices = pairs("--cost", cost, get_args(DimensionPart))
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
            part: prices[part] for part in get_args(DimensionPart) if part in prices}))
    if csv is not None:
        outputs[csv] = found.csv
    if figure is not None and ending is not None:
        outputs[figure] = tolerance_figure(machine, found, ending)
    from postproc.cli.catalogue import analysis_text

    rest = {key: value for key, value in found.figures.items() if key not in ("dimensions", "points", "of")}
    report((), json, found.figures, f"{found.text}\n{analysis_text(rest)}", outputs)


STIFF = "Example: postproc machine stiffness uranesx --rod 100 --joint 150 --drive 80 --tool 120 --force 300,0,-500"
RodOption = Annotated[float, typer.Option("--rod", metavar="N/UM", min=1e-9, max=1e9,
                                            help="stiffness of a rod's body along it")]
JointOption = Annotated[float | None, typer.Option("--joint", metavar="N/UM", min=1e-9, max=1e9,
                                                     help="of each joint along the rod; "
                                                   "left out: it does not yield")]
DriveOption = Annotated[float | None, typer.Option("--drive", metavar="N/UM", min=1e-9, max=1e9,
                                                     help="of a drive along its motion; "
                                                   "left out: it does not yield")]
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
