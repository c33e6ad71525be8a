"""Fixtures for every folder: LinuxCNC as a peer, where it is installed."""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import cache

import pytest

from tests import (
    compile_once,
    cover,
    environment,
    few_messages,
    machines_once,
    one_command,
    processor_time,
    rewrite_once,
    said,
    tiers,
)
from tests.linuxcnc import interpreter, simulator
from tests.margins import lengths_looked_at_where_they_are_seen
from tests.processor_time import (
    pytest_runtest_protocol,
    pytest_sessionfinish,
    pytest_terminal_summary,
    pytest_testnodedown,
)
from tests.said import pytest_runtest_call
from tests.together import pytest_xdist_make_scheduler

__all__ = ["environment", "lengths_looked_at_where_they_are_seen", "pytest_runtest_call", "pytest_runtest_protocol",
           "pytest_sessionfinish", "pytest_terminal_summary", "pytest_testnodedown", "pytest_xdist_make_scheduler"]

# Files that are imported make no garbage worth looking for.
gc.disable()
rewrite_once.install()
machines_once.install()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of tests alone."""
    processor_time.pytest_addoption(parser)
    said.pytest_addoption(parser)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whatever asks for LinuxCNC can be chosen with `-m linuxcnc`, the files of the quick tier with `-m
    quick`; the cases that a test marked `covering` can do without with `-m slow`."""
    cover.mark_slow(items)
    tiers.mark_quick(items)
    for item in items:
        if {"interpret", "simulate", "recorded", "standstill"} & set(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.linuxcnc)


def pytest_collection_finish(session: pytest.Session) -> None:
    """What stays until the end is not looked through by each collection of garbage, and there are fewer of them."""
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)
    gc.enable()
    compile_once.install()
    one_command.install()
    few_messages.install(session.config)


@cache
def _missing(module: str) -> str:
    return {"interpreter": interpreter, "simulator": simulator}[module].missing()


def _or_skip(function: Callable, module: str) -> Callable:
    if reason := _missing(module):
        pytest.skip(reason)
    return function


@pytest.fixture(scope="session")
def interpret() -> Callable[..., interpreter.Canonical]:
    """`interpreter.interpret`, or a skipped test."""
    return _or_skip(interpreter.interpret, "interpreter")


@pytest.fixture(scope="session")
def simulate() -> Callable[..., simulator.Run]:
    """`simulator.simulate`, or a skipped test."""
    return _or_skip(simulator.simulate, "simulator")


@pytest.fixture(scope="session")
def recorded() -> Callable[..., simulator.Run]:
    """`simulator.recorded`, or a skipped test."""
    return _or_skip(simulator.recorded, "simulator")


@pytest.fixture(scope="session")
def standstill() -> Callable[..., simulator.Floats]:
    """`simulator.standstill`, or a skipped test."""
    return _or_skip(simulator.standstill, "simulator")
