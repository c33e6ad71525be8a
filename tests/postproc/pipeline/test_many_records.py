"""Work grows in proportion to the file: counted in lines executed, not in seconds."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.path import build as path
from postproc.path import home_links
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from tests.benchmarks.bench_many import KINDS, text_of
from toolpaths import cl

MOST = {"tool changes": 4000}
"""lines executed for each; 20,000 of them are to take seconds"""
CASES = [*((kind, "linuxcnc") for kind in KINDS), ("tool changes", "siemens-840d"), ("tool changes", "heidenhain-tnc640")]
"""with the other formats of blocks, whose tool changes they write and read by code of their own"""
OURS = tuple(str(Path(package.__file__).parent) for package in (machines, postproc, cl))
SETUP = SetupFile.model_validate({"tools": {str(k): {"gauge_length": 100.0 + k % 3} for k in range(1, 21)}})


def converted(kind: str, count: int, machine: str = "mill-3axis", controller: str = "linuxcnc") -> PostResult:
    read, found = toolpaths.read_bytes(text_of(kind, count))
    result = convert(read, machine, controller, SETUP, diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


def steps(work: Callable[[], Any]) -> int:
    """How many lines of the project were executed, each turn of a comprehension counted."""
    count = 0

    def line(frame: FrameType, event: str, arg: Any) -> Any:
        nonlocal count
        count += 1
        return line

    before = sys.gettrace()
    sys.settrace(lambda frame, event, arg: line if frame.f_code.co_filename.startswith(OURS) else None)
    try:
        work()
    finally:
        sys.settrace(before)
    return count


@pytest.mark.parametrize(("kind", "controller"), CASES)
def test_steps_grow_no_faster_than_the_file(kind: str, controller: str) -> None:
    converted(kind, 16, controller=controller)  # imports, compiled code, what many of a kind alone ask for
    few, more, many = (steps(lambda n=n: converted(kind, n, controller=controller)) for n in (32, 64, 96))
    assert many - more <= 1.005 * (more - few) + 100, (few, more, many)
    assert (many - more) / 32 < MOST.get(kind, np.inf), "each is worked out by itself"


@pytest.mark.parametrize(("machine", "controller"),
                         [("mill-3axis", "linuxcnc"), ("mikron-ucp710", "linuxcnc")])
def test_links_by_home_together_are_those_made_one_by_one(machine: str, controller: str,
                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    together, done = home_links.add_home_links, []

    def watched(*args: Any) -> Any:
        done.append(together(*args))
        return done[-1]

    monkeypatch.setattr(path, "add_home_links", watched)
    result = converted("tool changes", 7, machine, controller)
    assert any(some.sum() >= 5 for some in done) or machine != "mill-3axis"
    monkeypatch.setattr(path, "add_home_links", lambda out, base, space, runs, *_: np.zeros(len(runs.each), dtype=bool))
    alone = converted("tool changes", 7, machine, controller)
    assert alone.text == result.text and alone.path is not None and result.path is not None
    assert alone.path.begin.tolist() == result.path.begin.tolist() and (alone.path.move == result.path.move).all()
