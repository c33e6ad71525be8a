"""Compiling a plain loop when it is first needed; small inputs never come here."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, cast


@cache
def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`function` compiled without the interpreter lock, kept on disk where the package's folder can be written.

    Contraction and reassociation are allowed, NaN and infinity keep their meaning (the test of positive pivots needs
    it).
    """
    from numba import njit

    options: dict[str, Any] = {"nogil": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
    try:
        return cast(Callable[..., Any], njit(function, cache=True, **options))
    except RuntimeError:
        return cast(Callable[..., Any], njit(function, **options))
