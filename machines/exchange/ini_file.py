"""LinuxCNC's INI and HAL files as entries with file and line: what of them fixes numbers, and no more."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from pathlib import Path

from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.input_files import is_regular, read_input, reason

_INCLUDE = re.compile(r"#INCLUDE\s+(\S+)")
_FROM_INI = re.compile(r"\[(\w+)\]\(?([\w-]+)\)?$")
DEPTH = 8
"""files that include each other"""


@dataclass(frozen=True)
class IniEntry:
    """`key = value` of a section."""

    section: str
    key: str
    value: str
    file: str
    line: int

    @property
    def number(self) -> float | None:
        """The value as LinuxCNC reads numbers: what follows is a comment."""
        try:
            return float(self.value.split()[0])
        except (ValueError, IndexError):
            return None

    @property
    def said(self) -> str:
        """As it stands there."""
        return f"[{self.section}] {self.key} = {self.value}"


@dataclass
class IniFile:
    """All entries in their order; of a key that stands twice LinuxCNC takes the first."""

    path: Path
    entries: list[IniEntry] = field(default_factory=list)
    found: list[Diagnostic] = field(default_factory=list)

    def first(self, section: str, key: str) -> IniEntry | None:
        """The entry that counts."""
        return next(self.all(section, key), None)

    def all(self, section: str, key: str) -> Iterator[IniEntry]:
        """All of them."""
        return (e for e in self.entries if e.section == section and e.key == key)


def read_ini(path: Path, text: str) -> IniFile:
    """The entries of an INI file and of those that it includes."""
    ini = IniFile(path)
    _read(ini, path, text, "", 0)
    seen: dict[tuple[str, str], IniEntry] = {}
    for entry in ini.entries:
        before = seen.setdefault((entry.section, entry.key), entry)
        if before.value != entry.value and entry.section.startswith(("JOINT_", "AXIS_", "TRAJ", "KINS")):
            ini.found.append(warning("import.contradiction", f"{before.said} in line {before.line} and {entry.key} = "
                                     f"{entry.value}: LinuxCNC takes the first", file=entry.file,
                                     lines=[entry.line], hint="take out the line that is not meant"))
    return ini


def _read(ini: IniFile, path: Path, text: str, section: str, depth: int) -> str:
    for line, raw in enumerate(text.splitlines(), 1):
        stripped = raw.strip()
        if included := _INCLUDE.match(stripped):
            other = path.parent / included[1]
            inner = _text_of(ini, other, str(path), line) if depth < DEPTH else ""
            section = _read(ini, other, inner, section, depth + 1)
        elif stripped.startswith("[") and "]" in stripped:
            section = stripped[1:stripped.index("]")].strip()
        elif "=" in stripped and stripped[0] not in "#;":
            key, _, value = stripped.partition("=")
            ini.entries.append(IniEntry(section, key.strip(), value.strip(), str(path), line))
    return section


def _text_of(ini: IniFile, path: Path, file: str, line: int) -> str:
    try:
        return read_input(path).decode("utf-8", "replace")
    except OSError as fault:
        ini.found.append(warning("import.file", f"{path.name} is not read: {reason(fault)}; what it states is missing",
                                 file=file, lines=[line], hint="put the file where the INI names it"))
        return ""


@dataclass(frozen=True)
class HalWord:
    """One statement of a HAL file."""

    words: tuple[str, ...]
    file: str
    line: int


_SET = re.compile(r"(?:setp\s+)?([\w.-]+)\s*=(?!>)\s*(\S+)\s*$")
"""`pin = value`: setp in its other form (halcmd(1))"""


def _words(statement: str) -> tuple[str, ...]:
    """Without the arrows, which mean nothing; `pin = value` as setp."""
    if set_by := _SET.match(statement.strip()):
        return ("setp", *set_by.groups())
    return tuple(statement.replace("=>", " ").replace("<=", " ").split())


class HalFiles:
    """What the HAL files and HALCMD lines of an INI set and connect."""

    def __init__(self, ini: IniFile) -> None:
        self.ini = ini
        self.lines = list(self._all())
        self.unread = [e for e in ini.all("HAL", "HALFILE") if not self._readable(e)]

    @staticmethod
    def _readable(entry: IniEntry) -> bool:
        name = entry.value.split()[0] if entry.value else ""
        return name.endswith(".hal") and not name.startswith("LIB:") and is_regular(Path(entry.file).parent / name)

    def _all(self) -> Iterator[HalWord]:
        for entry in self.ini.all("HAL", "HALFILE"):
            if self._readable(entry):
                path = Path(entry.file).parent / entry.value.split()[0]
                yield from self._file(path, entry.file, entry.line, 0)
        for entry in self.ini.all("HAL", "HALCMD"):
            yield HalWord(_words(entry.value), entry.file, entry.line)

    def _file(self, path: Path, file: str, line: int, depth: int) -> Iterator[HalWord]:
        """The statements of a HAL file named in a line of `file`, and of those that it runs (`source`)."""
        for number, raw in enumerate(_text_of(self.ini, path, file, line).splitlines(), 1):
            words = _words(raw.partition("#")[0])
            if words[:1] == ("source",) and len(words) > 1 and depth < DEPTH:
                yield from self._file(self.ini.path.parent / words[1], str(path), number, depth + 1)
            else:
                yield HalWord(words, str(path), number)

    def pin(self, name: str) -> tuple[float | None, HalWord | None]:
        """What a pin holds before anything runs, and the statement that says so.

        (None, statement) where something drives it whose value does not stand there; (None, None) where nothing names it.
        Sums (sum2) are followed; a tool length counts as 0.
        """
        return self._pin(name, 0)

    def _pin(self, name: str, depth: int) -> tuple[float | None, HalWord | None]:
        for word in self.lines:
            if word.words[:2] == ("setp", name) and len(word.words) > 2:
                return self._number(word.words[2]), word
        for word in self.lines:
            if word.words[:1] == ("net",) and name in word.words[2:]:
                return self._signal(word.words[1], name, word, depth)
        return None, None

    def _signal(self, signal: str, pin: str, word: HalWord, depth: int) -> tuple[float | None, HalWord]:
        for line in self.lines:
            if line.words[:2] == ("sets", signal) and len(line.words) > 2:
                return self._number(line.words[2]), line
        others = [p for line in self.lines if line.words[:2] == ("net", signal) for p in line.words[2:] if p != pin]
        for other in others:
            if other.startswith("motion.tooloffset."):
                return 0.0, word
            if other.endswith(".out") and depth < DEPTH:
                return self._sum(other.removesuffix(".out"), depth), word
        return None, word

    def _sum(self, component: str, depth: int) -> float | None:
        parts = [self._pin(f"{component}.in{k}", depth + 1) for k in (0, 1)]
        gains = [self._pin(f"{component}.gain{k}", depth + 1) for k in (0, 1)]
        total = 0.0
        for (part, where), (gain, gained) in zip(parts, gains, strict=True):
            if where is None:
                continue
            if part is None or (gained is not None and gain is None):
                return None
            total += part * (1.0 if gain is None else gain)
        return total

    def _number(self, text: str) -> float | None:
        if named := _FROM_INI.match(text):
            entry = self.ini.first(named[1], named[2])
            return entry.number if entry else None
        try:
            return float(text)
        except ValueError:
            return None
