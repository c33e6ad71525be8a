"""The tree of commands is built once for all calls in one process: typer's runner would build it for each of them."""

from __future__ import annotations

import sys
from functools import cache


def install() -> None:
    """For all tests of this process, where one of them calls commands."""
    if runner := sys.modules.get("typer.testing"):
        runner._get_command = cache(runner._get_command)  # type: ignore[attr-defined]
