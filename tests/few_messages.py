"""Workers tell what the whole run needs: steps that passed before and behind a test are no news to it.

A test is six messages of its worker: that it begins, how setting up, the test and taking down went, that it ends, twice.
What began, and what passed around the test, changes nothing that is printed or counted; `--durations` and `--junitxml` look
at it.
"""

from __future__ import annotations

from typing import Any

import pytest

WORKER = "WorkerInteractor"
"""pytest-xdist's plugin in a worker"""


def is_news(name: str, given: dict[str, Any]) -> bool:
    """Whether the run wants a message: not that a test begins, nor that what is around it passed without a word."""
    if name == "testreport":
        data = given["data"]
        return bool(data["when"] == "call" or data["outcome"] != "passed" or data["sections"])
    return name != "logstart"


def install(config: pytest.Config) -> None:
    """For all tests of this process, where it is a worker."""
    if config.getoption("durations", None) or config.getoption("xmlpath", None):
        return
    for worker in (one for one in config.pluginmanager.get_plugins() if type(one).__name__ == WORKER):
        tell = worker.sendevent

        def told(name: str, tell: Any = tell, **given: Any) -> None:
            if is_news(name, given):
                tell(name, **given)

        worker.sendevent = told
