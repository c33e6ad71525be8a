"""What a setter sees first: speeds as spindles take them, no needless pairs, the stock, the tool home while it indexes."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from postproc.base.options import Options
from postproc.compile.needless_pairs import needless_pairs
from postproc.compile.program import Command
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.control.test_clamps import CONTROLS, SETUP, indexed
from tests.postproc.kit import setup_of, toolpath, words_of
from toolpaths.diagnostics import Severity

OFF_AXIS = "[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n"


@cache
def flat(controller: str, rpm: float = 15915.507752, *events: str) -> PostResult:
    path = toolpath("RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", "GOTO/20,0,30", *events, "FEDRAT/MMPM,500",
                    "GOTO/20,9,30", "RAPID", "GOTO/20,9,40", head=["UNITS/MM", "LOADTL/1", f"SPINDL/RPM,{rpm},CLW",
                                                                   "COOLNT/FLOOD"])
    return postproc.convert(path, machines.load("mikron-ucp710"), controller, SETUP, Options())


def verdict(result: PostResult, text: str, *severities: Severity) -> set[str]:
    assert result.job is not None
    return {d.code for d in read_back(text, result.job, "test.apt", gcode="edited.nc")[1]
            if d.severity in (severities or (Severity.ERROR,))}


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLS)
@pytest.mark.parametrize(("asked", "most"),
                         [(15915.507752, 0), (795.774715, 1), (79.577472, 2), (7.957747, 3)])
def test_speeds_have_no_decimals_that_no_spindle_keeps(controller: str, asked: float, most: int) -> None:
    result = flat(controller, asked)
    assert result.ok, [str(d) for d in result.diagnostics]
    [speed] = re.findall(r"(?<![A-Z])S(\d+\.?\d*)", re.sub(r"\(.*?\)|;.*", "", result.text))
    assert len(speed.partition(".")[2]) <= most
    allowed = 0.5 if controller in ("fanuc-30i", "haas-ngc") else 5e-4 * asked
    assert abs(float(speed) - asked) <= allowed


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", CONTROLS)
def test_coolant_and_spindle_are_not_switched_off_and_on_at_one_place(controller: str) -> None:
    plain = flat(controller)
    for pair in (("COOLNT/OFF", "COOLNT/FLOOD"), ("SPINDL/OFF", "SPINDL/RPM,15915.507752,CLW"),
                 ("COOLNT/OFF", "SPINDL/OFF", "SPINDL/RPM,15915.507752,CLW", "COOLNT/FLOOD")):
        result = flat(controller, 15915.507752, *pair)
        assert result.ok and strip(result.text) == strip(plain.text), pair


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLS)
@pytest.mark.parametrize(("events", "code"), [
    (("COOLNT/OFF", "DELAY/2", "COOLNT/FLOOD"), "M9"), (("COOLNT/OFF", "OPSTOP", "COOLNT/FLOOD"), "M9"),
    (("SPINDL/OFF", "SPINDL/RPM,9000,CLW"), "M5"), (("SPINDL/OFF", "SPINDL/RPM,15915.507752,CCLW"), "M5"),
    (("COOLNT/OFF", "GOTO/20,4,30", "COOLNT/FLOOD"), "M9")])
def test_where_there_is_a_reason_they_are(controller: str, events: tuple[str, ...], code: str) -> None:
    result = flat(controller, 15915.507752, *events)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert len(re.findall(rf"(?<![A-Z]){code}\b", result.text)) == len(
        re.findall(rf"(?<![A-Z]){code}\b", flat(controller).text)) + 1


def strip(text: str) -> str:
    """Without comments, whose line numbers and fingerprints differ."""
    return "\n".join(line for line in text.splitlines() if not re.match(r"(\d+ )?[(;]", line))


@pytest.mark.parametrize("controller", CONTROLS)
def test_the_ending_switches_off_only_what_is_on(controller: str) -> None:
    path = toolpath("RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", "COOLNT/OFF", "SPINDL/OFF",
                    head=["UNITS/MM", "LOADTL/1", "SPINDL/RPM,900,CLW", "COOLNT/FLOOD"])
    text = strip(postproc.convert(path, machines.load("mikron-ucp710"), controller, SETUP, Options()).text)
    assert len(re.findall(r"\bM5\b", text)) == len(re.findall(r"\bM9\b", text)) == 1
    assert {"M5", "M9"} <= set(strip(flat(controller).text).replace("\n", " ").split())


def test_a_pair_is_kept_where_the_state_before_it_is_not_known() -> None:
    off, on = Command("COOLANT_OFF"), Command("FLOOD_ON")
    assert needless_pairs({0: [on], 4: [off, on]}, 9) == {4: []}
    assert not needless_pairs({4: [off, on]}, 9)
    assert not needless_pairs({0: [on], 2: [Command("INSERT", ("M77",))], 4: [off, on]}, 9)
    assert not needless_pairs({0: [Command("FLOOD_ON", skip=True)], 4: [off, on]}, 9)
    assert not needless_pairs({0: [Command("MIST_ON")], 4: [off, on]}, 9)
    assert not needless_pairs({0: [on], 4: [off, Command("OPERATION_START", ("A", 1.0)), on]}, 9)
    assert not needless_pairs({0: [on], 4: [Command("PROGRAM_STOP"), off, on]}, 9)  # the stop may have switched it off
    assert not needless_pairs({0: [on], 3: [Command("OPERATION_START", ("A", 1.0))], 4: [off, on]}, 9)
    assert needless_pairs({4: [on, Command("COMMENT", ("A",)), off, on]}, 9) == {4: [on, Command("COMMENT", ("A",))]}


# ---- stock -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("controller", CONTROLS)
def test_the_stock_stands_in_the_work_offset(controller: str) -> None:
    setup = setup_of(OFF_AXIS + "[rewind.stock]\nlow = [-30, -20, -15]\nhigh = [35, 25, 30.5]\n")
    result = postproc.convert(indexed(), machines.load("mikron-ucp710"), controller, setup, Options())
    assert result.ok, [str(d) for d in result.diagnostics]
    form = ["1 BLK FORM 0.1 Z X-30 Y-20 Z-15", "2 BLK FORM 0.2 X+35 Y+25 Z+30.5"]
    assert (result.text.splitlines()[1:3] == form) == (controller == "heidenhain-tnc640")
    assert ("BLK" in result.text) == (controller == "heidenhain-tnc640")


def test_the_stock_of_a_turned_part_is_turned_with_it() -> None:
    """x of the part along -Y of the table; the work offset is the part's zero."""
    setup = setup_of("[part]\norigin = [31, -12, 5]\nx_axis = [0, -1, 0]\ny_axis = [1, 0, 0]\n[tools.1]\ngauge_length = 90\n"
                     "[tools.2]\ngauge_length = 65\n[rewind.stock]\nlow = [-30, -20, -15]\nhigh = [35, 25, 30]\n")
    result = postproc.convert(indexed(), machines.load("mikron-ucp710"), "heidenhain-tnc640",
                              setup, Options())
    assert result.text.splitlines()[1:3] == ["1 BLK FORM 0.1 Z X-20 Y-35 Z-15", "2 BLK FORM 0.2 X+25 Y+30 Z+30"]


