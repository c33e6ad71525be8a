"""CL files of forms that installed packages read: a dialect near a built-in one, or a whole format given as records.

What the built-in reader knows by itself stays as it is where a dialect is asked for. The second reading is given the
records that a package has made of a file, so the proof says that how they were made is not compared.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Protocol, get_args, runtime_checkable

from toolpaths.aside import aside
from toolpaths.choices import DialectName, LengthUnit, ShopName
from toolpaths.cl.systems.as_statements import UP, AsStatements
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.source import normalise, text_of
from toolpaths.dataclass import dataclass
from toolpaths.plug_ins import PlugIn, PlugInFault, plug_in, registered, said
from toolpaths.toolpath import ClSource

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

APT_TEXT = tuple(name for name in get_args(DialectName) if name not in ("nci", "freecad", "step-nc"))
"""dialects whose records are text"""
HEAD = 20_000
"""bytes in which the marks of a dialect are looked for, and that a reader is shown"""
_WORD = re.compile(r"[A-Z][A-Z0-9_.-]*")
_POINT = re.compile(r"GOTO\s*/\s*([-+0-9.eE,\s]+)$")
_POINT_NUMBERS = (3, 6)


@dataclass(frozen=True)
class ShopDialect:
    """APT text of a post of the shop: what a package registers in the group `postproc.cl_dialects`.

    Attributes:
        like: the built-in dialect whose meaning of records holds
        marks: texts one of which stands in the first lines of such a file and of no other
        words: words of this dialect, and the word of `like` that each stands for, what follows it being the same
        passive: words that move nothing and change nothing, which are passed over
    """

    like: DialectName
    marks: tuple[str, ...]
    words: Mapping[str, str] = field(default_factory=dict)
    passive: tuple[str, ...] = ()

    def fault(self) -> str:
        """What is wrong with it, "" where nothing is."""
        if self.like not in APT_TEXT:
            return f"like = {self.like!r} is no dialect of APT text"
        if not self.marks or not all(isinstance(mark, str) and mark.strip() for mark in self.marks):
            return "marks is empty: nothing says which files are of it"
        wrong = [word for word in (*self.words, *self.words.values(), *self.passive) if not _WORD.fullmatch(str(word))]
        return f"{wrong[0]!r} is no word of a record" if wrong else ""

    def in_words_of_like(self, plain: bytes) -> bytes:
        """The text with the words of `like` in the place of the dialect's own, line for line."""
        if not self.words:
            return plain
        return _begins(self.words).sub(lambda m: m[1] + self.words[m[2].decode().upper()].encode(), plain)

    def without_passive(self, text: bytes) -> bytes:
        """A text with the words that are passed over as comments, line for line."""
        return _begins(self.passive).sub(rb"\1$$ \2", text) if self.passive else text


@runtime_checkable
class ShopReader(Protocol):
    """A whole format: an object of this form, or a class of it, is registered in the group `postproc.cl_readers`."""

    like: DialectName
    """the built-in dialect whose meaning of records holds"""

    def recognises(self, head: bytes) -> bool:
        """True for a file of this format by its first `HEAD` bytes."""

    def records(self, text: str) -> Iterable[tuple[int, str]]:
        """Records of APT text in the order in which they hold, each with the line of the file (from 1) that says it.

        Raises:
            ValueError: where the file is damaged; the message says where and why.
        """


@dataclass(frozen=True)
class ShopText:
    """A file that a package has read.

    Attributes:
        plug_in: which one reads it
        like: the built-in dialect whose meaning of records holds
        evidence: by what it was recognised
        text: its records as APT text
        lines: of the file by record, where a reader made them; None where the text stands line for line
        passive: words that are passed over
        moving: the text without these
    """

    plug_in: PlugIn
    like: DialectName
    evidence: str
    text: bytes
    lines: tuple[int, ...] | None = None
    passive: frozenset[str] = frozenset()
    moving: bytes = b""

    def source(self, data: bytes, units: LengthUnit | None) -> ClSource:
        """The file as the second reading is given it; `data`: its bytes."""
        return ClSource(aside(data), units or "", self.like, self.plug_in, self.moving or self.text, self.lines)

    def statements(self) -> AsStatements:
        """The records of a reader as statements and points."""
        made = AsStatements()
        records = self.text.decode().split("\n") if self.lines else []
        for line, record in zip(self.lines or (), records, strict=True):
            point = _POINT.match(record)
            numbers = [_number(part) for part in point[1].split(",")] if point else []
            if len(numbers) in _POINT_NUMBERS and None not in numbers:
                values = [n for n in numbers if n is not None]
                made.point(line, values[:3], values[3:] or UP)
            else:
                made.add(line, record)
        return made


def shop_text(data: bytes, other: bool, log: DiagnosticLog) -> ShopText | None:
    """A file as the package reads it that knows it, None where none does; plug-ins that cannot be used are in `log`.

    Args:
        other: the built-in reader does not take it for APT text, so that it may be of any format
    """
    return (_by_reader(data, log) if other else None) or _by_dialect(data, log)


