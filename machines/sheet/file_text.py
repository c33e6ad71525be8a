"""A new machine as the values and the text of its file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from machines.figures import SOURCE
from machines.toml_lines import KeyPath, Values

FileValue = float | int | str | list[float] | list[str]
"""what a new machine file holds under one key"""


def nested(figures: Mapping[KeyPath, FileValue]) -> Values:
    """Values by path as tables in tables."""
    values: Values = {}
    for path, value in figures.items():
        table = values
        for key in path[:-1]:
            table = table.setdefault(str(key), {})
        table[str(path[-1])] = value
    return values


def machine_text(figures: Mapping[KeyPath, FileValue], sheet: str) -> str:
    """The TOML text; `sheet` is the file that it is from."""
    lines = [f"# Written from {sheet}: correct the sheet and write it again, or go on in this file.",
             "# What is under `assumed` stands in no document."]
    tables = dict[KeyPath, list[KeyPath]]()
    for path in figures:
        of = path[:-2] if SOURCE in path else path[:-1]
        tables.setdefault(of, []).append(path)
    for of, paths in tables.items():
        lines += _table(of, [(path, figures[path]) for path in paths])
    return "\n".join(lines) + "\n"


def _table(of: KeyPath, entries: list[tuple[KeyPath, FileValue]]) -> Iterator[str]:
    """A table: its own keys, then where they are from."""
    if of:
        yield ""
        yield f"[{'.'.join(str(key) for key in of)}]"
    for path, value in sorted(entries, key=lambda entry: len(entry[0])):
        yield f"{'.'.join(str(key) for key in path[len(of):])} = {json.dumps(value, ensure_ascii=False)}"