# ---- indexing with the tool at home ------------------------------------------------------------------------

def at_home(index: str) -> SetupFile:
    return SETUP.model_copy(update={"clearance": SETUP.clearance.model_copy(update={"index": index})})


@cache
def indexing(controller: str, index: str, output: str) -> PostResult:
    return postproc.convert(indexed(), machines.load("mikron-ucp710"), controller, at_home(index),
                            Options(output=output))


@pytest.mark.covering
@pytest.mark.parametrize("output", ["auto", "axes"])
@pytest.mark.parametrize("controller", CONTROLS)
def test_the_tool_is_home_while_rotary_axes_are_turned(controller: str, output: str) -> None:
    result, low = indexing(controller, "home", output), indexing(controller, "plane", output)
    assert result.ok and low.ok, [str(d) for d in result.diagnostics]
    home = re.compile(r"(?:G53 G0(?: G49)?|SUPA G0(?: D0)?|L) Z\+?250\.?")
    assert len(home.findall(result.text)) > len(home.findall(low.text))
    assert not verdict(result, result.text) and "verify.index" in verdict(result, low.text)


@pytest.mark.parametrize(("controller", "output"), [("fanuc-30i", "axes"), ("heidenhain-tnc640", "auto")])
def test_the_tool_is_home_there_in_corrected_programs_too(controller: str, output: str,
                                                          tmp_path: Path) -> None:
    """The head nods by 40 arcsec along Z and is 0.1 mm off at its end: a retract that is corrected is as high as home."""
    (tmp_path / "z.csv").write_text("Z [mm],EZZ [um],EAZ [arcsec],EBZ [arcsec]\n-250,0,0,0\n250,100,40,-40\n")
    (tmp_path / "errors.toml").write_text('machine = "mikron-ucp710"\n' + "".join(
        f'[components.{name}]\ntable = "z.csv"\ninterpolation = "linear"\n' for name in ("EZZ", "EAZ", "EBZ")))
    options = Options(output=output, error_model=str(tmp_path / "errors.toml"))
    result, low = (postproc.convert(indexed(), machines.load("mikron-ucp710"), controller, at_home(index), options)
                   for index in ("home", "plane"))
    assert result.ok and low.ok, [str(d) for d in result.diagnostics]
    assert not verdict(result, result.text) and "verify.index" in verdict(result, low.text)
    for z, said in ((249.95, False), (249.5, True)):
        text = re.sub(r"Z(\+?)250\b\.?", rf"Z\g<1>{z}", result.text)
        assert ("verify.index" in verdict(result, text)) == said


