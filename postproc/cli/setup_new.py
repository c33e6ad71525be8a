"""The command `postproc setup new`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.shared.console import (
    Json,
    machine_of,
    own_files,
    progress_bar,
    read_cl,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    ClFile,
    DialectOption,
    MachineName,
    ToleranceOption,
    UnitsOption,
)
from postproc.cli.shared.says import SAYS, answer_line

if TYPE_CHECKING:
    from postproc.base.options import Options
    from postproc.setup_sheet.make import SetupSheet
    from postproc.setup_sheet.place import FoundPlace
    from postproc.setup_sheet.questions import GivenAnswers, Question

EXAMPLES = """Example: postproc setup new part.cls -m mikron-ucp710 -c fanuc-30i -o part.setup.toml

It asks for what neither the CL file nor the machine states; options answer before it asks; --yes writes assumed
values and marks them. The place of the part is one that travel allows, and the set-up is written where the conversion
with it is proved."""
_ALL_TOOLS = "of tool N, or without N= of all tools; may be repeated"


def setup_new(file: ClFile, machine: MachineName,
              output: Annotated[Path, typer.Option("-o", "--output", metavar="S.toml", help="set-up file to write")],
              controller: Annotated[str, typer.Option("-c", "--controller", metavar="CONTROLLER",
                                                      help="controller for which it is proved")] = "linuxcnc",
              yes: Annotated[bool, typer.Option("--yes", help="ask nothing: write assumed values, marked so")] = False,
              force: Annotated[bool, typer.Option("--force", help="replace a file that there is already")] = False,
              gauge_length: Annotated[list[str] | None, typer.Option("--gauge-length", metavar="[N=]MM",
                                                                     help=f"gauge length {_ALL_TOOLS}")] = None,
              spindle: Annotated[list[str] | None, typer.Option("--spindle", metavar="[N=]RPM", help="spindle speed where "
                                                                f"the CL file states none, {_ALL_TOOLS}")] = None,
              tool_number: Annotated[list[str] | None, typer.Option("--tool-number", metavar="NAME=N", help="number in the "
                                                                    "magazine of a tool to which the CL file gives "
                                                                    "none; may be repeated")] = None,
              feed: Annotated[float | None, typer.Option("--feed", metavar="MM/MIN", min=0.001, max=2e5,
                                                         help="feed of cuts for which the CL file states none")] = None,
              coolant: Annotated[str, typer.Option("--coolant", metavar="KIND", help="where the CL file states none: off, "
                                                   "flood, mist, through, air")] = "",
              origin: Annotated[str, typer.Option("--origin", metavar="X,Y,Z", help="mm, where the origin of the CL file "
                                                  "stands in the table frame; default: a place that fits")] = "",
              work_offset_code: Annotated[str, typer.Option("--work-offset-code", metavar="CODE", help="register of the "
                                                            "work offset, as the control names it")] = "G54",
              tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
              units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None, json: Json = "") -> None:
    """Write the set-up of a CL file: what the files state, what is asked for, a place that fits; proved."""
    from postproc.base.options import Options
    from toolpaths.input_files import there_is

    refuse_overwriting({"-o": str(output), "--json": json}, {"the CL file": str(file), **own_files(machine, controller)})
    if there_is(output) and not force:
        raise typer.BadParameter(f"{output} exists; --force replaces it", param_hint="-o")
    given = _given(gauge_length or [], spindle or [], feed, coolant, tool_number or [], origin)
    _known_register(work_offset_code)
    options = Options(tolerance, axis_tolerance, units=units, dialect=dialect,
                      allow_unknown=tuple(w.upper() for w in allow_unknown or ()))
    values: dict[str, Any] = {}
    with shown_errors(json), progress_bar() as progress:
        sheet, options, asked = _made(file, machine, controller, options, given, yes, work_offset_code, progress)
    text = ""
    outputs: dict[Path, str | bytes] = {}
    if sheet.text and sheet.fit is not None:
        outputs[output] = sheet.text
        text = _text(sheet, sheet.fit.place, output, file, machine, controller, options, asked)
    values = _values(sheet, output, asked)
    report(sheet.diagnostics, json, values, text, outputs)


def _made(file: Path, machine: str, controller: str, options: Options, given: GivenAnswers, yes: bool, code: str,
          progress: Any) -> tuple[SetupSheet, Options, int]:
    """The sheet, the options with the units that were answered, and how many questions were asked."""
    from dataclasses import replace

    from postproc.setup_sheet.make import new_setup
    from postproc.setup_sheet.questions import units_question
    from toolpaths.diagnostics import Severity, has_errors

    asked, m = _Asking(), machine_of(machine)
    path, found = read_cl(file, options)
    try:
        if not yes and _terminal() and not has_errors(found) and any(
                d.code == "cl.no-units" and d.severity is Severity.WARNING for d in found):
            options = replace(options, units="inch" if asked(units_question(path.units)) == "inch" else "mm")
            path, found = read_cl(file, options)
        sheet = new_setup(path, m, controller, options, given, None if yes else asked, yes, found, code, progress)
    except KeyboardInterrupt:
        SAYS.interrupted = asked.to_go_on()
        raise
    except EOFError:
        ended = replace(asked.added(given), complete=True)
        sheet = new_setup(path, m, controller, options, ended, None, False, found, code, progress)
    return sheet, options, len(asked.done)


class _Asking:
    """Asks on the terminal until an answer fits; the last gauge length and speed are offered for the next tool."""

    def __init__(self) -> None:
        self.last: dict[str, float | str] = {}
        self.done: list[tuple[Question, float | str]] = []

    def __call__(self, question: Question) -> float | str:
        from dataclasses import replace

        from postproc.setup_sheet.questions import parsed

        if question.kind == "origin" and not _terminal():
            return ""  # answers that come from a file end with the values; --origin states the place
        one = question if question.default is not None else replace(question, default=self.last.get(question.kind))
        while True:
            value, wrong = parsed(one, answer_line(one.prompt()))
            if value is not None and not wrong:
                self.last[question.kind] = value
                self.done.append((question, value))
                return value
            typer.echo(wrong, err=True)

    def to_go_on(self) -> str:
        """What is said of an interruption: the options that hold what was answered; "" where nothing was."""
        options = " ".join(question.answered_by(value) for question, value in self.done if value != "")
        return f"interrupted; nothing was written; the same command with these options goes on from there: {options}" \
            if options else ""

    def added(self, given: GivenAnswers) -> GivenAnswers:
        """The options of the command line with what was answered before standard input ended."""
        from dataclasses import replace

        from postproc.setup_sheet.questions import three_numbers

        result = given
        for question, value in self.done:
            if value == "":
                continue  # known by nobody: open still
            if question.name:
                result = replace(result, tool_number={**result.tool_number, question.name: int(float(value))})
            elif question.kind == "units":
                continue  # an option of reading
            elif question.kind == "coolant":
                result = replace(result, coolant=str(value))
            elif question.kind == "origin":
                result = replace(result, origin=three_numbers(str(value)))
            elif question.kind == "feed":
                result = replace(result, feed=float(value))
            elif question.kind == "spindle":
                result = replace(result, spindle={**result.spindle, question.number: float(value)})
            else:
                result = replace(result, gauge_length={**result.gauge_length, question.number: float(value)})
        return result


def _known_register(code: str) -> None:
    """Wrong use where no register of a control is called so; which of them a control has, the conversion says."""
    from pydantic import ValidationError

    from postproc.setup.model import SetupFile

    try:
        SetupFile(work_offset_code=code)
    except ValidationError:
        raise typer.BadParameter(f"{code!r} is no register of a work offset: G54, G54.1 P12, G154 P40, G520, preset 12",
                                 param_hint="--work-offset-code") from None


def _terminal() -> bool:
    """True where somebody sits there."""
    import sys

    return sys.stdin is not None and sys.stdin.isatty()


def _given(lengths: list[str], speeds: list[str], feed: float | None, coolant: str, numbers: list[str],
           origin: str) -> GivenAnswers:
    from typing import get_args

    from postproc.setup.spindle import CoolantKind
    from postproc.setup_sheet.questions import GivenAnswers, three_numbers

    if coolant and coolant not in get_args(CoolantKind):
        raise typer.BadParameter(f"{coolant!r} is not available; choose from {', '.join(get_args(CoolantKind))}",
                                 param_hint="--coolant")
    place = three_numbers(origin)
    if origin and place is None:
        raise typer.BadParameter(f"{origin!r} is not X,Y,Z in mm", param_hint="--origin")
    return GivenAnswers(_numbers(lengths, "--gauge-length", 2000.0), _numbers(speeds, "--spindle", 200000.0), feed, coolant,
                        _by_name(numbers), place)


def _by_name(values: list[str]) -> dict[str, int]:
    """Tool numbers by name; wrong use where a value is none."""
    result = {}
    for text in values:
        name, _, value = text.rpartition("=")
        if not name or not value.isdecimal() or not 0 < int(value) < 10**6:
            raise typer.BadParameter(f"{text!r} is not NAME=number", param_hint="--tool-number")
        result[name] = int(value)
    return result


def _numbers(values: list[str], option: str, most: float) -> dict[int, float]:
    """By tool number, 0 for all; wrong use where a value is none."""
    result = {}
    for text in values:
        number, _, value = text.rpartition("=")
        try:
            tool, size = int(number.lstrip("Tt") or 0), float(value)
        except ValueError:
            raise typer.BadParameter(f"{text!r} is neither a number nor N=number", param_hint=option) from None
        if not 0.0 < size <= most or tool < 0:
            raise typer.BadParameter(f"{text!r} is not above 0 and at most {most:g}", param_hint=option)
        result[tool] = size
    return result


def _values(sheet: SetupSheet, output: Path, asked: int) -> dict[str, Any]:
    place = sheet.fit.place if sheet.fit is not None else None
    return {"output": str(output) if sheet.text else None, "questions": asked,
            "answers": [{"key": key, "value": one.value, "source": one.source} for key, one in sheet.answers],
            "assumed": sheet.assumed if sheet.text else [],
            "tool_numbers": sheet.facts.numbers if sheet.facts is not None else {},
            "part": place.part.model_dump(mode="json") if place is not None and sheet.text else None,
            "place_reason": place.why if place is not None and sheet.text else "",
            "places_tried": sheet.fit.tried if sheet.fit is not None else 0,
            "diagnostics": [d.as_dict() for d in sheet.diagnostics]}


def _text(sheet: SetupSheet, place: FoundPlace | None, output: Path, file: Path, machine: str, controller: str,
          options: Options, asked: int) -> str:
    """What was written after so many questions, and the command that uses it."""
    import shlex

    assumed = f", {len(sheet.assumed)} assumed" if sheet.assumed else ""
    target = file.with_suffix(".nc").name if str(file) != "-" else "part.nc"
    words = [str(file), "-m", machine, "-c", controller, "--setup", str(output), *_reading(options), "-o", target]
    lines = [f"written: {output}, proved by a conversion", f"{asked} question{'s' * (asked != 1)} asked{assumed}"]
    if place is not None:
        lines.append(f"part: {place.why}")
    lines.append(f"next: postproc convert {shlex.join(words)}")
    return "\n".join(lines)


def _reading(options: Options) -> list[str]:
    """The options with which the file was read and proved, where they are not those of every command."""
    from postproc.base.options import Options as Default

    usual = Default()
    found = [word for name, value in (("--units", options.units), ("--dialect", options.dialect)) if value
             for word in (name, value)]
    found += [word for one in options.allow_unknown for word in ("--allow-unknown", one)]
    for name, value, own in (("--tolerance", options.tolerance, usual.tolerance),
                             ("--axis-tolerance", options.axis_tolerance, usual.axis_tolerance)):
        found += [name, f"{value:g}"] if value != own else []
    return found
