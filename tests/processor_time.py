"""Where the suite's processor time goes, by file and by test, with that of commands they start; what it may take.

A run of the whole suite ends with its total and the files that take most; `--cpu` prints it for any run, in full. A whole
run fails where one file or one test takes more than its share of the total (`OF_A_FILE`, `OF_A_TEST`): shares are the same
on slow and on busy machines, seconds are not. The total is turned into that of a machine that needs `USUAL` s for
`yardstick`, which workers time as they begin, after every `EVERY` tests and as they end; a run that takes `SLACK` times
`BUDGET` there is told so, and does not fail for it: other processors and load do not slow a yard and the suite alike.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from time import process_time
from typing import Any

import numpy as np
import pytest

FILES, TESTS, SHORT = 60, 60, 10
BUDGET = 480.0
"""s of processor for all of `make test`"""
USUAL = 0.115
"""s that `yardstick` takes on the machine for which the budget is meant, with nothing else to do"""
SLACK, EVERY = 1.25, 2000
OF_A_FILE, OF_A_TEST = 0.08, 0.015
"""shares of the whole run that one file and one test may take"""
WHOLE = 5000
"""tests from which a run counts as the whole suite"""
COLLECTION = "(start of the workers, imports, collection)"
spent: Counter[str] = Counter()
"""seconds by node id, of this process and of the commands it has waited for"""
yards: list[float] = []
"""what the yardstick took"""


def seconds() -> float:
    """Of this process and its ended children, user and system."""
    return sum(os.times()[:4])


def yardstick() -> float:
    """s of processor for a fixed piece of work of the suite's kind: numpy on small arrays, calls of Python."""
    begin, a = process_time(), np.linspace(0.0, 1.0, 30).reshape(10, 3)
    for k in range(16_000):
        b = np.cross(a, a[::-1]) if k % 8 == 0 else np.where(a > 0.5, a, -a)
        a = a + 1e-6 * np.sum(b) if np.any(b > 9.0) else a
        str({n: n * k for n in range(6)})
    return process_time() - begin


def too_dear(spent: Mapping[str, float]) -> list[str]:
    """Files and tests that take more than their share of a whole run."""
    tests = {name: value for name, value in spent.items() if "::" in name}
    total = sum(spent.values())
    return [f"{name} takes {value:.1f} s of {total:.1f}, at most {share:.0%} are allowed (tests/README.md)"
            for table, share in ((by_file(tests), OF_A_FILE), (tests, OF_A_TEST))
            for name, value in table.items() if value > share * total]


def usual(spent: Mapping[str, float], yards: Sequence[float]) -> float:
    """s that the whole run takes on the usual machine; infinite where no yard was timed."""
    return sum(spent.values()) * USUAL / float(np.median(yards)) if len(yards) else np.inf


def too_long(spent: Mapping[str, float], yards: Sequence[float]) -> list[str]:
    """What is said of a whole run that takes far more than its budget."""
    found = usual(spent, yards)
    return [] if found <= SLACK * BUDGET else [
        f"the suite takes {found:.0f} s on the usual machine, its budget is {BUDGET:.0f} s (tests/README.md)"]


def by_file(spent: Mapping[str, float]) -> Counter[str]:
    """Seconds by file."""
    files: Counter[str] = Counter()
    for name, value in spent.items():
        files[name.split("::")[0]] += value
    return files


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cpu", action="store_true",
                     help="processor seconds by file and by test, commands included")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    if not spent:
        spent[COLLECTION] = seconds()
        yards.append(yardstick())
    elif len(spent) % EVERY == 0:
        yards.append(yardstick())
    before = seconds()
    result = yield
    spent[item.nodeid] += seconds() - before
    return result


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput |= {"cpu": dict(spent), "yards": [*yards, yardstick()]}
    elif len(spent) > WHOLE and too_dear(spent) and not session.exitstatus:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    output = getattr(node, "workeroutput", {})
    spent.update(output.get("cpu", {}))
    yards.extend(output.get("yards", []))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    whole, full = len(spent) > WHOLE, config.getoption("--cpu")
    if not (whole or full):
        return
    said = f", {usual(spent, yards):.0f} s on the usual machine of {BUDGET:.0f} s" if whole else ""
    terminalreporter.section(f"processor time: {spent.total():.1f} s{said}, by file")
    for name, value in by_file(spent).most_common(FILES if full else SHORT):
        terminalreporter.write_line(f"{value:8.2f}  {name}")
    if full:
        terminalreporter.section("by test")
        for name, value in spent.most_common(TESTS):
            terminalreporter.write_line(f"{value:8.2f}  {name}")
    for line in [*too_dear(spent), *too_long(spent, yards)] if whole else ():
        terminalreporter.write_line(line, red=True)
