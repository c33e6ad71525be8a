"""Workers that hold one thing and do the same with many items: processes of this computer, or those of a cluster.

What they find does not depend on how many they are, and where all of them are gone this process does the rest.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import count
from typing import Generic, Literal, Protocol, TypeVar, cast

S = TypeVar("S")
V = TypeVar("V")
R = TypeVar("R")
V_contra = TypeVar("V_contra", contravariant=True)
R_co = TypeVar("R_co", covariant=True)
StartMethod = Literal["fork", "spawn"]


class Crew(Protocol[V_contra, R_co]):
    """Workers that hold what is shared."""

    @abstractmethod
    def results(self, items: Sequence[V_contra]) -> Iterator[R_co]:
        """What the function gives for each item, in order; what it raises is raised."""

    @abstractmethod
    def close(self) -> None:
        """The workers are free, what was begun is left."""


class Team(Protocol):
    """Workers that may be given work."""

    size: int

    @abstractmethod
    def crew(self, function: Callable[[S, V], R], shared: S) -> Crew[V, R]:
        """They hold `shared`; `function` is one of a module, of that and an item."""


_TEAM: ContextVar[Team | None] = ContextVar("team", default=None)


@contextmanager
def working(team: Team | None) -> Iterator[None]:
    """Searches that are begun here are spread over a team."""
    before = _TEAM.set(team)
    try:
        yield
    finally:
        _TEAM.reset(before)


def team_at_hand() -> Team | None:
    """The team of `working`; None where nobody has named one."""
    return _TEAM.get()


def forked() -> Team | None:
    """The cores of this computer, where a process may be forked: it has all that this one has without copying."""
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1
    method = multiprocessing.get_start_method(allow_none=True)
    alone = cores < 2 or method not in (None, "fork") or multiprocessing.current_process().daemon
    return None if alone else Processes(cores, "fork")


class Processes:
    """Processes of this computer. Those that are forked inherit what is shared; others get it packed (`pickle`)."""

    def __init__(self, size: int, method: StartMethod | None = None) -> None:
        self.size, self.method = size, method or cast(StartMethod, _method())

    def crew(self, function: Callable[[S, V], R], shared: S) -> Crew[V, R]:
        """See `Team`."""
        return _Pool(self.size, self.method, function, shared)


def _method() -> str:
    stated = multiprocessing.get_start_method(allow_none=True)
    return "fork" if (stated or ("fork" if sys.platform == "linux" else "spawn")) == "fork" else "spawn"


_TASKS: dict[int, tuple[Callable[..., object], object]] = {}
"""what workers are to do: theirs by inheritance, or unpacked as they began"""
_NUMBERS = count()


class _Pool(Generic[V, R]):
    """Processes that hold a function and what it shares."""

    def __init__(self, size: int, method: StartMethod, function: Callable[[S, V], R], shared: S) -> None:
        self.number = next(_NUMBERS)
        self.alone: Callable[[V], R] = lambda item: function(shared, item)
        _TASKS[self.number] = function, shared
        context = multiprocessing.get_context(method)
        if method == "fork":
            self.pool = ProcessPoolExecutor(size, context, _ignore_interrupt)
        else:
            packed = pickle.dumps((function, shared), pickle.HIGHEST_PROTOCOL)
            self.pool = ProcessPoolExecutor(size, context, _unpack, (self.number, packed))

    def results(self, items: Sequence[V]) -> Iterator[R]:
        """See `Crew`: where a process was killed, this one does what is left."""
        try:
            futures = [self.pool.submit(_done, self.number, item) for item in items]
        except BrokenProcessPool:
            futures = []
        for at, item in enumerate(items):
            try:
                yield cast(R, futures[at].result()) if at < len(futures) else self.alone(item)
            except BrokenProcessPool:
                yield self.alone(item)

    def close(self) -> None:
        """See `Crew`."""
        self.pool.shutdown(wait=False, cancel_futures=True)
        _TASKS.pop(self.number, None)


def _ignore_interrupt() -> None:
    """Ctrl-C is the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _unpack(number: int, packed: bytes) -> None:
    """In a process that has nothing of its parent's."""
    _ignore_interrupt()
    _TASKS[number] = pickle.loads(packed)


def _done(number: int, item: object) -> object:
    """In a worker."""
    function, shared = _TASKS[number]
    return function(shared, item)
