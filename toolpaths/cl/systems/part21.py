"""Instances of a Part 21 file (ISO 10303-21): their names, parameters and lines."""

from __future__ import annotations

import re
from typing import TypeAlias

from toolpaths.dataclass import dataclass

_TOKEN = re.compile(r"/\*.*?\*/|'(?:[^']|'')*'|#\d+|\.[A-Z_0-9]+\.|[A-Z_][A-Z0-9_-]*|"
                    r"[+-]?\d+\.?\d*(?:E[+-]?\d+)?|[(),$*;=]|\n", re.DOTALL | re.IGNORECASE)
_DEEPEST = 50


@dataclass(frozen=True)
class Reference:
    """#n"""

    number: int


@dataclass(frozen=True)
class Typed:
    """A value with its type, as SPEED_NAME(.RAPID.)."""

    name: str
    values: tuple[Value, ...]


Value: TypeAlias = "float | str | Reference | Typed | tuple[Value, ...] | None"
"""numbers, text (enumerations with their points), references, lists; None for $ and *"""


@dataclass(frozen=True)
class Instance:
    """#number=name(values); several names in one (complex instances) have the name "" and all words as values."""

    name: str
    values: tuple[Value, ...]
    line: int

    def value(self, index: int) -> Value:
        """The parameter, None where there are fewer."""
        return self.values[index] if index < len(self.values) else None


def instances(text: str) -> dict[int, Instance]:
    """All instances by number.

    Raises:
        ValueError: says the line that is no instance.
    """
    found, line, item, begun, at = dict[int, Instance](), 1, list[str](), 0, 0
    for match in _TOKEN.finditer(text):
        token, gap, at = match[0], text[at:match.start()], match.end()
        if gap.strip():
            raise ValueError(f"line {line}: {gap.strip()[:20]!r} is no part of an instance")
        if token == ";":
            if "=" in item:
                if item[1] != "=" or not item[0].startswith("#") or int(item[0][1:]) in found:
                    raise ValueError(f"line {begun}: {' '.join(item)[:60]!r} is no instance, or one twice")
                found[int(item[0][1:])] = _instance(item[2:], begun)
            item = []
        elif token != "\n" and not token.startswith("/*"):
            begun = begun if item else line
            item.append(token)
        line += token.count("\n")
    if item and "=" in item:
        raise ValueError(f"line {begun}: the file ends within {item[0]}")
    return found


def _instance(tokens: list[str], line: int) -> Instance:
    if tokens[0] == "(":
        return Instance("", tuple(word.upper() for word in tokens), line)
    try:
        values, end = _values(tokens, 2, 0)
    except (IndexError, ValueError) as fault:
        raise ValueError(f"line {line}: {' '.join(tokens)[:60]!r} is no instance") from fault
    if "-" in tokens[0] or tokens[1] != "(" or end != len(tokens):
        raise ValueError(f"line {line}: {' '.join(tokens)[:60]!r} is no instance")
    return Instance(tokens[0].upper(), values, line)


def _values(tokens: list[str], at: int, deep: int) -> tuple[tuple[Value, ...], int]:
    """(values up to the closing bracket, index behind it)"""
    if deep > _DEEPEST:
        raise ValueError("too many brackets")
    found: list[Value] = []
    while tokens[at] != ")":
        if found:
            if tokens[at] != ",":
                raise ValueError("a comma is missing")
            at += 1
        token, at = tokens[at], at + 1
        if token == "(":
            inner, at = _values(tokens, at, deep + 1)
            found.append(inner)
        elif tokens[at] == "(" and token[0].isalpha():
            inner, at = _values(tokens, at + 1, deep + 1)
            found.append(Typed(token.upper(), inner))
        else:
            found.append(_value(token))
    return tuple(found), at + 1


def _value(token: str) -> Value:
    if token in ("$", "*"):
        return None
    if token[0] == "#":
        return Reference(int(token[1:]))
    if token[0] == "'":
        return token[1:-1].replace("''", "'")
    return token.upper() if token[0] == "." and token[-1] == "." else float(token)
