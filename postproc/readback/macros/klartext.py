"""Klartext executed: Q, QL and QR parameters, FN functions, formulas, labels, programs that are called.

HEIDENHAIN TNC 640, Klartext Programming (34059x), subprograms and program section repeats, Q parameters: FN 0 to FN 5
arithmetic, FN 6 to
FN 8 and FN 13 angles, FN 9 to FN 12 jumps; formulas reckon ^ before * / % before + -, functions take the value behind them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import PurePath

from postproc.readback.macros.expressions import Cursor, MacroFault, applied, unsure, written
from postproc.readback.macros.held import Held
from postproc.readback.macros.klartext_datum import DatumShift
from postproc.readback.macros.klartext_strings import NUMBERS, Strings
from postproc.readback.macros.klartext_system import SystemData
from postproc.readback.macros.sources import ProgramFiles, SourceFile
from postproc.readback.macros.word_blocks import Blocks
from postproc.readback.text.flow import DEEPEST
from postproc.readback.text.words import lines_of
from toolpaths.diagnostics import Diagnostic

_COMMENT = re.compile(rb";[^~\n]*(?:~[ \t]*(?=\n))?|;[^\n]*")
_BLANKS = re.compile(r"[ \t]*")
_NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
_Q = re.compile(r"Q([LRS]?)(\d+)")
_SIGN = re.compile(r"[-+*/^%]")
_FUNCTION = re.compile(r"SQRT|SQ|SIN|COS|TAN|ASIN|ACOS|ATAN|LN|LOG|EXP|NEG|INT|ABS|FRAC|SGN|PI")
_GIVEN = re.compile(r"(Q[LRS]?\d+)[ \t]*=[ \t]*")
_STRING = re.compile(r"(?:DECLARE STRING[ \t]+)?QS(\d+)[ \t]*=[ \t]*")
_NAMED = re.compile(r"(TOOL (?:CALL|DEF)[ \t]+)\"([^\"]*)\"")
_USED = re.compile(r"\"[^\"]*\"|([-+]?)[ \t]*Q([LRS]?)(\d+)(?![\d]|[ \t]*=)")
"""parameters of a row, and names in quotes, which hold none"""
_FN = re.compile(r"FN[ \t]*(\d+)[ \t]*:[ \t]*")
_JUMP = re.compile(r"IF[ \t]*(.+?)[ \t]*(EQU|NE|GT|LT|IS UNDEFINED|IS DEFINED)[ \t]*(.*?)[ \t]*GOTO LBL[ "
                    "\t]*(?:\"([^\"]+)\"|(\\S+))")
_LABEL = re.compile(r"LBL[ \t]+\"?([^\"]+?)\"?")
_CALL = re.compile(r"CALL LBL[ \t]+\"?([^\"]+?)\"?(?:[ \t]+REP[ \t]?(\d+))?")
_PROGRAM = re.compile(r"CALL PGM[ \t]+(\"[^\"]+\"|\S+)")
_BEGIN = re.compile(r"(BEGIN|END) PGM[ \t]+\S+[ \t]*(MM|INCH)?")
_TOOL = re.compile(r"(TOOL CALL[ \t]+)\+?(\d+)\.(?!\d)")
PASSIVE = (16, 20, 38)
"""functions that print, wait for the blocks before to be done, and send"""
_END = re.compile(r"(?<![A-Z0-9])M0?(?:2|30)(?![0-9])")
_TWO: dict[int, tuple[str, Callable[[float, float], float]]] = {
    1: (r"\+", lambda a, b: a + b), 2: ("-", lambda a, b: a - b), 3: (r"\*", lambda a, b: a * b),
    4: ("DIV", lambda a, b: _divided(a, b)), 8: ("LEN", math.hypot),
    13: ("ANG", lambda a, b: math.degrees(math.atan2(a, b)) % 360.0)}
_ONE: dict[int, tuple[str, str]] = {5: ("SQRT", "SQRT"), 6: ("SIN", "SIN"), 7: ("COS", "COS")}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "SQ": lambda a: a * a, "SQRT": math.sqrt, "SIN": lambda a: math.sin(math.radians(a)),
    "COS": lambda a: math.cos(math.radians(a)), "TAN": lambda a: math.tan(math.radians(a)),
    "ASIN": lambda a: math.degrees(math.asin(a)), "ACOS": lambda a: math.degrees(math.acos(a)),
    "ATAN": lambda a: math.degrees(math.atan(a)), "LN": math.log, "LOG": math.log10, "EXP": math.exp, "NEG": lambda a: -a,
    "INT": lambda a: float(math.trunc(a)), "ABS": abs, "FRAC": lambda a: a - math.trunc(a),
    "SGN": lambda a: float((a > 0.0) - (a < 0.0))}
_RANKS = {"+": 0, "-": 0, "*": 1, "/": 1, "%": 1, "^": 2}


def _divided(a: float, b: float) -> float:
    if b == 0.0:
        raise MacroFault("gcode.expression", "division by 0", "the control stops there: test the divisor before")
    return a / b


def _joined(a: float, sign: str, b: float) -> float:
    if sign == "^":
        return applied("^", lambda x: _real(x ** b), a)
    if sign == "%":
        return math.fmod(a, b) if b else _divided(a, b)
    return {"+": a + b, "-": a - b, "*": a * b}[sign] if sign != "/" else _divided(a, b)


def _real(value: float | complex) -> float:
    if isinstance(value, complex):
        raise ValueError
    return value


@dataclass
class KlartextLevel:
    """A program or a part of it that runs: its next row; its QL parameters; `label`: it returns at LBL 0."""

    source: SourceFile
    at: int
    label: bool
    local: dict[int, float] = field(default_factory=dict)
    left: dict[int, int] = field(default_factory=dict)


def klartext_rows(data: bytes, file: str) -> tuple[list[str], list[Diagnostic]]:
    """Rows without comments and block numbers, in capitals; what ~ joins stands in the first of its rows."""
    text = _COMMENT.sub(lambda m: b"~" if m[0].rstrip().endswith(b"~") else b"", lines_of(data).upper())
    rows, made = text.decode("ascii", "replace").split("\n")[:-1], list[str]()
    first = -1
    for k, row in enumerate(rows):
        row, more = row.strip(), row.rstrip().endswith("~")
        body = re.sub(r"^/?[ \t]*\d+[ \t]+", "/" if row.startswith("/") else "", row + " ").strip().rstrip("~").strip()
        if first >= 0:
            made[first] += " " + row.rstrip("~").strip()
            made.append("")
        else:
            made.append(body)
        first = (k if first < 0 else first) if more else -1
    return made, []


class KlartextMacros:
    """Executes a program and what it calls."""

    def __init__(self, sources: ProgramFiles, held: Held) -> None:
        self.sources, self.held = sources, held
        self.blocks = Blocks(held, False, sources.read[0].name)
        self.levels = [KlartextLevel(sources.read[0], 0, False)]
        self.parameters: dict[tuple[str, int], float] = {}
        self.strings, self.system = Strings(self.term), SystemData(held)
        self.datum = DatumShift()
        self.units = ""
        self.line, self.ended = 0, False

    def run(self) -> None:
        """From BEGIN PGM to M30 or END PGM."""
        self._rows()
        main = self.sources.read[0]
        end = next((k for k, row in enumerate(main.rows) if row.startswith("END PGM")), -1)
        if end >= 0 and self.blocks.rows and not self.blocks.rows[-1].startswith("END PGM"):
            self.blocks.write(main.rows[end], end + 1)

    def _rows(self) -> None:
        while not self.ended:
            level = self.levels[-1]
            if level.at >= len(level.source.rows):
                if len(self.levels) == 1:
                    return
                self._back(level)
                continue
            row, self.line = level.source.rows[level.at], level.source.before + level.at + 1
            level.at += 1
            if row:
                self.blocks.count(self.line)
                self.statement(level, row)

    def _back(self, level: KlartextLevel) -> None:
        if level.label:
            raise MacroFault("gcode.subprogram", "the subprogram has no LBL 0", "end it with LBL 0")
        self.levels.pop()

    def statement(self, level: KlartextLevel, row: str) -> None:
        """One row."""
        if m := _FN.match(row):
            self._fn(int(m[1]), row[m.end():])
        elif m := _STRING.match(row):
            self.strings.put(int(m[1]), Cursor(row, m.end()))
        elif (m := _GIVEN.match(row)) is not None:
            self.put(m[1], self.formula(Cursor(row, m.end())))
        elif m := _LABEL.fullmatch(row):
            if m[1] == "0" and level.label:
                self.levels.pop()
        elif m := _CALL.fullmatch(self.filled(row) if "Q" in row and row.startswith("CALL LBL") else row):
            self._call(level, m[1].rstrip("."), m[2])
        elif m := _PROGRAM.fullmatch(self.strings.filled(row) if "QS" in row else row):
            self._program(m[1])
        elif m := _BEGIN.fullmatch(row):
            self._frame(level, row, m[1], m[2] or "")
        else:
            self._plain(row)

    def _plain(self, row: str) -> None:
        """Words with figures in the place of parameters; CYCL DEF sets the parameters that it states."""
        row = self.filled(row, row.startswith("CYCL DEF"))
        if row.startswith("TOOL CALL"):
            self.system.called(row)
        if self.datum.stated(row):
            return
        self.blocks.write(self.datum.shifted(row), self.line)
        self.ended = len(self.levels) >= 1 and bool(_END.search(row)) and not row.startswith("CYCL")

    def _frame(self, level: KlartextLevel, row: str, which: str, units: str) -> None:
        if which == "BEGIN":
            if self.units and units != self.units:
                raise MacroFault("gcode.units", "programs in mm and in inches that call one another",
                                 "write all of them in mm, or all in inches")
            self.units = self.system.units = self.units or units
        if len(self.levels) == 1:
            self.blocks.write(row, self.line)
            self.ended = which == "END"
        elif which == "END":
            self._back(level)

    def filled(self, row: str, keeps: bool = False) -> str:
        """A row with figures in the place of parameters."""
        if keeps:
            for m in _GIVEN.finditer(row):
                value = self.term(Cursor(row, m.end()))
                self.put(m[1], value)
        if "QS" in row:
            row = _NAMED.sub(lambda m: m[1] + str(self._tool(m[2])), self.strings.filled(row))
        row = _USED.sub(lambda m: m[0] if m[0].startswith('"') else self._figure(m), row)
        return _TOOL.sub(r"\1\2", row)

    def _figure(self, m: re.Match[str]) -> str:
        value = self.get(m[2], int(m[3]))
        return " " * (m[1] == "" and m[0][:1] == " ") + (written(-value if m[1] == "-" else value, True) if not m[1] else
                                                        _signed(-value if m[1] == "-" else value))

    def get(self, kind: str, index: int) -> float:
        """A parameter."""
        held = self.levels[-1].local.get(index) if kind == "L" else self.parameters.get((kind, index))
        if kind == "S":
            raise MacroFault("gcode.variable", f"QS{index} holds characters, where a number is asked for",
                             "TONUMB makes one of it")
        if held is None:
            raise MacroFault("gcode.variable", f"Q{kind}{index} is read before the program sets it: the control, another "
                                               f"program or "
                             "the operator has set it", f"set it first, in a copy of the program: Q{kind}{index} = ...")
        return held

    def put(self, name: str, value: float) -> None:
        """A parameter set."""
        m = _Q.fullmatch(name)
        if m is None or m[1] == "S":
            raise MacroFault("gcode.variable", f"{name} holds characters, where a number is set", "use a Q parameter")
        if m[1] == "L":
            self.levels[-1].local[int(m[2])] = value
        else:
            self.parameters[(m[1], int(m[2]))] = value

    def term(self, c: Cursor) -> float:
        """A figure, a parameter, a function of what follows, or brackets, with signs before it."""
        c.match(_BLANKS)
        if c.take("("):
            value = self._sum(c, 0)
            c.match(_BLANKS)
            c.need(")")
            return value
        if c.take("-"):
            return -self.term(c)
        if c.take("+"):
            return self.term(c)
        if number := c.match(_NUMBER):
            return float(number)
        if name := c.match(_Q):
            m = _Q.fullmatch(name)
            assert m is not None
            return self.get(m[1], int(m[2]))
        if of_strings := c.match(NUMBERS):
            return self.strings.number(of_strings, c)
        function = c.match(_FUNCTION)
        if function == "PI":
            return math.pi
        if not function:
            raise c.fault("a value is missing")
        return applied(function, _FUNCTIONS[function], self.term(c))

    def _sum(self, c: Cursor, rank: int) -> float:
        left = self.term(c)
        while True:
            at = c.at
            c.match(_BLANKS)
            sign = c.match(_SIGN)
            if not sign or _RANKS[sign] < rank:
                c.at = at
                return left
            left = _joined(left, sign, self._sum(c, _RANKS[sign] + 1))

    def formula(self, c: Cursor) -> float:
        """A whole formula."""
        value = self._sum(c, 0)
        c.match(_BLANKS)
        if not c.done:
            raise c.fault("a formula that is not read")
        return value

    def _tool(self, name: str) -> int:
        """The number of a tool that is called by its name."""
        known = {called.upper(): n for n, called in self.held.tools.items()}
        if name.upper() not in known:
            raise MacroFault("gcode.tool_name", f'no tool is called "{name}"',
                             '[tools.N] called = "..." of the set-up: the number of the tool that the control calls so')
        return known[name.upper()]

    def _whole_term(self, text: str) -> float:
        c = Cursor(text)
        value = self.term(c)
        c.match(_BLANKS)
        if not c.done:
            raise c.fault("a value that is not read")
        return value

    def _fn(self, number: int, rest: str) -> None:
        """FN 0 to FN 18; what FN 16, FN 20 and FN 38 print, wait for and send moves nothing."""
        if number in PASSIVE:
            return
        if number == 18:
            self.put(*self.system.read(rest, self._whole_term))
            return
        if number in (9, 10, 11, 12):
            self._branch(rest)
            return
        if number == 14:
            raise MacroFault("gcode.alarm", f"the program stops the control: FN 14 {rest[:40]}",
                             "it tests what its head sets: state what it asks for")
        given = _GIVEN.match(rest)
        if given is None or number not in (0, *_TWO, *_ONE):
            raise MacroFault("gcode.variable", f"FN {number} is not executed", "allowed are FN 0 to FN 13, FN 16, FN 18, "
                             "FN 20, FN 38, and formulas")
        text = rest[given.end():].strip()
        if number == 0:
            value = self._whole_term(text)
        elif number in _ONE:
            sign, name = _ONE[number]
            value = applied(name, _FUNCTIONS[name], self._whole_term(text.removeprefix(sign)))
        else:
            sign, f = _TWO[number]
            m = re.fullmatch(rf"([-+]?[ \t]*[Q.\d][^-+*D \tL]*|[^ \t]+)[ \t]*{sign}[ \t]*(.+)", text)
            if m is None:
                raise Cursor(text).fault(f"FN {number} that is not read")
            value = f(self._whole_term(m[1]), self._whole_term(m[2]))
        self.put(given[1], value)

    def _branch(self, rest: str) -> None:
        """IF a EQU b GOTO LBL n."""
        m = _JUMP.fullmatch(rest.strip())
        if m is not None and (m[5] or "").startswith("QS"):
            m = _JUMP.fullmatch(self.strings.filled(rest.strip()))
        if m is None:
            raise Cursor(rest).fault("a jump that is not read")
        if m[2].startswith("IS"):
            q = _Q.fullmatch(m[1].strip())
            held = q is not None and (int(q[2]) in self.levels[-1].local if q[1] == "L" else (q[1],
                                                                                              int(q[2])) in self.parameters)
            holds = held == (m[2] == "IS DEFINED")
        else:
            a, b = self._whole_term(m[1]), self._whole_term(m[3])
            if unsure(a, b):
                self.blocks.compared.setdefault(self.line, f"{a!r} {m[2]} {b!r}")
            holds = {"EQU": a == b, "NE": a != b, "GT": a > b, "LT": a < b}[m[2]]
        if holds:
            self.levels[-1].at = self._label(self.levels[-1].source, m[4] or m[5])

    def _label(self, source: SourceFile, name: str) -> int:
        """The row behind a label."""
        if name not in source.places:
            source.places[name] = next((k for k, row in enumerate(source.rows)
                                        if (m := _LABEL.fullmatch(row)) and m[1] == name), -1)
        if source.places[name] < 0:
            raise MacroFault("gcode.jump", f"there is no LBL {name}", "labels stand in the program that jumps to them")
        return source.places[name] + 1

    def _call(self, level: KlartextLevel, name: str, repeats: str | None) -> None:
        """CALL LBL n: to LBL 0 and back; with REP m times back to the label."""
        row = level.at - 1
        target = self._label(level.source, name)
        if repeats is None:
            self._push(KlartextLevel(level.source, target, True, level.local))
            return
        left = level.left.get(row, int(repeats))
        level.left[row] = left - 1
        if left > 0:
            level.at = target
        else:
            del level.left[row]

    def _push(self, level: KlartextLevel) -> None:
        if len(self.levels) > DEEPEST:
            raise MacroFault("gcode.subprogram", f"subprograms call one another more than {DEEPEST} deep, or without an end",
                             "the control takes no more levels")
        self.levels.append(level)

    def _program(self, name: str) -> None:
        """CALL PGM: a file next to the program."""
        stem = PurePath(name.strip('"').replace("\\", "/")).stem
        source = self.sources.open((stem,))
        if source is None:
            raise MacroFault("gcode.subprogram", f"there is no program {stem}", f"put it next to the program, as {stem}.H")
        self._push(KlartextLevel(source, 0, False))


def _signed(value: float) -> str:
    text = written(value, True)
    return text if text.startswith("-") else f"+{text}"
