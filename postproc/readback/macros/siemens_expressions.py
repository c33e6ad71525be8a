"""Expressions of SINUMERIK 840D (Programming Manual Job Planning, arithmetic functions; priority of the operations).

From the first that binds: NOT B_NOT; * / DIV MOD; + -; B_AND; B_XOR; B_OR; AND; XOR; OR; <<; comparisons, equal within a
part in 1e12.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

from postproc.readback.macros.expressions import COMMON, Cursor, MacroFault, applied

SiemensValue = float | str
BLANKS = re.compile(r"[ \t]*")
NAME = re.compile(r"[A-Z_$][A-Z_$][A-Z0-9_$]*|R\d+")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?")
_CODED = re.compile(r"'(H[0-9A-F]+|B[01]+)'")
_STRING = re.compile(r'"[^"]*"')
_SIGN = re.compile(r"==|<>|<=|>=|<<|[-+*/<>]|(?:B_AND|B_XOR|B_OR|AND|XOR|OR|DIV|MOD)(?![A-Z0-9_$])")
_AXIS = re.compile(r"[ \t]*([A-Z]\d*)[ \t]*\]")
_EQUAL = 1e-12


class Names(Protocol):
    """Where values of names come from."""

    def get(self, name: str, index: tuple[SiemensValue, ...]) -> SiemensValue:
        """A variable, an element of one, or a system variable."""


SiemensValueLater = Callable[[Names], SiemensValue]
"""a value as it is at the time of the call"""


def number(value: SiemensValue) -> float:
    """A value in arithmetic."""
    if isinstance(value, str):
        raise MacroFault("gcode.expression", f'"{value[:30]}" stands where a number is asked for')
    return value


def text(value: SiemensValue) -> str:
    """A value in a chain of characters."""
    return value if isinstance(value, str) else f"{value:g}"


def equal(a: SiemensValue, b: SiemensValue) -> bool:
    """Two values alike, numbers within a part in 1e12."""
    if isinstance(a, str) or isinstance(b, str):
        return text(a) == text(b)
    return abs(a - b) <= _EQUAL * max(abs(a), abs(b))


def _on_numbers(f: Callable[[float, float], float]) -> Callable[[SiemensValue, SiemensValue], SiemensValue]:
    return lambda a, b: float(f(number(a), number(b)))


def _divided(a: float, b: float) -> float:
    if b == 0.0:
        raise MacroFault("gcode.expression", "division by 0", "the control stops there: test the divisor before")
    return a / b


OPERATORS: dict[str, tuple[int, Callable[[SiemensValue, SiemensValue], SiemensValue]]] = {
    "*": (9, _on_numbers(lambda a, b: a * b)), "/": (9, _on_numbers(_divided)),
    "DIV": (9, _on_numbers(lambda a, b: float(math.trunc(_divided(a, b))))),
    "MOD": (9, _on_numbers(lambda a, b: math.fmod(a, b) if b else _divided(a, b))),
    "+": (8, _on_numbers(lambda a, b: a + b)), "-": (8, _on_numbers(lambda a, b: a - b)),
    "B_AND": (7, _on_numbers(lambda a, b: int(a) & int(b))), "B_XOR": (6, _on_numbers(lambda a, b: int(a) ^ int(b))),
    "B_OR": (5, _on_numbers(lambda a, b: int(a) | int(b))), "AND": (4, _on_numbers(lambda a, b: bool(a) and bool(b))),
    "XOR": (3, _on_numbers(lambda a, b: bool(a) != bool(b))), "OR": (2, _on_numbers(lambda a, b: bool(a) or bool(b))),
    "<<": (1, lambda a, b: text(a) + text(b)),
    "==": (0, lambda a, b: float(equal(a, b))), "<>": (0, lambda a, b: float(not equal(a, b))),
    ">": (0, _on_numbers(lambda a, b: a > b and not equal(a, b))), "<": (0,
                                                                         _on_numbers(lambda a, b: a < b and not equal(a,
                                                                                                                      b))),
    ">=": (0, _on_numbers(lambda a, b: a > b or equal(a, b))), "<=": (0, _on_numbers(lambda a, b: a < b or equal(a, b)))}
_ONE: dict[str, Callable[[float], float]] = {
    **COMMON, "POT": lambda a: a * a, "TRUNC": lambda a: float(math.trunc(a)), "ROUNDUP": lambda a: float(math.ceil(a))}
_MORE: dict[str, Callable[..., SiemensValue]] = {
    "ATAN2": lambda y, x: math.degrees(math.atan2(number(y), number(x))), "MINVAL": lambda a, b: min(number(a), number(b)),
    "MAXVAL": lambda a, b: max(number(a), number(b)), "BOUND": lambda a, b, x: min(max(number(a), number(x)), number(b)),
    "STRLEN": lambda s: float(len(text(s))), "NUMBER": lambda s: float(text(s)), "TOUPPER": lambda s: text(s).upper()}
FUNCTIONS = frozenset({*_ONE, *_MORE})


def skip(c: Cursor) -> None:
    """Behind blanks."""
    c.match(BLANKS)


def take(c: Cursor, sign: str) -> bool:
    """As `Cursor.take`, blanks before it aside."""
    skip(c)
    return c.take(sign)


def need(c: Cursor, sign: str) -> None:
    """As `Cursor.need`, blanks before it aside."""
    skip(c)
    c.need(sign)


def listed(c: Cursor, names: Names, end: str) -> list[SiemensValue]:
    """Values between commas up to `end`."""
    result = list[SiemensValue]()
    if take(c, end):
        return result
    while True:
        result.append(expression(c, names))
        if take(c, end):
            return result
        need(c, ",")


def indices(c: Cursor, names: Names) -> list[SiemensValue]:
    """What stands between [ and ]: numbers, or names of axes, which stand for themselves."""
    axis = _AXIS.match(c.text, c.at)
    if axis and not re.fullmatch(r"R\d+", axis[1]):
        c.at = axis.end()
        return [axis[1]]
    return listed(c, names, "]")


def expression(c: Cursor, names: Names) -> SiemensValue:
    """Values joined by operators."""
    f, c.at = _parsed(c.text, c.at)
    return f(names)


@lru_cache(maxsize=20_000)
def _parsed(text_: str, at: int) -> tuple[SiemensValueLater, int]:
    """(an expression taken apart, where it ends)."""
    c = Cursor(text_, at)
    return _joined(c, 0), c.at


def _joined(c: Cursor, rank: int) -> SiemensValueLater:
    """Values joined by operators that bind at least as `rank` does, from the left."""
    left = _value_of(c)
    while True:
        at = c.at
        skip(c)
        sign = c.match(_SIGN)
        if not sign or OPERATORS[sign][0] < rank:
            c.at = at
            return left
        binds, f = OPERATORS[sign]
        left = _operated(f, left, _joined(c, binds + 1))


def _operated(f: Callable[[SiemensValue, SiemensValue], SiemensValue], left: SiemensValueLater,
              right: SiemensValueLater) -> SiemensValueLater:
    return lambda names: f(left(names), right(names))


def _constant(value: SiemensValue) -> SiemensValueLater:
    return lambda names: value


def _negative(of: SiemensValueLater) -> SiemensValueLater:
    return lambda names: -number(of(names))


def _value_of(c: Cursor) -> SiemensValueLater:
    """A number, characters, a name, a function or brackets, with a sign before it."""
    skip(c)
    if c.take("("):
        result = _joined(c, 0)
        need(c, ")")
        return result
    if c.take("-"):
        return _negative(_value_of(c))
    if c.take("+"):
        return _value_of(c)
    if found := c.match(_STRING):
        return _constant(found[1:-1])
    if found := c.match(_NUMBER):
        return _constant(float(found.replace("EX", "e")))
    if found := c.match(_CODED):
        return _constant(float(int(found[2:-1], 16 if found[1] == "H" else 2)))
    name = c.match(NAME) or ("R" if c.text.startswith("R[", c.at) and c.take("R") else "")
    if not name:
        raise c.fault("a value is missing")
    return _named(name, c)


def _several(c: Cursor, end: str) -> list[SiemensValueLater]:
    result = list[SiemensValueLater]()
    if take(c, end):
        return result
    while True:
        result.append(_joined(c, 0))
        if take(c, end):
            return result
        need(c, ",")


def _named(name: str, c: Cursor) -> SiemensValueLater:
    if name in ("NOT", "B_NOT"):
        inner = _value_of(c)
        return (lambda names: float(not number(inner(names)))) if name == "NOT" else \
            (lambda names: float(~int(number(inner(names)))))
    if name in ("TRUE", "FALSE", "$PI"):
        return _constant(math.pi if name == "$PI" else float(name == "TRUE"))
    if name in FUNCTIONS:
        need(c, "(")
        return _function(name, _several(c, ")"), c)
    if not take(c, "["):
        return lambda names: names.get(name, ())
    axis = _AXIS.match(c.text, c.at)
    if axis and not re.fullmatch(r"R\d+", axis[1]):
        c.at, letter = axis.end(), axis[1]
        return lambda names: names.get(name, (letter,))
    index = _several(c, "]")
    return lambda names: names.get(name, tuple([f(names) for f in index]))


def _function(name: str, given: list[SiemensValueLater], c: Cursor) -> SiemensValueLater:
    if name in _ONE and len(given) == 1:
        one, argument = _ONE[name], given[0]
        return lambda names: applied(name, one, number(argument(names)))
    fault = c.fault(f"{name} with these values is no number")
    more = _MORE.get(name)

    def made(names: Names) -> SiemensValue:
        values = [f(names) for f in given]
        if more is None:
            raise fault
        try:
            return more(*values)
        except (TypeError, ValueError) as why:
            raise fault from why
    return made


def split_values(given: str) -> list[str]:
    """The values of a call, by the commas between them."""
    parts, depth, last, inside = list[str](), 0, 0, False
    for k, sign in enumerate(given):
        inside ^= sign == '"'
        depth += 0 if inside else (sign in "([") - (sign in ")]")
        if sign == "," and not depth and not inside:
            parts.append(given[last:k])
            last = k + 1
    return [*parts, given[last:]] if given.strip() else []


def axis_values(c: Cursor, names: Names) -> dict[str, float]:
    """What a frame states: values by axis, or RPL, up to the end of its row."""
    given = dict[str, float]()
    while True:
        skip(c)
        if c.done:
            return given
        key = c.match(re.compile(r"[A-Z]+"))
        if not key or key in given:
            raise c.fault(f"{key} stands twice" if key else "not a block of words")
        take(c, "=")
        given[key] = number(expression(c, names))
