"""What a caller from Python gives, checked: a fault says what was found, what is allowed and what to do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import SupportsFloat

from toolpaths.diagnostics import Diagnostic, error, value_shown


def wrong(message: str, remedy: str) -> Diagnostic:
    """An ERROR of a call: no file leads there."""
    return error("call.value", f"{message}; {remedy}")


def is_number(value: object, least: float = -math.inf, most: float = math.inf) -> bool:
    """True for a number, also one of numpy, from `least` to `most`; not for a text, a flag, an array or NaN."""
    try:
        return isinstance(value, SupportsFloat) and not isinstance(value, bool) and least <= float(value) <= most
    except (TypeError, ValueError, OverflowError):
        return False


def faults_of(values: Mapping[str, tuple[object, object]], words: Mapping[str, tuple[str, ...]]) -> list[Diagnostic]:
    """What is wrong with named values.

    Args:
        values: by name (value, default): a value is of its default's type
        words: by name the closed list that a value is of
    """
    found = []
    for name, (value, default) in values.items():
        remedy = _remedy(value, default, words.get(name, ()))
        if remedy:
            found.append(wrong(f"{name} is {value_shown(value)}", remedy))
    return found


def _remedy(value: object, default: object, words: tuple[str, ...]) -> str:
    """What to give instead; "" where nothing is wrong."""
    if words:
        return "" if isinstance(value, str) and value in words else f"give one of {', '.join(map(repr, words))}"
    if isinstance(default, bool):
        return "" if isinstance(value, bool) else "give True or False"
    if isinstance(default, float):
        return "" if is_number(value) else "give a number"
    if isinstance(default, tuple):
        texts = isinstance(value, tuple) and all(isinstance(one, str) for one in value)
        return "" if texts else "give a tuple of texts"
    return "" if isinstance(value, (str, Path)) else "give a text, of a file its name"