def shop_names() -> tuple[str, ...]:
    """Names that may be asked for: dialects and readers of installed packages, none of them imported."""
    return tuple(sorted({*registered("postproc.cl_dialects"), *registered("postproc.cl_readers")}))


def shop_text_as(name: ShopName, data: bytes, log: DiagnosticLog) -> ShopText | None:
    """A file as the package reads it that registers the name, whatever the file looks like; None, with an error in `log`,
    where that plug-in cannot be used."""
    dialects, readers = registered("postproc.cl_dialects"), registered("postproc.cl_readers")
    try:
        if name in dialects:
            return _in_dialect(*_dialect(name, dialects[name]), "asked for,", data, log)
        given, reader = plug_in("postproc.cl_readers", name, readers[name])
        return _read(given, _made(given, reader), data, log)
    except PlugInFault as fault:
        log.error("cl.plug-in", str(fault), hint=fault.hint)
    return None


def _by_reader(data: bytes, log: DiagnosticLog) -> ShopText | None:
    for name, points in registered("postproc.cl_readers").items():
        try:
            given, reader = plug_in("postproc.cl_readers", name, points)
            if not _recognised(given, reader := _made(given, reader), data):
                continue
        except PlugInFault as fault:
            log.warning("cl.plug-in", f"{fault}; it is not used", hint=fault.hint)
            continue
        return _read(given, reader, data, log)
    return None


def _made(given: PlugIn, found: object) -> ShopReader:
    """The reader of an entry point, which may name its class."""
    try:
        found = found() if isinstance(found, type) else found
        if isinstance(found, ShopReader) and found.like in APT_TEXT:
            return found
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise PlugInFault(f"the CL reader {given} is not made: {said(fault)}", _correct(given)) from fault
    raise PlugInFault(f"the CL reader {given} is no ShopReader (like, recognises, records)", _correct(given))


def _recognised(given: PlugIn, reader: ShopReader, data: bytes) -> bool:
    try:
        return reader.recognises(data[:HEAD]) is True
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise PlugInFault(f"the CL reader {given} does not say which files it reads: {said(fault)}",
                          _correct(given)) from fault


def _read(given: PlugIn, reader: ShopReader, data: bytes, log: DiagnosticLog) -> ShopText:
    """The records of a file; an error where there are none, its records then being none."""
    records, lines = list[str](), list[int]()
    try:
        for line, record in reader.records(text_of(normalise(data, DiagnosticLog("")))):
            records.append(" ".join(str(record).split()))
            lines.append(int(line))
        if min(lines, default=1) < 1:
            raise ValueError(f"a record stands in line {min(lines)}")
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        why = str(fault) if type(fault) is ValueError and str(fault) else said(fault)
        log.error("cl.plug-in", f"the CL reader {given} does not read the file: {why}",
                  hint=f"look at the file; if it is right, {_correct(given)}")
        records, lines = [], []
    return ShopText(given, reader.like, f"recognised by {given}", "\n".join(records).encode(), tuple(lines))


def _by_dialect(data: bytes, log: DiagnosticLog) -> ShopText | None:
    head = data[:HEAD].replace(b"\x00", b"").upper()
    for name, points in registered("postproc.cl_dialects").items():
        try:
            given, found = _dialect(name, points)
        except PlugInFault as fault:
            log.warning("cl.plug-in", f"{fault}; it is not used", hint=fault.hint)
            continue
        mark = next((mark for mark in found.marks if mark.upper().encode() in head), "")
        if mark:
            return _in_dialect(given, found, f'"{mark}", recognised by', data, log)
    return None


def _dialect(name: str, points: list[EntryPoint]) -> tuple[PlugIn, ShopDialect]:
    """A dialect of a package.

    Raises:
        PlugInFault: where it cannot be imported, or is none.
    """
    given, found = plug_in("postproc.cl_dialects", name, points)
    if not isinstance(found, ShopDialect) or found.fault():
        why = found.fault() if isinstance(found, ShopDialect) else "is no ShopDialect"
        raise PlugInFault(f"the CL dialect {given}: {why}", _correct(given))
    return given, found


def _in_dialect(given: PlugIn, found: ShopDialect, evidence: str, data: bytes, log: DiagnosticLog) -> ShopText:
    text = found.in_words_of_like(normalise(data, log))
    return ShopText(given, found.like, f"{evidence} {given}", text, None, frozenset(word.upper() for word in found.passive),
                    found.without_passive(text))


def _correct(given: PlugIn) -> str:
    return f"correct, reinstall or uninstall the package {given.package}"


def _begins(words: Iterable[str]) -> re.Pattern[bytes]:
    """Any of the words at the beginning of a line, as a whole one."""
    some = b"|".join(re.escape(word.encode()) for word in sorted(words, key=len, reverse=True))
    return re.compile(rb"(?mi)^([ \t]*)(" + some + rb")(?=[ \t]*(?:/|,|$))")


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
