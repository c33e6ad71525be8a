"""The set-up file with the part at its new place: every other line as it was, comments with it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from postproc.setup import PartPlacement


def placed_text(source: Path, target: Path, part: PartPlacement) -> str:
    """The text of the set-up `source` with another [part], for a file at `target`.

    Files (its base, meshes) are named relative to the set-up that names them, so in another folder by another name.
    """
    import tomlkit

    document = tomlkit.parse(source.read_bytes().decode("utf-8-sig"))
    for table, key in _named(document):
        if isinstance(table.get(key), str):
            table[key] = _relative(source, target, table[key])
    if "part" not in document:
        document["part"] = tomlkit.table()
    table = document["part"]
    for key, values in (("origin", part.origin), ("x_axis", part.x_axis), ("y_axis", part.y_axis)):
        table[key] = list(values)
    return tomlkit.dumps(document)


def _named(document: Any) -> list[tuple[Any, str]]:
    """Tables of a set-up with the key that names a file in each."""
    bodies = document.get("bodies", {})
    tables = [(document, "base"), (bodies, "part"), (bodies.get("table", {}), "file")]
    tables += [(fixture, "file") for fixture in bodies.get("fixtures", [])]
    return tables + [(tool, "holder_mesh") for tool in document.get("tools", {}).values()]


def _relative(source: Path, target: Path, name: str) -> str:
    """A file that `source` names, as `target` names it; untouched where both stand in one folder."""
    here, there = source.resolve().parent, target.resolve().parent
    return name if here == there or Path(name).is_absolute() else Path(os.path.relpath(here / name, there)).as_posix()
