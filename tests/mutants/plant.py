"""Faults planted by function name: the text of a function is changed, compiled again and put in the place of the old one.

Nothing is written: the files of the project stay as they are, and a process that ends takes its fault with it. A function is
found by its qualified name alone (`set_system`, `SerialModel._joint`), so that a file that moves keeps its faults.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from machines.kinematics import chain_loop

ROOT = Path(__file__).parents[2]
PACKAGES = ("toolpaths", "machines", "postproc")


class NotPlanted(Exception):
    """The function, or the text in it, does not stand there once."""


@dataclass(frozen=True)
class Fault:
    """One wrong line.

    Attributes:
        name: in words, stable
        room: where it belongs in the table
        function: qualified name of a function at the top of a module or of a class
        old, new: text that stands once in that function (of several of one name: in one of them), and what
            stands there instead
        cases: names of the conversions in which it acts; () for those of the room
        why: what makes a survivor harmless or out of reach, for the published table
    """

    name: str
    room: str
    function: str
    old: str
    new: str
    cases: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True)
class Place:
    """A function in the source: its module, file, and first and last line (from 0, decorators left out; last exclusive)."""

    module: str
    path: Path
    first: int
    last: int


@cache
def functions() -> dict[str, list[Place]]:
    """Every function of the project at the top of a module or of a class, by qualified name."""
    found: dict[str, list[Place]] = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            for name, node in _defined(ast.parse("".join(_lines(path))), ""):
                found.setdefault(name, []).append(Place(module, path, node.lineno - 1, node.end_lineno or node.lineno))
    return found


def _defined(tree: ast.Module | ast.ClassDef, before: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield before + node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from _defined(node, f"{before}{node.name}.")


def place_of(function: str, old: str) -> Place:
    """Where the function stands; of several of one name it is the one whose text holds `old`, once.

    Raises:
        NotPlanted: it stands nowhere, or the text does not stand once in one of them.
    """
    named = functions().get(function, [])
    counts = [_text(place).count(old) for place in named]
    if counts.count(0) != len(counts) - 1 or max(counts) != 1:
        where = ", ".join(f"{n} times in {p.module}" for p, n in zip(named, counts, strict=True)) or "there is none"
        raise NotPlanted(f"{old!r} does not stand once in one function {function}: {where}")
    return named[counts.index(1)]


@cache
def _lines(path: Path) -> list[str]:
    return path.read_text("utf-8").splitlines(keepends=True)


def _text(place: Place) -> str:
    return "".join(_lines(place.path)[place.first:place.last])


def spoilt(fault: Fault) -> tuple[Place, str]:
    """The text of the whole file with the fault in it.

    Raises:
        NotPlanted: the function is not found, or no single one of its name holds `old` once.
    """
    place = place_of(fault.function, fault.old)
    lines = _lines(place.path)
    return place, "".join([*lines[:place.first], _text(place).replace(fault.old, fault.new), *lines[place.last:]])


def _code_in(code: CodeType, name: str) -> CodeType:
    found = [c for c in _codes(code) if c.co_qualname == name]
    if len(found) != 1:
        raise NotPlanted(f"{name}: {len(found)} such functions in the compiled text")
    return found[0]


def _codes(code: CodeType) -> Iterator[CodeType]:
    for c in code.co_consts:
        if isinstance(c, CodeType):
            yield c
            yield from _codes(c)


def _function(module: str, name: str) -> FunctionType:
    """The function object itself, below properties, caches and other wrappers."""
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = inspect.getattr_static(found, part)
    while not isinstance(found, FunctionType) or hasattr(found, "__wrapped__"):
        below = next((b for b in (getattr(found, a, None) for a in ("fget", "func", "__func__", "__wrapped__", "py_func"))
                      if b is not None), None)
        if below is None:
            raise NotPlanted(f"{name}: no function below {type(found).__name__}")
        found = below
    return found


@contextmanager
def planted(fault: Fault) -> Iterator[None]:
    """The fault in this process, for as long as the block lasts; chains by columns, whose compiled twin takes no fault."""
    place, text = spoilt(fault)
    code = _code_in(compile(text, str(place.path), "exec", dont_inherit=True), fault.function)
    target = _function(place.module, fault.function)
    kept = target.__code__
    if code.co_freevars != kept.co_freevars:
        raise NotPlanted(f"{fault.name}: the change takes other names from outside the function")
    forget()
    target.__code__ = code
    wanted, chain_loop.wanted = chain_loop.wanted, lambda *_: False
    try:
        yield
    finally:
        target.__code__, chain_loop.wanted = kept, wanted
        forget()


def forget() -> None:
    """Empty every cache of the project: what was made before is made again."""
    import gc
    import sys

    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in PACKAGES:
            for value in list(vars(module).values()):
                if isinstance(value, functools._lru_cache_wrapper):
                    value.cache_clear()
    gc.collect(0)
