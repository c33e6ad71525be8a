"""The path of the tool's centre offset back to the contour: radius registers for CL files of the centre."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from postproc.cycle_time.source import from_gcode
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from postproc.verification.second_witness import second_witness
from tests.postproc.kit import convert, good, goto, tilted, toolpath
from toolpaths.diagnostics import Severity

NEXT = ["fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"]
BEFORE = ["CUTTER/10", "RAPID", "GOTO/-60,0,20", "GOTO/-60,0,2"]
ON, OFF, AFTER = "CUTCOM/LEFT", "CUTCOM/OFF", ["GOTO/-60,0,2", "RAPID", "GOTO/-60,0,20"]
IN = ["GOTO/-40,-15,2", "CIRCLE/-40,0,2,0,0,1,15", "GOTO/-25,0,2"]
OUT = ["GOTO/-25,0,2", "CIRCLE/-40,0,2,0,0,1,15", "GOTO/-40,15,2"]


def corner(x: int, y: int, i: int, j: int) -> list[str]:
    return [f"CIRCLE/{x},{y},2,0,0,-1,5", f"GOTO/{x + i},{y + j},2"]


PATHS = {
    "pocket": ["GOTO/20,-10,2", "CIRCLE/20,0,2,0,0,1,10", "GOTO/30,0,2", "GOTO/30,20,2", "GOTO/-30,20,2", "GOTO/-30,-20,2",
               "GOTO/30,-20,2", "GOTO/30,0,2", "CIRCLE/20,0,2,0,0,1,10", "GOTO/20,10,2"],
    "rounded": [*IN, "GOTO/-25,10,2", *corner(-20, 10, 0, 5), "GOTO/20,15,2", *corner(20, 10, 5, 0), "GOTO/25,-10,2",
                *corner(20, -10, 0, -5), "GOTO/-20,-15,2", *corner(-20, -10, -5, 0), *OUT],
    "sharp": [*IN, "GOTO/-25,15,2", "GOTO/25,15,2", "GOTO/25,-15,2", "GOTO/-25,-15,2", *OUT],
    "notch": ["GOTO/-30,0,2", "GOTO/-20,0,2", "CIRCLE/0,0,2,0,0,-1,20", "GOTO/20,0,2", "GOTO/30,0,2", "GOTO/30,30,2",
              "GOTO/-30,30,2"]}
"""a pocket; a boss by arcs of the radius round its corners, and by sharp ones; arcs that meet lines in inside corners"""
CONTOUR = {
    "pocket": [(20, -15), (35, 0), (35, 25), (-35, 25), (-35, -25), (35, -25), (35, 0), (20, 15)],
    "rounded": [(-40, -20), (-20, 0), (-20, 10), (20, 10), (20, -10), (-20, -10), (-20, 0), (-40, 20)],
    "sharp": [(-40, -20), (-20, 0), (-20, 10), (20, 10), (20, -10), (-20, -10), (-20, 0), (-40, 20)],
    "notch": [(-30, -5), (-200**0.5, -5), (200**0.5, -5), (35, -5), (35, 35), (-30, 35)]}
GOES = [("pocket", c) for c in NEXT] + [("rounded", "siemens-840d"), ("rounded", "heidenhain-tnc640"),
                                        ("sharp", "fanuc-30i"), ("notch", "fanuc-30i")]


def setup(**tool: object) -> SetupFile:
    return SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0, "compensation": "radius", **tool}}})


@cache
def made(name: str, controller: str) -> PostResult:
    return convert(toolpath(*BEFORE, ON, *PATHS[name], OFF, *AFTER), "mill-3axis", controller, setup())


def errors(result: PostResult) -> list[tuple[str, str]]:
    return [(d.code, d.message) for d in result.diagnostics if d.severity is Severity.ERROR]


@pytest.mark.covering
@pytest.mark.parametrize(("name", "controller"), GOES)
def test_the_words_are_the_contour_and_the_tool_runs_as_the_file_says(name: str, controller: str) -> None:
    result = good(made(name, controller))
    assert result.job is not None and result.comparison is not None and result.comparison.executed is not None
    motion = result.comparison.executed[1]
    rows = np.flatnonzero(motion.compensation != 40)
    words = motion.end[rows][:, :2] + motion.contour[rows][:, 2:]
    moves = np.concatenate([[True], (np.abs(np.diff(words, axis=0)) > 1e-6).any(axis=1)])  # corners stay where they are
    assert words[moves] == pytest.approx(np.array(CONTOUR[name]), abs=2e-3)
    assert result.comparison.worst_tip < 1e-3 and result.witness is not None and not result.witness.not_compared
    head = " ".join(re.sub("[();]", "", result.text.upper()).split())
    assert "HOLDS 5.0000 MM, THE WORDS ARE THE CONTOUR, OFFSET BACK FROM THE PATH OF THE TOOL'S CENTRE" in head
    assert ("NORM G450 CFTCP" in head) == (controller == "siemens-840d")


def mirrored(line: str) -> str:
    """A record seen in the plane X Z: left becomes right, counter-clockwise clockwise."""
    word, _, numbers = line.replace("LEFT", "RIGHT").partition("/")
    if word not in ("GOTO", "CIRCLE"):
        return f"{word}/{numbers}" if numbers else word
    values = [-float(v) if k in (1, 5) else float(v) for k, v in enumerate(numbers.split(","))]
    return f"{word}/" + ",".join(f"{v:g}" for v in values)


@pytest.mark.parametrize(("name", "controller"), [("rounded", "siemens-840d"), ("notch", "fanuc-30i")])
def test_the_tool_right_of_the_contour(name: str, controller: str) -> None:
    lines = [mirrored(line) for line in [*BEFORE, ON, *PATHS[name], OFF, *AFTER]]
    text = good(convert(toolpath(*lines), "mill-3axis", controller, setup())).text
    assert "G42" in text and ("X-20 Y-10" if name == "rounded" else "X35. Y-35.") in text


@pytest.mark.parametrize(("lines", "controller", "said"), [
    (PATHS["pocket"], "linuxcnc", "does not begin square"), (PATHS["pocket"], "generic-iso", "does not begin square"),
    (PATHS["rounded"], "fanuc-30i", "outside corner"), (PATHS["rounded"], "haas-ngc", "outside corner"),
    (PATHS["sharp"], "siemens-840d", "outside corner"), (PATHS["sharp"], "haas-ngc", "outside corner"),
    ([*IN, "CIRCLE/-23,0,2,0,0,-1,2", "GOTO/-23,2,2", "GOTO/-10,2,2"], "siemens-840d", "smaller than the tool"),
    (["GOTO/-40,0,2", "GOTO/-40,20,2", "GOTO/-40,20,1", "GOTO/-40,40,1"], "fanuc-30i", "no cut in the plane"),
    (["GOTO/-40,0,2", "GOTO/-40,-20,2", "GOTO/-20,-40,2"], "fanuc-30i", "first or last move"),
    ([*PATHS["pocket"][:4], "STOP", *PATHS["pocket"][4:]], "fanuc-30i", "no move stands between"),
    ([*PATHS["pocket"][:2], "COOLNT/OFF", *PATHS["pocket"][2:]], "heidenhain-tnc640", "no move stands between"),
    ([f"GOTO/{20 + 10*np.sin(a):.5f},{-10 * np.cos(a):.5f},2" for a in np.linspace(0, np.pi, 151)], "haas-ngc", "so short"),
    (["GOTO/-40,0,2"], "fanuc-30i", "first or last move"),
    (["GOTO/-40,0,2", "CIRCLE/-20,0,2,0,0,-1,20", "GOTO/-20,20,2"], "heidenhain-tnc640", "first or last move")])
def test_what_has_no_contour_is_refused(lines: list[str], controller: str, said: str) -> None:
    result = convert(toolpath(*BEFORE, ON, *lines, OFF, *AFTER), "mill-3axis", controller, setup())
    assert [code for code, _ in errors(result)] == ["cutcom.offset_back"] and result.text == ""
    assert said in errors(result)[0][1]


def test_the_diameter_is_that_of_file_or_set_up() -> None:
    lines = [line for line in [*BEFORE, ON, *PATHS["pocket"], OFF, *AFTER] if "CUTTER" not in line]
    assert [c for c, _ in errors(convert(toolpath(*lines), "mill-3axis", "fanuc-30i", setup()))] == ["cutcom.radius"]
    text = good(convert(toolpath(*lines), "mill-3axis", "fanuc-30i", setup(diameter=8.0))).text
    assert "X20. Y-14." in text and "D1 HOLDS 4.0000 MM" in text
    path = toolpath(*BEFORE, ON, *PATHS["pocket"], OFF, *AFTER)
    both = errors(convert(path, "mill-3axis", "fanuc-30i", setup(diameter=12.0)))
    assert [code for code, _ in both] == ["cutcom.radius"] and "10 mm, the set-up says 12 mm" in both[0][1]


@pytest.mark.parametrize(("controller", "old", "new"), [
    ("fanuc-30i", "X35. Y25.", "X35. Y25.02"), ("fanuc-30i", "G41 D1", "G42 D1"), ("siemens-840d", "I0 J15", "I0 J15.02"),
    ("heidenhain-tnc640", "L X-35 Y-25", "L X-35 Y-24.98"), ("heidenhain-tnc640", " RL", "")])
def test_a_changed_contour_is_found(controller: str, old: str, new: str) -> None:
    result = good(made("pocket", controller))
    assert result.job is not None and old in result.text
    assert [d for d in read_back(result.text.replace(old, new).encode(), result.job, "")[1] if d.severity is Severity.ERROR]


def test_the_radius_is_executed() -> None:
    """By the read-back, by the second witness from the CL file's own CUTTER, and in the time of the program."""
    result = good(made("rounded", "siemens-840d"))
    assert result.job is not None and result.comparison is not None and result.comparison.executed is not None
    bare = replace(result.job, cutcom=tuple(replace(one, radius=0.0) for one in result.job.cutcom))
    assert "verify.tip" in {d.code for d in read_back(result.text.encode(), bare, "")[1]}
    code, motion = result.comparison.executed
    for contour in (0.0 * motion.contour, 1.2 * motion.contour):
        other = replace(result.comparison, executed=(code, replace(motion, contour=contour)))
        said, _ = second_witness(result.source, result.setup, result.options, result.job, other, result.text)
        assert [f.code for f in said.findings] == ["compensation"]
    said, _ = second_witness(result.source, setup(diameter=12.0), result.options, result.job, result.comparison, result.text)
    assert "contour, 6 mm" in said.findings[0].message
    for tool, arcs in ((setup(diameter=10.0), 6), (setup(compensation="wear"), 2)):
        blocks, _ = from_gcode(result.text.encode(), result.machine, result.controller, tool)
        assert blocks is not None and int(blocks.arc.sum()) == arcs


