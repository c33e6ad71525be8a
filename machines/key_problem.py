"""A fault of a machine file that shows only when several keys are seen together."""

from __future__ import annotations

from toolpaths.dataclass import dataclass


@dataclass(frozen=True)
class KeyProblem:
    """A fault that only several keys together show: stable code, path of the key at fault, message, hint."""

    code: str
    path: tuple[str | int, ...]
    message: str
    hint: str = ""
