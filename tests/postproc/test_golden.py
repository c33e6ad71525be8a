"""Reviewed programs, byte for byte.

After a wanted change: `GOLDEN=renew pytest tests/postproc/test_golden.py`, then read the difference (`git diff
tests/golden`) block by block as if it went to the machine, and commit it with the change that caused it.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import toolpaths
from postproc.pipeline import PostResult
from tests.postproc.kit import SAMPLES, convert, good
from toolpaths.diagnostics import has_errors

GOLDEN = Path(__file__).parents[1] / "golden"
PIECES = [
    (SAMPLES / "pocket.cls", "mill-3axis", "linuxcnc"),
    (SAMPLES / "pocket.cls", "mill-3axis", "generic-iso"),
    (SAMPLES / "inch_plate.apt", "mill-3axis", "linuxcnc"),
    (SAMPLES / "five_faces.cls", "mikron-ucp710", "linuxcnc"),
    (GOLDEN / "short_five_axis.apt", "mikron-ucp710", "linuxcnc"),
    (GOLDEN / "short_five_axis.apt", "head-table", "generic-iso"),
]


def made(source: Path, machine: str, controller: str) -> PostResult:
    path, found = toolpaths.read(source)
    assert not has_errors(found)
    return good(convert(path, machine, controller))


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: f"{p[0].stem}-{p[1]}-{p[2]}")
def test_written_as_reviewed(piece: tuple[Path, str, str]) -> None:
    source, machine, controller = piece
    file = GOLDEN / f"{source.stem}-{machine}-{controller}.ngc"
    text = made(*piece).text
    if os.environ.get("GOLDEN") == "renew":
        file.write_text(text, encoding="ascii", newline="\n")
    assert file.read_bytes() == text.encode("ascii"), "see the docstring of this file"


def test_no_file_is_left_over() -> None:
    assert {p.name for p in GOLDEN.glob("*.ngc")} == {f"{s.stem}-{m}-{c}.ngc" for s, m, c in PIECES}
