"""Loops over numbers, written once: interpreted as they stand, or compiled when that pays. Nobody else imports numba.

    @loop
    def speeds(blocks, most): ...

    chosen(speeds, size=len(blocks), enough=20_000)(blocks, most)

A loop is an ordinary function: called by its name it is interpreted, and so are the loops that it calls. `compiled` gives
the same function as machine code, and with it all loops that it calls by their names.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from types import FunctionType
from typing import Any, TypeVar, cast, overload

from toolpaths.dataclass import dataclass

Function = TypeVar("Function", bound=Callable[..., Any])
Result = TypeVar("Result")
Takes = tuple[tuple[str, int], ...]
"""Type and dimensions of each argument: ("float64", 2) for rows, ("float64", 0) for a number."""
_LOOP = "__loop__"
_shared: list[str] = []


@dataclass(frozen=True)
class Loop:
    """How a loop is compiled.

    Each operation is rounded by itself and in the order of the text, so that a loop gives the same bits on
    every processor, and those of the interpreter.

    Attributes:
        alone: other loops do not follow once this one is compiled (`wanted`)
        takes: one compiled form for arrays of any layout; without it one for each kind of arguments that comes
    """

    alone: bool = False
    takes: Takes = ()


@overload
def loop(function: Function) -> Function: ...


@overload
def loop(*, alone: bool = False,
         takes: Takes = ()) -> Callable[[Function], Function]: ...


def loop(function: Function | None = None, *, alone: bool = False,
         takes: Takes = ()) -> Function | Callable[[Function], Function]:
    """Mark a function over numbers and arrays as one that can be compiled; it is not changed. Options as in `Loop`."""

    def marked(function: Function) -> Function:
        setattr(function, _LOOP, Loop(alone, takes))
        return function

    return marked if function is None else marked(function)


def compiled(function: Callable[..., Result]) -> Callable[..., Result]:
    """A loop as machine code, made when it is first needed and kept on disk where the package's folder can be written."""
    return _compiled(function)


def wanted(size: int, enough: int, function: Callable[..., Any] | None = None) -> bool:
    """Whether compiled code pays: work of `enough` or more, or what is asked for is compiled anyway.

    That is `function`; without it any loop but those that stand `alone`.
    """
    there = bool(_shared) if function is None else function in _made
    return (size >= enough or there) and available()


def chosen(function: Callable[..., Result], size: int, enough: int) -> Callable[..., Result]:
    """A loop compiled where the work is `enough` or more, or because it is compiled anyway; else as it stands."""
    return compiled(function) if wanted(size, enough, function) else function


@cache
def available() -> bool:
    """Whether there is a compiler at all; without one everything is interpreted, or done by numpy."""
    return find_spec("numba") is not None


_made: dict[Callable[..., Any], Callable[..., Any]] = {}


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    if function not in _made:
        how: Loop = getattr(function, _LOOP)
        _made[function] = _by_numba(_calling_compiled(function), how)
        if not how.alone:
            _shared.append(function.__name__)
    return _made[function]


def _calling_compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same text that finds compiled loops under the names of those that it calls; the module is left as it is."""
    assert isinstance(function, FunctionType)
    known = function.__globals__
    helpers = {name: _compiled(known[name]) for name in function.__code__.co_names if hasattr(known.get(name), _LOOP)}
    if not helpers:
        return function
    made = FunctionType(function.__code__, {**known, **helpers}, function.__name__, function.__defaults__)
    made.__qualname__, made.__doc__ = function.__qualname__, function.__doc__
    return made


@cache
def _without_scipy() -> None:
    """numba loads what it knows of numpy without SciPy, which it looks for there and needs for matrices alone: 0.2 s and
    20 MB of every command that compiles. A loop with a product of matrices still finds it."""
    import numba.np.linalg as linalg

    def absent() -> None:
        raise ImportError

    own = cast(Any, linalg)
    known = own.ensure_blas
    own.ensure_blas = absent
    try:
        import numba.np.arraymath as arraymath

        cast(Any, arraymath)._HAVE_BLAS = True
    finally:
        own.ensure_blas = known


def _by_numba(function: Callable[..., Any], how: Loop) -> Callable[..., Any]:
    from numba import njit, types

    _without_scipy()

    def argument(kind: str, dimensions: int) -> Any:
        number = getattr(types, kind)
        return types.Array(number, dimensions, "A", readonly=True) if dimensions else number

    signature = tuple(argument(*one) for one in how.takes) or None
    options: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
    try:
        return cast(Callable[..., Any], njit(signature, cache=True, **options)(function))
    except RuntimeError:  # no folder for the cache
        return cast(Callable[..., Any], njit(signature, **options)(function))
