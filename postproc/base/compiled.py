"""Compiling a plain loop when it is first needed; small inputs never come here."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any, cast


@cache
def compiled(function: Callable[..., Any], fused: bool = False) -> Callable[..., Any]:
    """`function` compiled without the interpreter lock, kept on disk where the package's folder can be written.

    Each operation is rounded by itself and in the order of the text, so that a loop gives the same bits on every processor,
    and those of a numpy twin that does the same operations. `fused` lets the compiler join a product and a sum: faster,
    and the last bits depend on the processor; only where twins need to agree within a tolerance.
    A function is compiled one direction only: what is kept on disk is found by its file, whose text must change with the
        path.
    """
    from numba import njit

    options: dict[str, Any] = {"nogil": True, "fastmath": {"contract"} if fused else False, "error_model": "numpy"}
    try:
        return cast(Callable[..., Any], njit(function, cache=True, **options))
    except RuntimeError:
        return cast(Callable[..., Any], njit(function, **options))


@cache
def available() -> bool:
    """Whether there is a compiler at all; without one everything runs on numpy."""
    return find_spec("numba") is not None


def wanted(size: int, enough: int) -> bool:
    """Whether compiled code pays: work of `enough` or more, or the compiler is loaded anyway."""
    return (size >= enough or compiled.cache_info().currsize > 0) and available()
