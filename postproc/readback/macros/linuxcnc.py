"""LinuxCNC's O words and parameters executed (O codes and G-code overview of its manual; checked against `rs274`)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from postproc.readback.macros.expressions import LINUXCNC, Cursor, Expressions, MacroFault, ValueLater, plain
from postproc.readback.macros.held import Held
from postproc.readback.macros.linuxcnc_parameters import OLevel, Parameters
from postproc.readback.macros.sources import ProgramFiles, SourceFile
from postproc.readback.macros.word_blocks import Blocks, Word, coded
from postproc.readback.text.flow import DEEPEST

_SEQUENCE = re.compile(r"N\d+(?:\.\d*)?")
_LABEL = re.compile(r"O(<[^<>]+>|\d+)([A-Z]*)")
_COMPUTED = re.compile(r"O\[")
_PLAIN = re.compile(r"(?:[A-Z][-+]?(?:\d+(?:\.\d*)?|\.\d+))+")
_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
_LETTER = re.compile(r"[A-Z]")
_KEYWORD = re.compile(r"[A-Z]+")
_DIGITS = re.compile(r"\d+")
_NAME = re.compile(r"<[^<>]*>")
_ENDS = {"IF": ("ELSEIF", "ELSE", "ENDIF"), "ELSEIF": ("ENDIF",), "ELSE": ("ENDIF",), "WHILE": ("ENDWHILE",),
         "REPEAT": ("ENDREPEAT",), "SUB": ("ENDSUB",)}
_OPENS = ("SUB", "IF", "DO", "REPEAT")
_CLOSES = {"ENDSUB": ("SUB",), "ELSEIF": ("IF",), "ELSE": ("IF",), "ENDIF": ("IF",), "ENDREPEAT": ("REPEAT",),
           "ENDWHILE": ("WHILE",)}
ARGUMENTS = 30


class LinuxCncMacros:
    """Executes a program with its O words."""

    def __init__(self, sources: ProgramFiles, held: Held) -> None:
        self.sources, self.held = sources, held
        self.blocks = Blocks(held, True, sources.read[0].name)
        self.parameters = Parameters(self.blocks, held)
        self.expressions = Expressions(LINUXCNC, self.variable, self._special)
        self.levels = [OLevel(sources.read[0], 0)]
        self.words_of: dict[str, list[Word]] = {}
        self.misplaced: dict[str, dict[int, tuple[str, str]]] = {}
        self.line, self.ended = 0, False
        self.keywords: dict[str, Callable[[OLevel, str, Cursor], None]] = {
            "SUB": self._over, "ENDSUB": self._back, "RETURN": self._back, "CALL": self._call, "IF": self._if,
            "ELSEIF": self._past,
            "ELSE": self._past, "ENDIF": self._nothing, "WHILE": self._while, "ENDWHILE": self._again, "DO": self._nothing,
            "REPEAT": self._repeat, "ENDREPEAT": self._once_more, "BREAK": self._break, "CONTINUE": self._continue}

    def run(self) -> None:
        """From the first row to M2 or M30."""
        while not self.ended:
            level = self.levels[-1]
            if level.at >= len(level.source.rows):
                if len(self.levels) > 1:
                    raise MacroFault("gcode.subprogram", "the subprogram has no endsub", "end it with endsub")
                return
            row, self.line = level.source.rows[level.at], level.source.before + level.at + 1
            level.at += 1
            if row:
                self.blocks.count(self.line)
                self.statement(level, row)

    def statement(self, level: OLevel, row: str) -> None:
        """An O word, or a block of words and assignments."""
        row = row[len(m[0]):] if (m := _SEQUENCE.match(row)) else row
        if not row.startswith("O"):
            self.block(row)
            return
        c = Cursor(row)
        if _COMPUTED.match(row):
            c.take("O")
            label = f"{round(plain(self.expressions.value(c)))}"
            word = c.match(_KEYWORD)
        elif m := _LABEL.match(row):
            label, word = _label(m[1]), m[2]
            c.at = m.end()
        else:
            raise c.fault("not an O word")
        if word in self.keywords:
            self._judge(level)
            self.keywords[word](level, label, c)
        elif word or not c.done:
            raise c.fault("not an O word")

    def _judge(self, level: OLevel) -> None:
        """An O word that belongs to nothing, or whose block crosses another."""
        source = level.source
        if source.name not in self.misplaced:
            named = ((k, _named(row)) for k, row in enumerate(source.rows))
            self.misplaced[source.name] = misplaced((k, *one) for k, one in named if one is not None)
        if wrong := self.misplaced[source.name].get(level.at - 1):
            raise MacroFault("gcode.jump", *wrong)

    def block(self, row: str) -> None:
        """Words, and assignments, which hold from behind the block on."""
        known = self.words_of.get(row)
        if known is None and _PLAIN.fullmatch(row):
            known = self.words_of[row] = [Word(a, float(v), a + v) for a, v in _WORD.findall(row)]
        made, given = known or [], list[tuple[int | str, float]]()
        if known is None:
            made, given = self._read(Cursor(row))
        for place, value in given:
            self.parameters.put(place, value, self.levels[-1])
        if made:
            self.blocks.block(made, self.line)
            self.ended = any(w.letter == "M" and w.value in (2.0, 30.0) for w in made)

    def _read(self, c: Cursor) -> tuple[list[Word], list[tuple[int | str, float]]]:
        made, given = list[Word](), list[tuple[int | str, float]]()
        while not c.done:
            if c.take("#"):
                place = self._place(c)
                c.need("=")
                given.append((place, plain(self.expressions.value(c))))
                continue
            start, letter = c.at, c.match(_LETTER)
            if not letter:
                raise c.fault("not a block of words")
            if number := _WORD.match(c.text, start):
                c.at = number.end()
                made.append(Word(letter, float(number[2]), number[0]))
            else:
                made.append(Word(letter, coded(letter, plain(self.expressions.value(c)))))
        return made, given

    def _place(self, c: Cursor) -> int | str:
        """What stands behind a #: a number or a name."""
        if name := c.match(_NAME):
            return name[1:-1]
        digits = c.match(_DIGITS)
        return int(digits) if digits else _whole(plain(self.expressions.value(c)))

    def _asked(self, c: Cursor) -> Callable[[], int | str]:
        """What stands behind a #, to be asked for later."""
        if (name := c.match(_NAME)) or (digits := c.match(_DIGITS)):
            place = name[1:-1] if name else int(digits)
            return lambda: place
        number = self.expressions.compiled(c)
        return lambda: _whole(plain(number()))

    def variable(self, c: Cursor) -> ValueLater:
        """The value of a parameter."""
        place = self._asked(c)
        return lambda: self.parameters.get(place(), self.levels[-1])

    def _special(self, name: str, c: Cursor) -> ValueLater:
        """EXISTS[#<name>]."""
        if name != "EXISTS":
            raise c.fault(f"{name or 'nothing'} stands where a value is asked for")
        c.need("[")
        c.need("#")
        place = self._asked(c)
        c.need("]")
        return lambda: float(self.parameters.exists(place(), self.levels[-1]))

    def _condition(self, c: Cursor) -> float:
        c.need("[")
        value = plain(self.expressions.expression(c))
        c.need("]")
        return value

    def found(self, source: SourceFile, label: str, words: tuple[str, ...], first: int) -> int:
        """The next row of a label with one of these words."""
        key = f"{label} {words} {first}"
        if key not in source.places:
            source.places[key] = next((k for k in range(first, len(source.rows))
                                       if (named := _named(source.rows[k])) and named[0] == label and named[1] in words), -1)
        if source.places[key] < 0:
            raise MacroFault("gcode.jump", f"o{label} has no {' or '.join(w.lower() for w in words)}",
                             "each of them begins and ends in one file, with one number")
        return source.places[key]

    def _begins(self, source: SourceFile, label: str, words: tuple[str, ...], before: int) -> int:
        """The row before this one of a label with one of these words, -1 for none."""
        key = f"{label} {words} before {before}"
        if key not in source.places:
            source.places[key] = next((k for k in range(before - 1, -1, -1)
                                       if (named := _named(source.rows[k])) and named[0] == label and named[1] in words), -1)
        return source.places[key]

    def _nothing(self, level: OLevel, label: str, c: Cursor) -> None:
        """endif and do: run through."""

    def _over(self, level: OLevel, label: str, c: Cursor) -> None:
        """A sub that is met, not called."""
        level.at = self.found(level.source, label, ("ENDSUB",), level.at) + 1

    def _past(self, level: OLevel, label: str, c: Cursor) -> None:
        """else behind a part that was run."""
        level.at = self.found(level.source, label, ("ENDIF",), level.at)

    def _if(self, level: OLevel, label: str, c: Cursor) -> None:
        holds = self._condition(c) != 0.0
        while not holds:
            at = self.found(level.source, label, _ENDS["IF"], level.at)
            level.at, row = at + 1, level.source.rows[at]
            word, c = _word(row)
            self.line = level.source.before + at + 1
            holds = word != "ELSEIF" or self._condition(c) != 0.0

    def _do_of(self, level: OLevel, label: str) -> int:
        """The row of the do that a while ends, -1 where the while begins."""
        last = self._begins(level.source, label, ("DO", "WHILE"), level.at - 1)
        return last if last >= 0 and _word(level.source.rows[last])[0] == "DO" else -1

    def _while(self, level: OLevel, label: str, c: Cursor) -> None:
        holds, start = self._condition(c) != 0.0, self._do_of(level, label)
        if start >= 0:
            level.at = start + 1 if holds else level.at
        elif not holds:
            level.at = self.found(level.source, label, ("ENDWHILE",), level.at) + 1

    def _again(self, level: OLevel, label: str, c: Cursor) -> None:
        start = self._begins(level.source, label, ("WHILE",), level.at - 1)
        if start < 0:
            raise MacroFault("gcode.jump", f"o{label} endwhile without while", "begin it with while")
        level.at = start

    def _repeat(self, level: OLevel, label: str, c: Cursor) -> None:
        level.left[label] = int(self._condition(c))
        if level.left[label] <= 0:
            level.at = self.found(level.source, label, ("ENDREPEAT",), level.at) + 1

    def _once_more(self, level: OLevel, label: str, c: Cursor) -> None:
        level.left[label] = level.left.get(label, 0) - 1
        if level.left[label] > 0:
            level.at = self._begins(level.source, label, ("REPEAT",), level.at - 1) + 1

    def _end_of(self, level: OLevel, label: str) -> int:
        """The row that ends the loop of a label around here."""
        start = self._begins(level.source, label, ("WHILE", "REPEAT", "DO"), level.at - 1)
        word = _word(level.source.rows[start])[0] if start >= 0 else ""
        if word not in ("DO", "WHILE"):
            raise MacroFault("gcode.jump", f"o{label} break or continue outside of a while or do",
                             "LinuxCNC takes them in these loops only")
        return self.found(level.source, label, ("WHILE",) if word == "DO" else ("ENDWHILE",), level.at)

    def _break(self, level: OLevel, label: str, c: Cursor) -> None:
        level.at = self._end_of(level, label) + 1

    def _continue(self, level: OLevel, label: str, c: Cursor) -> None:
        """LinuxCNC looks for the end of a do from here on by the label alone, and carries out a break that it meets;
        the next repeat then runs twice as often (2.9, compared with rs274)."""
        end = self._end_of(level, label)
        of_a_do = _word(level.source.rows[end])[0] == "WHILE"
        if of_a_do and self._begins(level.source, label, ("BREAK",), end) >= level.at:
            raise MacroFault("gcode.jump", f"o{label} continue in a do, with a break of o{label} behind it: LinuxCNC leaves "
                             "the loop there", "put the break before the continue, or use while")
        level.at = end

    def _call(self, level: OLevel, label: str, c: Cursor) -> None:
        given = list[float]()
        while not c.done:
            given.append(self._condition(c))
        if len(self.levels) > DEEPEST:
            raise MacroFault("gcode.subprogram", f"subprograms call one another more than {DEEPEST} deep, or without an end",
                             "the control takes no more levels")
        for source in (level.source, *self.sources.read, None):
            source = source or self.sources.open((label,))
            if source is not None and (at := self._begins(source, label, ("SUB",), len(source.rows))) >= 0:
                local = dict(enumerate(given[:ARGUMENTS], 1))
                self.levels.append(OLevel(source, at + 1, local))
                return
        raise MacroFault("gcode.subprogram", f"there is no subprogram o<{label.lower()}>",
                         f"put it next to the program, as {label.lower()}.ngc")

    def _back(self, level: OLevel, label: str, c: Cursor) -> None:
        """endsub and return, with a value or without."""
        if len(self.levels) < 2:
            raise MacroFault("gcode.jump", "endsub or return outside of a sub", "take it out, or begin the sub")
        self.parameters.returned(self._condition(c) if not c.done else None)
        self.levels.pop()


