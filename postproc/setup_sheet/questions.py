"""The questions of a new set-up: each for one value that no file states, its unit, what is allowed, what is assumed."""

from __future__ import annotations

import contextlib
import json
import math
import shlex
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Literal, get_args

from machines.sheet.quantity import QuantityKind, WrongFigureError, read_quantity
from postproc.setup.spindle import CoolantKind
from postproc.setup_sheet.facts import NumberedTool, SheetFacts, ToolFacts
from toolpaths.choices import LengthUnit
from toolpaths.dataclass import dataclass

QuestionKind = Literal["tool_number", "gauge_length", "spindle", "feed", "coolant", "origin", "units"]
AnswerSource = Literal["answered", "assumed"]
ASSUMED_SPEED = 1000.0
"""rev/min, for a first run in the air: no cutting speed"""
ASSUMED_FEED = 100.0
"""mm/min, likewise"""
ASSUMED_LENGTH = 150.0
"""mm, longer where CAM draws a longer cutter"""
_ABOVE_CUTTER = 50.0
"""mm from the end of a cutter, as CAM draws it, to the gauge point, where that is assumed"""
_LARGEST: dict[QuestionKind, float] = {"tool_number": 999999.0, "gauge_length": 2000.0, "spindle": 200000.0,
                                       "feed": 200000.0, "origin": 100000.0}
_UNITS: dict[QuestionKind, str] = {"tool_number": "", "gauge_length": "mm", "spindle": "rev/min", "feed": "mm/min",
                                   "coolant": "", "origin": "mm", "units": ""}
_MEASURES: dict[QuestionKind, tuple[QuantityKind, float]] = {"gauge_length": ("length", 1.0), "feed": ("speed", 60.0)}
"""answers that may come with a unit; how many of the question's unit one of read_quantity is"""
_OPTIONS: dict[QuestionKind, str] = {"tool_number": "--tool-number", "gauge_length": "--gauge-length",
                                     "spindle": "--spindle", "feed": "--feed", "coolant": "--coolant", "origin": "--origin",
                                     "units": "--units"}
_WORDS: dict[QuestionKind, tuple[str, ...]] = {"coolant": get_args(CoolantKind), "units": get_args(LengthUnit)}
"""answers that are words"""


@dataclass(frozen=True)
class Question:
    """One value that is asked for; `number` is that of the tool, 0 for all; `name` is that of a tool without a number.

    Attributes:
        text: what is asked, without its unit
        default: taken where the answer is empty, None where there is none
        assumed: what --yes takes, None: nothing, the key is left out
        largest: what is taken at most, where the machine says
        optional: nothing depends on it, an empty answer leaves the key out
    """

    kind: QuestionKind
    number: int
    text: str
    default: float | str | None
    assumed: float | str | None
    name: str = ""
    largest: float = math.inf
    optional: bool = False

    @property
    def key(self) -> str:
        """Its key in the set-up, as `assumed` names it."""
        if self.name:
            return f"tool_numbers.{self.name}"
        return f"tools.{self.number}.{self.kind}" if self.number else f"output.{self.kind}"

    @property
    def unit(self) -> str:
        """Of the answer."""
        return _UNITS[self.kind]

    @property
    def option(self) -> str:
        """The option that answers it."""
        if self.name:
            return f"{_OPTIONS[self.kind]} {shlex.quote(f'{self.name}=N')}"
        words: dict[QuestionKind, str] = {"coolant": "KIND", "origin": "X,Y,Z"}
        value = words.get(self.kind) or {"mm": "MM", "rev/min": "RPM"}.get(self.unit, "MM/MIN")
        return f"{_OPTIONS[self.kind]} {f'{self.number}=' if self.number else ''}{value}"

    def answered_by(self, value: float | str) -> str:
        """The option with an answer."""
        key = f"{self.name}=" if self.name else f"{self.number}=" if self.number else ""
        return f"{_OPTIONS[self.kind]} {shlex.quote(key + (f'{value:.10g}' if isinstance(value, float) else value))}"

    def prompt(self) -> str:
        """What stands before the answer."""
        offered = f"{self.default:g}" if isinstance(self.default, float) else self.default
        default = "" if offered is None or self.optional else f" [{offered}]"
        return f"{self.text}{f', {self.unit}' if self.unit else ''}{default}: "


@dataclass(frozen=True)
class Answer:
    """A value with where it comes from."""

    value: float | str
    source: AnswerSource


@dataclass(frozen=True)
class GivenAnswers:
    """Answers on the command line: by tool number, 0 for all tools; numbers of tools by name."""

    gauge_length: Mapping[int, float] = field(default_factory=dict)
    spindle: Mapping[int, float] = field(default_factory=dict)
    feed: float | None = None
    coolant: str = ""
    tool_number: Mapping[str, int] = field(default_factory=dict)
    origin: tuple[float, float, float] | None = None
    """mm, where the origin of the CL file's absolute frame stands in the table frame; None: a place is looked for"""

    complete: bool = False
    """nobody answers any more: questions whose answer may be left empty are open too"""

    def of(self, question: Question) -> float | str | None:
        """The answer to a question, None where there is none."""
        if question.name:
            return next((float(n) for name, n in self.tool_number.items() if name.upper() == question.name.upper()), None)
        if question.kind == "feed":
            return self.feed
        if question.kind == "coolant":
            return self.coolant or None
        known = self.gauge_length if question.kind == "gauge_length" else self.spindle
        return known.get(question.number, known.get(0))


