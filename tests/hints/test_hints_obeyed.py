"""The law of hints: what a message says is done, word by word, and its fault is gone."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from machines.analysis import certify
from machines.geometric_error.exchange import survey
from machines.layouts import search as layouts
from tests.explained_codes import DATA
from tests.hints.case import HintCase, called
from tests.hints.cases import CASES
from tests.hints.open_codes import OPEN
from toolpaths.diagnostics import REPORT

EXPLAINED = tomllib.loads((DATA / "codes.toml").read_text("utf-8"))
"""messages and remedies by code; `tests/postproc/explain` compares them with the source"""
VERDICTS = frozenset({"do not run this program"})
"""what is said of a program that is wrong: no remedy, the fault is in the project or in what others have edited"""
NOTHING = "nothing is to be done"
"""how a hint begins that only says what was taken and why that is right: no remedy"""


def remedies(hints: list[str]) -> list[str]:
    """Hints that ask for something."""
    return [hint for hint in hints if hint not in VERDICTS and not hint.startswith((NOTHING, REPORT))]


@pytest.fixture(autouse=True)
def few_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a model of errors does at each of many places changes figures of `errors check`, and no hint; so do the boxes
    after which a certificate gives up, and the layouts that are tried."""
    monkeypatch.setattr(survey, "PLACES", 500)
    monkeypatch.setattr(certify, "MOST", 6_000)
    monkeypatch.setattr(certify, "FEW", 3_000)
    for name, value in (("RESTARTS", 1), ("ROUNDS", 12), ("CROWD", 6), ("GRID", (3, 3, 2))):
        monkeypatch.setattr(layouts, name, value)


@pytest.mark.parametrize("case", CASES, ids=[f"{c.code}-{k}" for k, c in enumerate(CASES)])
def test_a_hint_obeyed_is_the_end_of_its_fault(case: HintCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    if case.packages:
        monkeypatch.syspath_prepend(str(tmp_path))
    case.begin(tmp_path)
    _, before = called(case.command, tmp_path)
    said = [d for d in before if d["code"] == case.code and re.search(case.says, d["hint"])]
    assert said, [f"{d['code']} {d['message']}; {d['hint']}" for d in before]
    again = case.obey(tmp_path, said[0]["hint"])
    code, after = called(again, tmp_path)
    left = [f"{d['code']} {d['message']}; {d['hint']}" for d in after if (
        d["message"] == said[0]["message"] if case.code_left else d["code"] == case.code)]
    assert left == []
    errors = {d["code"] for d in after if d["severity"] == "error"}
    assert errors <= set(case.stops), [f"{d['code']} {d['message']}; {d['hint']}" for d in after if d["code"] in errors]
    assert code == (1 if errors else 0)


def test_every_code_with_a_remedy_is_under_the_law_or_named() -> None:
    """A new remedy comes with its case; the table of those without one only shrinks."""
    reported = {code for code, one in EXPLAINED.items() if any(hint.startswith(REPORT) for hint in one["remedies"])}
    assert reported, "the remedy of faults of postproc is read from the source"
    known = {code for code, one in EXPLAINED.items() if remedies(one["remedies"])}
    proved = {case.code for case in CASES}
    assert proved & reported == set(), "a file leads there: it is no fault of postproc"
    assert proved & set(OPEN) == set(), "take it out of the table"
    assert known - proved - set(OPEN) == set(), "write a case"
    assert set(OPEN) <= known, "no such remedy"
    assert len(OPEN) <= 33 and all(len(why) > 10 for why in OPEN.values())
