"""Reports that stand in the documentation are those of the commands next to them, and are written when the site is built."""

from __future__ import annotations

import runpy
import shlex
from pathlib import Path

import pytest

from tests.docs.page import ROOT, blocks

MADE = runpy.run_path(str(ROOT / "docs" / "live_reports.py"))
PAGE = (ROOT / "docs" / "explanation" / "live-reports.md").read_text("utf-8")


def test_the_page_names_the_commands_that_make_its_reports() -> None:
    said = [shlex.split(block.text)[1:] for block in blocks(PAGE) if block.kind == "sh"]
    assert said == [[*words, "-o", name] for name, words in MADE["COMMANDS"].items()]
    assert all(f"../reports/{name}" in PAGE for name in MADE["COMMANDS"])


@pytest.mark.slow  # CI makes them with the site
@pytest.mark.parametrize("name", MADE["COMMANDS"])
def test_reports_are_written(name: str, tmp_path: Path) -> None:
    """From wherever the site is built; a command that does not write its page ends the build."""
    some = MADE["write_reports"].__globals__["COMMANDS"]
    kept = dict(some)
    try:
        for other in set(kept) - {name}:
            del some[other]
        MADE["write_reports"](tmp_path / "reports")
        assert (tmp_path / "reports" / name).read_text("utf-8").startswith("<!doctype html>")
        some[name] = ["report", "nothing.cls", "-m", "mill-3axis", "-c", "linuxcnc"]
        with pytest.raises(RuntimeError, match="nothing"):
            MADE["write_reports"](tmp_path / "reports")
    finally:
        some.clear()
        some.update(kept)