@pytest.mark.parametrize("index", ["home", "plane"])
def test_a_plane_is_stated_at_home_on_travel_from_home(index: str) -> None:
    """Behind a tool change, or `index = "home"`: no length is in force above the part and cancelled for G68.2, G43.4."""
    result = indexing("fanuc-30i", index, "auto")
    assert result.ok, [str(d) for d in result.diagnostics]
    blocks, above, cancelled = result.text.split("\n"), False, 0
    for k, block in enumerate(blocks):
        if block.startswith(("G68.2", "G43.4")):
            cancelled += above
            assert "G43" in blocks[k + 2 * block.startswith("G68.2")]
        above = "G43" in block or (above and not block.startswith("G53 G0 "))
    planes = sum(block.startswith("G68.2") for block in blocks)
    assert planes > 3 and cancelled == (0 if index == "home" else 1)  # the mode by the tip goes by home all the same
    alone = [blocks[k - 1] for k, block in enumerate(blocks) if block == "G69" and k and blocks[k - 1] == "G49"]
    assert len(alone) == (0 if index == "home" else 1)
    assert ("5006#6 TOS" in result.text) == ("G49" in blocks)
    height, moved = 0.0, list[float]()
    for block in blocks:  # the length goes off just below home, whatever length the tool has
        words = words_of(block.partition("(")[0])
        if block.startswith("G0 G49"):
            moved.append(float(words["Z"]) - height)
        height = float(words.get("Z", height))
    assert len(moved) >= 3 and all(mm > 1.0 for mm in moved)


@pytest.mark.covering
@pytest.mark.parametrize("output", ["auto", "tcp"])
@pytest.mark.parametrize(("controller", "machine"), [("fanuc-30i", "mikron-ucp710"), ("haas-ngc", "trunnion-bc"),
                                                     ("fanuc-30i", "trunnion-bc")])
def test_the_mode_by_the_tip_begins_and_ends_at_the_height_of_home(controller: str, machine: str, output: str) -> None:
    """G43.4 and G234 take the length, G49 ends them: neither stands near the part, with the part off the rotary axes."""
    result = postproc.convert(indexed(), machines.load(machine), controller, SETUP, Options(output=output))
    assert result.ok and result.path is not None, [str(d) for d in result.diagnostics]
    path, lift = result.path, result.machine.retract_axis
    height = result.machine.home[lift] - path.q[:, lift]
    law = np.array([frame.control.law == "tcp" for frame in path.frames])[path.frame]
    begins, ends = np.flatnonzero(~law[:-1] & law[1:]), np.flatnonzero(law[:-1] & ~law[1:])
    assert len(begins) and len(begins) == len(ends)
    assert height[begins].max() <= 10.0 + 1e-9 and np.abs(height[ends] - 10.0).max() < 1e-9
    blocks = strip(result.text).split("\n")
    assert sum(block.startswith(("G43.4", "G234")) for block in blocks) == len(begins)


def test_haas_indexes_at_home_unless_the_set_up_says_otherwise() -> None:
    """Mill Operator's Manual, G254: before rotary motion, a G53 move retracts the tool."""
    haas = postproc.convert(indexed(), machines.load("mikron-ucp710"), "haas-ngc", SETUP, Options())
    assert strip(haas.text) == strip(indexing("haas-ngc", "home", "auto").text)
    warned = verdict(haas, indexing("haas-ngc", "plane", "auto").text, Severity.WARNING)
    assert "verify.index" in warned and not verdict(haas, indexing("haas-ngc", "plane", "auto").text)
    fanuc = postproc.convert(indexed(), machines.load("mikron-ucp710"), "fanuc-30i", SETUP, Options())
    assert strip(fanuc.text) == strip(indexing("fanuc-30i", "home", "auto").text)