@pytest.mark.parametrize(("controller", "old", "new", "said"), [
    ("siemens-840d", "G450", "G451", "G451"), ("siemens-840d", "X20 Y10\n", "X20 Y10\nZ2.5\nZ2\n", "does not cut"),
    ("siemens-840d", r"N\d+ G40\n", "", "stays on to the end"),
    ("siemens-840d", "X20 Y10\n", "X20 Y10\nM8\n", "that is no move"),
    ("siemens-840d", "X20 Y10\n", "X20 Y10 M0\n", "that is no move"),
    ("fanuc-30i", "X-30. Y35.", "X-28. Y35.\nY34.\nX-30. Y35.", "")])
def test_what_the_reader_does_not_execute(controller: str, old: str, new: str, said: str) -> None:
    result = good(made("rounded" if controller == "siemens-840d" else "notch", controller))
    text = result.text[:result.text.index("41")] + re.sub(old, new, result.text[result.text.index("41"):])
    text = text if old != "G450" else result.text.replace(old, new)
    assert result.job is not None and text != result.text
    found = [d for d in read_back(text.encode(), result.job, "")[1] if d.severity is Severity.ERROR]
    assert found and said in " ".join(d.message for d in found)


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640"])
def test_in_a_tilted_plane(controller: str) -> None:
    axis = tilted(30.0, 0.0)
    across, side = np.cross([0.0, 1.0, 0.0], axis), np.array([0.0, 1.0, 0.0])

    def at(*points: tuple[float, float]) -> list[str]:
        return goto(np.array([x * across + y * side for x, y in points]), np.tile(axis, (len(points), 1)))
    arc = "CIRCLE/" + ",".join(f"{v:.12f}" for v in (*(25.0 * across + 15.0 * side), *axis, 5.0))
    lines = [*at((0, 0)), ON, *at((20, -10), (30, -10), (30, 15)), arc, *at((20, 15)), OFF, *at((25, 5)), "RAPID",
             *goto((100.0 * axis)[None], axis[None])]
    lines = ["CUTTER/6", "RAPID", *lines]
    result = good(convert(toolpath(*lines), "mikron-ucp710", controller, setup()))
    assert result.comparison is not None and result.comparison.worst_tip < 2e-3
    assert re.search(r"CYCLE800\(0|PLANE SPATIAL", result.text)