def number_questions(named: tuple[NumberedTool, ...]) -> list[Question]:
    """The number in the magazine of each tool to which the CL file gives none of its own; a free one is offered."""
    return [Question("tool_number", 0, f"tool {json.dumps(one.name, ensure_ascii=False)}: number in the magazine "
                     f"({one.why})", float(one.number), float(one.number), one.name) for one in named if one.assumed]


def origin_question(found: tuple[float, float, float]) -> Question:
    """Where the part stands on a table that turns; offered is the place that travel has chosen."""
    return Question("origin", 0, "where the origin of the CL file stands in machine coordinates, axes at 0: x, y, z "
                    "(offered: a place that travel allows)",
                    ", ".join(f"{v:g}" for v in found), None)


def units_question(read: LengthUnit) -> Question:
    """The unit of the lengths of a CL file that states none, offered as it was `read`: by the answer it is read again."""
    return Question("units", 0, f"unit of the CL file, which states none ({', '.join(_WORDS['units'])})", read, None)


def questions_of(facts: SheetFacts) -> list[Question]:
    """All that the files leave open, in the order of the set-up file."""
    result = []
    for tool in facts.tools:
        if facts.lengths or facts.reach:
            result.append(Question("gauge_length", tool.number, f"{tool.called}: gauge length, from the gauge point of the "
                                   "spindle to the tip", None, _length(tool)))
        elif facts.turning:
            result.append(Question("gauge_length", tool.number, f"{tool.called}: gauge length (empty: not known; travel and "
                                   "place are then found as if it were 0)", "", None, optional=True))
        if not tool.speed:
            most = "" if math.isinf(facts.largest_speed) else f", at most {facts.largest_speed:g}"
            of = tool.cutting_speed
            offered = min(of.rpm if of else ASSUMED_SPEED, facts.largest_speed)
            why = f" (offered: {of.said})" if of else ""
            result.append(Question("spindle", tool.number, f"{tool.called}: spindle speed, {tool.direction}{most}{why}",
                                   offered if of else None, offered, largest=facts.largest_speed))
    if facts.without_feed:
        result.append(Question("feed", 0, f"feed of {facts.without_feed} moves that cut without one", None, ASSUMED_FEED))
    if not any(tool.coolant for tool in facts.tools):
        result.append(Question("coolant", 0, f"coolant ({', '.join(get_args(CoolantKind))})", "off", "off"))
    return result


def _length(tool: ToolFacts) -> float:
    """The gauge length that is assumed, mm."""
    if tool.cutter is None:
        return ASSUMED_LENGTH
    return max(ASSUMED_LENGTH, 10.0 * math.ceil((tool.cutter + _ABOVE_CUTTER) / 10.0))


def parsed(question: Question, text: str) -> tuple[float | str | None, str]:
    """The value of an answer, and what is wrong with it ("" where nothing is)."""
    text = text.strip()
    if not text:
        return question.default, "" if question.default is not None else "a value is needed"
    if known := _WORDS.get(question.kind):
        return (text.lower(), "") if text.lower() in known else (None, f"{text!r} is not one of {', '.join(known)}")
    if question.kind == "origin":
        return (text, "") if three_numbers(text) else (None, f"{text!r} is not x, y, z in mm")
    if question.kind in _MEASURES:  # "4.35 in", "20 ipm"
        measure, share = _MEASURES[question.kind]
        with contextlib.suppress(WrongFigureError):
            text = f"{read_quantity(text, measure) * share:.12g}"
    text = text.removesuffix(_UNITS[question.kind]).rstrip() if _UNITS[question.kind] else text
    text = text.removesuffix("rpm").rstrip() if question.kind == "spindle" else text
    if _thousands(text):
        return None, f"{text!r} may be {text.replace(',', '')} or {text.replace(',', '.')}: write it without the comma"
    try:
        value = float(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)
    except ValueError:
        return None, f"{text!r} is not a number"
    if question.kind == "tool_number" and value != int(value):
        return None, f"{text} is not a whole number"
    largest = min(_LARGEST[question.kind], question.largest)
    if not 0.0 < value <= largest:
        return None, f"{text} is not above 0 and at most {largest:g} {question.unit}"
    return value, ""


def three_numbers(text: str) -> tuple[float, float, float] | None:
    """Three lengths in mm between commas or blanks; None where they are none."""
    try:
        x, y, z = (float(word) for word in text.replace(",", " ").split())
    except ValueError:
        return None
    return (x, y, z) if all(abs(v) <= _LARGEST["origin"] for v in (x, y, z)) else None


def _thousands(text: str) -> bool:
    """True for a number whose comma may part thousands or decimals: 12,000."""
    whole, comma, rest = text.partition(",")
    return bool(comma) and whole.isdigit() and rest.isdigit() and len(whole) <= 3 == len(rest) and whole[0] != "0"


def answered(questions: list[Question], given: GivenAnswers, ask: Callable[[Question], float | str] | None,
             assume: bool) -> tuple[dict[str, Answer], list[Question]]:
    """The answers by key, and the questions that have none: from the command line, by asking, else assumed."""
    result, left = dict[str, Answer](), list[Question]()
    for question in questions:
        value = given.of(question)
        if value is not None:
            result[question.key] = Answer(value, "answered")
        elif assume and question.assumed is not None:
            result[question.key] = Answer(question.assumed, "assumed")
        elif ask is not None and (said := ask(question)) != "":
            result[question.key] = Answer(said, "answered")
        elif not question.optional or given.complete:
            left.append(question)
    return result, left
