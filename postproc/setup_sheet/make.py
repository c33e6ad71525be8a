"""A new set-up: facts of the files -> questions -> answers -> a place that fits, proved by a conversion -> text."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.controllers.model import ControllerFile, load_controller
from postproc.readback.comparison.length_margins import MUCH
from postproc.setup.model import SetupFile
from postproc.setup_sheet.facts import NumberedTool, SheetFacts, facts_of, named_tools, taken_numbers
from postproc.setup_sheet.place import Fit, below_origin, beyond, fitted, found_place, looked_for, odd_one
from postproc.setup_sheet.questions import (
    Answer,
    GivenAnswers,
    Question,
    answered,
    number_questions,
    origin_question,
    questions_of,
    three_numbers,
)
from postproc.setup_sheet.text import ORIGIN, TOOL_NUMBERS, SheetHeader, sheet_text, sheet_values
from toolpaths.choices import LengthUnit
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, error, has_errors, info, read_value, warning
from toolpaths.toolpath import Toolpath

_SAME_PLACE = 0.005
"""mm up to which the place that was offered has been accepted, as it was printed"""


@dataclass(frozen=True)
class SetupSheet:
    """What came of it: `text` is "" where a diagnostic is an ERROR.

    Attributes:
        questions: all that the files leave open
        answers: by key of the set-up
    """

    text: str
    diagnostics: tuple[Diagnostic, ...]
    facts: SheetFacts | None = None
    questions: tuple[Question, ...] = ()
    answers: tuple[tuple[str, Answer], ...] = ()
    fit: Fit | None = None

    @property
    def assumed(self) -> list[str]:
        """Keys that --yes has assumed."""
        return list(self.fit.setup.assumed) if self.fit is not None else []


def new_setup(toolpath: Toolpath, machine: Machine, controller: str | Path, options: Options, given: GivenAnswers,
              ask: Callable[[Question], float | str] | None, assume: bool, found: list[Diagnostic],
              code: str = "G54", progress: Progress | None = None) -> SetupSheet:
    """The set-up of a file on a machine and a control, proved by a conversion.

    Args:
        given: answers of the command line
        ask: asks for one value; None: nobody can be asked
        assume: questions without an answer take what is assumed, marked so
        found: what reading the file found
        code: register of the work offset
    """
    spec = read_value(load_controller(controller))
    known = [*found, *(d for d in toolpath.faults if d not in found)]
    if has_errors(known):
        return SetupSheet("", tuple(known))
    once = _asked_once(ask) if ask is not None else None

    def made(reach: bool) -> SetupSheet:
        return _made(toolpath, machine, controller, options, given, once, assume,
                     (list(found), known), code, progress, spec, reach)

    first = made(False)
    if first.text or not (ask is not None or assume) or not _lengths_may_help(first):
        return first
    again = made(True)
    return again if again.text else first


def _stated(fit: Fit, at: Callable[[tuple[float, float, float]], Fit],
            ask: Callable[[Question], float | str] | None) -> Fit:
    """The part where somebody says that it stands, where travel or the table's origin has chosen its place; `at` fits it
    there."""
    if ask is None or fit.place is None or not fit.result.ok or not (below_origin(fit) or looked_for(fit)):
        return fit
    said = three_numbers(str(ask(origin_question(fit.setup.part.origin))))
    if said is None:
        return fit
    same = max(abs(a - b) for a, b in zip(said, fit.setup.part.origin, strict=True)) < _SAME_PLACE
    return replace(fit, place=replace(fit.place, stated=True)) if same else at(said)


def _asked_once(ask: Callable[[Question], float | str]) -> Callable[[Question], float | str]:
    """The same, with one answer to each question; what was left empty may be asked again."""
    said: dict[str, float | str] = {}

    def once(question: Question) -> float | str:
        if said.get(question.key, "") == "":
            said[question.key] = ask(question)
        return said[question.key]

    return once


def _lengths_may_help(made: SetupSheet) -> bool:
    """True where no place fits and a tool has no gauge length: its spindle was held against travel as if it cut itself."""
    if made.fit is None or made.facts is None or not beyond(made.fit.result):
        return False
    return not {f"tools.{tool.number}.gauge_length" for tool in made.facts.tools} <= {key for key, _ in made.answers}


def _made(toolpath: Toolpath, machine: Machine, controller: str | Path, options: Options, given: GivenAnswers,
          ask: Callable[[Question], float | str] | None, assume: bool, read: tuple[list[Diagnostic], list[Diagnostic]],
          code: str, progress: Progress | None, spec: ControllerFile, reach: bool) -> SetupSheet:
    """See `new_setup`; `reach`: gauge lengths are asked for although no word depends on them."""
    found, known = read[0], list(read[1])
    if refused := facts_of(toolpath, machine, spec, options).refused:  # nobody is asked for what no answer puts right
        return SetupSheet("", (*known, *refused))
    named, asked, unnumbered = _numbers(toolpath, given, ask, assume)
    facts = replace(facts_of(toolpath, machine, spec, options, named), reach=reach)
    known += _of_two(named, toolpath) + _no_such_name(given, [one.name for one in asked], toolpath)
    if facts.refused or has_errors(known):
        return SetupSheet("", (*known, *facts.refused), facts)
    questions = [*asked, *questions_of(facts)]
    answers, left = answered(questions[len(asked):], given, ask, assume)
    questions = [one for one in questions if ask is not None or given.complete or not one.optional]
    left = [*unnumbered, *left]
    known += _unused(given, facts, toolpath)
    for tool in () if facts.lengths or reach else facts.tools:  # not needed, but given: travel is checked with it
        length = given.gauge_length.get(tool.number, given.gauge_length.get(0))
        if length is not None:
            answers[f"tools.{tool.number}.gauge_length"] = Answer(length, "answered")
    known += _short(facts, answers, toolpath.file)
    if left:
        return SetupSheet("", (*known, _open(left, toolpath.file)), facts, tuple(questions), tuple(answers.items()))
    values = sheet_values(facts, answers, toolpath.name or Path(toolpath.file).name, code,
                          machine.name)
    setup = SetupFile.model_validate({**values, "work_offset": toolpath.frames[0].name})
    def at(origin: tuple[float, float, float] | None) -> Fit:
        return fitted(toolpath, machine, controller, setup, options, found, progress, origin)

    first = at(given.origin)
    if any(d.code == "rapid.off_line" for d in first.result.diagnostics):
        setup = setup.model_copy(update={"output": setup.output.model_copy(update={"rapids_as_feed": True})})
        first = at(given.origin)
    fit = _stated(first, at, ask)
    if below_origin(fit) or (assume and looked_for(fit)):
        fit = replace(fit, setup=fit.setup.model_copy(update={"assumed": [*fit.setup.assumed, ORIGIN]}))
    made = SetupSheet("", tuple(known), facts, tuple(questions), tuple(answers.items()), fit)
    if not fit.result.ok:
        return _with(made, _not_fitted(fit), text="")
    header = SheetHeader(Path(toolpath.file).name, machine.name, fit.result.controller_name, toolpath.units,
                     _units(toolpath.units, found, options), options.tolerance, options.axis_tolerance)
    return _with(made, _assumed(made, fit), text=sheet_text(header, facts, answers, fit, toolpath))


def _numbers(toolpath: Toolpath, given: GivenAnswers, ask: Callable[[Question], float | str] | None,
             assume: bool) -> tuple[tuple[NumberedTool, ...], list[Question], list[Question]]:
    """Numbers of tools by name, answered or assumed; the questions, and those without an answer."""
    named = named_tools(toolpath)
    asked = number_questions(named)
    answers, left = answered(asked, given, ask, assume)
    said = {q.name: int(answers[q.key].value) for q in asked if q.key in answers and answers[q.key].source == "answered"}
    return tuple(replace(one, number=said[one.name], why="answered", assumed=False) if one.name in said else one
                 for one in named), asked, left


def _of_two(named: tuple[NumberedTool, ...], toolpath: Toolpath) -> list[Diagnostic]:
    """Answered numbers that another tool has."""
    own, used = {one.name: one.number for one in named}, taken_numbers(toolpath)
    free = next(n for n in count(1) if n not in used and n not in own.values())
    return [error("setup.number_taken", f"T{one.number} is the number of another tool, not free for {one.name!r}",
                  file=toolpath.file, hint=f"{free} is free: --tool-number {shlex.quote(f'{one.name}={free}')}")
            for one in named if one.why == "answered" and (one.number in used or any(
                n == one.number for name, n in own.items() if name != one.name))]


def _no_such_name(given: GivenAnswers, names: list[str], toolpath: Toolpath) -> list[Diagnostic]:
    """Numbers for names that no tool without a number has."""
    wrong = [name for name in given.tool_number if name.upper() not in {n.upper() for n in names}]
    said = f"tools that need one: {', '.join(names)}" if names else "every tool has its number in the CL file: leave it out"
    return [error("setup.no_such_name", f"--tool-number {name}: no tool of that name needs a number", file=toolpath.file,
                  hint=said) for name in wrong]


def _units(read: LengthUnit, found: list[Diagnostic], options: Options) -> str:
    """Where the units that the file was read in come from."""
    if options.units:
        return f"answered (--units {options.units}: state it to convert too)"
    said = next((d.severity for d in found if d.code == "cl.no-units"), None)
    if said is None:
        return "stated by the CL file"
    if said is Severity.INFO:
        return "by the unit of the feeds in the CL file, which has no UNITS record"
    why, other = ("its feeds are in inches", "mm") if read == "inch" else ("the CL file states none", "inch")
    return f"ASSUMED: {why}; where its lengths are in {other}, write this file again with --units {other}"


def _with(made: SetupSheet, more: list[Diagnostic], text: str) -> SetupSheet:
    return SetupSheet(text, (*made.diagnostics, *more), made.facts, made.questions, made.answers, made.fit)


def _open(left: list[Question], file: str) -> Diagnostic:
    """All that still has to be given, in one list."""
    lines = [f"  {one.text}{f', {one.unit}' if one.unit else ''}: {one.option}" for one in left]
    said = f"{len(left)} value{'s' * (len(left) > 1)} nobody has stated:\n" + "\n".join(lines)
    return error("setup.unanswered", said, file=file, hint="run it on a terminal, give the options, or --yes to write "
                 "assumed values that are marked so")


def _unused(given: GivenAnswers, facts: SheetFacts, toolpath: Toolpath) -> list[Diagnostic]:
    """Answers for tools that the file does not cut with."""
    used = {tool.number for tool in facts.tools}
    wrong = sorted({n for n in (*given.gauge_length, *given.spindle) if n and n not in used})
    if not wrong:
        return []
    return [error("setup.no_such_tool", f"{', '.join(f'T{n}' for n in wrong)}: the CL file cuts with no such tool",
                  file=toolpath.file, hint=f"it cuts with {', '.join(f'T{n}' for n in sorted(used))}")]


def _short(facts: SheetFacts, answers: dict[str, Answer], file: str) -> list[Diagnostic]:
    """Gauge lengths below the length of the cutter as CAM draws it: a wrong key, inches, or another point."""
    given = {tool.number: answers.get(f"tools.{tool.number}.gauge_length") for tool in facts.tools}
    return [warning("setup.short_tool", f"{tool.called}: gauge length {length.value:g} mm, shorter than the cutter alone, "
                    f"{tool.cutter:g} mm in the CL file", file=file, lines=[tool.line], hint="it is measured in mm from the "
                    "gauge point of the spindle to the tip")
            for tool in facts.tools if (length := given[tool.number]) is not None and tool.cutter is not None
            and float(length.value) < tool.cutter]


def _assumed(made: SetupSheet, fit: Fit) -> list[Diagnostic]:
    """What was assumed, as a warning each."""
    keys = {one.key: one for one in made.questions}
    values = dict(made.answers)
    named = made.facts.named if made.facts is not None else ()
    numbers = ", ".join(f"{one.name} = T{one.number}" for one in named if one.assumed)
    said = [warning("setup.assumed", f"{key} = {values[key].value} {keys[key].unit} is assumed: nobody has stated it",
                    hint=f"state it by {keys[key].option}, or in the file, and take its name out of `assumed`")
            for key in fit.setup.assumed if key in keys]
    if ORIGIN in fit.setup.assumed:
        said.append(_place_assumed(fit))
    said += _no_length(values, fit)
    if numbers:
        said.append(warning("setup.assumed", f"{TOOL_NUMBERS}: {numbers} is assumed: nobody has stated it", hint="see that "
                            "the magazine holds them so, or put in its numbers, and take `tool_numbers` out of `assumed`"))
    return said


def _no_length(values: dict[str, Answer], fit: Fit) -> list[Diagnostic]:
    """Tools whose length nobody has stated, which may not be much longer than the 0 mm that the program is proved with."""
    lengths = fit.result.comparison.lengths if fit.result.comparison is not None else ()
    return [warning("setup.assumed", f"tools.{one.number}.gauge_length = 0 mm is assumed: nobody has stated it, and by "
                    f"{one.longer:.0f} mm more the program meets {one.ends_longer}", hint=f"state it by --gauge-length "
                    f"{one.number}=MM, or in the file")
            for one in lengths if one.longer < MUCH and f"tools.{one.number}.gauge_length" not in values]


def _place_assumed(fit: Fit) -> Diagnostic:
    """Why the place of the part is assumed."""
    depth = below_origin(fit)
    why = f"cuts reach {depth:g} mm below the table's origin, where nobody has stated that there is room" if depth else (
        f"travel alone has chosen {list(fit.setup.part.origin)} mm, which may be in the air or in the table")
    return warning("setup.assumed", f"{ORIGIN} is assumed: {why}", hint="state where the part stands by --origin X,Y,Z, or "
                   f"in [part], and take `{ORIGIN}` out of `assumed`")


_SHORTER = "shorter tools, "
_ELSE = f"a machine with more travel, {_SHORTER}or a file for each side of the part"
"""what serves where no place fits; no tool is shorter than one of 0 mm"""


def _not_fitted(fit: Fit) -> list[Diagnostic]:
    """Why no place fits, next to what stands against the first."""
    errors = [d for d in fit.result.diagnostics if d.severity is Severity.ERROR]
    if odd := odd_one(fit.result, fit.result.toolpath):
        return [*errors, *odd]
    tried = fit.nowhere or f"{fit.tried} place{'s' * (fit.tried > 1)} tried, none is possible"
    said = [info("place.found", tried
                 + "".join(f"; {why}" for why in fit.lacks[:3]),
                 hint=_ELSE if any(tool.gauge_length for tool in fit.setup.tools.values()) else _ELSE.replace(_SHORTER, ""))]
    said = said if fit.tried > 1 or fit.lacks else []
    if fit.place is not None and fit.place.stated:
        said = found_place(fit.result, fit.result.toolpath)
    return [*errors, *said]
