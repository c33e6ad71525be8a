"""Custom macro B of Fanuc, Mazak (EIA) and Haas executed: variables, IF, WHILE, GOTO, G65, G66, M97, M98, M99.

Fanuc B-64484EN, custom macro and subprogram call; Haas mill operator's manual, macros and M97, M98, M99.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from postproc.readback.macros.expressions import (
    FANUC,
    Cursor,
    Expressions,
    MacroFault,
    MacroValue,
    ValueLater,
    plain,
    rounded,
)
from postproc.readback.macros.fanuc_variables import Variables
from postproc.readback.macros.held import Held
from postproc.readback.macros.plane_words import PlaneWords
from postproc.readback.macros.scaled_words import ScaledWords
from postproc.readback.macros.sources import ProgramFiles, SourceFile
from postproc.readback.macros.word_blocks import Blocks, Word, coded
from postproc.readback.text.flow import DEEPEST

_SEQUENCE = re.compile(r"N\d+")
_PROGRAM = re.compile(r"O(\d+)")
_PLAIN = re.compile(r"(?:[A-Z][-+]?(?:\d+(?:\.\d*)?|\.\d+))+")
_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
_PRINTED = re.compile(r"(?:POPEN|PCLOS|[BD]PRNT\[.*\]|SETVN#.*)$")
_LETTER = re.compile(r"[A-Z]")
_DIGITS = re.compile(r"\d+")
FIRST = {"A": 1, "B": 2, "C": 3, "I": 4, "J": 5, "K": 6, "D": 7, "E": 8, "F": 9, "H": 11, "M": 13, "Q": 17, "R": 18, "S": 19,
         "T": 20, "U": 21, "V": 22, "W": 23, "X": 24, "Y": 25, "Z": 26}
"""local variables of the arguments (specification I); I, J, K once more are #7 to #9 and so on (specification II)"""
_CALLS = (("G", 65.0), ("G", 66.0), ("G", 66.1), ("M", 98.0), ("M", 198.0), ("M", 97.0), ("M", 99.0), ("G", 67.0))
_SCALED = frozenset("ABCEIJKQRUVWXYZ")
"""arguments whose unit, without a point, is a parameter of the control"""


@dataclass
class Level:
    """A program that runs: its lines first..last, the next one, its local variables, how often it runs again."""

    source: SourceFile
    first: int
    last: int
    at: int
    local: dict[int, MacroValue]
    times: int = 1
    modal: bool = False


@dataclass
class ModalCall:
    """What G66 calls behind each block that moves."""

    program: int
    times: int
    local: dict[int, MacroValue] = field(default_factory=dict)


