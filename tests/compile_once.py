"""Workers compile a loop one at a time: the second finds on disk what the first has kept there."""

from __future__ import annotations

import fcntl
import os
import sys
import tempfile
import types
from collections.abc import Sequence
from functools import wraps
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

MODULE = "numba.core.dispatcher"
LOCK = Path(tempfile.gettempdir()) / f"postproc-tests-compile-{os.getuid()}.lock"
OWNER = os.getuid()
"""children that run as another user (`tests/faults`) compile without the lock, which is not theirs"""
_depth = [0]


def one_at_a_time(compile: Any) -> Any:
    """`Dispatcher.compile`, which looks on disk before it compiles, under a lock of all workers."""

    @wraps(compile)
    def locked(*arguments: Any, **options: Any) -> Any:
        if _depth[0] or os.geteuid() != OWNER:
            return compile(*arguments, **options)
        with LOCK.open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            _depth[0] += 1
            try:
                return compile(*arguments, **options)
            finally:
                _depth[0] -= 1

    return locked


class _Locking(Loader):
    """The loader of the module, and the lock behind it."""

    def __init__(self, loader: Any) -> None:
        self.loader = loader

    def create_module(self, spec: ModuleSpec) -> types.ModuleType | None:
        return self.loader.create_module(spec)

    def exec_module(self, module: types.ModuleType) -> None:
        self.loader.exec_module(module)
        module.Dispatcher.compile = one_at_a_time(module.Dispatcher.compile)


class Finder(MetaPathFinder):
    """Waits for the compiler to be imported: no test imports it sooner for that."""

    def find_spec(self, name: str, path: Sequence[str] | None,
                  target: types.ModuleType | None = None) -> ModuleSpec | None:
        if name != MODULE:
            return None
        spec = PathFinder.find_spec(name, path)
        if spec is not None and spec.loader is not None:
            spec.loader = _Locking(spec.loader)
        return spec


def install() -> None:
    """For all tests of this process and of those that it forks."""
    if MODULE not in sys.modules and not any(isinstance(finder, Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, Finder())
