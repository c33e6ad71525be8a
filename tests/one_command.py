"""The tree of commands is built once for all calls in one process: typer's runner would build it for each of them."""

from __future__ import annotations

import sys
from functools import cache

BUILDS = "_get_command"
"""the function of typer's runner that builds them"""


def install() -> None:
    """For all tests of this process, where one of them calls commands."""
    if runner := sys.modules.get("typer.testing"):
        setattr(runner, BUILDS, cache(getattr(runner, BUILDS)))
