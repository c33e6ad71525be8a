"""The questions that make a sheet, in the order of a brochure: each checked as it is answered."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import field
from typing import get_args

from machines.sheet.jog import QUESTIONS
from machines.sheet.make import ENDLESS, says_endless
from machines.sheet.model import PivotForm, ZeroEnd, spelt
from machines.sheet.pivots import names_of
from machines.sheet.quantity import QuantityKind, angles_of, read_quantity
from toolpaths.dataclass import dataclass

Check = Callable[[str], str]
"""the text of an answer as it goes into the sheet.

Raises:
    ValueError: where it is none, saying what is allowed.
"""


@dataclass(frozen=True)
class SheetQuestion:
    """One question.

    Attributes:
        default: taken where the answer is empty; None: an answer is needed
    """

    text: str
    default: str | None
    check: Check

    def prompt(self) -> str:
        """What stands before the answer."""
        return f"{self.text}{f' [{self.default}]' if self.default else ''}: "

    def parsed(self, text: str) -> str:
        """What goes into the sheet.

        Raises:
            ValueError: where the answer does not fit.
        """
        text = text.strip() or (self.default or "")
        if not text and self.default is None:
            raise ValueError("an answer is needed")
        return self.check(text)


_WHERE = {"MRZP": " (settings 255 to 257, as the control shows them)", "MRZP second": " (where the control has two sets)"}
"""where the numbers of a pivot stand, by its name"""
_ON_ITS_LINE = " (a point on the line that it turns about, in machine coordinates, all axes at 0)"
Ask = Callable[[SheetQuestion], str]


@dataclass
class _Sheet:
    """The lines of a sheet as its questions are answered."""

    ask: Ask
    lines: list[str] = field(default_factory=list)

    def text(self, words: str, default: str | None, check: Check = json.dumps) -> str:
        """The answer to a question."""
        return self.ask(SheetQuestion(words, default, check))


def sheet_text(ask: Ask) -> str:
    """The text of a sheet, every question asked."""
    sheet = _Sheet(ask)
    sheet.lines += [f"description = {sheet.text('what the machine is called', None)}",
                    f"source = {sheet.text('document of its figures: maker, title, page', None)}"]
    table = _letters(sheet, "rotary axes in the table, the one next to the bed first, e.g. B C, or none", "B C")
    head = _letters(sheet, "rotary axes in the head, the one next to the slides first, or none", "none")
    slides = _letters(sheet, "linear axes that move the table, the one next to the bed first, or none", "none", "XYZ", 3)
    sheet.lines += [f"table = {json.dumps(table)}", f"head = {json.dumps(head)}", f"table_slides = {json.dumps(slides)}"]
    for letter in "XYZ":
        sheet.lines += _slide(sheet, letter)
    for letter in (*table, *head):
        sheet.lines += _turn(sheet, letter, letter in table)
    if table or head:
        sheet.lines += _pivots(sheet, tuple(table), tuple(head))
    speed = sheet.text("largest speed of the spindle, e.g. 8100 rpm; empty: not known", "", _quantity("turning speed"))
    sheet.lines.insert(2, f"spindle = {speed}")
    top = _table_top(sheet) if table else []
    change = sheet.text("tool change, chip to chip, e.g. 4.2 s; empty: not known", "", _quantity("time"))
    return "\n".join([*sheet.lines, *top, *(["", "[times]", f"tool_change = {change}"] if change != '""' else [])]) + "\n"


def _table_top(sheet: _Sheet) -> list[str]:
    """Distances that prove the Z of the pivots."""
    def ends(text: str) -> str:
        both = text.split(" to ")
        if text and len(both) != 2:
            raise ValueError(f"{text!r} is not two lengths as 102 mm to 610 mm")
        if text and both[0].strip().replace(".", "", 1).isdigit():  # "102 to 610 mm"
            both[0] += f" {both[1].strip().lstrip('.0123456789').strip()}"
        for one in both if text else ():
            read_quantity(one, "length")
        return json.dumps([one.strip() for one in both]) if text else ""

    between = sheet.text("spindle nose to table, least and most, e.g. 102 mm to 610 mm; empty: not known", "", ends)
    size = sheet.text("diameter or longer side of the table, e.g. 500 mm; empty: not known", "", _quantity("length"))
    given = [*([f"spindle_to_table = {between}"] if between else []), *([f"size = {size}"] if size != '""' else [])]
    return ["", "[table_top]", *given] if given else []


def _letters(sheet: _Sheet, words: str, default: str, known: str = "ABC", most: int = 2) -> list[str]:
    def check(text: str) -> str:
        letters = [] if text.lower() == "none" else text.upper().replace(",", " ").split()
        if set(letters) - set(known) or len(set(letters)) < len(letters) or len(letters) > most:
            raise ValueError(f"{text!r} is not up to {most} of {', '.join(known)}, or none")
        return " ".join(letters)

    return sheet.text(words, default, check).split()


def _slide(sheet: _Sheet, letter: str) -> Iterator[str]:
    yield ""
    yield f"[{letter}]"
    yield f"travel = {sheet.text(f'{letter}: length of travel, e.g. 762 mm or 30 in', None, _quantity('length'))}"
    zero = sheet.text(f"{letter}: machine zero: upper end, lower end or middle", "upper", _one_of(*get_args(ZeroEnd)))
    yield f"zero = {zero}"
    yield from _speeds(sheet, letter, "speed", "acceleration", "22.9 m/min or 900 ipm", "5 m/s2 or 0.5 g")


def _turn(sheet: _Sheet, letter: str, in_table: bool) -> Iterator[str]:
    def ends(text: str) -> str:
        if says_endless(text):
            return json.dumps(ENDLESS)
        both = angles_of(text)
        if both is None:
            raise ValueError(f"{text!r} is not two angles as -35 120, nor {ENDLESS}")
        return json.dumps([f"{one:g} deg" for one in both])

    def seen(text: str) -> str:
        if text:
            words = {word: word for word in (along, against)} | {word.split()[-1]: word for word in (along, against)}
            return json.dumps(words[spelt(text)]) if spelt(text) in words else _none_of(text, along, against)
        return ""

    yield ""
    yield f"[{letter}]"
    yield f"travel = {sheet.text(f'{letter}: both ends in degrees, e.g. -35 120, or {ENDLESS}', None, ends)}"
    yield from _speeds(sheet, letter, "turning speed", "turning acceleration", "50 rpm or 300 deg/s", "500 deg/s2")
    question, along, against = QUESTIONS[letter, in_table]
    jog = sheet.text(f"{question} ({along} / {against}; empty: not tried)", "", seen)
    yield from [f"jog = {jog}"] if jog else []


def _speeds(sheet: _Sheet, letter: str, speed: QuantityKind, acceleration: QuantityKind, fast: str,
            hard: str) -> Iterator[str]:
    yield f"rapid = {sheet.text(f'{letter}: rapid, e.g. {fast}', None, _quantity(speed))}"
    given = sheet.text(f"{letter}: acceleration, e.g. {hard}; empty: not known", "", _quantity(acceleration))
    yield from [f"acceleration = {given}"] if given != '""' else []


def _pivots(sheet: _Sheet, table: tuple[str, ...], head: tuple[str, ...]) -> Iterator[str]:
    def known(text: str) -> str:
        word = _one_of(*get_args(PivotForm))(text)
        names_of(json.loads(word), table, head)
        return word

    def vector(text: str) -> str:
        if not text:
            return ""
        try:
            numbers = [float(one) for one in text.replace(",", " ").split()]
        except ValueError:
            numbers = []
        if len(numbers) != 3:
            raise ValueError(f"{text!r} is not three numbers, X Y Z in mm")
        return json.dumps(numbers)

    machine, *controls = get_args(PivotForm)
    form = sheet.text(f"pivots: {machine} (a point of each axis), or the numbers of {', '.join(controls)}", machine, known)
    yield from ("", "[pivots]", f"form = {form}", "[pivots.points]")
    for chain in names_of(json.loads(form), table, head):
        for name in chain:
            needed = "(" not in name and name != "MRZP second"
            plain = name.strip("()")
            where = _ON_ITS_LINE if json.loads(form) == machine else _WHERE.get(plain, "")
            asked = f"{plain}{where}: X Y Z in mm"
            words, default = (asked, None) if needed else (f"{asked}; empty: none", "")
            numbers = sheet.text(words, default, vector)
            yield from [f"{json.dumps(plain)} = {numbers}"] if numbers else []


def _quantity(measure: QuantityKind) -> Check:
    def check(text: str) -> str:
        if text:
            read_quantity(text, measure)
        return json.dumps(text)

    return check


def _one_of(*words: str) -> Check:
    def check(text: str) -> str:
        return json.dumps(text.lower()) if text.lower() in words else _none_of(text, *words)

    return check


def _none_of(text: str, *words: str) -> str:
    """Raises:
        ValueError: always.
    """
    raise ValueError(f"{text!r} is not one of {', '.join(words)}")