class FanucMacros:
    """Executes a program; `haas` where the control is one."""

    def __init__(self, sources: ProgramFiles, held: Held, haas: bool) -> None:
        self.sources, self.held, self.haas = sources, held, haas
        self.blocks = Blocks(held, False, sources.read[0].name)
        self.levels: list[Level] = []
        self.modal: ModalCall | None = None
        self.plane = PlaneWords(self.blocks, haas)
        self.scaled = ScaledWords(self.blocks, self.plane, haas)
        self.variables = Variables(self.blocks, held)
        self.expressions = Expressions(FANUC, self.variable, self._unknown)
        self.words_of: dict[str, list[Word]] = {}
        self.line, self.ended = 0, False

    def run(self) -> None:
        """From the first line to M30."""
        first = self.sources.read[0]
        last = next((k - 1 for k, row in enumerate(first.rows) if _PROGRAM.match(row) and any(
            _PROGRAM.match(r) for r in first.rows[:k])), len(first.rows) - 1)
        self.levels = [Level(first, 0, last, 0, {})]
        while self.levels and not self.ended:
            level = self.levels[-1]
            if level.at > level.last:
                if len(self.levels) > 1:
                    raise MacroFault("gcode.subprogram", "the subprogram has no M99", "end it with M99")
                return
            row, self.line = level.source.rows[level.at], level.source.before + level.at + 1
            level.at += 1
            if row:
                self.blocks.count(self.line)
                self.statement(row)
                if self.expressions.unsure:
                    self.blocks.compared.setdefault(self.line, self.expressions.unsure[0])
                    self.expressions.unsure.clear()

    def statement(self, row: str) -> None:
        """One row: a macro statement, or a block of words."""
        row = row[len(m[0]):] if (m := _SEQUENCE.match(row)) else row
        c = Cursor(row)
        if row.startswith("#"):
            self.assign(c)
        elif row.startswith("IF["):
            self.branch(c)
        elif row.startswith("GOTO"):
            c.take("GOTO")
            self.jump(self.number(c))
        elif row.startswith(("WHILE[", "DO")) and not row.startswith("DO["):
            self.loop(c)
        elif row.startswith("END"):
            self.again(row[3:])
        elif m := _PROGRAM.match(row):
            if len(self.levels) == 1:
                self.blocks.write(m[0], self.line)
        elif row and not _PRINTED.match(row):
            self.block(self.words(row))

    def _unknown(self, name: str, c: Cursor) -> ValueLater:
        raise c.fault(f"{name or 'nothing'} stands where a value is asked for")

    def variable(self, c: Cursor) -> ValueLater:
        """#n, #[...] or ##n."""
        digits = c.match(_DIGITS)
        if digits:
            index = int(digits)
            return lambda: self.variables.get(index, self.levels[-1].local)
        place = self.expressions.compiled(c)
        return lambda: self.variables.get(_index(plain(place())), self.levels[-1].local)

    def index(self, c: Cursor) -> int:
        """The number behind a #."""
        digits = c.match(_DIGITS)
        return int(digits) if digits else _index(plain(self.expressions.value(c)))

    def number(self, c: Cursor) -> int:
        """A whole number, a variable or an expression, to the end of the row."""
        value = plain(self.expressions.value(c))
        if not c.done:
            raise c.fault("words behind a jump")
        return round(value)

    def assign(self, c: Cursor) -> None:
        """#1=..., one or more in a row."""
        while not c.done:
            c.need("#")
            index = self.index(c)
            c.need("=")
            value = self.expressions.expression(c)
            if index == 3000:
                raise MacroFault("gcode.alarm", f"the program stops the control with alarm {plain(value):g} (#3000)",
                                 "it tests what its head sets: state what it asks for")
            self.variables.put(index, value, self.levels[-1].local, self.line)

    def condition(self, c: Cursor) -> bool:
        """[...] that is not 0."""
        c.need("[")
        value = plain(self.expressions.expression(c))
        c.need("]")
        return value != 0.0

    def branch(self, c: Cursor) -> None:
        """IF [...] GOTO n, IF [...] THEN ..."""
        c.need("IF")
        holds = self.condition(c)
        if c.take("GOTO"):
            target = self.number(c)
            if holds:
                self.jump(target)
        elif c.take("THEN") or self.haas:
            if holds:
                self.statement(c.text[c.at:])
        else:
            raise c.fault("GOTO or THEN is missing behind IF [...]")

    def loop(self, c: Cursor) -> None:
        """WHILE [...] DO m: behind END m where the condition does not hold."""
        holds = self.condition(c) if c.take("WHILE") else True
        c.need("DO")
        mark = c.text[c.at:]
        level = self.levels[-1]
        end = self.found(level, f"END{mark}", level.at, level.last + 1)
        if not holds:
            level.at = end + 1

    def again(self, mark: str) -> None:
        """END m: back to its DO."""
        level = self.levels[-1]
        level.at = self.found(level, f"DO{mark}", level.first, level.at - 1, last=True)

    def found(self, level: Level, sign: str, first: int, stop: int, last: bool = False) -> int:
        """The row of a loop's END, the first one, or of its DO, the last."""
        key = f"{sign} {first} {stop}"
        places = level.source.places
        if key not in places:
            rows = range(stop - 1, first - 1, -1) if last else range(first, stop)
            places[key] = next((k for k in rows if _ends(level.source.rows[k], sign, last)), -1)
        if places[key] < 0:
            raise MacroFault("gcode.jump", f"a loop has no {sign}", "every DO m has its END m in the same program")
        return places[key]

    def jump(self, target: int, level: Level | None = None) -> None:
        """GOTO n: to the block N of the program, behind it first."""
        level = level or self.levels[-1]
        if not level.source.numbers:
            for k, row in enumerate(level.source.rows):
                if m := _SEQUENCE.match(row):
                    level.source.numbers.setdefault(int(m[0][1:]), []).append(k)
        rows = [k for k in level.source.numbers.get(target, ()) if level.first <= k <= level.last]
        if not rows:
            raise MacroFault("gcode.jump", f"there is no block N{target} to jump to", "number the block that is meant")
        level.at = next((k for k in rows if k >= level.at), rows[0])

    def words(self, row: str) -> list[Word]:
        """The words of a row; those whose variable is vacant are left out."""
        known = self.words_of.get(row)
        if known is None and _PLAIN.fullmatch(row):
            known = self.words_of[row] = [Word(a, float(v), a + v) for a, v in _WORD.findall(row)]
        if known is not None:
            return known
        c, made = Cursor(row), list[Word]()
        while not c.done:
            if c.take(","):
                raise c.fault(", with a chamfer or a rounding is not executed")
            start, letter = c.at, c.match(_LETTER)
            if not letter:
                raise c.fault("not a block of words")
            number = _WORD.match(row, start)
            if number:
                c.at = number.end()
                made.append(Word(letter, float(number[2]), number[0]))
            elif (value := self.expressions.value(c)) is not None:
                made.append(Word(letter, coded(letter, value)))
        return made

    def block(self, words: Sequence[Word]) -> None:
        """A block of words, with calls and returns."""
        passive = self.held.passive
        codes = {(w.letter, w.value) for w in words if w.letter in "GM" and f"{w.letter}{w.value:g}" not in passive}
        call = next((k for k in _CALLS if k in codes), None)
        if call in (("G", 65.0), ("G", 66.0), ("G", 66.1)):
            self.macro_call(words, call[1])
            return
        if call == ("G", 67.0):
            self.modal, words = None, [w for w in words if (w.letter, w.value) != call]
        elif call is not None and call[1] in (98.0, 198.0, 97.0) and (call[1] != 97.0 or self.haas):
            self.subprogram(words, call[1])
            return
        elif call == ("M", 99.0):
            self.returned(words)
            return
        moved = self.written(words) if words else False
        self.ended = bool({("M", 2.0), ("M", 30.0)} & codes)
        if moved and self.modal is not None and not self.levels[-1].modal:
            self.call(self.modal.program, self.modal.times, self.modal.local, modal=True)

    def written(self, words: Sequence[Word]) -> bool:
        """A block without calls; True where it moves an axis."""
        made = self.plane.taken(self.scaled.taken(words))
        self.blocks.within = self.scaled.name or self.blocks.within
        return bool(made) and self.blocks.block(made, self.line)

    def subprogram(self, words: Sequence[Word], code: float) -> None:
        """M98 P L, M198 (of another folder or store: a file next to the program), and Haas' M97; other words come first."""
        stated = {w.letter: w.value for w in words}
        if "P" not in stated:
            raise MacroFault("gcode.subprogram", f"M{code:g} without P", "state the number of the program: M98 P1000")
        rest = [w for w in words if w.letter not in "PLN" and w.value != code]
        if rest:
            self.written(rest)
        number, times = int(stated["P"]), int(stated.get("L", 1.0))
        if code == 97.0:
            level = self.levels[-1]
            self.push(Level(level.source, level.first, len(level.source.rows) - 1, level.at, level.local, times))
            self.jump(number)
            self.levels[-1].first = self.levels[-1].at
            return
        if number > 9999 and "L" not in stated and not self.haas:
            number, times = number % 10000, number // 10000
        self.call(number, times, self.levels[-1].local)

    def macro_call(self, words: Sequence[Word], code: float) -> None:
        """G65 and G66 P L with arguments."""
        if code == 66.1:
            raise MacroFault("gcode.subprogram", "G66.1 is not executed", "write G66, or G65 in each block")
        stated = {w.letter: w.value for w in words}
        if "P" not in stated:
            raise MacroFault("gcode.subprogram", f"G{code:g} without P", "state the number of the program: G65 P9000")
        local = arguments([w for w in words if w.letter not in "GNPLO"])
        if code == 65.0:
            self.call(int(stated["P"]), int(stated.get("L", 1.0)), local)
        elif self.modal is not None:
            raise MacroFault("gcode.subprogram", "G66 while another G66 is on", "write G67 before it")
        else:
            self.modal = ModalCall(int(stated["P"]), int(stated.get("L", 1.0)), local)

    def call(self, number: int, times: int, local: dict[int, MacroValue], modal: bool = False) -> None:
        """A program by its number: of the file that calls, of the others that were read, of a file next to them."""
        here = self.levels[-1].source
        span = next((s for source in (here, *self.sources.read) if (s := program(source, number))), None)
        if span is None:
            stems = (f"O{number}", f"O{number:04d}", f"O{number:05d}", f"{number}", f"{number:04d}")
            source = self.sources.open(stems)
            span = None if source is None else program(source, number) or (source, 0, len(source.rows) - 1)
        if span is None:
            raise MacroFault("gcode.subprogram", f"there is no subprogram O{number}",
                             f"put it next to the program, as O{number:04d}.nc")
        self.push(Level(*span, span[1], local, times, modal or self.levels[-1].modal))

    def push(self, level: Level) -> None:
        """One level deeper."""
        if len(self.levels) > DEEPEST:
            raise MacroFault("gcode.subprogram", f"subprograms call one another more than {DEEPEST} deep, or without an end",
                             "the control takes no more levels")
        if level.times > 0:
            self.levels.append(level)

    def returned(self, words: Sequence[Word]) -> None:
        """M99: again, or back to the block behind the call, or with P to a block of the caller."""
        target = next((int(w.value) for w in words if w.letter == "P"), None)
        rest = [w for w in words if w.letter not in "PLN" and (w.letter, w.value) != ("M", 99.0)]
        if rest:
            self.written(rest)
        level = self.levels[-1]
        if len(self.levels) == 1:
            if target is None:
                raise MacroFault("gcode.subprogram", "M99 in the main program starts it again", "write M30")
            self.jump(target)
            return
        level.times -= 1
        if level.times > 0 and target is None:
            level.at = level.first
            return
        self.levels.pop()
        if target is not None:
            self.jump(target)


