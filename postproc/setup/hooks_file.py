"""Blocks of the shop that stand in a file of their own, or of a whole job."""

from __future__ import annotations

from pydantic import BaseModel

from machines.hooks import HooksModel
from machines.user_file import read_toml, validate
from toolpaths.diagnostics import Diagnostic


class _HooksOfFile(BaseModel):
    """A file with [hooks]: one of its own, a job file, or a set-up; what else is in it is not looked at here."""

    hooks: HooksModel


def load_hooks(file: str) -> tuple[HooksModel | None, list[Diagnostic]]:
    """The [hooks] of a file."""
    values, found = read_toml(file, kind="hooks")
    model, faults = (None, found) if values is None else validate(values, _HooksOfFile)
    return (None if model is None else model.hooks), faults
