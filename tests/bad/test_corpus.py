"""Texts that coverage-guided fuzzing found, chosen so that each runs lines that the others do not.

What holds for any text: reading raises nothing; what reads without an error can be written, and reads back the same.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from toolpaths.cl.inspect import inspect, summary
from toolpaths.cl.read import read_bytes
from toolpaths.cl.text.dialects import DIALECTS
from toolpaths.cl.write import text_of
from toolpaths.diagnostics import has_errors

FILES = sorted((Path(__file__).parent / "corpus").iterdir())


@pytest.mark.covering
@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
@pytest.mark.parametrize("dialect", [None, *DIALECTS])
def test_no_text_makes_the_reader_stumble(path: Path, dialect: str | None) -> None:
    result = read_bytes(path.read_bytes(), dialect=dialect)
    assert str(inspect(result)["points"]) in summary(result)
    if not has_errors(result.diagnostics):
        again = read_bytes(text_of(result.toolpath))
        assert not has_errors(again.diagnostics)
        assert again.toolpath.equals(result.toolpath)


def test_the_corpus_is_small() -> None:
    assert len(FILES) <= 60
    assert sum(p.stat().st_size for p in FILES) <= 200_000
