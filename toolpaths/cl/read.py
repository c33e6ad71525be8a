"""Read a CL file: bytes -> lines -> statements -> dialect and units -> rows -> Toolpath."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from toolpaths.aside import aside
from toolpaths.choices import CubicPieces, DialectName, LengthUnit, ShopName
from toolpaths.cl.assemble import assemble
from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.curves import SPLINE_CHORD, SPLINE_SHARE
from toolpaths.cl.forms import check_forms
from toolpaths.cl.indexing import TRANS_HINT
from toolpaths.cl.interpret import HANDLERS, known, report_others, run
from toolpaths.cl.rapid_heights import low_rapids
from toolpaths.cl.records import counted
from toolpaths.cl.structure import open_paths
from toolpaths.cl.systems.recognise import Form, read_form, recognised, shop_form
from toolpaths.cl.systems.shop_forms import ShopText, shop_names, shop_text, shop_text_as
from toolpaths.cl.text.dialects import DIALECTS, Dialect, detect, units_said
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.other_formats import APT, other_format
from toolpaths.cl.text.scan import LARGEST, LARGEST_OWN, ReadProgress, scan
from toolpaths.cl.text.source import normalise
from toolpaths.cl.text.statements import Lexer, StatementList
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, has_errors
from toolpaths.input_files import read_input, unreadable
from toolpaths.toolpath import ClSource, RecordCounts, Toolpath

AskedDialect = DialectName | ShopName
_OWN_HEAD = b"$$-> TOOLPATH /"
_TAIL = 400
"""bytes that hold the last two lines"""
_ENDS = (b"FINI", b"END")
_SEEN = 20_000
"""bytes of a file that some package may read, in which APT text has a point"""
_SENTENCE = 3
"""words of a line behind the end that is the text of a listing"""


@dataclass(frozen=True)
class ReadResult:
    """What a CL file holds, and what reading it showed.

    `evidence` says by what the dialect was recognised; records are counted as the file writes them.
    """

    toolpath: Toolpath
    diagnostics: list[Diagnostic]
    unknown_words: dict[str, int] = field(default_factory=dict)
    dialect: DialectName = "generic"
    evidence: str = ""
    arc_records: int = 0
    cycle_records: int = 0
    lines: int = 0


def read_file(path: str | Path, *, units: LengthUnit | None = None, dialect: AskedDialect | None = None,
              allow_unknown: Iterable[str] = (), progress: ReadProgress | None = None,
              tolerance: float = 0.0) -> ReadResult:
    """Read the file at `path` (- for standard input); see `read_bytes`. A file that cannot be opened is a diagnostic too."""
    try:
        data = read_input(path, standard_input=True)
    except OSError as fault:
        diagnostics = [unreadable(fault, "cl.open", path, "name a CL file (APT text)")]
        return ReadResult(_with_faults(_empty(str(path)), diagnostics), diagnostics)
    return read_bytes(data, file=str(path), units=units, dialect=dialect, allow_unknown=allow_unknown,
                      progress=progress, tolerance=tolerance)


def read_bytes(data: bytes | str, *, file: str = "", units: LengthUnit | None = None, dialect: AskedDialect | None = None,
               allow_unknown: Iterable[str] = (), progress: ReadProgress | None = None,
               tolerance: float = 0.0, cubics: CubicPieces = "") -> ReadResult:
    """Read the text of a CL file.

    Args:
        data: the file, in any encoding if bytes
        units: "mm" or "inch", used instead of what the file says
        dialect: one of `DIALECTS`, or the name of one that an installed package registers; used instead of the recognised
            one
        allow_unknown: words that may be left out although they look like motion
        progress: called with (bytes read, bytes in all)
        tolerance: mm of the program; a share of it may go to arcs and chords in the place of splines
        cubics: "pieces": splines by chords at equal steps between their knots (`Role.CUBIC`), so that they can be written as
            what they are; "uniform": as cubics with equal knots; else by as few arcs or chords as the tolerance allows

    Raises:
        ValueError: for a dialect or unit that does not exist (wrong use; faults of the file are diagnostics).
    """
    _check_options(units, dialect)
    allow_unknown = frozenset(allow_unknown)
    log = DiagnosticLog(file)
    raw = data.encode("utf-8", "replace") if isinstance(data, str) else bytes(data)
    other = None if recognised(raw) else other_format(raw)
    built_in = _built_in(dialect)
    shop = _read_by_package(raw, built_in, other is not None, log) if dialect in (None, built_in) else shop_text_as(
        ShopName(str(dialect)), raw, log)
    if dialect not in (None, built_in) and shop is None:
        return ReadResult(_with_faults(_empty(file), log.diagnostics()), log.diagnostics())
    if other and shop is None:
        return _refused(file, f"this is {other[0]}", other[1])
    said, apt = _said(raw, built_in, shop, log, progress)
    program, found = said.program, DIALECTS[said.name]
    b = ToolpathBuilder(program, said.points, found, _units(program, units, log), log, allow_unknown,
                        SPLINE_SHARE * tolerance or SPLINE_CHORD, cubics, frozenset() if shop is None else shop.passive)
    run(b, 0, len(program.statements))
    b.finish_rows()
    open_paths(b)
    if file and apt:
        _cut_off(raw, said.lines, log)
    counts = report_others(b)
    if b.row == 0 and not has_errors(log.diagnostics()):
        log.error("cl.empty", "the file has no points", hint="a CL file has GOTO records")
    toolpath = assemble(b)
    _check_rapids(b, toolpath)
    if apt or shop is not None:
        check_forms(program, log, b.allow_unknown, found, raw)
    records = counted(b, frozenset(HANDLERS))
    if _no_apt_text(b, records):
        return _refused(file, "no line of it is a record of APT text, and it is no form of a CAM system that is read", APT)
    diagnostics = _of_turning([op.turning for op in toolpath.operations], log)
    read = replace(_with_faults(toolpath, diagnostics), records=records)
    source = ClSource(aside(raw), units or "", built_in or "") if shop is None else shop.source(raw, units)
    object.__setattr__(read, "source", source)
    return ReadResult(read, diagnostics, counts, found.name, said.evidence,
                      b.arc_records, b.cycle_records, said.lines)


def _of_turning(turning: list[bool], log: DiagnosticLog) -> list[Diagnostic]:
    """What is said of a file: where all of it is turning and not all of it can be read, that alone, for it is not
    converted whatever its records are; where some of it is, that besides."""
    found = log.diagnostics()
    if not any(turning) or not has_errors(found):
        return found
    if not all(turning):
        log.info("cl.turning", "turning stands between milling: milling alone is converted")
        return log.diagnostics()
    own = DiagnosticLog(log.file)
    lines = sorted({line for d in found if d.severity is Severity.ERROR for line in d.lines})
    own.many(Severity.ERROR, "cl.turning", "this is a turning file: milling alone is converted",
             np.array(lines or [0], np.int64), "take turning operations out of the CL file")
    return [*own.diagnostics(), *(d for d in found if d.severity is Severity.INFO)]


def _said(raw: bytes, dialect: DialectName | None, shop: ShopText | None, log: DiagnosticLog,
          progress: ReadProgress | None) -> tuple[Form, bool]:
    """What a file says, and True where it is APT text, line for line."""
    if shop is not None and shop.lines is not None:
        return shop_form(shop, raw), False
    plain = normalise(raw, log) if shop is None else shop.text
    form = read_form(plain, dialect if shop is None else shop.like, log)
    if form is not None:
        return form, False
    largest = LARGEST_OWN if plain.startswith(_OWN_HEAD) else LARGEST
    parts = scan(plain, progress, largest)
    program = Lexer(plain, parts, log, known, largest).program()
    if shop is not None:
        return Form(shop.like, shop.evidence, program, parts.points, parts.lines), True
    found, evidence = (DIALECTS[dialect], "given") if dialect else detect(program)
    return Form(found.name, evidence, program, parts.points, parts.lines), True


def _read_by_package(data: bytes, dialect: DialectName | None, other: bool, log: DiagnosticLog) -> ShopText | None:
    """A file that an installed package reads; None where a dialect is asked for, or the file is the project's own form or
    one that is known without it. `other`: it is no APT text."""
    known_form = dialect is not None or data.startswith(_OWN_HEAD) or recognised(data) is not None
    return None if known_form else shop_text(data, other or b"GOTO" not in data[:_SEEN].upper(), log)


def _refused(file: str, message: str, hint: str) -> ReadResult:
    """A file that is none to read: one error, whatever its lines are."""
    log = DiagnosticLog(file)
    log.error("cl.format", message, hint=hint)
    return ReadResult(_with_faults(_empty(file), log.diagnostics()), log.diagnostics())


def _no_apt_text(b: ToolpathBuilder, records: RecordCounts) -> bool:
    """True where no line of a file is a record, and nothing else is wrong with it."""
    errors = {d.code for d in b.log.diagnostics() if d.severity is Severity.ERROR}
    return b.row == 0 and records.executed == 0 and records.dropped > 0 and errors == {"cl.text"}


def _check_rapids(b: ToolpathBuilder, toolpath: Toolpath) -> None:
    """Rapids below all that their tool cuts: an error where an indexed part may stand in the wrong frame, else a warning."""
    rows = low_rapids(toolpath)
    indexed = bool(b.turns_at or b.entries)
    b.log.many(Severity.ERROR if indexed else Severity.WARNING, "cl.rapid-below", "a rapid goes below everything that its "
               "tool cuts along that axis", toolpath.line[rows],
               TRANS_HINT if indexed else "look at the point in the CAM system")


def _cut_off(data: bytes, lines: int, log: DiagnosticLog) -> None:
    """A warning where the last line has no end and is not one that ends a file."""
    *before, last = (line.strip() for line in data[-_TAIL:].replace(b"\r", b"\n").rstrip(b"\x1a\x00").split(b"\n"))
    ended = next((line for line in reversed(before) if line), b"").upper().startswith(_ENDS)
    text = ended and b"/" not in last and len(last.split()) >= _SENTENCE
    if last and not text and not last.upper().startswith((*_ENDS, b"$$")):
        found = last[:60].decode("ascii", "replace")
        log.warning("cl.cut-off", f"the file ends behind {found!r} without a line end: it may "
                    "be cut off", lines, "compare the last line with the CAM system, or write the file again")


def _built_in(dialect: AskedDialect | None) -> DialectName | None:
    """A dialect that was asked for as one of the project's own."""
    return next((name for name in DIALECTS if name == dialect), None)


