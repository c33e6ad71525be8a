"""Pairs [least, greatest] of a set-up file."""

from __future__ import annotations


def pair(value: object) -> object:
    """The value, where it is two numbers.

    Raises:
        ValueError: says what is expected, with an example.
    """
    numbers = isinstance(value, list | tuple) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value)
    if not numbers or len(value) != 2:  # type: ignore[arg-type]
        raise ValueError("expected two numbers, [least, greatest], e.g. [-30, 30]")
    return tuple(value)  # type: ignore[arg-type]
