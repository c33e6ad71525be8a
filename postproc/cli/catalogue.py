"""Controllers, and figures of an analysis, as people and programs read them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from machines.user_file import read_toml
from postproc.controllers.model import builtin_files, load_controller
from toolpaths.diagnostics import read_value
from toolpaths.table_text import table_text


def controller_values(source: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Every value of a controller, flat by dotted key, and the file and line (or "default") it comes from.

    Raises:
        DiagnosticError: where the file has faults.
    """
    spec = read_value(load_controller(source))
    file = read_value(read_toml(source, builtin=builtin_files(), kind="controller"))
    values, origins = {}, {}
    for path, value in _flat(spec.model_dump(), ()):
        origin = file.origins.get(path)
        values[".".join(path)] = value
        origins[".".join(path)] = f"{Path(origin.file).name}:{origin.line}" if origin else "default"
    return values, origins


def _flat(values: dict[str, Any], above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Each value with the keys that lead to it."""
    for key, value in values.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, (*above, key))
        else:
            yield (*above, key), value


def controller_text(values: dict[str, Any], origins: dict[str, str]) -> str:
    """The same for people: a value a line, where it comes from in a column of its own."""
    return "\n".join(table_text([(origins[key], f"{key} = {json.dumps(value)}") for key, value in values.items()]))


def analysis_text(figures: dict[str, Any], indent: str = "") -> str:
    """Figures of an analysis, one a line; the keys carry the units."""
    return "\n".join(table_text(list(_indented(figures, indent))))


def _indented(figures: dict[str, Any], indent: str) -> Iterator[tuple[str, str]]:
    """(key, value) line by line, tables inside moved in."""
    for key, value in figures.items():
        if isinstance(value, dict):
            yield indent + key, ""
            yield from _indented(value, indent + "  ")
        else:
            yield indent + key, _plain(value)


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(_plain(v) for v in value)
    return str(value)
