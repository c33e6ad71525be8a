"""Every JSON object that a command writes in any test is held to its published schema, by its own reading of schemas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from typer._click.globals import get_current_context

from postproc.cli.shared import console
from postproc.cli.shared.schemas import result_schema

TYPES: Mapping[str, tuple[type, ...]] = {
    "string": (str,), "integer": (int, np.integer), "number": (int, float, np.integer, np.floating),
    "boolean": (bool, np.bool_), "array": (list, tuple, np.ndarray), "object": (Mapping,), "null": (type(None),)}

BEFORE = "convert"
"""a job file is refused before its command begins, in the form of a refusal that all commands share"""


def faults(schema: Mapping[str, Any], value: Any) -> list[str]:
    """Where a value is not as its schema says: types, constants, choices, keys that must be there, conditions."""
    types = schema.get("type", ())
    if types and not any(_is(value, one) for one in ([types] if isinstance(types, str) else types)):
        return [f"{value!r} is not of type {types}"]
    found = [f"{value!r} is not {schema['const']!r}"] if "const" in schema and value != schema["const"] else []
    found += [f"{value!r} is none of {schema['enum']}"] if "enum" in schema and value not in schema["enum"] else []
    found += [f"no key {key}" for key in schema.get("required", ()) if key not in value]
    found += [f"{key}: {fault}" for key, below in schema.get("properties", {}).items() if key in value
              for fault in faults(below, value[key])]
    found += [f"{k}: {fault}" for k, one in enumerate(value if "items" in schema else ())
              for fault in faults(schema["items"], one)]
    if "if" in schema and not faults(schema["if"], value):
        found += faults(schema["then"], value)
    return found


def _is(value: Any, name: str) -> bool:
    return isinstance(value, TYPES[name]) and (name == "boolean" or not isinstance(value, bool))


def install() -> None:
    """From now on."""
    headed = console._headed

    def checked(values: dict[str, Any], ok: bool) -> dict[str, Any]:
        found = headed(values, ok)
        context = get_current_context(silent=True)
        if context is not None:
            command = context.command_path.partition(" ")[2] or BEFORE
            assert not (wrong := faults(result_schema(command), found)), f"postproc {command} --json: {wrong}"
        return found

    console._headed = checked
