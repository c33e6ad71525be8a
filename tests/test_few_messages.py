"""What workers tell: every outcome, every failure, every word that was printed; not that nothing happened around a test."""

from __future__ import annotations

from typing import Any

import pytest

from tests.few_messages import is_news


def _report(when: str, outcome: str, *sections: tuple[str, str]) -> dict[str, Any]:
    return {"data": {"when": when, "outcome": outcome, "sections": list(sections)}}


@pytest.mark.parametrize(("name", "given", "news"), [
    ("logstart", {}, False), ("logfinish", {}, True), ("runtest_protocol_complete", {}, True), ("workerfinished", {}, True),
    ("testreport", _report("setup", "passed"), False), ("testreport", _report("teardown", "passed"), False),
    ("testreport", _report("call", "passed"), True), ("testreport", _report("setup", "skipped"), True),
    ("testreport", _report("setup", "failed"), True), ("testreport", _report("teardown", "failed"), True),
    ("testreport", _report("teardown", "passed", ("Captured stdout call", "x")), True)])
def test_what_a_run_must_know_is_told(name: str, given: dict[str, Any], news: bool) -> None:
    assert is_news(name, given) == news
