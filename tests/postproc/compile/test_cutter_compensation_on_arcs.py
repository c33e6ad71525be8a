"""Cutter compensation that begins or ends on an arc, its register where CUTCOM names none, programs without a tool."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, convert, good, goto, tilted, toolpath
from toolpaths.diagnostics import Diagnostic, Severity

NAMES = ["linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "generic-iso"]
MODAL = ["fanuc-30i", "haas-ngc", "generic-iso"]
DOWN = ["CUTTER/10", "RAPID", "GOTO/20,-20,20", "GOTO/20,-20,2"]
OUT = ["RAPID", "GOTO/-50,20,20"]
INTO = ["GOTO/20,0,2", "CIRCLE/0,0,2,0,0,1,20", "GOTO/0,20,2"]
ROUND = [*DOWN, "CUTCOM/LEFT", *INTO, "GOTO/-20,20,2", "CUTCOM/OFF", "GOTO/-50,20,2", *OUT]
BEGINS = [*DOWN, "GOTO/20,0,2", "CUTCOM/LEFT", *INTO[1:], "GOTO/-20,20,2", "CUTCOM/OFF", "GOTO/-50,20,2", *OUT]
ENDS = [*DOWN, "CUTCOM/LEFT", *INTO, "GOTO/-20,20,2", "CUTCOM/OFF", "CIRCLE/-20,40,2,0,0,-1,20", "GOTO/-40,40,2", *OUT]
BARE = ["FEDRAT/200", "GOTO/0,0,10,0,0,1", "GOTO/10,0,10,0.6,0,0.8"]


def errors(result: PostResult) -> list[Diagnostic]:
    return [d for d in result.diagnostics if d.severity is Severity.ERROR]


@cache
def made(controller: str, *lines: str) -> PostResult:
    return convert(toolpath(*lines), "mill-3axis", controller)


@pytest.mark.parametrize("controller", NAMES)
def test_a_contour_with_straight_ways_in_and_out_is_written(controller: str) -> None:
    assert good(made(controller, *ROUND)).text


@pytest.mark.parametrize("controller", NAMES)
def test_an_arc_that_begins_compensation_is_refused_but_by_linuxcnc(controller: str) -> None:
    result = made(controller, *BEGINS)
    assert result.ok == (controller == "linuxcnc")
    assert [(d.code, d.lines) for d in errors(result)] == ([] if result.ok else [("cutcom.arc", (10,))])
    assert all("begins" in d.message and "straight move that leads to" in d.hint for d in errors(result))


@pytest.mark.parametrize("controller", NAMES)
def test_an_arc_that_ends_compensation_is_refused(controller: str) -> None:
    noted = errors(made(controller, *ENDS))
    assert [(d.code, d.lines) for d in noted] == [("cutcom.arc", (14,))]
    assert "ends" in noted[0].message and "away from" in noted[0].hint


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i"])
def test_a_plunge_between_is_no_way_in(controller: str) -> None:
    """A move along Z leads nowhere in the plane, so the arc behind it is the first move there."""
    lines = ["CUTTER/10", "RAPID", "GOTO/20,0,20", "CUTCOM/LEFT", "GOTO/20,0,2", *INTO[1:], "GOTO/-20,20,2", *OUT]
    assert [d.code for d in errors(made(controller, *lines))] == ([] if controller == "linuxcnc" else ["cutcom.arc"])


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc"])
@pytest.mark.parametrize("travel", ["into", "arc", "plunge"])
def test_it_is_the_same_in_a_tilted_plane(controller: str, travel: str) -> None:
    z = tilted(30.0, 0.0)
    y = np.array([0.0, 1.0, 0.0])
    x = np.cross(y, z)

    def at(*places: tuple[float, float, float]) -> list[str]:
        return goto(np.array([a * x + b * y + h * z for a, b, h in places]), np.tile(z, (len(places), 1)))
    arc = ["CIRCLE/0,0,0," + ",".join(f"{v:.9f}" for v in z) + ",20", *at((0, 20, 0), (-20, 20, 0)), "CUTCOM/OFF",
           *at((-50, 20, 0)), "RAPID", *at((-50, 20, 40))]
    travels = {"into": [*at((20, -20, 40), (20, -20, 0)), "CUTCOM/LEFT", *at((20, 0, 0))],
               "arc": [*at((20, 0, 40), (20, 0, 0)), "CUTCOM/LEFT"],
               "plunge": [*at((20, 0, 40)), "CUTCOM/LEFT", *at((20, 0, 0))]}
    result = convert(toolpath("RAPID", *travels[travel], *arc), "trunnion-bc", controller)
    assert [d.code for d in errors(result)] == ([] if travel == "into" else ["cutcom.arc"])
    if controller == "fanuc-30i" and travel == "into":
        rows = result.text.split("\n")
        on = rows.index("G41 D1")
        assert result.job is not None and "G68.2" in result.text
        edited = "\n".join([*rows[:on], rows[on + 1], rows[on], *rows[on + 2:]])
        assert "verify.cutcom_arc" in codes(read_back(edited.encode(), result.job, "test.apt")[1])


def test_a_change_of_side_on_an_arc_is_reported_once() -> None:
    lines = [*DOWN, "CUTCOM/RIGHT", "GOTO/20,0,2", "CUTCOM/LEFT", *INTO[1:], "GOTO/-20,20,2", *OUT]
    assert [(d.code, d.lines) for d in errors(made("fanuc-30i", *lines))] == [("cutcom.arc", (11,))]


@pytest.mark.parametrize("controller", NAMES)
def test_an_arc_out_of_the_plane_is_refused(controller: str) -> None:
    arc = ["CIRCLE/0,0,12,0,1,0,10", "GOTO/-10,0,12"]
    lines = [*DOWN, "CUTCOM/LEFT", "GOTO/20,0,2", "GOTO/0,0,2", *arc, "CUTCOM/OFF", *OUT]
    assert [(d.code, d.lines) for d in errors(made(controller, *lines))] == [("cutcom.arc_plane", (13,))]


def test_the_keys_of_a_shops_file_allow_it(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    for key, lines in (("begins_on_arc", BEGINS), ("ends_on_arc", ENDS)):
        shop.write_text(f'base = "fanuc-30i"\ncutter_compensation.{key} = true\n')
        assert good(convert(toolpath(*lines), "mill-3axis", shop)).text
    shop.write_text('base = "fanuc-30i"\ncutter_compensation.modal_register = false\n')
    assert "G41\n" in good(convert(toolpath(*ROUND), "mill-3axis", shop)).text


# ---- verify ------------------------------------------------------------------------------------------------


def spoilt(controller: str, old: str, new: str, lines: list[str]) -> list[str]:
    """The errors of an edited program: code and message."""
    result = good(made(controller, *lines))
    assert result.job is not None and old in result.text
    found = read_back(result.text.replace(old, new, 1).encode(), result.job, "test.apt")[1]
    return [f"{d.code} {d.message}" for d in found if d.severity is Severity.ERROR]


@pytest.mark.parametrize("controller", MODAL)
def test_verify_reports_compensation_that_was_moved_to_an_arc(controller: str) -> None:
    rows = good(made(controller, *ROUND)).text.split("\n")
    on = rows.index("G41 D1")
    assert rows[on + 2].startswith("G3 ")
    edited = "\n".join([*rows[:on], rows[on + 1], "G41 D1", *rows[on + 2:]])
    noted = spoilt(controller, "\n".join(rows), edited, ROUND)
    assert any(t.startswith("verify.cutcom_arc") and "begins" in t for t in noted), noted


@pytest.mark.parametrize("controller", MODAL)
def test_verify_reports_an_arc_behind_the_end(controller: str) -> None:
    lines = [*DOWN, "CUTCOM/LEFT", *INTO, "GOTO/-20,20,2", "CIRCLE/-20,40,2,0,0,-1,20", "GOTO/-40,40,2", "CUTCOM/OFF",
             "GOTO/-50,40,2", *OUT]
    text = good(made(controller, *lines)).text
    rows = text.split("\n")
    off = rows.index("G40")
    assert rows[off - 1].startswith("G2 ")
    noted = spoilt(controller, text, "\n".join([*rows[:off - 1], "G40", rows[off - 1], *rows[off + 1:]]), lines)
    assert any(t.startswith("verify.cutcom_arc") and "ends" in t for t in noted), noted


# ---- the register ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("controller", NAMES)
def test_the_register_of_the_tool_stands_where_d_is_modal(controller: str) -> None:
    result = good(made(controller, *ROUND))
    assert ("G41 D1\n" in result.text) == (controller in MODAL)
    noted = [d for d in result.diagnostics if d.code == "cutcom.register"]
    assert len(noted) == 1 and noted[0].severity is Severity.WARNING and ("D1" in noted[0].message) == (controller in MODAL)


def test_the_register_is_that_of_the_length_where_the_file_names_one() -> None:
    head = ["UNITS/MM", "LOADTL/1,ADJUST,7", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
    text = good(convert(toolpath(*ROUND, head=head), "mill-3axis", "fanuc-30i")).text
    assert "G43 H7" in text and "G41 D7\n" in text


def test_each_tool_has_its_own() -> None:
    text = good(made("haas-ngc", *ROUND, "LOADTL/2", "SPINDL/RPM,1000,CLW", *ROUND)).text
    assert [row for row in text.split("\n") if row.startswith("G41")] == ["G41 D1", "G41 D2"]


def test_a_register_that_cutcom_names_stays() -> None:
    result = good(made("fanuc-30i", *[line.replace("LEFT", "LEFT,12") for line in ROUND]))
    assert "G41 D12\n" in result.text
    assert "names none" not in "".join(d.message for d in result.diagnostics)


@pytest.mark.covering
@pytest.mark.parametrize("controller", MODAL)
@pytest.mark.parametrize(("new", "found"), [("G41\n", "none"), ("G41 D2\n", "2"), ("G41 D1\nD2\n", "2")])
def test_verify_knows_the_register_that_holds(controller: str, new: str, found: str) -> None:
    noted = spoilt(controller, "G41 D1\n", new, ROUND)
    assert len(noted) == 1 and f"register of the cutter compensation is {found}, it should be 1" in noted[0]


def test_linuxcnc_takes_the_tool_in_the_spindle() -> None:
    for same in ("G41 D0\n", "G41 D1\n"):
        assert spoilt("linuxcnc", "G41\n", same, ROUND) == []
    assert "is 2, it should be 1" in "".join(spoilt("linuxcnc", "G41\n", "G41 D2\n", ROUND))
    named = [line.replace("LEFT", "LEFT,3") for line in ROUND]
    assert "is 1, it should be 3" in "".join(spoilt("linuxcnc", "G41 D3\n", "G41\n", named))


# ---- no tool -----------------------------------------------------------------------------------------------


TURNS = {"spindle": {"rpm": 1000}}
NUMBERED = SetupFile.model_validate({"output": TURNS, "tool_numbers": {"unnamed": 7},
                                     "tools": {"7": {"gauge_length": 90.0}}})
MEASURED = SetupFile.model_validate({"output": {**TURNS, "tool_call": False}})


@pytest.mark.parametrize(("controller", "name", "code"), [
    ("fanuc-30i", "mikron-ucp710", "G43.4 H7"), ("haas-ngc", "trunnion-bc", "G234 H7"),
    ("linuxcnc", "mikron-ucp710", "G43 H7"),
    ("siemens-840d", "mikron-ucp710", "TRAORI"), ("heidenhain-tnc640", "mikron-ucp710", "TOOL CALL 7 Z")])
def test_a_file_without_a_tool_is_written_with_the_number_of_the_set_up(controller: str, name: str,
                                                                        code: str) -> None:
    """Its register is that of the number; without one the file is refused in every mode, the tool's first line named."""
    path = toolpath(*BARE, head=["UNITS/MM"])
    for output in ("auto", "axes"):
        found = errors(convert(path, name, controller, output=output))
        assert [(d.code, d.lines) for d in found] == [("tool.number", (3,)), ("spindle.not_started", (3, 4))]
        assert '"unnamed" = 1' in found[0].hint
    assert code in good(convert(path, name, controller, NUMBERED)).text
    assert good(convert(path, name, controller, NUMBERED, output="axes")).text


def test_compensation_without_a_tool_needs_its_register() -> None:
    head = ["UNITS/MM", "FEDRAT/MMPM,600"]
    found = errors(convert(toolpath(*ROUND, head=head), "mill-3axis", "fanuc-30i", MEASURED))
    assert [(d.code, d.lines) for d in found] == [("tool.missing", (7,))] and "CUTCOM/LEFT,1" in found[0].hint
    zero = errors(convert(toolpath(*ROUND, head=["LOADTL/0", *head]), "mill-3axis", "fanuc-30i", MEASURED))
    assert [d.code for d in zero] == ["tool.missing"], "D0 is no register"
    named = [line.replace("LEFT", "LEFT,4") for line in ROUND]
    assert "G41 D4" in good(convert(toolpath(*named, head=head), "mill-3axis", "fanuc-30i", MEASURED)).text
    assert good(convert(toolpath(*ROUND, head=head), "mill-3axis", "linuxcnc", MEASURED)).text
