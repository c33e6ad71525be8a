"""What a task depends on, as one hash: the same bytes of all inputs, options and version give the same key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

from postproc.base.job_place import found_upwards
from postproc.base.options import Options
from postproc.base.version import VERSION
from postproc.batch.forms import INPUTS
from postproc.batch.tasks import Task
from postproc.proof.hashes import input_hashes, sha256
from postproc.setup.job_file import load_job_file
from toolpaths.diagnostics import DiagnosticError
from toolpaths.input_files import is_regular, read_input

UNREADABLE = "unreadable"
"""stands for the hash of what cannot be read: the command says why"""


def keys_of(tasks: list[Task]) -> list[str]:
    """A key for each task: version, command, options, and the bytes of all files that it reads: bases, tables, meshes and a
    postproc.toml above it included. Each file is read once."""
    return _Hashing().keys(tasks)


class _Hashing:
    """Hashes of files and of groups of inputs, kept while the keys of one batch are made."""

    def __init__(self) -> None:
        self._file = cache(_hash_of)
        self._inputs = cache(_inputs)

    def keys(self, tasks: list[Task]) -> list[str]:
        return [self._key(task) for task in tasks]

    def _key(self, task: Task) -> str:
        job = self._job_values(task.file)
        given = job | {name.replace("-", "_"): value for name, value in task.options if name in INPUTS}
        machine, controller = task.machine or job.get("machine", ""), task.controller or job.get("controller", "")
        files = self._inputs(machine, controller, *(given.get(name, "") for name in ("setup", "hooks", "error_model")))
        named = [(name, self._file(Path(value))) for name, value in task.options
                 if name not in INPUTS and value and len(value) < 255 and is_regular(value)]
        text = json.dumps([VERSION, task.command, task.machine, task.controller, task.options, task.file.name,
                           str(task.output), self._file(task.file), job, files, named])
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def _job_values(self, file: Path) -> dict[str, str]:
        """What a postproc.toml above a file gives, as texts."""
        where = found_upwards(file.parent)
        values, _ = load_job_file(where) if where else ({}, [])
        return {key: str(value) for key, value in (values or {}).items()}


def _hash_of(file: Path) -> str:
    return _or_unreadable(lambda: sha256(read_input(file)))


def _inputs(machine: str, controller: str, setup: str, hooks: str, error_model: str) -> str:
    """Hashes of set-up, hooks, error model, machine and controller with all files that they name."""
    options = replace(Options(), setup=setup, hooks=hooks, error_model=error_model)
    return _or_unreadable(lambda: json.dumps({
        what: [(one.file, one.sha256) for one in files] for what, files in
        input_hashes(machine or "mill-3axis", controller or "linuxcnc", options).items()}))


def _or_unreadable(made: Callable[[], str]) -> str:
    try:
        return made()
    except (OSError, ValueError, DiagnosticError):
        return UNREADABLE
