"""JSON schemas: of the files that users write, from their models; of what commands write with --json, from `results.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from machines.user_model import DRAFT, SCHEMA_KEY
from postproc.cli.shared.console import SCHEMA_VERSION

RESULTS: Mapping[str, Mapping[str, str]] = tomllib.loads(Path(__file__).with_name("results.toml").read_text("utf-8"))
"""by the words of a command: the keys that stay, each with its type, of what it writes where it ends with 0"""
_DIAGNOSTIC = {"severity": {"enum": ["error", "warning", "info"]}, "code": {"type": "string"}, "message": {"type": "string"},
               "file": {"type": "string"}, "lines": {"type": "array", "items": {"type": "integer"}},
               "count": {"type": "integer"}, "hint": {"type": "string"}}
_HEAD = {"schema_version": {"const": SCHEMA_VERSION}, "ok": {"type": "boolean"},
         "diagnostics": {"type": "array", "items": {"type": "object", "required": list(_DIAGNOSTIC),
                                                    "properties": _DIAGNOSTIC}}}


def _setup() -> dict[str, Any]:
    from machines.user_model import schema
    from postproc.setup.model import SetupFile

    return schema("setup", SetupFile)


def _controller() -> dict[str, Any]:
    from machines.user_model import schema
    from postproc.controllers.model import ControllerFile

    return schema("controller", ControllerFile)


def _job() -> dict[str, Any]:
    from machines.user_model import schema
    from postproc.setup.job_file import JobFile

    return schema("job", JobFile)


def _batch() -> dict[str, Any]:
    from machines.user_model import schema
    from postproc.batch.model import BatchFile

    return schema("batch", BatchFile)


def _machine() -> dict[str, Any]:
    import machines

    return machines.schema()


def _errors() -> dict[str, Any]:
    from machines.geometric_error.files.loader import error_model_schema

    return error_model_schema()


def _measurements() -> dict[str, Any]:
    from machines.calibration.measurement_file import measurement_schema

    return measurement_schema()


_FILES: Mapping[str, Callable[[], dict[str, Any]]] = {
    "machine-file": _machine, "setup-file": _setup, "controller-file": _controller, "error-model": _errors,
    "measurements": _measurements, "job-file": _job, "batch-file": _batch}
FILES = tuple(_FILES)


def file_schema(name: str) -> dict[str, Any]:
    """The schema of one of FILES."""
    return _FILES[name]()


def result_schema(command: str) -> dict[str, Any]:
    """The schema of the object that a command writes: what each has, and where it ends with 0 the keys that stay."""
    keys = RESULTS[command]
    done = {"properties": {key: _typed(text) for key, text in keys.items()}, "required": list(keys)}
    return {SCHEMA_KEY: DRAFT, "$id": f"urn:postproc:result:{command.replace(' ', '-')}:{SCHEMA_VERSION}",
            "title": f"postproc {command} --json", "type": "object", "properties": _HEAD,
            "required": list(_HEAD), "if": {"properties": {"ok": {"const": True}}}, "then": done}


def _typed(text: str) -> dict[str, Any]:
    """A type of `results.toml`: words of JSON schemas with "or" between them."""
    words = text.split(" or ")
    return {"type": words[0] if len(words) == 1 else words}
