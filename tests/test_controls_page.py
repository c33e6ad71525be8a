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


@pytest.mark.parametrize("column", range(1, 6))
def test_every_word_names_its_page_or_is_assumed(column: int) -> None:
    """Letters that the pages explain, a manual by its number, or that no page at hand says it."""
    pages = "".join((ROOT / page).read_text("utf-8")
                    for page in ("docs/reference/control-rules.md", "postproc/readback/SHARED.md"))
    explained = set(re.findall(r"\b([FSTHN]\d?) =", pages))
    cells = {row[0]: row[column] for row in FEATURES[1:] if row[column] not in ("-", "*shop*")}
    said = {name: [*re.findall(r"[AB]-\d{5}EN?|\*assumed\*", cell),
                   *(explained & set(re.sub(r"`[^`]*`|,", " ", cell).split()))]
            for name, cell in cells.items()}
    assert len(cells) > 15 and [name for name, pages in said.items() if not pages] == []


def test_tests_are_there() -> None:
    named = [name for row in (*FEATURES[1:], *OPTIONS[1:]) for name in re.findall(r"`([^`]+)`", row[-1])]
    assert len(named) > 40 and [name for name in named if not (ROOT / "tests" / name).is_file()] == []


MACHINE = {"module", "travel", "velocity", "acceleration", "jerk", "home", "assumed", "source"}
"""keys of the machine itself: its kinematics and figures, and who states them"""
ELSEWHERE = {"description", "assumed", "machine", "placement", "orientation"}
"""keys of a set-up for people, and of commands that convert nothing"""


def test_every_key_is_listed_with_a_test_that_states_it() -> None:
    """Those of a control, its axes, clamps and rests in the machine file, and those of a set-up."""
    from machines.models import AxisModel, ControlModel, TimingModel
    from postproc.setup import model as setup
    from postproc.setup.bodies import ToolBody
    from postproc.setup.joints import Joints
    from postproc.setup.places import PlaceSetup

    listed = {key: re.findall(r"`([^`]+)`", row[2]) for row in OPTIONS[1:]
              for key in re.findall(r"[a-z_]+", " ".join(re.findall(r"`([^`]+)`", row[0])))}
    keys = {key for one in (ControlModel, AxisModel, TimingModel) for key in one.model_fields} - MACHINE
    keys |= {key for one in (setup.SetupFile, setup.PartPlacement, PlaceSetup, setup.LinkClearance, setup.ToolSetup,
                             setup.OutputSettings, setup.RewindSettings, Joints) for key in one.model_fields}
    keys -= ELSEWHERE | set(ToolBody.model_fields)
    assert keys - set(listed) == set()
    texts = {key: "".join((ROOT / "tests" / name).read_text("utf-8") for name in names) for key, names in listed.items()}
    assert sorted(key for key in keys if key not in texts[key]) == []
