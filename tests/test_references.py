"""The page on the documents: it is what its command writes, but for values, and what it names is there."""

from __future__ import annotations

import re

from tests.references_page import PAGE, PLACES
from tests.source import ROOT


def test_the_page_has_every_row() -> None:
    text = PAGE.read_text("utf-8")
    assert [p.of for p in PLACES if f"| {p.of} | {p.what} | {p.here} |" not in text] == []
    values = {number for line in text.splitlines() for number in re.findall(r"^\| (\d+(?:, \d+)*) \|", line)}
    assert {one for some in values for one in some.split(", ")} == {str(number) for number in range(1, 13)}


def test_files_that_it_names_are_there() -> None:
    named = {name for p in PLACES for name in re.findall(r"`([\w/.-]+\.(?:py|toml))`", p.here)}
    assert [name for name in named if not (ROOT / name).exists() and not (ROOT / "machines" / name).exists()] == []
    assert len(named) > 8