def _check_options(units: LengthUnit | None, dialect: AskedDialect | None) -> None:
    if units not in (None, "mm", "inch"):
        raise ValueError(f"units are mm or inch, not {units!r}")
    if dialect is not None and dialect not in DIALECTS and dialect not in (packages := shop_names()):
        near = get_close_matches(dialect, [*DIALECTS, *packages], 1)
        raise ValueError(f"no dialect {dialect!r}; {f'did you mean {near[0]!r}? ' if near else ''}known: "
                         + ", ".join([*DIALECTS, *packages]))


def _units(program: StatementList, given: LengthUnit | None, log: DiagnosticLog) -> LengthUnit:
    """The unit of the file: as given, by its UNITS word, by its feed units, else mm."""
    said = units_said(program)
    for body, line in said.wrong:
        log.error("cl.units", f"UNITS/{body}: the units are MM or INCHES", line,
                  "write UNITS/MM or UNITS/INCHES, or give --units")
    if given is not None:
        if said.words and given not in said.words:
            log.warning("cl.units", f"the file says {'/'.join(said.words)}, {given} was asked for and is taken",
                        next(iter(said.words.values())))
        elif not said.words and len(said.feeds) == 1 and given not in said.feeds:
            log.warning("cl.units", f"the file's feeds are in {'/'.join(said.feeds)}, {given} was asked for and is taken",
                        next(iter(said.feeds.values())))
        return given
    if len(said.words) > 1:
        log.error("cl.units", "the file changes its units", max(said.words.values()),
                  "give them with --units")
    if said.words or said.wrong:  # what is wrong has been said
        return next(iter(said.words), next(iter(said.feeds), "mm"))
    return _units_of_feeds(said.feeds, log)


def _units_of_feeds(feeds: dict[LengthUnit, int], log: DiagnosticLog) -> LengthUnit:
    if len(feeds) == 1:
        (unit, line), = feeds.items()
        add = log.info if unit == "mm" else log.warning
        add("cl.no-units", f"the file has no UNITS record; {unit} is taken from the unit of its feeds", line,
            "give the units with --units")
        return unit
    log.warning("cl.no-units", "the file has no UNITS record; mm is taken",
                hint="give the units with --units")
    return "mm"


def _with_faults(toolpath: Toolpath, diagnostics: list[Diagnostic]) -> Toolpath:
    return replace(toolpath, faults=tuple(d for d in diagnostics if d.severity is Severity.ERROR))


def _empty(file: str) -> Toolpath:
    log = DiagnosticLog(file)
    b = ToolpathBuilder(StatementList(), scan(b"").points, _GENERIC, "mm", log)
    return assemble(b)


_GENERIC: Dialect = DIALECTS["generic"]
