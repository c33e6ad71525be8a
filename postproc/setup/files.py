"""Files that a set-up names: each is relative to the file that names it, the set-up itself or a base of it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from machines.toml_lines import own_copy
from machines.user_file import UserFile
from toolpaths.input_files import place

Key = tuple[str | int, ...]


def file_keys(values: Mapping[str, Any]) -> list[Key]:
    """Paths of keys of unchecked values that name a mesh file."""
    bodies, tools = _table(values.get("bodies")), _table(values.get("tools"))
    keys: list[Key] = [("bodies", "part"), ("bodies", "table", "file")]
    fixtures = bodies.get("fixtures")
    keys += [("bodies", "fixtures", k, "file") for k in range(len(fixtures) if isinstance(fixtures, list) else 0)]
    keys += [("tools", number, "holder_mesh") for number in tools]
    return [key for key in keys if isinstance(value_at(values, key), str)]


def seen_from_here(file: UserFile) -> UserFile:
    """The set-up with the names of mesh files that its bases give as it would give them itself."""
    here, values = Path(file.file).parent, own_copy(dict(file.values))
    for key in file_keys(values):
        there = Path(file.origin(key).file).parent
        value_at(values, key[:-1])[key[-1]] = renamed(str(value_at(values, key)), there, here)
    return replace(file, values=values)


def renamed(name: str, there: Path, here: Path) -> str:
    """A file as folder `here` names it, that is `name` in folder `there`; untouched where both are one."""
    there, here = place(there), place(here)
    return name if here == there or Path(name).is_absolute() else Path(os.path.relpath(there / name, here)).as_posix()


def _table(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def value_at(values: Any, key: Key) -> Any:
    """The value at a path of keys, None where there is none."""
    for step in key:
        if isinstance(values, Mapping):
            values = values.get(step)
        else:
            values = values[step] if isinstance(values, list) and isinstance(step, int) else None
    return values
