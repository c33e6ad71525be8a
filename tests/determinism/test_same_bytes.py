"""The same bytes from the same input, whatever the process did before and wherever it runs; all variants: `make same`."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from postproc.feedrate.windows import Method
from tests.determinism.cases import CASES, QUICK, made
from tests.determinism.run import ROOT, different, hashes, variants
from toolpaths import compiled
from toolpaths.compiled import available
from toolpaths.smoothing.sweep import compiled_sweep, sweep_here

ELSEWHERE = {"PYTHONHASHSEED": "7", "TZ": "Asia/Kathmandu", "LC_ALL": "C", "OPENBLAS_NUM_THREADS": "1"}


@pytest.mark.slow
def test_a_program_depends_neither_on_the_place_nor_on_what_the_process_did_before(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made in a process of its own with another hash seed, zone, language and thread count, and here, where other commands
    have run and loops are compiled: what is compiled already must decide nothing."""
    monkeypatch.chdir(ROOT)
    for name in ("orient", *QUICK):
        found = made(name, tmp_path)
    assert found and hashes(sys.executable, ELSEWHERE, quick=True) == {name: made(name, tmp_path) for name in QUICK}


@pytest.mark.parametrize("before", [[], ["a loop that was compiled for another command"]])
def test_what_is_compiled_already_decides_nothing_where_last_bits_differ(before: list[str],
                                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "_shared", before)
    monkeypatch.setattr(compiled, "_made", dict.fromkeys(before))
    assert Method().settled().kernel is available() and (sweep_here() is compiled_sweep) is available()


def test_differences_and_failures_are_told() -> None:
    assert different({"a": "1", "b": "2"}, {"a": "1", "b": "3", "failed": "no"}) == ["b", "failed"]
    assert {"hash seed 1", "decimal comma", "one thread"} <= set(variants()) and set(QUICK) <= set(CASES)
