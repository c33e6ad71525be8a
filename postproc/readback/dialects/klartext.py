"""Heidenhain TNC 640 Klartext.

From the user's manuals Klartext Programming and Cycle Programming 34059x: L, C with CC, CR, CP, LP; FMAX
holds in its block, F from block to block; R0, RL, RR; I before an axis for incremental; M91, M99, M128, M129;
TOOL CALL takes the length with the tool; CYCL DEF by number and Q parameters; FUNCTION TCPM F TCP AXIS POS
PATHCTRL AXIS; PLANE SPATIAL, turns about the fixed X, then Y, then Z, with TURN, MOVE or STAY; LBL, CALL LBL
with REP, CALL PGM.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import PurePath
from typing import ClassVar

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.base import M_CODES, Reader
from postproc.readback.dialects.iso import New
from postproc.readback.dialects.klartext_run import KlartextRun
from postproc.readback.dialects.klartext_splines import spline_statement
from postproc.readback.text.canonical import (
    STATEMENT,
    Canonical,
    DialectStatement,
    ProgramText,
    added,
)
from postproc.readback.text.flow import Call, Structure
from postproc.readback.text.modal import GROUPS, Groups
from postproc.readback.text.words import Words, block_delete, lines_of, read_words
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, error, warning

_COMMENT = re.compile(rb";[^~\n]*(?:~[ \t]*(?=\n))?|;[^\n]*")
_SKIPPED = re.compile(rb"(?m)^[ \t]*/[ \t]*(\d+[ \t]+)")
_JOINED = re.compile(rb"~[ \t]*\n")
_SLOW = re.compile(rb"(?m)^(?![ \t]*(?:\d+[ \t]+)?L[ \t](?![^\n]*M12[89]))[^\n]+$")
_HEAD = re.compile(rb"(?m)^[ \t]*(?:\d+[ \t]+)?L[ \t]")
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)"
_WORD = re.compile(rf"\s*(?:(?P<fmax>F ?MAX)|(?P<side>R[0LR])(?![\d.])|(?P<sense>DR[-+])"
                   rf"|(?P<letter>IP[AR]|P[AR]|I?[XYZABCUVW]|[FMSRN])\s*(?P<number>{_NUMBER}))\s*")
_QWORD = re.compile(rf"Q(\d+)\s*=\s*({_NUMBER})")
_KEYED = re.compile(rf"(SP[ABC]|DIST|ABST|T|TA|HSC-MODE:|S|F|DL|DR|DR2)\s*({_NUMBER})")
_SIDES = {"R0": 40.0, "RL": 41.0, "RR": 42.0}
_PASSIVE = ("BLK FORM", "TOOL DEF", "* -", "*")
_WORKS = re.compile(r"(?<![A-Z0-9])M ?\d")
"""an M function, which no statement of the shop hides"""
_CONTOURS = ("CC", "CP", "CR", "C", "LP", "L")
_CONTOUR = re.compile(rf"({'|'.join(_CONTOURS)})(?![A-Z])")
_NUMBERED = re.compile(r"\d+\s+")
_FAST = ((b"F MAX", b"G0"), (b"FMAX", b"G0"), (b" R0", b" G40"), (b" RL", b" G41"), (b" RR", b" G42"))
_HINT = "allowed are L, C, CR, CP, LP, CC, TOOL CALL, CYCL DEF, CYCL CALL, PLANE SPATIAL, FUNCTION TCPM, LBL, CALL"


class KlartextReader(Reader):
    """Klartext programs: L blocks at once, all others one by one as statements."""

    groups: Groups = GROUPS | {"offset": (), "length": (), "level": (), "path": (), "once": (), "arc_distance": (),
                               "distance": (), "units": (), "feed_mode": (), "plane": ()}
    language = "klartext"
    turn_codes = True
    statements = frozenset({*_CONTOURS, "BLK FORM", "TOOL DEF", "BEGIN PGM", "END PGM", "TOOL CALL", "CYCL DEF", "CYCL CALL",
                            "LBL", "CALL LBL", "CALL PGM", "PLANE SPATIAL", "PLANE RESET", "FUNCTION TCPM",
                            "FUNCTION RESET TCPM", "STOP", "SPL"})
    m_codes = (*M_CODES, 13.0, 14.0, 91.0, 99.0, 126.0, 127.0, 128.0, 129.0)
    letters = "GMFS?"
    sides: ClassVar[dict[int, str]] = {40: "off (R0)", 41: "left (RL)", 42: "right (RR)"}
    alone = "BEGIN PGM A MM\n{}END PGM A MM\n"
    smoothing_hint = "CYCL DEF 32.1 T and 32.2 TA as the post writes them"
    arc_slack = 0.016
    """mm, the TNC's own (circle end points)"""

    stating: ClassVar[dict[str, str]] = {
        "compensation": "R0", "offset": "the preset (CYCL DEF 247)", "length": "a tool (TOOL CALL)"}
    leaving: ClassVar[dict[InterpolationMode, tuple[str, ...]]] = {"tcp": ("FUNCTION RESET TCPM", "M129"),
                                                                       "tilted": ("PLANE RESET",)}
    units_codes = "BEGIN PGM ... MM"
    units_from = "nobody knows: the control takes no program without"

    def tokens(self, data: bytes, file: str) -> tuple[ProgramText, list[Diagnostic]]:
        """Words of L blocks; statements of the others."""
        text = lines_of(data).upper()
        text = _COMMENT.sub(lambda m: b"~" if m[0].rstrip().endswith(b"~") else b"", text)
        text = _JOINED.sub(b" \x01", text)
        rows = np.cumsum([0, *(1 + row.count(b"\x01") for row in text.split(b"\n"))]) if b"\x01" in text else None
        text, found = block_delete(_SKIPPED.sub(rb"\1/", text.replace(b"\x01", b" ")), file)
        slow: list[tuple[int, str]] = []

        def cut(match: re.Match[bytes]) -> bytes:
            slow.append((match.start(), match[0].decode("ascii", "replace")))
            return b""
        ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == 10)
        fast = _HEAD.sub(b"G1 ", _SLOW.sub(cut, text))
        for old, short in (*_FAST, *((b" I" + a.encode(), b" " + a.lower().encode()) for a in self.axes)):
            fast = fast.replace(old, short)
        words, more = read_words(fast, file)
        new: New = []
        statements: list[DialectStatement] = []
        for start, row in slow:
            more += self._statement(row, int(np.searchsorted(ends, start)) + 1, new, statements, file)
        words = added(Words(words.letter, words.value, words.line, words.lines), new)
        if rows is not None:
            words, more = _in_file(words, rows), [_moved(d, rows) for d in more]
        return ProgramText(words, tuple(statements)), found + more

    def _statement(self, row: str, line: int, new: New, statements: list[DialectStatement],
                   file: str) -> list[Diagnostic]:
        """One block that is no plain L."""
        body = row.strip()
        body = "" if body.isdigit() else body[match.end():] if (match := _NUMBERED.match(body)) else body
        block = _block(body, self.controller.program.passive if self.controller is not None else ())
        if block is None:
            return [error("gcode.syntax", f"not a block that this reader executes: {body[:60]!r}", file=file, lines=[line],
                          hint=_HINT)]
        made, words = block
        new += [(line, letter, value) for letter, value in words]
        if made.name:
            new.append((line, STATEMENT, float(len(statements))))
            statements.append(made)
        return []

    def check(self, words: Words, file: str) -> list[Diagnostic]:
        """Codes and words; FMAX stands for G0 next to the G1 of its block."""
        plain = words.take((words.letter != ord(STATEMENT)) & ((words.letter != ord("G")) | (words.value > 3)))
        letter = np.where(plain.letter >= 97, plain.letter - 32, plain.letter).astype(np.uint8)
        return super().check(Words(letter, plain.value, plain.line, plain.lines), file)

    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """LBL to LBL 0 are subprograms, also where they are run in passing; CALL LBL REP repeats what stands before."""
        where, index = text.words.pick(STATEMENT)
        here = [(int(b), text.statements[int(k)]) for b, k in zip(where, index, strict=True)]
        self.ends = [b for b, s in here if s.name == "END PGM"]
        labels = [(b, str(s.args[0])) for b, s in here if s.name == "LBL"]
        subprograms, calls, found = {}, {}, list[Diagnostic]()
        for b, name in labels:
            last = next((e for e, n in labels if e > b and n == "0"), 0)
            if name != "0" and last:
                subprograms[f"LBL {name}"] = (b, last)
        for b, s in here:
            name = str(s.args[0]) if s.args else ""
            if s.name == "CALL LBL" and s.keys.get("REP", 0.0) > 0.0:
                if first := next((a for a, n in labels if n == name and a < b), 0):
                    subprograms[f"REP {name} {b}"] = (first, b - 1)
                calls[b] = Call(b, f"REP {name} {b}" if first else f"LBL {name} before its REP", int(s.keys["REP"]))
            elif s.name in ("CALL LBL", "CALL PGM"):
                calls[b] = Call(b, f"{s.name[5:]} {name}")
        if not any(s.name == "BEGIN PGM" and s.args[1] for _, s in here):
            found.append(self.unstated(file, 1))
        names = {str(s.args[0]) for _, s in here if s.name == "BEGIN PGM"} | {PurePath(file).stem.upper()}
        subprograms |= {f"PGM {name}": (1, text.words.lines) for name in names if name} if file else {}
        subprograms = {k: v for k, v in subprograms.items() if v != (1, text.words.lines) or calls or k.startswith("PGM")}
        return Structure((1, text.words.lines), subprograms, calls), found + _frame(here, file, text.words.lines)

    def units(self, code: Canonical, file: str) -> list[Diagnostic]:
        """BEGIN PGM states them, or `structure` says that it does not."""
        return []

    def offset_of(self, text: str) -> float:
        """Number of the preset that CYCL DEF 247 takes."""
        return float(dict(_QWORD.findall(text)).get("339", "nan"))

    def offset_name(self, number: float) -> str:
        """A line of the datum table."""
        return f"datum {number:g}"

    def stems(self, call: str) -> tuple[str, ...]:
        """The name of CALL PGM, without folders."""
        return (call.removeprefix("PGM "),) if call.startswith("PGM ") else ()

    def behind_end(self, structure: Structure) -> tuple[tuple[int, int], ...]:
        """Lines that may stand behind the end: those of labels."""
        ends = tuple((b, b) for b in self.ends)
        return ends + tuple(v for k, v in structure.subprograms.items() if k.startswith("LBL"))

    def canonical(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words."""
        run = KlartextRun(text, line, file, self.axes)
        return run.canonical(), [*run.found, *_two_units(text, file)]


def _two_units(text: ProgramText, file: str) -> list[Diagnostic]:
    """A program that calls another in other units."""
    units = {str(s.args[1]) for s in text.statements if s.name == "BEGIN PGM" and s.args[1]}
    if len(units) < 2:
        return []
    return [error("gcode.units", "programs in mm and in inches that call one another", file=file,
                  hint="write all of them in mm, or all in inches")]


def _frame(here: list[tuple[int, DialectStatement]], file: str, lines: int) -> list[Diagnostic]:
    names = [s.args[0] for _, s in here if s.name in ("BEGIN PGM", "END PGM")]
    if len(names) == 2 and names[0] == names[1]:
        return []
    return [warning("gcode.frame", "the program has no BEGIN PGM and END PGM of one name", file=file, lines=[lines],
                    hint="write 0 BEGIN PGM NAME MM ... END PGM NAME MM")]


def _in_file(words: Words, rows: Ints) -> Words:
    """Words with the line that each block begins in, in a file whose blocks are longer than a line."""
    return Words(words.letter, words.value, rows[words.line - 1] + 1, int(rows[-1]))


def _moved(d: Diagnostic, rows: Ints) -> Diagnostic:
    from dataclasses import replace
    return replace(d, lines=tuple(int(rows[n - 1]) + 1 for n in d.lines))


_Word = tuple[str, float]
_NOTHING = DialectStatement("", ())


@lru_cache(maxsize=10_000)
def _block(body: str, passive: tuple[str, ...]) -> tuple[DialectStatement, tuple[_Word, ...]] | None:
    """A block that is no plain L: the statement, its words; None where it is none. Programs say the same again and again.

    `passive`: beginnings of blocks of the shop that do nothing.
    """
    if not body or body.startswith(_PASSIVE) or (not _WORKS.search(body) and any(
            re.match(rf"{re.escape(p)}(?![A-Z0-9])", body) for p in passive if p[1:2].isalpha())):
        return _NOTHING, ()
    made = _named(body)
    return (made, ()) if made is not None else _contour(body)


def _named(body: str) -> DialectStatement | None:
    """Blocks that begin with a name; None where it is none of these."""
    keys = {f"Q{n}": float(v) for n, v in _QWORD.findall(body)}
    if re.match(r"SPL(?![A-Z])", body):
        return spline_statement(body)
    if match := re.fullmatch(r"(BEGIN|END) PGM (\S+)\s*(MM|INCH)?", body):
        return DialectStatement(f"{match[1]} PGM", (match[2], match[3]))
    if match := re.fullmatch(rf"TOOL CALL(?: (\d+))?(?: ([XYZ]))?((?: (?:S|F|DL|DR|DR2) ?=? ?{_NUMBER})*)", body):
        return DialectStatement("TOOL CALL", (float(match[1]) if match[1] else None, match[2]),
                                _keyed(match[3]))
    if match := re.fullmatch(r"CYCL DEF (\d+)(?:\.(\d+))?\b(.*)", body):
        if match[2] is None and not re.fullmatch(rf"[^=]*?(?:Q\d+\s*=\s*{_NUMBER}\s*)*", match[3]):
            return None
        values = keys if match[2] is None else _keyed(match[3])
        return DialectStatement("CYCL DEF", (float(match[1]), float(match[2]) if match[2] else None, match[3].strip()),
                                values)
    if match := re.fullmatch(r"CYCL CALL(?: POS)?(.*)", body):
        return DialectStatement("CYCL CALL" + (" POS" if " POS" in body else ""),
                                (match[1].replace("POS", "").strip(),))
    if match := re.fullmatch(r"LBL \"?([^\"]+?)\"?", body):
        return DialectStatement("LBL", (match[1],))
    if match := re.fullmatch(r"CALL LBL \"?([^\"\s]+)\"?(?: REP ?(\d+))?", body):
        return DialectStatement("CALL LBL", (match[1],), {"REP": float(match[2] or 0.0)})
    if match := re.fullmatch(r"CALL PGM (\S+)", body):
        return DialectStatement("CALL PGM", (PurePath(match[1].replace("\\", "/")).stem,))
    if match := re.fullmatch(r"(PLANE SPATIAL|PLANE RESET|FUNCTION TCPM|FUNCTION RESET TCPM)\b(.*)", body):
        return DialectStatement(match[1], tuple(match[2].split()), _keyed(match[2]))
    return DialectStatement("STOP", (body[4:].strip(),)) if re.fullmatch(r"STOP(?: M0?[01])?", body) else None


def _keyed(text: str) -> dict[str, float]:
    return {k.strip(": ="): float(v) for k, v in _KEYED.findall(text.replace("=", " "))}


def _contour(body: str) -> tuple[DialectStatement, tuple[_Word, ...]] | None:
    """CC, C, CR, CP, LP and L blocks, and blocks of M functions alone: the statement that is left, and their words."""
    name = match[1] if (match := _CONTOUR.match(body)) else ""
    at, keys, sense, after = len(name), {}, 0.0, ""
    made: list[_Word] = []
    while at < len(body):
        match = _WORD.match(body, at)
        if match is None:
            return None
        at = match.end()
        if match["fmax"]:
            made.append(("G", 0.0))
        elif match["side"]:
            made.append(("G", _SIDES[match["side"]]))
        elif match["sense"]:
            sense = 1.0 if match["sense"].endswith("+") else -1.0
        elif match["letter"] in ("F", "M", "S"):
            if not (match["letter"] == "F" and after in ("M128", "M126")):
                made.append((match["letter"], float(match["number"])))
            after = match["letter"] + match["number"]
        elif name == "L" and match["letter"] != "R":
            letter = match["letter"]
            made.append((letter[1].lower() if len(letter) == 2 else letter, float(match["number"])))
        elif name and (match["letter"] != "R" or name == "CR"):
            keys[match["letter"]] = float(match["number"])
        else:
            return None
    if not name and not made:
        return None
    if name in ("L", "LP"):
        made.insert(0, ("G", 1.0))
    return DialectStatement("" if name in ("L", "") else name, (sense,), keys), tuple(made)
