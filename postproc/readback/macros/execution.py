"""A program in macro language as the plain program that the control makes of it, block by block."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace as changed
from typing import TYPE_CHECKING, Literal

import numpy as np

from postproc.readback.text.canonical import Files, placed
from postproc.readback.text.tool_names import called_otherwise
from postproc.readback.text.words import lines_of, plain
from toolpaths.arrays import Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.pattern import pattern
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from postproc.readback.macros.fanuc import FanucMacros
    from postproc.readback.macros.held import Held
    from postproc.readback.macros.klartext import KlartextMacros
    from postproc.readback.macros.linuxcnc import LinuxCncMacros
    from postproc.readback.macros.siemens import SiemensMacros
    from postproc.readback.macros.sources import Cleaned, ProgramFiles

ToolsNumbered = Callable[[bytes, str], tuple[bytes, list[Diagnostic]]]
MacroLanguage = Literal["fanuc", "haas", "linuxcnc", "siemens", "klartext"]
_NEEDED = {
    "fanuc": re.compile(rb"[#\[]|GOTO|M0*99[ \t]*P|M0*198(?!\d)"
                        rb"|G0*(?:(?:1[056]|30|31|52|68|92|6[567])(?![\d.])|5[01](?:\.1)?(?![\d.]))"),
    "linuxcnc": re.compile(rb"[#\[]|G0*(?:10|28|30|52|92)(?![\d])|\bO\s*(?:<|\d+\s*[A-Z])"),
    "siemens": re.compile(
        rb"\b(?:DEF|IF|GOTO[FBCS]?|FOR|WHILE|REPEATB?|LOOP|CASE|EXTERN|A?TRANS|A?ROTS?|A?SCALE|A?MIRROR|HOLES[12]|CYCLE801|EXTCALL|SETAL|G53|G153|G20|G21)\b"
        rb"|\bR\d+[ \t]*=|=[ \t]*[-+]*[ \t]*(?!(?:IC|AC|DC|ACP|ACN)[ \t]*\([ \t]*[-+.\d]+[ \t]*\))[A-Z_$(\[]"
        rb"|=[ \t]*[-+]?[\d.]+[ \t]*[-+*/]|\bT[ \t]*=[ \t]*\"|\bPROC\b[^\n]*(?:\(|\bSAVE\b)"
        rb"|\bMCALL[ \t]+(?!CYCLE8)[A-Z_]"),
    "klartext": re.compile(rb"DECLARE STRING|TRANS DATUM|CYCL DEF[ \t]*(?:[78]|1[01])\.|FN[ \t]*\d+[ \t]*:"
                           rb"|(?m:^)[ \t]*(?:\d+[ \t]+)?Q[LRS]?\d+[ \t]*=|Q[LRS]?\d+(?!\d|[ \t]*=)")}
_SIGNS_OF: dict[MacroLanguage, tuple[bytes, ...]] = {"fanuc": (b"#", b"[", b"GOTO"), "linuxcnc": (b"#", b"[")}
_BEGINNINGS: dict[MacroLanguage, tuple[re.Pattern[bytes], ...]] = {
    "fanuc": (re.compile(rb"M0*(?:99[ \t]*P|198)"), re.compile(rb"G0*(?:1[056]|30|31|50|51|52|92|6[5678])")),
    "linuxcnc": (re.compile(rb"G0*(?:10|28|30|52|92)"), re.compile(rb"O\s*[<\d]"))}
"""one of these stands where `_NEEDED` finds anything: each looked for by its first letter, they are soon absent"""
_CONTINUED = pattern(rb"~[ \t]*\n")
_COMMENT, _STRING = re.compile(rb";[^\n]*"), re.compile(rb'(?<!T=)"[^"\n]*"')
_SIGNS = pattern(rb"=[ \t]*[-+]*[ \t]*(?:[A-Z_$(\[]|[\d.]+[ \t]*[-+*/])")
_POLYNOMIAL = pattern(rb"(?:\bPO[ \t]*\[[ \t]*[A-Z]?[ \t]*\][ \t]*=|=[ \t]*PO)[ \t]*\([-+.,\dEX \t]*\)")
_CONTROL_POINTS = pattern(rb"(?m)^[^;(\n]*\bBSPLINE\b")
"""polynomials of numbers, which the dialect reads by itself"""
_PARAMETERS = pattern(rb"R\d+[ \t]*=")
_WORDS = (b"DEF", b"IF", b"GOTO", b"FOR", b"WHILE", b"REPEAT", b"LOOP", b"CASE", b"EXT", b"TRANS", b"ROT", b"SCALE",
          b"MIRROR", b"HOLES", b"CYCLE801", b"SETAL", b"G53", b"G153", b"G20", b"G21", b"PROC", b"MCALL", b'"')
"""one of these, signs or parameters stand where `_NEEDED` finds anything in a program of SINUMERIK: absent is soon known"""


@dataclass(frozen=True)
@arrays(line="B")
class PlainProgram:
    """A program without macro language.

    Attributes:
        text: a block a line; line (B + 1,): of each block, counted through all files; files: as `Canonical.files`
    """

    text: bytes
    line: Ints
    files: Files


def needed(data: bytes, language: MacroLanguage, passive: tuple[str, ...] = ()) -> bool:
    """True where a program, comments aside, has what only its execution explains."""
    key: MacroLanguage = "fanuc" if language == "haas" else language
    form, text = _NEEDED[key], data.upper()
    if language == "siemens":
        bare = _COMMENT.sub(b"", text) if b";" in text else text
        bare = _STRING.sub(b"", bare) if b'"' in bare else bare
        bare = _POLYNOMIAL.sub(b" ", bare) if b"PO" in bare else bare
        likely = any(word in bare for word in _WORDS) or _SIGNS.search(bare) or _PARAMETERS.search(bare)
        return bool(likely) and form.search(bare) is not None
    if key in _SIGNS_OF and not (any(sign in text for sign in _SIGNS_OF[key])
                                 or any(part.search(text) for part in _BEGINNINGS[key])):
        return False
    if not form.search(text):
        return False
    if language == "klartext":
        return form.search(_CONTINUED.sub(b" ", re.sub(rb";[^~\n]*", b"", lines_of(text)))) is not None
    found = {m[0] for m in form.finditer(plain(text))}
    codes = {f"G{int(f[1:])}" for f in found if f[:1] == b"G" and f[1:].isdigit()}
    return bool({f for f in found if not (f[:1] == b"G" and f[1:].isdigit())} or codes - set(passive))


def executed(data: bytes, file: str, others: Mapping[str, bytes], language: MacroLanguage, held: Held,
             numbered: ToolsNumbered) -> tuple[PlainProgram | None, list[Diagnostic]]:
    """The plain program; None, and why, where a block cannot be executed.

    Work is bounded: `held.most` blocks. `numbered` puts numbers in the place of the names of tools.
    """
    from postproc.readback.macros.expressions import MacroFault
    from postproc.readback.macros.siemens import SiemensMacros
    from postproc.readback.macros.sources import ProgramFiles

    rows = _rows_of(language)

    def cleaned(text: bytes, name: str) -> tuple[list[str], list[Diagnostic]]:
        text, found = ((text, called_otherwise(text, held.tools, name)) if language == "siemens" else
                       numbered(text, name))
        made, more = rows(text, name)
        return made, [*found, *more]
    upper = data.upper() if language == "siemens" else b""
    if curve := _POLYNOMIAL.search(upper) or _CONTROL_POINTS.search(upper):
        fault = MacroFault("gcode.curve", "a curve (POLY, PO, BSPLINE) in a program with variables, jumps or frames is not "
                           "executed", "write such a curve as lines or arcs, or the program without them")
        return None, [fault.at(file, data.count(b"\n", 0, curve.start()) + 1)]
    sources = ProgramFiles(data, file, others, cleaned)
    run = _run(language, sources, held)
    try:
        run.run()
    except MacroFault as fault:
        return None, [*sources.found, *placed([fault.at(file, run.line)], sources.files)]
    except RecursionError:
        deep = MacroFault("gcode.expression", "brackets too deep", "write the expression in steps")
        return None, [*sources.found, *placed([deep.at(file, run.line)], sources.files)]
    except (ArithmeticError, ValueError):
        large = MacroFault("gcode.expression", "a number that the block needs is too large, or is none",
                           "the control stops there: test the value before")
        return None, [*sources.found, *placed([large.at(file, run.line)], sources.files)]
    judged = run.judged() if isinstance(run, SiemensMacros) else run.blocks.judged()
    found = [*sources.found, *placed(judged, sources.files)]
    if has_errors(found):
        return None, found
    text = "".join(f"{row}\n" for row in run.blocks.rows).encode("ascii", "replace")
    line = np.array([0, *run.blocks.lines], dtype=np.int64)
    return PlainProgram(text, line, sources.files), found


def _run(language: MacroLanguage, sources: ProgramFiles,
         held: Held) -> FanucMacros | LinuxCncMacros | SiemensMacros | KlartextMacros:
    """The interpreter of a language; all are imported where a program needs one."""
    from postproc.readback.macros.fanuc import FanucMacros
    from postproc.readback.macros.klartext import KlartextMacros
    from postproc.readback.macros.linuxcnc import LinuxCncMacros
    from postproc.readback.macros.siemens import SiemensMacros

    if language == "linuxcnc":
        return LinuxCncMacros(sources, held)
    if language == "siemens":
        return SiemensMacros(sources, held)
    return KlartextMacros(sources, held) if language == "klartext" else FanucMacros(sources, held, language == "haas")


def _rows_of(language: MacroLanguage) -> Cleaned:
    """The blocks of a text, as its language has them."""
    from postproc.readback.macros.klartext import klartext_rows
    from postproc.readback.macros.siemens_rows import siemens_rows
    from postproc.readback.macros.sources import word_rows

    if language == "siemens":
        return siemens_rows
    return klartext_rows if language == "klartext" else word_rows


def in_source(found: list[Diagnostic], program: PlainProgram) -> list[Diagnostic]:
    """Faults of the plain program, at the lines that its blocks come from."""
    last = len(program.line) - 1
    return placed([changed(d, lines=tuple(int(program.line[min(n, last)]) for n in d.lines)) for d in found], program.files)
