"""docs/controls.md: each word of its first table is the controller file's or the writer's, each test is there."""

from __future__ import annotations

import re

import pytest

from postproc.controllers.model import builtin_files
from tests.source import ROOT

PAGE = (ROOT / "docs" / "controls.md").read_text("utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]
FEATURES, OPTIONS = ([row for row in ROWS if len(row) == n] for n in (8, 3))
WRITERS = "".join(file.read_text("utf-8") for room in ("postproc/writing", "postproc/controllers", "postproc/control")
                  for file in (ROOT / room).glob("*.py"))


@pytest.mark.parametrize("column", range(1, 7))
def test_words_are_those_of_the_controller(column: int) -> None:
    name = FEATURES[0][column]
    text = builtin_files()[name].read_text("utf-8") + WRITERS
    words = [word for row in FEATURES[1:] for word in re.findall(r"`([^`]+)`", row[column])]
    assert len(words) > 10 and [word for word in words if word not in text] == []


def test_tests_are_there() -> None:
    named = [name for row in (*FEATURES[1:], *OPTIONS[1:]) for name in re.findall(r"`([^`]+)`", row[-1])]
    assert len(named) > 40 and [name for name in named if not (ROOT / "tests" / name).is_file()] == []


def test_every_key_of_a_control_is_listed() -> None:
    from machines.models import ControlModel

    listed = set(re.findall(r"`([a-z_]+)`", "".join(row[0] for row in OPTIONS)))
    assert set(ControlModel.model_fields) - {"module"} <= listed
