"""What a machine can do: kinematics, limits, machine files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from machines.machine import Machine
    from toolpaths.diagnostics import Diagnostic

__all__ = ["catalogued", "implausible", "load", "load_checked", "names", "schema"]


def load(source: str | Path) -> Machine:
    """The machine of a built-in name or a path to a TOML file.

    Raises:
        toolpaths.diagnostics.DiagnosticError: where the file has errors; carries all of them.
    """
    from machines import loader

    return loader.load(source)


def load_checked(source: str | Path) -> tuple[Machine | None, list[Diagnostic]]:
    """The machine of a built-in name or a path, or None and every fault of its file."""
    from machines import loader

    return loader.load_checked(source)


def implausible(source: str | Path) -> list[Diagnostic]:
    """What no machine has in a machine file that loads: a wrong unit, a pivot with a wrong sign; a warning each."""
    from machines import loader

    return loader.implausible_of(source)


def names() -> list[str]:
    """The built-in models of machines: one of each kind and class."""
    from machines import loader

    return loader.names()


def catalogued() -> list[str]:
    """The built-in machines that people own, their figures with sources."""
    from machines import loader

    return loader.catalogued()


def schema() -> dict[str, Any]:
    """The JSON schema of a machine file."""
    from machines import loader

    return loader.machine_schema()
