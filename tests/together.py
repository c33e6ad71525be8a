"""Files that look at the same dear thing stay with one worker: the syntax of all source files takes seconds to make."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
WORK = "tests/source.py"
"""the name of what the files are given as that take the syntax of files from there"""
_TAKES = re.compile(r"^(?:from tests\.source import .*(?:nodes|product|tree|walked)|import tests\.source)", re.MULTILINE)


@cache
def of(file: str) -> str:
    """The name of the work to which a file of tests belongs: its own, or that of all that share."""
    path = ROOT / file
    return WORK if path.is_file() and _TAKES.search(path.read_text("utf-8")) else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """In the place of `--dist loadfile`."""
    from xdist.scheduler import LoadFileScheduling

    class Together(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return of(nodeid.split("::", 1)[0])

    return Together(config, log) if config.getvalue("dist") == "loadfile" else None
