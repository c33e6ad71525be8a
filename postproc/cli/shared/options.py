"""Options and arguments that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

from postproc.base.options import Orientation
from toolpaths.choices import FigureEnding, GivenDialect, GivenUnit

_LONGEST = 72
"""characters of an option with its choices that stand on one line of 80 columns"""


def _of_packages() -> tuple[str, ...]:
    """Dialects of installed packages."""
    from toolpaths.cl.systems.shop_forms import shop_names

    return shop_names()


def word_option(option: str, words: Any, said: str, *others: str, more: Callable[[], Iterable[str]] = tuple) -> Any:
    """An option that takes one of the values of a Literal; another is wrong use, and help shows the values: as choices,
    or in its text where a narrow terminal would break them. `others` are further names of it; `more` gives further values,
    asked for where it is none of these."""
    known = {str(word): word for word in get_args(words)}
    shown = [word for word in known if word]

    def taken(value: object) -> Any:
        if str(value) in known:
            return known[str(value)]
        if str(value) in (further := tuple(more())):
            return str(value)
        raise typer.BadParameter(f"{value!r} is not available; choose from {', '.join([*shown, *further])}",
                                 param_hint=option)

    choices = f"{{{','.join(shown)}}}"
    if len(option) + len(choices) > _LONGEST:
        return typer.Option(option, *others, parser=taken, metavar=option.strip("-").upper(),
                            help=f"{said}: {', '.join(shown)}")
    return typer.Option(option, parser=taken, metavar=choices, help=said)


ClFile = Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")]
def _hold_blocks(context: typer.Context, value: int | None) -> None:
    """The number of blocks that was asked for, while the command runs."""
    if value is not None:
        from postproc.readback.macros.held import most_blocks

        context.with_resource(most_blocks(value))


MaxBlocks = Annotated[int | None, typer.Option("--max-blocks", metavar="N", min=1, max=1_000_000_000,
                                               callback=lambda context, value: _hold_blocks(context, value),
                                               help="blocks of a program with macros that are executed before it "
                                               "counts as endless (default 1000000)")]


def _names(start: str, *folders: str) -> list[str]:
    """Built-in names of some folders and TOML files of the present one that begin so, for completion in a shell."""
    here = Path(__file__).parents[3]
    known = [file for folder in folders for file in (here / folder).glob("*.toml")]
    return sorted([one.stem for one in known if one.stem.startswith(start)] + [str(one) for one in Path().glob(
        "*.toml") if str(one).startswith(start)])


def _machines(incomplete: str) -> list[str]:
    return _names(incomplete, "machines/data", "machines/catalogue")


def _controllers(incomplete: str) -> list[str]:
    return _names(incomplete, "postproc/controllers")


MachineName = Annotated[str, typer.Option("-m", "--machine", metavar="MACHINE", autocompletion=_machines,
                                         help="name from `postproc machine list`, or a TOML file")]
ToleranceOption = Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0,
                                                help="largest deviation of the tip")]
AxisToleranceOption = Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0,
                                               help="largest deviation of the tool axis")]
UnitsOption = Annotated[GivenUnit, word_option("--units", GivenUnit, "units of a CL file that states none")]
DialectOption = Annotated[GivenDialect, word_option(
    "--dialect", GivenDialect, "read the CL file as this dialect instead of the recognised one (--axis-from tlaxis: "
    "a .clt that lacks the ROTABL which turn its frame back); also one of an installed package", "--axis-from",
    more=_of_packages)]
HooksFile = Annotated[str, typer.Option("--hooks", metavar="FILE", help="TOML file whose [hooks] are blocks of the shop; "
                                        "those of the set-up go before them")]
ControllerName = Annotated[str, typer.Option("-c", "--controller", metavar="CONTROLLER", autocompletion=_controllers,
                                             help="name from `postproc controller list`, or a TOML file")]
MaxTilt = Annotated[float, typer.Option("--max-tilt", metavar="DEG", min=0.0, max=120.0, help="largest angle of "
                                        "a chosen axis to the surface normal, else to the programmed axis")]
Orient = Annotated[Orientation, word_option("--orient", Orientation, "keep: the tool axes of the CL file; per-pass, "
                                            "whole-part, auto: turned for the least planned time (3+2 passes of ball "
                                            "cutters)")]
Beyond = Annotated[bool, typer.Option("--error-model-beyond", help="hold the end value outside the measured range")]
RequireProof = Annotated[bool, typer.Option("--require-proof", help="refuse a program in which the deviation of some "
                                            "block has no proved bound and is only sampled, or whose clamps or "
                                            "turns of modulo axes are read back alone")]
ProofOption = Annotated[bool, typer.Option("--proof",
                                           help="write what was proved, and the hashes of all files that it rests on, "
                                           "next to the program: OUT.proof.json")]
ProofOf = Annotated[str, typer.Option("--proof", metavar="FILE", help="report what has changed since this proof was "
                                      "written; default: GCODE.proof.json, where it is there")]
Allow = Annotated[list[str] | None, typer.Option("--allow-unknown", metavar="WORD",
                                                 help="leave records with this word out where nothing carries them out, "
                                                 "take them as they stand where only their form is refused; may be "
                                                 "repeated")]


def figure_ending(figure: Path | None) -> FigureEnding | None:
    """Ending of the file of --figure, None without one; wrong use where nothing can be drawn with it."""
    if figure is None:
        return None
    ending: FigureEnding = ending_of(figure, FigureEnding, "--figure", "is not a .png or .svg file")
    return ending


def ending_of(file: Path, endings: Any, option: str, wrong: str) -> Any:
    """The ending of a file as a value of a Literal; wrong use of `option` where it is none.

    Raises:
        DiagnosticError: where what draws is not installed: said before anything is computed.
    """
    ending = file.suffix.lower()
    if ending not in get_args(endings):
        raise typer.BadParameter(f"{file.name} {wrong}", param_hint=option)
    if ending in get_args(FigureEnding):
        from toolpaths.extras import need

        need("matplotlib", "drawings need")
    return ending

SearchWorkers = Annotated[int, typer.Option("-j", "--workers", metavar="N", min=0, max=1024, help="processes that search; "
                                            "default: as many as there are cores")]
SchedulerOption = Annotated[str, typer.Option("--scheduler", metavar="ADDRESS", help="search on the cluster of this Dask "
                                              "scheduler (tcp://HOST:8786)")]
ModelOfControl = Annotated[str, typer.Option("--model", metavar="MODEL", help="cycle-time model of the control that choices "
                                             "and times go by: a name, or a file of time --calibrate; default: the "
                                             "controller's")]


def only_with_errors(beyond: bool, error_model: str) -> None:
    """Wrong use of --error-model-beyond without an error model."""
    if beyond and not error_model:
        raise typer.BadParameter("it needs --error-model", param_hint="--error-model-beyond")
