"""String parameters of Klartext: QS parameters, what joins and cuts them, numbers that are made of them.

HEIDENHAIN TNC 640, Klartext Programming (34059x), string parameters: || joins; TOCHAR( DAT+Q1 DECIMALS3 ) and
SUBSTR( SRC_QS1 BEG0 LEN4 ) are strings; TONUMB( SRC_QS1 ), STRLEN( SRC_QS1 ), INSTR( SRC_QS1 SEA_QS2 BEG0 ) and
STRCOMP( SRC_QS1 SEA_QS2 ) are numbers; places count from 0.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import ROUND_HALF_UP, Decimal

from postproc.readback.macros.expressions import Cursor, MacroFault

_BLANKS = re.compile(r"[ \t]*")
_QUOTED = re.compile(r'"[^"]*"')
_QS = re.compile(r"QS(\d+)")
_SOURCE, _SOUGHT = re.compile(r"SRC_QS(\d+)"), re.compile(r"SEA_QS(\d+)")
_DIGITS = re.compile(r"[+]?\d+")
NUMBERS = re.compile(r"(?:TONUMB|STRLEN|INSTR|STRCOMP)(?=[ \t]*\()")
LONGEST = 255
"""characters that a string holds"""


class Strings:
    """The strings of a program by number; `value` reads a number of the program at a cursor."""

    def __init__(self, value: Callable[[Cursor], float]) -> None:
        self.held: dict[int, str] = {}
        self.value = value

    def get(self, index: int) -> str:
        """A string; a fault where the program has not set it."""
        if index not in self.held:
            raise MacroFault("gcode.variable", f"QS{index} is read before the program sets it: the control, another program "
                             "or the operator has set it", f'set it first, in a copy of the program: QS{index} = "..."')
        return self.held[index]

    def put(self, index: int, c: Cursor) -> None:
        """The string that stands at the cursor, to the end of the row."""
        made = self._part(c)
        while self._sign(c, "||"):
            made += self._part(c)
        c.match(_BLANKS)
        if not c.done:
            raise c.fault("a string that is not read")
        if len(made) > LONGEST:
            raise MacroFault("gcode.expression", f"a string of {len(made)} characters", f"the control holds {LONGEST}")
        self.held[index] = made

    def filled(self, row: str) -> str:
        """A row with the characters of strings in their place, in quotation marks."""
        return _QS.sub(lambda m: f'"{self.get(int(m[1]))}"', row)

    def number(self, name: str, c: Cursor) -> float:
        """The number of a function of strings, behind its name."""
        self._need(c, "(")
        source = self._of(c, _SOURCE)
        if name == "TONUMB":
            made = self._figure(source, c)
        elif name == "STRLEN":
            made = float(len(source))
        else:
            sought = self._of(c, _SOUGHT)
            if name == "INSTR":
                begin = self._stated(c, "BEG") or 0
                at = source.find(sought, begin)
                made = float(len(source) if at < 0 else at)
            else:
                made = float((source > sought) - (source < sought))
        self._need(c, ")")
        return made

    def _figure(self, text: str, c: Cursor) -> float:
        try:
            return float(Decimal(text.strip().replace(",", ".")))
        except ArithmeticError as fault:
            raise c.fault(f"TONUMB of {text!r}, which is no number") from fault

    def _part(self, c: Cursor) -> str:
        c.match(_BLANKS)
        if found := c.match(_QUOTED):
            return found[1:-1]
        if found := c.match(_QS):
            return self.get(int(found[2:]))
        if c.take("TOCHAR"):
            self._need(c, "(")
            self._need(c, "DAT")
            value, places = self.value(c), self._stated(c, "DECIMALS") or 0
            self._need(c, ")")
            return str(Decimal(repr(value)).quantize(Decimal(1).scaleb(-places), ROUND_HALF_UP))
        if c.take("SUBSTR"):
            self._need(c, "(")
            source = self._of(c, _SOURCE)
            begin = self._stated(c, "BEG") or 0
            length = self._stated(c, "LEN")
            self._need(c, ")")
            return source[begin:None if length is None else begin + length]
        raise c.fault("a string is missing, or a function that is not executed")

    def _of(self, c: Cursor, form: re.Pattern[str]) -> str:
        c.match(_BLANKS)
        found = c.match(form)
        if not found:
            raise c.fault("a string parameter is missing")
        return self.get(int(found.partition("QS")[2]))

    def _stated(self, c: Cursor, word: str) -> int | None:
        """The whole number behind a word; None where the word is not there."""
        if not self._sign(c, word):
            return None
        digits = c.match(_DIGITS)
        value = float(digits) if digits else self.value(c)
        if value < 0.0 or value != round(value) or value > LONGEST:
            raise c.fault(f"{word} with {value:g}")
        return round(value)

    def _sign(self, c: Cursor, sign: str) -> bool:
        c.match(_BLANKS)
        return c.take(sign)

    def _need(self, c: Cursor, sign: str) -> None:
        c.match(_BLANKS)
        c.need(sign)
