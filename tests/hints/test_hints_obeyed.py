"""The law of hints: what a message says is done, word by word, and its fault is gone."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest

from machines.geometric_error.exchange import survey
from machines.layouts import search as layouts
from postproc.cycle_time import conversion
from tests.explained_codes import DATA
from tests.hints.call_cases import CALLS, CallCase
from tests.hints.case import HintCase, called
from tests.hints.cases import CASES, OF_PROGRAMS
from tests.margins import looked_at
from toolpaths.diagnostics import REPORT, Severity

EXPLAINED = tomllib.loads((DATA / "codes.toml").read_text("utf-8"))
"""messages and remedies by code; `tests/postproc/explain` compares them with the source"""
VERDICTS = frozenset({"do not run this program"})
"""what is said of a program that is wrong: no remedy, the fault is in the project or in what others have edited"""
LOOKED_AT = frozenset({"tool-table.outside", "verify.no_bound", "witness.failed"})
"""codes of how far lengths of tools may be off, of bounds between places, and of the second witness (`tests/margins.py`)"""
NOTHING = "nothing is to be done"
"""how a hint begins that only says what was taken and why that is right: no remedy"""


FEW_PLACES = {"report.GRID": (3, 3, 3, 2), "report.COARSE": (2, 2, 2, 2), "extremes.MOST": 20, "extremes.START": 20,
              "transmission.ROUNDS": 2, "box.POINTS": 3, "box.STEPS": 16}
"""where a machine is analysed"""
FEW_ROUNDS = {"executed_fit.ROUNDS": 1, "executed_fit.HALVINGS": 1, "candidate_moves.FEEDS": (1000.0,)}
"""where the model of a control is fitted, and a test for it planned"""


def remedies(hints: list[str]) -> list[str]:
    """Hints that ask for something."""
    return [hint for hint in hints if hint not in VERDICTS and not hint.startswith((NOTHING, REPORT))]


@pytest.fixture(autouse=True, scope="module")
def few_places() -> Iterator[None]:
    """What a model of errors does at each of many places changes figures of `errors check`, and no hint; so do the boxes
    after which a certificate gives up, the layouts that are tried, and the band of a program's time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(survey, "PLACES", 500)
        patch.setattr(conversion, "BAND_UP_TO", 0)
        for name in ("MOST", "FEW"):
            patch.setattr(f"machines.analysis.certify.{name}", 500)
        for name, value in FEW_PLACES.items():
            patch.setattr(f"machines.analysis.{name}", value)
        for name, value in FEW_ROUNDS.items():
            patch.setattr(f"postproc.time_fit.{name}", value)
        for name, value in (("RESTARTS", 1), ("ROUNDS", 12), ("CROWD", 6), ("GRID", (3, 3, 2))):
            patch.setattr(layouts, name, value)
        yield


@pytest.mark.parametrize("case", CALLS, ids=[case.code for case in CALLS])
def test_a_hint_to_who_calls_the_package_is_obeyed(case: CallCase, tmp_path: Path) -> None:
    one, other = tmp_path / "wrong", tmp_path / "right"
    one.mkdir()
    other.mkdir()
    [said] = [d for d in case.wrong(one) if d.code == case.code]
    assert re.search(case.says, said.hint), said.hint
    after = case.right(other)
    assert [str(d) for d in after if d.code == case.code or d.severity is Severity.ERROR] == []


@pytest.mark.parametrize("case", OF_PROGRAMS.values(), ids=OF_PROGRAMS)
def test_a_hint_obeyed_is_the_end_of_its_fault(case: HintCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with looked_at() if case.code in LOOKED_AT else nullcontext():
        assert not faults_of(case, tmp_path, monkeypatch)


def faults_of(case: HintCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What speaks against the law: the hint is not said for the fault, or that or another error is when it was obeyed."""
    monkeypatch.chdir(tmp_path)
    if case.packages:
        monkeypatch.syspath_prepend(str(tmp_path))
    untouched = {name: resolve_name(name) for name, _ in case.stands_in}
    case.begin(tmp_path)
    for name, value in case.stands_in:
        monkeypatch.setattr(name, value)
    _, before = called(case.command, tmp_path)
    if case.ends:
        for name, _ in case.stands_in:
            monkeypatch.setattr(name, untouched[name])
    said = [d for d in before if d["code"] == case.code and re.search(case.says, d["hint"])]
    if not said:
        return ["not said", *_lines(before)]
    again = case.obey(tmp_path, said[0]["hint"])
    code, after = called(again, tmp_path, case.plain)
    left = [d for d in after if (d["message"] == said[0]["message"] if case.code_left else d["code"] == case.code)]
    errors = {d["code"] for d in after if d["severity"] == "error"}
    others = [d for d in after if d["severity"] == "error" and d["code"] not in case.stops]
    return [*_lines([*left, *others]), *([] if code == (1 if errors else 0) else [f"exit code {code}"])]


def _lines(found: list[dict[str, Any]]) -> list[str]:
    return [f"{d['code']} {d['message']}; {d['hint']}" for d in found]


def test_every_code_with_a_remedy_is_under_the_law() -> None:
    """A new remedy comes with its case."""
    reported = {code for code, one in EXPLAINED.items() if any(hint.startswith(REPORT) for hint in one["remedies"])}
    assert reported, "the remedy of faults of postproc is read from the source"
    known = {code for code, one in EXPLAINED.items() if remedies(one["remedies"])}
    proved = {case.code for case in (*CASES, *CALLS)}
    assert proved & reported == set(), "a file leads there: it is no fault of postproc"
    assert known - proved == set(), "write a case"
