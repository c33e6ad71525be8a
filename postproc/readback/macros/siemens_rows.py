"""Rows of SINUMERIK programs: their block numbers, labels and heads, what belongs together, where programs begin and end."""

from __future__ import annotations

import re
from dataclasses import field

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.siemens_expressions import NAME
from postproc.readback.macros.sources import SourceFile
from postproc.readback.text.words import block_delete, lines_of
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic

_COMMENT = re.compile(rb'("[^"\n]*")|;[^\n]*')
_SMALL = re.compile(rb'"[^"\n]*"|[^"\n]+')
_BEGINS = re.compile(r"%_N_([A-Z0-9_]+)_([MS]PF)")
_FRONT = re.compile(r"[ \t]*(?:(?:N|:)(\d+)(?![A-Z_]))?[ \t]*(?:([A-Z_][A-Z0-9_]*):(?!=))?[ \t]*")
_HEAD = re.compile(r"IF|ELSE|ENDIF|FOR|ENDFOR|WHILE|ENDWHILE|REPEATB?|UNTIL|LOOP|ENDLOOP|CASE|GOTO[FBCS]?|DEF|EXTERN|PROC|"
                   r"RET|MSG|SETAL|A?TRANS|A?ROTS?|A?SCALE|A?MIRROR")
_JUMPS = re.compile(r"(?<![A-Z0-9_])GOTO[FBC]?(?![A-Z0-9_])")
_CLOSES = {"ENDIF": ("IF", "ELSE"), "ELSE": ("IF",), "ENDFOR": ("FOR",), "ENDWHILE": ("WHILE",), "UNTIL": ("REPEAT",),
           "ENDLOOP": ("LOOP",)}


@dataclass(frozen=True)
class SiemensRow:
    """One row: its block number, -1 for none, its label, the word that it begins with, and all behind number and label."""

    number: int
    label: str
    head: str
    body: str


@dataclass
class Listing:
    """A file: its rows; programs by name with their first and last row; the partner of each row of a loop or IF.

    `main`: first and last row of the program that runs first: rows before any %_N_ row, else the first MPF, else the first.
    """

    rows: list[SiemensRow]
    main: tuple[int, int] = (0, -1)
    programs: dict[str, tuple[int, int]] = field(default_factory=dict)
    partner: dict[int, int] = field(default_factory=dict)


@dataclass
class RowDone:
    """What a row has done: moved an axis, ended the program, returned; the call that follows; what MCALL names."""

    moved: bool = False
    ended: bool = False
    back: bool = False
    call: tuple[str, str, int] | None = None
    modal: tuple[str, str] | None = None


def siemens_rows(data: bytes, file: str) -> tuple[list[str], list[Diagnostic]]:
    """Rows without comments, in capitals but for what stands in quotation marks."""
    data = _COMMENT.sub(lambda m: m[1] or b"", lines_of(data))
    data = _SMALL.sub(lambda m: m[0] if m[0].startswith(b'"') else m[0].upper(), data)
    data, found = block_delete(data, file)
    return data.decode("ascii", "replace").split("\n")[:-1], found


def row_of(text: str) -> SiemensRow:
    """A row taken apart."""
    front = _FRONT.match(text)
    assert front is not None
    body = text[front.end():].strip()
    word = NAME.match(body)
    head = word[0] if word and _HEAD.fullmatch(word[0]) else ""
    if head == "IF" and _JUMPS.search(body):
        head = "IF GOTO"
    if head == "REPEAT" and body != "REPEAT":
        head = "REPEAT LABEL"
    return SiemensRow(int(front[1]) if front[1] else -1, front[2] or "", head, body)


def listing(source: SourceFile) -> Listing:
    """A file's rows, and what belongs together in them."""
    made = Listing([row_of(text) for text in source.rows])
    starts = [(k, m[1], m[2]) for k, text in enumerate(source.rows) if (m := _BEGINS.match(text.strip()))]
    ends = [k for k, _, _ in starts[1:]] + [len(source.rows)]
    for (k, name, _), end in zip(starts, ends, strict=False):
        made.programs[name] = (k + 1, end - 1)
    before = made.rows[:starts[0][0]] if starts else made.rows
    if any(row.body and not row.body.startswith("%") for row in before) or not starts:
        made.main = (0, len(before) - 1)
    else:
        made.main = made.programs[next((name for _, name, kind in starts if kind == "MPF"), starts[0][1])]
    open_: list[tuple[str, int]] = []
    for k, row in enumerate(made.rows):
        if row.head in _CLOSES:
            if not open_ or open_[-1][0] not in _CLOSES[row.head]:
                raise _alone(source, k, f"{row.head} without {_CLOSES[row.head][0]}")
            made.partner[k] = open_[-1][1]
            made.partner[open_.pop()[1]] = k
        if row.head in ("IF", "ELSE", "FOR", "WHILE", "REPEAT", "LOOP"):
            open_.append((row.head, k))
    if open_:
        raise _alone(source, open_[-1][1], f"{open_[-1][0]} without its end")
    return made


def _alone(source: SourceFile, k: int, what: str) -> MacroFault:
    return MacroFault("gcode.jump", what,
                      "each of them begins and ends in one program", source.before + k + 1)