def _whole(number: float) -> int:
    """The number of a parameter."""
    if abs(number - round(number)) > 1e-4:
        raise MacroFault("gcode.expression", f"the number of a parameter is not whole: #[{number:g}]")
    return round(number)


def _label(text: str) -> str:
    return text.strip("<>") if text.startswith("<") else f"{int(text)}"


def _named(row: str) -> tuple[str, str] | None:
    """Label and word of an O row; None for others."""
    if not row.startswith(("O", "N")):
        return None
    m = _LABEL.match(_SEQUENCE.sub("", row, count=1) if row.startswith("N") else row)
    return (_label(m[1]), m[2]) if m else None


def _word(row: str) -> tuple[str, Cursor]:
    """The word of an O row, and what stands behind it."""
    c = Cursor(_SEQUENCE.sub("", row, count=1) if row.startswith("N") else row)
    m = _LABEL.match(c.text)
    if m is None:
        raise c.fault("not an O word")
    c.at = m.end()
    return m[2], c


def misplaced(rows: Iterable[tuple[int, str, str]]) -> dict[int, tuple[str, str]]:
    """O words that do not belong together: (what is wrong, remedy) by row; rows: (row, label, word), in order."""
    open_: list[tuple[str, str]] = []
    found: dict[int, tuple[str, str]] = {}
    for k, label, word in rows:
        if word in _OPENS or (word == "WHILE" and (label, "DO") not in open_):
            open_.append((label, word))
        elif word in _CLOSES or word == "WHILE":
            begins = [(label, begin) for begin in _CLOSES.get(word, ("DO",))]
            where = next((n for n in range(len(open_) - 1, -1, -1) if open_[n] in begins), -1)
            if where < 0:
                begin = begins[0][1].lower()
                found[k] = f"o{label.lower()} {word.lower()} without {begin}", f"begin it with {begin}, or take it out"
                continue
            if where < len(open_) - 1:
                inner = open_[-1]
                found[k] = (f"o{label.lower()} {word.lower()} before the end of o{inner[0].lower()} {inner[1].lower()}, "
                            "which began within it", f"end o{inner[0].lower()} first")
            if word not in ("ELSEIF", "ELSE"):
                del open_[where]
    return found
