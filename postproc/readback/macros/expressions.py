"""Expressions of Fanuc's custom macro B and of LinuxCNC: values of words, conditions, assignments.

Fanuc B-64484EN (arithmetic and logic operation): functions, then * / AND MOD, then + - OR XOR, then comparisons;
a variable that was never set is vacant: it counts as 0, and EQ and NE know it from 0. LinuxCNC (G-code overview): ** before
* / MOD, + -, comparisons, AND OR XOR, which are 1 or 0; numbers nearer than 0.0001 are equal.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from decimal import Decimal

from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error

MacroValue = float | None
_NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
_NAME = re.compile(r"[A-Z]+")
LINUXCNC_EQUAL = 1e-4
ROUNDING = 1e-9
"""share by which two numbers that were worked out may differ and mean the same: controls have eight digits and more"""
_COMPARISONS = frozenset({"EQ", "NE", "GT", "GE", "LT", "LE"})
HINT = "write it as the control's manual has it, or give the figures themselves"


class MacroFault(Exception):
    """A block that cannot be executed: code, message, remedy; its line, where it is not the one that runs."""

    def __init__(self, code: str, message: str, hint: str = HINT, line: int = 0) -> None:
        super().__init__(message)
        self.code, self.message, self.hint, self.line = code, message, hint, line

    def at(self, file: str, line: int) -> Diagnostic:
        """The error, with the line of the block."""
        return error(self.code, self.message, file=file, lines=[self.line or line], hint=self.hint)


class Cursor:
    """A place in a row of text."""

    def __init__(self, text: str, at: int = 0) -> None:
        self.text, self.at = text, at

    def take(self, sign: str) -> bool:
        """True, and behind it, where `sign` stands here."""
        if not self.text.startswith(sign, self.at):
            return False
        self.at += len(sign)
        return True

    def need(self, sign: str) -> None:
        """Behind `sign`, which must stand here."""
        if not self.take(sign):
            raise self.fault(f"{sign!r} is missing")

    def match(self, form: re.Pattern[str]) -> str:
        """What of `form` stands here, "" for nothing."""
        found = form.match(self.text, self.at)
        self.at = found.end() if found else self.at
        return found[0] if found else ""

    def fault(self, what: str) -> MacroFault:
        """An error of syntax."""
        return MacroFault("gcode.expression", f"{what}: {self.text[:60]!r}")

    @property
    def done(self) -> bool:
        """True at the end."""
        return self.at >= len(self.text)


@dataclass(frozen=True)
class Grammar:
    """Operators by their signs, with (rank, function); a higher rank binds first. Functions of one argument.

    `full_turn`: ATAN lies between 0 and 360 degrees.
    """

    operators: dict[str, tuple[int, Callable[[MacroValue, MacroValue], float]]]
    functions: dict[str, Callable[[float], float]]
    full_turn: bool


def plain(a: MacroValue) -> float:
    """A value in arithmetic: vacant is 0."""
    return 0.0 if a is None else a


def _arithmetic(f: Callable[[float, float], float]) -> Callable[[MacroValue, MacroValue], float]:
    return lambda a, b: f(plain(a), plain(b))


def _bits(f: Callable[[int, int], int]) -> Callable[[MacroValue, MacroValue], float]:
    return lambda a, b: float(f(round(plain(a)), round(plain(b))))


def _divided(a: float, b: float) -> float:
    if b == 0.0:
        raise MacroFault("gcode.expression", "division by 0", "the control stops there: test the divisor before")
    return a / b


def _power(a: float, b: float) -> float:
    try:
        result = a ** b
    except (ValueError, ZeroDivisionError, OverflowError):
        result = math.nan
    if isinstance(result, complex) or not math.isfinite(result):
        raise MacroFault("gcode.expression", f"{a:g} to the power of {b:g} is no number")
    return float(result)


def _fanuc_modulo(a: float, b: float) -> float:
    return math.fmod(a, b) if b else _divided(a, b)


def _linuxcnc_modulo(a: float, b: float) -> float:
    rest = math.fmod(a, b) if b else _divided(a, b)
    return rest + abs(b) if rest < 0.0 else rest


def rounded(a: float) -> float:
    """To the nearest whole number, halves away from 0."""
    return math.copysign(math.floor(abs(a) + 0.5), a)


def _up(a: float) -> float:
    return math.copysign(math.ceil(abs(a)), a)


def _degrees(f: Callable[[float], float]) -> Callable[[float], float]:
    return lambda a: math.degrees(f(a))


def _sine(f: Callable[[float], float]) -> Callable[[float], float]:
    return lambda a: f(math.radians(a))


def _decimal_bits(a: float) -> float:
    return float(int(f"{round(abs(a))}", 16))


def _binary(a: float) -> float:
    digits = f"{round(abs(a)):x}"
    if not digits.isdigit():
        raise ValueError
    return float(digits)


COMMON: dict[str, Callable[[float], float]] = {
    "SIN": _sine(math.sin), "COS": _sine(math.cos), "TAN": _sine(math.tan), "ASIN": _degrees(math.asin),
    "ACOS": _degrees(math.acos), "SQRT": math.sqrt, "ABS": abs, "ROUND": rounded, "LN": math.log, "EXP": math.exp}
_COMPARED: dict[str, Callable[[float, float], bool]] = {
    "GT": lambda a, b: a > b, "GE": lambda a, b: a >= b, "LT": lambda a, b: a < b, "LE": lambda a, b: a <= b}


def _compared(f: Callable[[float, float], bool]) -> Callable[[MacroValue, MacroValue], float]:
    return lambda a, b: float(f(plain(a), plain(b)))


def _orders(rank: int) -> dict[str, tuple[int, Callable[[MacroValue, MacroValue], float]]]:
    return {name: (rank, _compared(f)) for name, f in _COMPARED.items()}


FANUC = Grammar({
    **_orders(1), "EQ": (1, lambda a, b: float(a == b)), "NE": (1, lambda a, b: float(a != b)),
    "+": (2, _arithmetic(lambda a, b: a + b)), "-": (2, _arithmetic(lambda a, b: a - b)),
    "OR": (2, _bits(lambda a, b: a | b)), "XOR": (2, _bits(lambda a, b: a ^ b)),
    "*": (3, _arithmetic(lambda a, b: a * b)), "/": (3, _arithmetic(_divided)),
    "MOD": (3, _arithmetic(_fanuc_modulo)), "AND": (3, _bits(lambda a, b: a & b))},
    {**COMMON, "SQR": math.sqrt, "RND": rounded, "FIX": lambda a: float(math.trunc(a)), "FUP": _up,
     "BIN": _binary, "BCD": _decimal_bits}, True)
LINUXCNC = Grammar({
    "AND": (1, _arithmetic(lambda a, b: float(a != 0.0 and b != 0.0))),
    "OR": (1, _arithmetic(lambda a, b: float(a != 0.0 or b != 0.0))),
    "XOR": (1, _arithmetic(lambda a, b: float((a != 0.0) != (b != 0.0)))),
    **_orders(2), "EQ": (2, _arithmetic(lambda a, b: float(abs(a - b) < LINUXCNC_EQUAL))),
    "NE": (2, _arithmetic(lambda a, b: float(abs(a - b) >= LINUXCNC_EQUAL))),
    "+": (3, _arithmetic(lambda a, b: a + b)), "-": (3, _arithmetic(lambda a, b: a - b)),
    "**": (5, _arithmetic(_power)), "*": (4, _arithmetic(lambda a, b: a * b)), "/": (4, _arithmetic(_divided)),
    "MOD": (4, _arithmetic(_linuxcnc_modulo))},
    {**COMMON, "FIX": lambda a: float(math.floor(a)), "FUP": lambda a: float(math.ceil(a))}, False)


ValueLater = Callable[[], MacroValue]
"""a value as it is at the time of the call"""


class Expressions:
    """Values from text without blanks, in capitals, each place taken apart once.

    `variable` takes apart what stands behind a #, `special` what stands behind a name that is no function.
    """

    def __init__(self, grammar: Grammar, variable: Callable[[Cursor], ValueLater],
                 special: Callable[[str, Cursor], ValueLater]) -> None:
        self.grammar, self.variable, self.special = grammar, variable, special
        signs = sorted(grammar.operators, key=len, reverse=True)
        self.signs = re.compile("|".join(re.escape(sign) for sign in signs))
        self.values: dict[tuple[str, int], tuple[ValueLater, int]] = {}
        self.whole: dict[tuple[str, int], tuple[ValueLater, int]] = {}
        self.unsure: list[str] = []

    def value(self, c: Cursor) -> MacroValue:
        """A number, a variable, a function or brackets, each with signs before it."""
        return self.once(self.values, c, self.compiled)

    def expression(self, c: Cursor) -> MacroValue:
        """Values joined by operators."""
        return self.once(self.whole, c, self.joined)

    def once(self, known: dict[tuple[str, int], tuple[ValueLater, int]], c: Cursor,
             compiled: Callable[[Cursor], ValueLater]) -> MacroValue:
        """The value at a cursor, its text taken apart the first time only."""
        key = c.text, c.at
        found = known.get(key)
        if found is None:
            found = known[key] = compiled(c), c.at
        c.at = found[1]
        return found[0]()

    def compiled(self, c: Cursor) -> ValueLater:
        """As `value`, to be asked for later."""
        if c.take("["):
            result = self.joined(c)
            c.need("]")
            return result
        if c.take("#"):
            return self.variable(c)
        if c.take("-"):
            return _negative(self.compiled(c))
        if c.take("+"):
            return self.compiled(c)
        number = c.match(_NUMBER)
        if number:
            return _constant(float(number))
        name = c.match(_NAME)
        if name == "ATAN":
            return self._arc_tangent(c)
        if name == "POW" and self.grammar.full_turn:
            return self._to_the_power(c)
        if name not in self.grammar.functions:
            return self.special(name, c)
        function = self.grammar.functions[name]
        argument = self._within(c)
        return lambda: applied(name, function, plain(argument()))

    def _within(self, c: Cursor) -> ValueLater:
        c.need("[")
        result = self.joined(c)
        c.need("]")
        return result

    def _arc_tangent(self, c: Cursor) -> ValueLater:
        c.need("[")
        rise = self.joined(c)
        run = self.joined(c) if c.take(",") else None
        c.need("]")
        if run is None and c.take("/"):
            run = self._within(c)

        def angle() -> float:
            made = math.degrees(math.atan2(plain(rise()), 1.0 if run is None else plain(run())))
            return made + 360.0 if made < 0.0 and run is not None and self.grammar.full_turn else made
        return angle

    def _to_the_power(self, c: Cursor) -> ValueLater:
        """POW[a,b] of Fanuc."""
        c.need("[")
        base = self.joined(c)
        c.need(",")
        power = self.joined(c)
        c.need("]")
        return lambda: _power(plain(base()), plain(power()))

    def joined(self, c: Cursor, rank: int = 0) -> ValueLater:
        """Values joined by operators that bind at least as `rank` does, from the left."""
        left = self.compiled(c)
        while True:
            found = self.signs.match(c.text, c.at)
            if found is None or self.grammar.operators[found[0]][0] < rank:
                return left
            c.at = found.end()
            binds, f = self.grammar.operators[found[0]]
            right = self.joined(c, binds + 1)
            compared = self.grammar.full_turn and found[0] in _COMPARISONS
            left = self._compared(found[0], f, left, right) if compared else _operated(f, left, right)

    def _compared(self, sign: str, f: Callable[[MacroValue, MacroValue], float], left: ValueLater,
                  right: ValueLater) -> ValueLater:
        """A comparison; two values that differ by no more than rounding are kept in `unsure`."""
        def made() -> float:
            a, b = left(), right()
            if a != b and unsure(a, b):
                self.unsure.append(f"{plain(a)!r} {sign} {plain(b)!r}")
            return f(a, b)
        return made


def unsure(a: MacroValue, b: MacroValue) -> bool:
    """True for two numbers that are one but for rounding: which is the larger one depends on the digits of the control."""
    return a is not None and b is not None and a != b and abs(a - b) <= ROUNDING * max(abs(a), abs(b))


def _constant(value: float) -> ValueLater:
    return lambda: value


def _negative(of: ValueLater) -> ValueLater:
    def made() -> MacroValue:
        value = of()
        return None if value is None else -value
    return made


def _operated(f: Callable[[MacroValue, MacroValue], float], left: ValueLater, right: ValueLater) -> ValueLater:
    return lambda: f(left(), right())


def applied(name: str, f: Callable[[float], float], argument: float) -> float:
    """A function of a number; what is no number is an error."""
    try:
        result = f(argument)
    except (ValueError, OverflowError) as fault:
        raise MacroFault("gcode.expression", f"{name} of {argument:g} is no number",
                         "the control stops there: test the value before") from fault
    return float(result)


def written(value: float, whole: bool = False) -> str:
    """A number as a word has it; `whole`: without a point, where it is a whole number."""
    if not math.isfinite(value):
        raise MacroFault("gcode.expression", f"a value is {value}", "the control stops there: test it before")
    if value == round(value) and abs(value) < 1e15:
        return f"{round(value)}" + ("" if whole else ".")
    text = format(Decimal(repr(value)), "f")
    return text if "." in text else text + "."
