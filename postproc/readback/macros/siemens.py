"""Programs of SINUMERIK 840D executed: variables, jumps, loops, subprograms (Programming Manual Job Planning)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import PurePath

from postproc.readback.macros.expressions import Cursor, MacroFault
from postproc.readback.macros.held import Held
from postproc.readback.macros.siemens_expressions import SiemensValue, equal, expression, number, skip, split_values, take
from postproc.readback.macros.siemens_rows import Listing, SiemensRow, listing
from postproc.readback.macros.siemens_variables import KINDS, DeclaredVariable, SavedModes, SiemensNames
from postproc.readback.macros.siemens_words import SiemensWords
from postproc.readback.macros.sources import ProgramFiles, SourceFile
from postproc.readback.macros.word_blocks import Blocks
from toolpaths.diagnostics import Diagnostic, info, warning

DEEPEST = 16
"""levels of programs (840D sl)"""
_TARGET = re.compile(r"[A-Z_][A-Z0-9_]*|\d+")
_PARAMETER = re.compile(r"(VAR )?[ \t]*(REAL|INT|BOOL|CHAR|AXIS|STRING)[ \t]*(?:\[\d+\])?[ \t]*([A-Z_][A-Z0-9_]*)"
                        r"[ \t]*(?:=[ \t]*([^,]+))?")
_PROC = re.compile(r"PROC[ \t]+[A-Z_][A-Z0-9_]*[ \t]*(?:\(([^()]*)\))?")
_SAVE = re.compile(r"(?<![A-Z0-9_])SAVE(?![A-Z0-9_])")
_CASE = re.compile(r"[ \t]*DEFAULT(?![A-Z0-9_])")
_COUNT = re.compile(r"(?<![A-Z0-9_])P[ \t]*=?[ \t]*(?=[\dR(])")


@dataclass
class SiemensLevel:
    """A program, or a part of one that is repeated, that runs: rows first..last, the next, its variables, how often again.

    `back`: variables of the caller that take over values of its own at the end; `part`: ends at its last row; `saved`: what
    SAVE gives the caller back.
    """

    source: SourceFile
    first: int
    last: int
    at: int
    local: dict[str, DeclaredVariable]
    times: int = 1
    part: bool = False
    back: dict[str, tuple[str, tuple[SiemensValue, ...]]] = field(default_factory=dict)
    ends: dict[int, float] = field(default_factory=dict)
    modal: bool = False
    saved: SavedModes | None = None


class SiemensMacros:
    """Executes a program and what it calls."""

    def __init__(self, sources: ProgramFiles, held: Held) -> None:
        self.sources, self.held = sources, held
        self.blocks = Blocks(held, False, sources.read[0].name)
        self.words = SiemensWords(self.blocks, held, self.runnable)
        self.names: SiemensNames = self.words.names
        self.listings: dict[str, Listing] = {}
        self.levels: list[SiemensLevel] = []
        self.line, self.ended = 0, False
        self.modal: tuple[str, str] | None = None

    def judged(self) -> list[Diagnostic]:
        """Tools whose names the set-up has not, units of another dialect, and the order of patterns, which the control
        chooses."""
        order = [info("gcode.hole_order", f"{name}: the holes are taken in the order that keeps travel short, from where "
                      "the tool stands, as the control chooses it", file=self.blocks.file, lines=[line])
                 for name, line in self.words.patterns.items() if name != "HOLES2"]
        order += [warning("gcode.iso_units", f"G{code} is a code of the control's ISO dialect, taken as G{code + 50}: in "
                          "its own language the control knows none", file=self.blocks.file, lines=[line],
                          hint=f"write G{code + 50}") for code, line in self.words.iso_units.items()]
        return order + [warning("gcode.tool_name", f'no tool of the set-up is called "{name}": its length counts as 0',
                        file=self.blocks.file, lines=[line], hint='[tools.N] called = "..." of the set-up: the number of '
                        'the tool that the control calls so') for name, line in self.words.unknown_tools.items()]

    def listed(self, source: SourceFile) -> Listing:
        """The rows of a file."""
        if source.name not in self.listings:
            self.listings[source.name] = listing(source)
        return self.listings[source.name]

    def run(self) -> None:
        """From the first row to M30, or the end of the main program."""
        first = self.sources.read[0]
        made = self.listed(first)
        start, last = made.main
        self._push(SiemensLevel(first, start, last, start, {}))
        while self.levels and not self.ended:
            level = self.levels[-1]
            if level.at > level.last:
                if len(self.levels) == 1:
                    return
                self.back()
                continue
            row, self.line = self.listed(level.source).rows[level.at], level.source.before + level.at + 1
            level.at += 1
            if row.body:
                self.blocks.count(self.line)
            if row.body and not row.body.startswith("%"):
                self.statement(level, row)

    def _push(self, level: SiemensLevel) -> None:
        if len(self.levels) > DEEPEST:
            raise MacroFault("gcode.subprogram", f"subprograms call one another more than {DEEPEST} deep, or without an end",
                             "the control takes no more levels")
        self.levels.append(level)
        self.names.local = level.local

    def statement(self, level: SiemensLevel, row: SiemensRow) -> None:
        """One row: a jump, a loop, a declaration, or words."""
        c = Cursor(row.body, len(row.head.split(" ", 1)[0]))
        head = row.head
        if head.startswith("GOTO"):
            self.jump(head, "" if head == "GOTOS" else self._target(c))
        elif head == "IF GOTO":
            self._if_jump(c)
        elif head in ("IF", "ELSE", "ENDIF", "FOR", "ENDFOR", "WHILE", "ENDWHILE", "REPEAT", "UNTIL", "LOOP", "ENDLOOP"):
            self._block(level, head, c, level.at - 1)
        elif head in ("REPEAT LABEL", "REPEATB"):
            self._part(level, head == "REPEATB", c)
        elif head == "CASE":
            self._case(c)
        elif head == "DEF":
            self.names.declare(c)
        elif head == "SETAL":
            raise MacroFault("gcode.alarm", f"the program stops the control with an alarm: {row.body[:60]}",
                             "it tests what its head sets: state what it asks for")
        elif head == "RET":
            self.back(returns=True)
        elif head not in ("EXTERN", "PROC", "MSG"):
            self._words(head, c if head else Cursor(row.body))

    def _words(self, head: str, c: Cursor) -> None:
        """Words, assignments and calls; behind a block that moves, what MCALL names."""
        made = self.words.row(head, c, self.line)
        self.ended = made.ended
        if made.modal is not None:
            self.modal = made.modal if made.modal[0] else None
        if made.back and len(self.levels) > 1:
            self.back(returns=True)
        elif made.back:
            self.ended = True
        if made.call is not None:
            self.call(*made.call)
        elif made.moved and self.modal is not None and not self.levels[-1].modal:
            self.call(*self.modal, 1, modal=True)

    def _target(self, c: Cursor) -> str:
        return self.names.jump_name(c)

    def _if_jump(self, c: Cursor) -> None:
        """IF condition GOTOF label, once or more in a row."""
        while True:
            holds = number(expression(c, self.names)) != 0.0
            skip(c)
            how = c.match(re.compile(r"GOTO[FBC]?"))
            if not how:
                raise c.fault("GOTOF or GOTOB is missing behind IF")
            target = self._target(c)
            if holds:
                self.jump(how, target)
                return
            if not take(c, "IF"):
                return

    def jump(self, how: str, target: str) -> None:
        """GOTOF ahead, GOTOB back, GOTO and GOTOC ahead first; GOTOS to the beginning."""
        if how == "GOTOS":
            raise MacroFault("gcode.endless", "GOTOS starts the program again without an end", "write M30")
        while True:
            level = self.levels[-1]
            rows = self.listed(level.source).rows
            ahead, behind = range(level.at, level.last + 1), range(level.at - 1, level.first - 1, -1)
            search = [*ahead] if how == "GOTOF" else [*behind] if how == "GOTOB" else [*ahead, *behind]
            sought = int(target[1:]) if re.fullmatch(r"N\d+", target) else -2
            where = next((k for k in search if rows[k].label == target or rows[k].number == sought), -1)
            if where >= 0:
                level.at = where
                return
            if not level.part:
                break
            self.levels.pop()
        if how != "GOTOC":
            raise MacroFault("gcode.jump", f"there is no label {target} to jump to with {how}",
                             "GOTOF looks ahead, GOTOB back, GOTO in both directions, in the same program")

    def _block(self, level: SiemensLevel, head: str, c: Cursor, k: int) -> None:
        """IF ... ELSE ... ENDIF and the loops."""
        partner = self.listed(level.source).partner
        if head == "IF" and not number(expression(c, self.names)):
            level.at = partner[k] + 1
        elif head == "ELSE":
            level.at = partner[k]
        elif head == "WHILE" and not number(expression(c, self.names)):
            level.at = partner[k] + 1
        elif head in ("ENDWHILE", "ENDLOOP"):
            level.at = partner[k]
        elif head == "UNTIL" and not number(expression(c, self.names)):
            level.at = partner[k] + 1
        elif head == "FOR":
            self._for(level, c, k, partner[k])
        elif head == "ENDFOR":
            if partner[k] not in level.ends:
                raise MacroFault("gcode.jump", "a jump has led into a FOR loop: where it ends is not known",
                                 "jump to the row of FOR, or before it")
            name = self._loop_variable(level, partner[k])
            self.names.put(name, (), number(self.names.get(name, ())) + 1.0)
            if number(self.names.get(name, ())) <= level.ends[partner[k]]:
                level.at = partner[k] + 1

    def _loop_variable(self, level: SiemensLevel, k: int) -> str:
        m = re.match(r"FOR[ \t]+([A-Z_][A-Z0-9_]*|R\d+)", self.listed(level.source).rows[k].body)
        if m is None:
            raise MacroFault("gcode.expression", "FOR without a variable", "write FOR I = 1 TO 5")
        return m[1]

    def _for(self, level: SiemensLevel, c: Cursor, k: int, end: int) -> None:
        name = self._loop_variable(level, k)
        skip(c)
        c.at += len(name)
        if not take(c, "="):
            raise c.fault("FOR without =")
        self.names.put(name, (), expression(c, self.names))
        if not take(c, "TO"):
            raise c.fault("FOR without TO")
        level.ends[k] = number(expression(c, self.names))
        if number(self.names.get(name, ())) > level.ends[k]:
            level.at = end + 1

    def _part(self, level: SiemensLevel, one_row: bool, c: Cursor) -> None:
        """REPEAT label, REPEAT label label, REPEATB label, each with P=."""
        labels, times = list[str](), 1
        while True:
            skip(c)
            if m := _COUNT.match(c.text, c.at):
                c.at = m.end()
                times = round(number(expression(c, self.names)))
            elif found := c.match(_TARGET):
                labels.append(found)
            else:
                break
        rows = self.listed(level.source).rows
        where = [next((k for k in range(level.first, level.last + 1) if rows[k].label == name), -1) for name in labels[:2]]
        if not where or min(where) < 0 or not c.done:
            raise c.fault("REPEAT of a label that is not in the program")
        last = where[0] if one_row else where[1] if len(where) > 1 else level.at - 2
        if times > 0:
            self._push(SiemensLevel(level.source, where[0], last, where[0], level.local, times, part=True,
                                    modal=level.modal))

    def _case(self, c: Cursor) -> None:
        """CASE value OF 1 GOTOF A 2 GOTOF B DEFAULT GOTOF C."""
        value = expression(c, self.names)
        if not take(c, "OF"):
            raise c.fault("CASE without OF")
        while not c.done:
            default = bool(c.match(_CASE))
            here = value if default else expression(c, self.names)
            skip(c)
            how = c.match(re.compile(r"GOTO[FBC]?"))
            target = self._target(c)
            if equal(value, here):
                self.jump(how, target)
                return
            skip(c)

    def runnable(self, name: str) -> bool:
        """True for the name of a subprogram that is known, or that stands next to the program."""
        return self._found(name) is not None

    def _found(self, name: str) -> tuple[SourceFile, int, int] | None:
        for source in self.sources.read:
            if name in self.listed(source).programs:
                return source, *self.listed(source).programs[name]
        opened = self.sources.open((name, f"_N_{name}_SPF", f"{name}_SPF", f"_N_{name}_MPF"))
        if opened is None or opened is self.sources.read[0]:
            return None
        made = self.listed(opened)
        return opened, *made.programs.get(name, (0, len(made.rows) - 1))

    def call(self, name: str, given: str, times: int, modal: bool = False) -> None:
        """A subprogram with the text of its values."""
        span = self._found(PurePath(name).stem.removeprefix("_N_").removesuffix("_SPF"))
        if span is None:
            raise MacroFault("gcode.subprogram", f"there is no subprogram {name}",
                             f"put it next to the program, as {name}.SPF")
        local, back = self._parameters(span, given)
        head = next((row.body for row in self.listed(span[0]).rows[span[1]:span[2] + 1] if row.head == "PROC"), "")
        saved = self.words.saved() if _SAVE.search(head) else None
        if times > 0:
            self._push(SiemensLevel(*span, span[1], local, times, back=back, modal=modal or self.levels[-1].modal,
                                    saved=saved))

    def _parameters(self, span: tuple[SourceFile, int, int], given: str,
                    ) -> tuple[dict[str, DeclaredVariable], dict[str, tuple[str, tuple[SiemensValue, ...]]]]:
        """Variables of a PROC with the values of a call."""
        rows = self.listed(span[0]).rows
        head = next((m for k in range(span[1], span[2] + 1) if (m := _PROC.match(rows[k].body))), None)
        stated = _PARAMETER.finditer(head[1]) if head and head[1] else iter(())
        values = split_values(given)
        local: dict[str, DeclaredVariable] = {}
        back: dict[str, tuple[str, tuple[SiemensValue, ...]]] = {}
        count = 0
        for k, m in enumerate(stated):
            count += 1
            here = values[k].strip() if k < len(values) else ""
            made = local[m[3]] = DeclaredVariable(next(kind for kind in KINDS if kind == m[2]))
            if here or m[4]:
                made.put((), here if m[2] == "AXIS" else expression(Cursor(here or m[4]), self.names))
            if m[1] and here:
                back[m[3]] = (here, ())
        if len([v for v in values if v.strip()]) > count:
            raise MacroFault("gcode.subprogram", f"a call with {len(values)} values, and PROC takes {count}",
                             "state as many as the PROC line has")
        return local, back

    def back(self, returns: bool = False) -> None:
        """The end of a program or part: again, or back to what has called it; `returns`: out of parts too."""
        while returns and self.levels[-1].part:
            self.levels.pop()
        level = self.levels[-1]
        level.times -= 1
        if level.saved is not None:
            self.words.give_back(level.saved, self.line)
        if level.times > 0:
            level.at = level.first
            return
        if len(self.levels) == 1:
            self.ended = True
            return
        self.levels.pop()
        self.names.local = self.levels[-1].local
        for name, (target, index) in level.back.items():
            self.names.put(target, index, level.local[name].values.get((), 0.0))