def _index(number: float) -> int:
    """The whole number of a variable."""
    if number != rounded(number):
        raise MacroFault("gcode.expression", f"the number of a variable is not whole: #[{number:g}]")
    return int(number)


def _ends(row: str, sign: str, behind: bool) -> bool:
    """True where a row, its number aside, is that END, or ends with that DO."""
    row = _SEQUENCE.sub("", row, count=1) if row.startswith("N") else row
    return row.endswith(sign) and row.startswith(("WHILE[", "DO")) if behind else row == sign


def arguments(words: Sequence[Word]) -> dict[int, MacroValue]:
    """Local variables of a macro call: sets of I, J, K one behind the other."""
    local: dict[int, MacroValue] = {}
    sets, before = 0, ""
    for w in words:
        if w.letter in _SCALED and w.text and "." not in w.text and w.value:
            raise MacroFault("gcode.decimal_point", f"argument {w.text} has no decimal point: its unit is a parameter "
                             "of the control", "write the decimal point")
        if w.letter not in FIRST:
            raise MacroFault("gcode.subprogram", f"{w.letter} is no argument of a macro", "G, L, N, O and P are none")
        if w.letter in "IJK":
            sets += bool(before) and w.letter <= before
            before = w.letter
            local[FIRST[w.letter] + 3 * sets] = w.value
        else:
            local[FIRST[w.letter]] = w.value
    return local


def program(source: SourceFile, number: int) -> tuple[SourceFile, int, int] | None:
    """Rows of O number in a file."""
    key = f"O {number}"
    if key not in source.places:
        source.places[key] = next((k for k, row in enumerate(source.rows) if (m := _PROGRAM.match(row)) and
                                   int(m[1]) == number), -1)
    first = source.places[key]
    if first < 0:
        return None
    key = f"O {number} last"
    if key not in source.places:
        source.places[key] = next((k - 1 for k in range(first + 1, len(source.rows)) if _PROGRAM.match(source.rows[k])),
                                  len(source.rows) - 1)
    return source, first, source.places[key]
