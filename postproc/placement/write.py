"""The set-up file with the part at its new place: every other line as it was, comments with it."""

from __future__ import annotations

from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

from postproc.setup.files import file_keys, renamed
from postproc.setup.model import PartPlacement
from toolpaths.input_files import read_input


def placed_text(source: Path, target: Path, part: PartPlacement) -> str:
    """The text of the set-up `source` with another [part], for a file at `target`.

    Files (its base, meshes) are named relative to the set-up that names them, so in another folder by another name.
    """
    import tomlkit

    document: Any = tomlkit.parse(read_input(source).decode("utf-8-sig"))
    here, there = source.parent, target.parent
    for *tables, key in [("base",), *file_keys(document)]:
        table = reduce(getitem, tables, document)
        if isinstance(table.get(key), str):
            table[key] = renamed(table[key], here, there)
    if "part" not in document:
        document["part"] = tomlkit.table()
    table = document["part"]
    if "system" in table or "base" in document:
        table["system"] = False
    for key, values in (("origin", part.origin), ("x_axis", part.x_axis), ("y_axis", part.y_axis)):
        table[key] = list(values)
    return tomlkit.dumps(document)

