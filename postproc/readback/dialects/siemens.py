"""Siemens SINUMERIK 840D sl, milling.

From the programming manuals Fundamentals, Job Planning and Cycles: X=IC(), X=AC(), POLY, CR=, I=AC(), TURN=; G54 to
G57, G505 to G599; T, M6 and D; SUPA; G4 F; MCALL with CYCLE81 to CYCLE86; TRAORI with ORIAXES, left by
TRAFOOF; SD42940 as a statement of its own; CYCLE800 with turns
about X, Y, Z as _MODE orders them; CYCLE832; subprograms by their names or L numbers, M17, RET.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import ClassVar

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.base import M_CODES, Reader, as_bytes
from postproc.readback.dialects.iso import New, relative_words
from postproc.readback.dialects.siemens_cycles import CYCLES
from postproc.readback.dialects.siemens_polynomials import NAMES, terms_apart
from postproc.readback.dialects.siemens_run import LENGTH_AXIS, ROUNDED, ROUNDED_RAPID, SiemensRun
from postproc.readback.text.canonical import (
    LOADED,
    OFFSET,
    REGISTER,
    REST,
    STATEMENT,
    TURNS,
    UNSTATED,
    Canonical,
    DialectStatement,
    ProgramText,
    added,
)
from postproc.readback.text.flow import Call, Structure
from postproc.readback.text.modal import GROUPS, Groups, codes, fill, number_of
from postproc.readback.text.rollover import DIRECTION, NEGATIVE, POSITIVE, SHORTEST
from postproc.readback.text.words import Words, block_delete, lines_of, read_words
from toolpaths.arrays import Bools, Ints, distinct
from toolpaths.diagnostics import Diagnostic, error

FORCED = 128
"""added to the letter of a word that is absolute whatever holds"""
_COMMENT = re.compile(rb'("[^"\n]*")|;[^\n]*')
_SIGNS = np.isin(np.arange(256), list(b'=("[:@'))
_NAMES = np.isin(np.arange(256), list(b"ABCDEFGHIJKLMNOPQRSTUVWXYZ_$"))
_TOKEN = re.compile(
    r"\s*(?:(?P<setting>\$SC_[A-Z_]+)\s*=\s*(?P<set>[-+]?\d+)(?![\d.])|(?P<call>[A-Z_$][A-Z_$0-9]+)\s*\((?P<args>(?:\"[^\"]*\"|[^()\"])*)\)"
    r"|(?P<key>[A-Z]+\d*)\s*=\s*(?:(?P<how>[A-Z]+)\s*\(\s*(?P<within>[-+]?(?:\d+\.?\d*|\.\d+))\s*\)"
    r"|(?P<value>[-+]?(?:\d+\.?\d*|\.\d+)))"
    r"|(?P<letter>[A-Z])\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+))(?![A-Z_=(])"
    r"|(?P<name>[A-Z_$][A-Z_$0-9]+)|\"(?P<text>[^\"]*)\")\s*")
_PROGRAM = re.compile(rb"(?m)^[ \t]*%_N_([A-Z0-9_]+)_([MS]PF)[^\n]*$")
PASSIVE = frozenset({"MSG", "SOFT", "BRISK", "FFWON", "FFWOF", "CFTCP", "CFC", "CFIN", "RTLION", "STOPRE", "NORM", "DIAMOF",
                     "WORKPIECE", "ORIMKS", "PROC", "COMPOF"})
"""names that change nothing of what is read back here"""
_KEYS = {"CR": "R", "TURN": TURNS, "ADIS": ROUNDED, "ADISPOS": ROUNDED_RAPID}
DIRECTIONS = {"DC": SHORTEST, "ACP": POSITIVE, "ACN": NEGATIVE}
"""of modulo axes"""
KNOWN = PASSIVE.union(CYCLES, NAMES, ("SUPA", "TRAORI", "TRAFOOF", "ORIAXES", "CYCLE800", "CYCLE832", "MCALL", "RET", "CALL",
                         LENGTH_AXIS))


class SiemensReader(Reader):
    """Programs of SINUMERIK; words like `SUPA` and calls are statements of their block."""

    groups: Groups = GROUPS | {
        "motion": (0, 1, 2, 3), "units": (70, 71, 700, 710), "offset": (54, 55, 56, 57, 500, *range(505, 600)),
        "path": (9, 60, 64, 641, 642, 643, 644, 645), "once": (4,), "exact_stop": (601, 602, 603), "corners": (450,),
        "length": (), "level": (), "arc_distance": ()}
    language = "siemens"
    m_codes = (*M_CODES, 17.0)
    letters = f"GMFSTDNIJKRLP?~>{ROUNDED}{ROUNDED_RAPID}"
    stating = {k: v for k, v in Reader.stating.items() if k != "level"} | {"length": "D, or a tool"}
    leaving: ClassVar[dict[InterpolationMode, tuple[str, ...]]] = {"tcp": ("TRAFOOF",), "tilted": ("CYCLE800",)}
    lost_by: ClassVar[frozenset[str]] = frozenset({"TRAORI", "TRAFOOF"})
    """S2 6.: frames may be lost"""
    neutral: ClassVar[frozenset[str]] = PASSIVE
    statements = KNOWN
    units_codes = "G70, G71, G700 or G710"
    units_from = "machine data 20150 and 20152 have the reset position of group 13"
    smoothing_hint = "CYCLE832 as the post writes it, or G60"
    arc_slack = 0.01
    """MD21000 CIRCLE_ERROR_CONST, its default"""

    def read(self, data: bytes | str, file: str = "", others: Mapping[str, bytes] | None = None,
             ) -> tuple[Canonical | None, list[Diagnostic]]:
        """As every dialect; names of other files are names of subprograms."""
        self.names = {PurePath(name).stem.upper().removesuffix("_SPF").removeprefix("_N_") for name in others or {}}
        self.names |= {m[1].decode() for m in _PROGRAM.finditer(as_bytes(data).upper())}
        return super().read(data, file, others)

    def tokens(self, data: bytes, file: str) -> tuple[ProgramText, list[Diagnostic]]:
        """Blocks of plain words at once; those with names, calls and = one by one."""
        text = _COMMENT.sub(lambda m: m[1] or b"", lines_of(data)).upper()
        self.programs = [(text.count(b"\n", 0, m.start()) + 1, m[1].decode()) for m in _PROGRAM.finditer(text)]
        self.mains = [m[1].decode() for m in _PROGRAM.finditer(text) if m[2] == b"MPF"]
        text, found = block_delete(_PROGRAM.sub(b"", text), file)
        text, special = _apart(text)
        words, more = read_words(text, file)
        new: New = []
        statements: list[DialectStatement] = []
        for line, row in special:
            more += _parse(row, line, new, statements, file)
        return ProgramText(added(words, new), tuple(statements)), found + more

    def stems(self, call: str) -> tuple[str, ...]:
        """POCKET may be in POCKET, _N_POCKET_SPF, POCKET_SPF."""
        return call, f"_N_{call}_SPF", f"{call}_SPF"

    def check(self, words: Words, file: str) -> list[Diagnostic]:
        """Codes and words; relative and forced ones count as plain."""
        letter = words.letter & 127
        small = (letter >= 97) & (letter <= 122)
        plain = Words(np.where(small, letter - 32, letter).astype(np.uint8), words.value, words.line,
                      words.lines)
        return super().check(plain.take(plain.letter != ord(STATEMENT)), file)

    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """Programs begin at %_N_ lines, the main one is what stands before them, else the first MPF, else the first; a
        name or an L number that is one's calls it, P times."""
        words, lines = text.words, text.words.lines
        starts = [*self.programs, (lines + 1, "")]
        spans = {name: (a, starts[k + 1][0] - 1) for k, (a, name) in enumerate(starts[:-1])}
        main = (1, starts[0][0] - 1)
        if self.programs and not (words.line < starts[0][0]).any():
            main = spans[next(iter([*self.mains, self.programs[0][1]]))]
        back = set(codes(words, "M", (17,))[0].tolist())
        where, index = words.pick(STATEMENT)
        named = [(int(b), text.statements[int(k)]) for b, k in zip(where, index, strict=True)]
        back |= {b for b, s in named if s.name == "RET"}
        spans = {name: (a, min([n for n in back if a <= n <= b], default=b)) for name, (a, b) in spans.items()}
        own = PurePath(file).stem.upper().removesuffix("_SPF").removeprefix("_N_")
        subprograms = {name: span for name, span in spans.items() if span[0] != main[0]}
        if file != self.main_file:
            subprograms[own] = (1, min(back, default=lines))
        times = dict(zip(*(a.tolist() for a in words.pick("P")), strict=True))
        passive = self.controller.program.passive if self.controller is not None else ()
        known = KNOWN.union(passive)
        calls = {b: Call(b, s.name, int(times.get(b, 1.0))) for b, s in named if s.name not in known}
        calls |= {int(b): Call(int(b), f"L{int(n)}", int(times.get(b, 1.0)))
                  for b, n in zip(*(a.tolist() for a in words.pick("L")), strict=True)}
        unknown = [c for c in calls.values() if c.name not in self.names | set(spans) and not c.name.startswith("L")]
        return Structure(main, subprograms, calls), [
            error("gcode.unknown_word", f"{c.name} is not executed by this reader", file=file, lines=[c.line],
                  hint="neither a function that it knows nor the name of a subprogram") for c in unknown]

    def canonical(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words."""
        words, found = text.words, list[Diagnostic]()
        new: New = []
        drop = np.zeros(len(words.letter), dtype=bool)
        run = SiemensRun(words, text, line, file, found, new, self.axes)
        self._plain(words, new, drop, run)
        laws, drills = run.statements()
        words = relative_words(words, self.axes)
        letter = words.letter.copy()
        center = np.isin(letter, [ord(a) for a in "IJK"])
        letter[center] += 32
        letter[letter >= FORCED] -= FORCED
        value = words.value.copy()
        units = (letter == ord("G")) & np.isin(value, (70, 71, 700, 710))
        found += self._feeds_apart(words, line, file)
        value[units] = np.where(np.isin(value[units], (70, 700)), 20.0, 21.0)
        drop |= (letter == ord(STATEMENT)) | np.isin(letter, [ord(a) for a in (*"LP", ROUNDED, ROUNDED_RAPID)])
        return Canonical(added(Words(letter, value, words.line, words.lines), new, drop), line, laws, drills,
                         curves=run.polynomials.stacked(), splines=np.array(run.polynomials.splines, dtype=np.int64)), found

    def _feeds_apart(self, words: Words, line: Ints, file: str) -> list[Diagnostic]:
        """F while G70 holds: it leaves feeds in the basic system, mm or inches as MD10240 has it (S1, 3.1.6)."""
        state = fill(*codes(words, "G", (70, 71, 700, 710)), words.lines, 0.0) == 70.0
        blocks = distinct(words.line[(words.letter == ord("F")) & state[words.line]])
        if not len(blocks):
            return []
        return [error("gcode.units", "F while G70 holds, which leaves feeds in the basic system of the control (MD10240)",
                      file=file, lines=line[blocks][:6].tolist(), count=len(blocks), hint="write G700 in the place of G70")]

    def _plain(self, words: Words, new: New, drop: Bools, run: SiemensRun) -> None:
        """What codes without names set: tools, length, offsets, rests, exact stop."""
        for b in codes(words, "G", (4,))[0].tolist():
            low, high = np.searchsorted(words.line, [b, b + 1])
            here = low + np.flatnonzero(words.letter[low:high] == ord("F"))
            drop[here] = True
            if not len(here):
                run.fault("gcode.dwell", b, "G4 lacks F", "state the seconds: G4 F0.5")
            new += [(b, REST, float(words.value[k])) for k in here]
        for b, g in zip(*codes(words, "G", self.groups["offset"]), strict=True):
            new.append((int(b), OFFSET, float(g)))
        run.rounding()
        tool, edge = number_of(words, "T"), words.pick("D")
        change = codes(words, "M", (6,))[0]
        events = sorted([(int(b), 0, 0.0) for b in change] + [(int(b), 1, float(d)) for b, d in zip(*edge, strict=True)])
        loaded = -1.0
        for b, kind, d in events:
            if kind == 0:
                loaded = float(np.nan_to_num(tool[b], nan=-1.0))
                new.append((b, LOADED, loaded))
                if loaded < 0.0:
                    run.fault("gcode.tool", b, "M6 without a tool number", "state T with its number before it")
            if d not in (0.0, 1.0):
                run.fault("gcode.tool", b, f"D{d:g}: the length of another cutting edge than the first is not known",
                          "D1 or D0")
            register = -1.0 if kind and d == 0.0 else loaded
            run.length.append((b, np.inf if kind and d > 0.0 and loaded < 0.0 else register))
            new.append((b, REGISTER, register if kind else UNSTATED))


def _apart(text: bytes) -> tuple[bytes, list[tuple[int, str]]]:
    """(text whose blocks with names, calls or = are left empty, those blocks by line)."""
    signs = np.frombuffer(text, dtype=np.uint8)
    letter = _NAMES[signs]
    at = np.flatnonzero(_SIGNS[signs] | np.append(letter[:-1] & letter[1:], False))
    ends = np.append(np.flatnonzero(signs == 10), len(text))
    kept, special, done = [], list[tuple[int, str]](), 0
    for line in distinct(np.searchsorted(ends, at)).tolist():
        first, last = int(ends[line - 1]) + 1 if line else 0, int(ends[line])
        special.append((line + 1, text[first:last].decode("ascii", "replace")))
        kept.append(text[done:first])
        done = last
    return b"".join([*kept, text[done:]]), special


def _parse(row: str, line: int, new: New, statements: list[DialectStatement], file: str) -> list[Diagnostic]:
    """The words and statements of one block."""
    at, row = 0, terms_apart(row, line, new, statements)
    while at < len(row.rstrip()):
        match = _TOKEN.match(row, at)
        if match is None or not _token(match, line, new, statements):
            return [error("gcode.syntax", f"not a block of words: {row.strip()[:60]!r}", file=file, lines=[line],
                          hint="a block is words, names of the control and calls")]
        at = match.end()
    return []


def _token(match: re.Match[str], line: int, new: New, statements: list[DialectStatement]) -> bool:
    """One word or statement; False where it is not read."""
    if match["letter"]:
        new.append((line, match["letter"], float(match["number"])))
    elif match["setting"]:
        new.append((line, STATEMENT, float(len(statements))))
        statements.append(DialectStatement(match["setting"], (float(match["set"]),)))
    elif match["key"]:
        return _assigned(match, line, new)
    elif match["call"] or match["name"]:
        args = _arguments(match["args"]) if match["call"] else ()
        new.append((line, STATEMENT, float(len(statements))))
        statements.append(DialectStatement(match["call"] or match["name"], args))
    elif match["text"] is not None and statements and statements[-1].name == "CALL":
        statements[-1] = DialectStatement(match["text"])
    return True


def _assigned(match: re.Match[str], line: int, new: New) -> bool:
    """X=IC(1), X=AC(1), I=AC(1), X=1, CR=, TURN=."""
    key, how = match["key"], match["how"]
    value = float(match["within"] or match["value"])
    if key in _KEYS and how is None:
        new.append((line, _KEYS[key], value))
    elif len(key) == 1 and how in (None, "AC", "IC"):
        code = ord(key) + (0 if how is None else FORCED if how == "AC" else 32)
        new.append((line, chr(code), value))
    elif key in "ABC" and how in DIRECTIONS:
        new += [(line, chr(ord(key) + FORCED), value), (line, DIRECTION, 8.0 * ord(key) + DIRECTIONS[how])]
    else:
        return False
    return True


def _arguments(text: str) -> tuple[float | str | None, ...]:
    """Numbers, names and strings between commas; None where nothing stands."""
    result: list[float | str | None] = []
    for part in re.findall(r'(?:"[^"]*"|[^,])+|(?<=,)(?=,)|^(?=,)|(?<=,)$', text) if text.strip() else []:
        part = part.strip()
        try:
            result.append(float(part) if part else None)
        except ValueError:
            result.append(part.strip('"'))
    return tuple(result)
