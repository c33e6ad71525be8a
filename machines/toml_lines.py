"""Values of a TOML text and where each key stands: the line numbers that the standard parser does not keep.

The scanner only sees texts that `tomllib` has accepted, so it need not check anything.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

Values = dict[str, Any]
KeyPath = tuple[str | int, ...]
"""keys and array indices from the root, as pydantic's error locations"""

SHORT, KEPT = 50_000, 64
"""characters and number of texts that are kept: built-in files and set-ups, which one process reads over and over; long
tables of errors are not"""
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY_PART = re.compile(r"""[ \t]*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([A-Za-z0-9_-]+))[ \t]*""")
_STRING = re.compile(r'"{3}(?:[^\\]|\\.)*?"{3,5}|\'{3}.*?\'{3,5}|"(?:[^"\\]|\\.)*"|\'[^\']*\'', re.DOTALL)
_SCALAR = re.compile(r"[^,\]}\n#]+")


def parsed(text: str) -> tuple[Values, dict[KeyPath, int]]:
    """Values of a TOML text and the line of each; whoever changes them takes a copy.

    Raises:
        tomllib.TOMLDecodeError: where it is none.
    """
    return (_kept if len(text) < SHORT else _parsed)(text)


def _parsed(text: str) -> tuple[Values, dict[KeyPath, int]]:
    return tomllib.loads(text), key_lines(text)


_kept = lru_cache(maxsize=KEPT)(_parsed)


def own_copy(values: Values) -> Values:
    """A copy of the tables and arrays of TOML values, for whoever changes them; what is in them cannot be changed."""
    return {key: _own(value) for key, value in values.items()}


def _own(value: Any) -> Any:
    if isinstance(value, dict):
        return own_copy(value)
    return [_own(one) for one in value] if isinstance(value, list) else value


def key_lines(text: str) -> dict[KeyPath, int]:
    """1-based line of every table, key and array element of a valid TOML text."""
    return _Scanner(text).scan()


class _Scanner:
    def __init__(self, text: str):
        self.text = text
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.elements: dict[KeyPath, int] = {}
        self._line = 1
        self._counted = 0

    def scan(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        self._blank()
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._blank()
        return self.lines

    def _line_here(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line

    def _mark(self, path: KeyPath) -> None:
        line = self._line_here()
        for n in range(1, len(path) + 1):
            self.lines.setdefault(path[:n], line)

    def _blank(self) -> None:
        found = _BLANK.match(self.text, self.at)
        assert found
        self.at = found.end()

    def _key(self) -> tuple[str, ...]:
        parts: list[str] = []
        while found := _KEY_PART.match(self.text, self.at):
            parts.append(next(g for g in found.groups() if g is not None))
            self.at = found.end()
            if self.text[self.at] != ".":
                break
            self.at += 1
        return tuple(parts)

    def _header(self) -> KeyPath:
        """`[a.b]` or `[[a.b]]`: the path of the table that follows; arrays of tables get the index in."""
        double = self.text.startswith("[[", self.at)
        self.at += 2 if double else 1
        keys = self._key()
        self.at += 2 if double else 1
        path: KeyPath = ()
        for key in keys[:-1]:
            path = self._into_last((*path, key))
        path = (*path, keys[-1])
        if double:
            self.elements[path] = self.elements.get(path, -1) + 1
        path = self._into_last(path)
        self._mark(path)
        return path

    def _into_last(self, path: KeyPath) -> KeyPath:
        return (*path, self.elements[path]) if path in self.elements else path

    def _pair(self, table: KeyPath) -> None:
        start = self.at
        path = (*table, *self._key())
        end, self.at = self.at, start
        self._mark(path)
        self.at = end + 1  # the equals sign
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        self._blank()
        if self.text[self.at] == "[":
            self._items(path, "]")
        elif self.text[self.at] == "{":
            self._items(path, "}")
        else:
            found = _STRING.match(self.text, self.at) or _SCALAR.match(self.text, self.at)
            assert found
            self.at = found.end()

    def _items(self, path: KeyPath, close: str) -> None:
        """An array or inline table, from its opening bracket to behind its closing one."""
        self.at += 1
        index = 0
        self._blank()
        while self.text[self.at] != close:
            if close == "}":
                self._pair(path)
            else:
                self._mark((*path, index))
                self._value((*path, index))
                index += 1
            self._blank()
            if self.text[self.at] == ",":
                self.at += 1
                self._blank()
        self.at += 1


def dotted(path: Sequence[str | int]) -> str:
    """("axes", 0, "name") as axes[0].name"""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def table_named(path: KeyPath) -> str:
    """("axes", "X") as [axes.X], ("places", 0) as table 1 of places: one of a list has no name that a file could hold."""
    last = path[-1]
    return f"table {last + 1} of {dotted(path[:-1])}" if isinstance(last, int) else f"[{dotted(path)}]"
