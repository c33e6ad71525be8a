"""The set-up file with the part at its new place: every other line as it was, comments with it."""

from __future__ import annotations

import os
from pathlib import Path

from postproc.setup import PartPlacement


def placed_text(source: Path, target: Path, part: PartPlacement) -> str:
    """The text of the set-up `source` with another [part], for a file at `target`.

    A base file, named relative to the set-up that names it, is named relative to the new one.
    """
    import tomlkit

    document = tomlkit.parse(source.read_bytes().decode("utf-8-sig"))
    base = document.get("base")
    if isinstance(base, str) and not Path(base).is_absolute():
        document["base"] = _relative(source, target, base)
    if "part" not in document:
        document["part"] = tomlkit.table()
    table = document["part"]
    for key, values in (("origin", part.origin), ("x_axis", part.x_axis), ("y_axis", part.y_axis)):
        table[key] = list(values)
    return tomlkit.dumps(document)


def _relative(source: Path, target: Path, name: str) -> str:
    """A file that `source` names, as `target` names it; untouched where both stand in one folder."""
    here, there = source.resolve().parent, target.resolve().parent
    return name if here == there else Path(os.path.relpath(here / name, there)).as_posix()
