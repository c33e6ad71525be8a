"""By how much the lengths of tools may differ is not looked at by conversions in these rooms, where no test sees it.

It is a sixth of a conversion. It is looked at where it is made and proved (`postproc/verification`), in all other rooms
(every machine and control, reports, commands, hints, pages), and in what rooms share (`kit.sample`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from postproc.verification import length_limits, read_back

TESTS = Path(__file__).parent
ROOMS = frozenset({TESTS / "linuxcnc", *(TESTS / "postproc" / room for room in (
    "alignment", "batch", "cli", "collision", "compile", "control", "controllers", "correction", "cycle_time", "differences", "job", "joints", "orientation",
    "path", "pipeline", "placement", "planning", "readback", "reference", "report", "setup_sheet", "time_study", "witness", "writing"))})
SEEN = frozenset({"test_golden_programs.py", "test_every_machine_and_control.py"})
"""files of these rooms that show them"""
NAME = "length_margins"


def _none(*given: Any) -> tuple[()]:
    return ()


@pytest.fixture(autouse=True)
def lengths_looked_at_where_they_are_seen(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """For every test."""
    if request.path.parent in ROOMS and request.path.name not in SEEN:
        monkeypatch.setattr(read_back, NAME, _none)


@contextmanager
def looked_at() -> Iterator[None]:
    """For results that other rooms see too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(read_back, NAME, length_limits.length_margins)
        yield
