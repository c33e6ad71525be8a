"""Built-in machines are loaded once for all tests of a process, anew under a planted fault (`mutants/plant.py`)."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from machines import loader

NAME = "kept_for_tests"
"""under which the cache stands in the module, where `plant.forget` empties it"""


def install() -> None:
    """For all tests of this process."""
    if hasattr(loader, NAME):
        return
    load_checked = loader.load_checked
    kept = cache(load_checked)
    setattr(loader, NAME, kept)

    def once(source: str | Path) -> tuple[Any, list[Any]]:
        if not isinstance(source, str) or source not in loader.builtin():
            return load_checked(source)
        machine, found = kept(source)
        return machine, list(found)

    loader.load_checked = once


def forget() -> None:
    """What was loaded until now: behind a fault planted in what loads machines, and before it is taken out."""
    getattr(loader, NAME).cache_clear()
