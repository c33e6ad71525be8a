"""Pairs [least, greatest] of a set-up file."""

from __future__ import annotations


def pair(value: object) -> object:
    """The value, where it is two numbers.

    Raises:
        ValueError: says what is expected, with an example.
    """
    if not isinstance(value, list | tuple) or len(value) != 2 or not all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in value):
        raise ValueError("expected two numbers, [least, greatest], e.g. [-30, 30]")
    return tuple(value)
