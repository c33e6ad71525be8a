"""Expressions of SINUMERIK 840D (Programming Manual Job Planning, arithmetic functions; priority of the operations).

From the first that binds: NOT B_NOT; * / DIV MOD; + -; B_AND; B_XOR; B_OR; AND; XOR; OR; <<; comparisons, equal within a
part in 1e12.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Protocol

from postproc.readback.macros.expressions import COMMON, Cursor, MacroFault, applied

SiemensValue = float | str
BLANKS = re.compile(r"[ \t]*")
NAME = re.compile(r"[A-Z_$][A-Z_$][A-Z0-9_$]*|R\d+")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?")
_CODED = re.compile(r"'(H[0-9A-F]+|B[01]+)'")
_STRING = re.compile(r'"[^"]*"')
_SIGN = re.compile(r"==|<>|<=|>=|<<|[-+*/<>]|(?:B_AND|B_XOR|B_OR|AND|XOR|OR|DIV|MOD)(?![A-Z0-9_$])")
_EQUAL = 1e-12


class Names(Protocol):
    """Where values of names come from."""

    def get(self, name: str, index: tuple[SiemensValue, ...]) -> SiemensValue:
        """A variable, an element of one, or a system variable."""


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


def value_of(c: Cursor, names: Names) -> SiemensValue:
    """A number, characters, a name, a function or brackets, with a sign before it."""
    skip(c)
    if c.take("("):
        result = expression(c, names)
        need(c, ")")
        return result
    if c.take("-"):
        return -number(value_of(c, names))
    if c.take("+"):
        return value_of(c, names)
    if found := c.match(_STRING):
        return found[1:-1]
    if found := c.match(_NUMBER):
        return float(found.replace("EX", "e"))
    if found := c.match(_CODED):
        return float(int(found[2:-1], 16 if found[1] == "H" else 2))
    name = c.match(NAME) or ("R" if c.text.startswith("R[", c.at) and c.take("R") else "")
    if not name:
        raise c.fault("a value is missing")
    return _named(name, c, names)


def _named(name: str, c: Cursor, names: Names) -> SiemensValue:
    if name in ("NOT", "B_NOT"):
        inner = number(value_of(c, names))
        return float(not inner) if name == "NOT" else float(~int(inner))
    if name in ("TRUE", "FALSE"):
        return float(name == "TRUE")
    if name == "$PI":
        return math.pi
    if name in FUNCTIONS:
        need(c, "(")
        given = listed(c, names, ")")
        if name in _ONE and len(given) == 1:
            return applied(name, _ONE[name], number(given[0]))
        try:
            return _MORE[name](*given)
        except (KeyError, TypeError, ValueError) as fault:
            raise c.fault(f"{name} with these values is no number") from fault
    index = tuple(indices(c, names)) if take(c, "[") else ()
    return names.get(name, index)


def indices(c: Cursor, names: Names) -> list[SiemensValue]:
    """What stands between [ and ]: numbers, or names of axes, which stand for themselves."""
    axis = re.compile(r"[ \t]*([A-Z]\d*)[ \t]*\]").match(c.text, c.at)
    if axis and not re.fullmatch(r"R\d+", axis[1]):
        c.at = axis.end()
        return [axis[1]]
    return listed(c, names, "]")


def expression(c: Cursor, names: Names, rank: int = 0) -> SiemensValue:
    """Values joined by operators that bind at least as `rank` does, from the left."""
    left = value_of(c, names)
    while True:
        at = c.at
        skip(c)
        sign = c.match(_SIGN)
        if not sign or OPERATORS[sign][0] < rank:
            c.at = at
            return left
        binds, f = OPERATORS[sign]
        left = f(left, expression(c, names, binds + 1))
