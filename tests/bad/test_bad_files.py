"""Every file here is bad in one direction; its first line names the diagnostic that must come."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from toolpaths.cl.read import read_file
from toolpaths.diagnostics import Severity

FILES = sorted(p for p in Path(__file__).parent.iterdir() if p.suffix in (".cls", ".apt"))
EXPECT = re.compile(r"\$\$ expect: (error|warning) (cl\.[a-z-]+) line=(\d+)(?: count=(\d+))?")


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_expected_diagnostic(path: Path) -> None:
    expected = EXPECT.match(path.read_text(encoding="utf-8"))
    assert expected is not None
    severity, code, line, count = expected.groups()
    found = read_file(path).diagnostics
    lines = (int(line),) if int(line) else ()
    match = [d for d in found if d.code == code and d.severity.name.lower() == severity and d.lines[:1] == lines]
    assert match, [str(d) for d in found]
    assert count is None or match[0].count == int(count)
    others = [d for d in found if d.severity is Severity.ERROR and d.code != code]
    assert not others, [str(d) for d in others]


def test_there_are_many() -> None:
    assert len(FILES) >= 80
