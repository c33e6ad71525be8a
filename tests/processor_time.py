"""Where the suite's processor time goes: `pytest --cpu` adds it up by file and by test, with that of commands they start."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Generator
from typing import Any

import pytest

FILES, TESTS = 60, 60
COLLECTION = "(start of the workers, imports, collection)"
spent: Counter[str] = Counter()
"""seconds by node id, of this process and of the commands it has waited for"""


def seconds() -> float:
    """Of this process and its ended children, user and system."""
    return sum(os.times()[:4])


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cpu", action="store_true",
                     help="processor seconds by file and by test, commands included")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    if not spent:
        spent[COLLECTION] = seconds()
    before = seconds()
    result = yield
    spent[item.nodeid] += seconds() - before
    return result


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["cpu"] = dict(spent)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    spent.update(getattr(node, "workeroutput", {}).get("cpu", {}))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    if not config.getoption("--cpu"):
        return
    files: Counter[str] = Counter()
    for name, value in spent.items():
        files[name.split("::")[0]] += value
    terminalreporter.section(f"processor time: {spent.total():.1f} s, by file")
    for name, value in files.most_common(FILES):
        terminalreporter.write_line(f"{value:8.2f}  {name}")
    terminalreporter.section("by test")
    for name, value in spent.most_common(TESTS):
        terminalreporter.write_line(f"{value:8.2f}  {name}")
