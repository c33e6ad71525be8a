"""Tools without a number, or that no record loads: numbered by the set-up, measured into the work offset, or refused."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.kit import convert, good, machine, toolpath
from toolpaths.diagnostics import Diagnostic, Severity

CONTROLLERS = ("linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc")
SPINDLE = ["SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
CUT = ["RAPID", "GOTO/0,0,30", "GOTO/0,0,0", "GOTO/10,0,0", "RAPID", "GOTO/10,0,30"]
NOTHING = ["UNITS/MM", *SPINDLE, *CUT]
ONE = ["UNITS/MM", "CUTTER/10,1", *SPINDLE, *CUT]
NAMED = ["UNITS/MM", "TPRINT/EM10", "TLDATA/MILL,10,0,75,0,0", *SPINDLE, *CUT]
ZERO = ["UNITS/MM", "TPRINT/EM10", "TLDATA/MILL,10,0,75,0,0", "LOAD/TOOL,0", *SPINDLE, *CUT]
SEVERAL = ["UNITS/MM", *SPINDLE, "CUTTER/10,1", *CUT, "CUTTER/6,3", *CUT, "CUTTER/10,1", *CUT]
FILES = {"nothing of a tool": NOTHING, "its form": ONE, "its name": NAMED, "number 0": ZERO, "several forms": SEVERAL}


def setup_of(text: str, folder: Path) -> SetupFile:
    (folder / "s.toml").write_text(text)
    setup, found = load_setup(folder / "s.toml")
    assert setup is not None, [str(d) for d in found]
    return setup


def errors(result: PostResult) -> list[Diagnostic]:
    return [d for d in result.diagnostics if d.severity is Severity.ERROR]


def hinted(result: PostResult) -> str:
    """The lines of a set-up that the refusal proposes."""
    found = errors(result)
    assert [d.code for d in found] == ["tool.number"] and not result.text and found[0].lines
    head, *lines = found[0].hint.split("\n")
    assert head == "add to the set-up:"
    return "\n".join(line for line in lines if not line.startswith("or,")) + "\n"


@pytest.mark.covering
@pytest.mark.parametrize(("file", "controller"), [
    *((file, CONTROLLERS[k]) for k, file in enumerate(FILES)), *(("several forms", one) for one in CONTROLLERS)])
def test_the_hint_numbers_the_tools(file: str, controller: str, tmp_path: Path) -> None:
    path = toolpath(head=FILES[file])
    text = hinted(convert(path, "mill-3axis", controller, SetupFile()))
    numbers = tomllib.loads(text)["tool_numbers"].values()
    assert sorted(numbers) == list(range(1, len(numbers) + 1)) and len(numbers) == (2 if file == "several forms" else 1)
    setup = setup_of(text + "".join(f"[tools.{n}]\ngauge_length = {100 + 20 * n}\n" for n in numbers), tmp_path)
    result = good(convert(path, "mill-3axis", controller, setup))
    called = re.findall(r"(?:^|[ \n])(?:T|TOOL CALL )([1-9])(?= M6|\n(?:N\d+ )?M6| Z)", result.text)
    assert called == (["1", "2", "1"] if file == "several forms" else ["1"])
    assert not re.search(r"(^|\s)(T0|TOOL CALL 0)(\s|$)", result.text)
    assert result.job is not None and result.job.register_lengths() == {n: 100.0 + 20 * n for n in numbers}
    (tmp_path / "p.nc").write_text(result.text)
    assert postproc.verify(tmp_path / "p.nc", path, machine("mill-3axis"), controller, setup=setup).ok


def test_numbers_that_are_proposed_are_free() -> None:
    """Those of [tools.N] that nothing uses come first, those of the file and of [tool_numbers] not at all."""
    setup = SetupFile.model_validate({"tools": {"7": {"gauge_length": 90.0}, "1": {"gauge_length": 80.0}},
                                      "tool_numbers": {"D10 R1": 1}})
    path = toolpath(head=[*SEVERAL, "CUTTER/4,0", *CUT])
    hint = errors(convert(path, "mill-3axis", setup=setup))[0].hint
    assert hint.split("\n") == ["add under [tool_numbers] of the set-up:", '"D6 R3" = 7', '"D4" = 2']


@pytest.mark.parametrize("name", ["fork-head-ab", "head-table", "mikron-ucp710", "uranesx"])
def test_the_same_on_every_kind_of_machine(name: str) -> None:
    found = errors(convert(toolpath(head=NOTHING), name, "generic-iso", SetupFile()))
    assert "tool.number" in {d.code for d in found} and "verify.not_reached" not in {d.code for d in found}


def test_rapids_before_the_first_load_are_made_with_its_tool() -> None:
    result = good(convert(toolpath(head=["UNITS/MM", "RAPID", "GOTO/5,5,50", "LOADTL/1", *SPINDLE, *CUT]), "mill-3axis"))
    lines = result.text.splitlines()
    assert lines.index("T1 M6") < lines.index("G43 H1") < lines.index("G0 X5 Y5")


def test_a_number_without_a_load_is_loaded() -> None:
    """CATIA may describe a tool by TOOLNO and load none."""
    result = good(convert(toolpath(head=["UNITS/MM", "TOOLNO/1,MILL,10,0,75", *SPINDLE, *CUT]), "mill-3axis"))
    assert "T1 M6" in result.text.splitlines() and "tool.loaded" in {d.code for d in result.diagnostics}


# ---- measured into the work offset -------------------------------------------------------------------------


MEASURED = "[output]\ntool_call = false\n[part]\norigin = [20.0, -15.0, 10.0]\n"
LENGTH = "[tools.0]\ngauge_length = 100\n"
CALLS = re.compile(r"(?:^|\s)(T\d|G43|H\d|TOOL CALL|D[1-9]|M0?6\b)", re.MULTILINE)


@pytest.mark.parametrize(("controller", "name"), [
    (c, ("mill-3axis", "mikron-ucp710")[k % 2]) for k, c in enumerate(CONTROLLERS) if c != "heidenhain-tnc640"])
def test_a_measured_tool_is_not_called(name: str, controller: str, tmp_path: Path) -> None:
    path, setup = toolpath(head=NOTHING), setup_of(MEASURED + LENGTH, tmp_path)
    result = good(convert(path, name, controller, setup))
    blocks = re.sub(r"\(.*?\)|;.*", "", result.text)
    assert not CALLS.search(blocks) and ("D0" in blocks if controller == "siemens-840d" else "G49" in blocks)
    assert result.job is not None and result.job.control.work_offset[2] == 110.0 and result.extents is not None
    assert result.extents["Z"][0] == pytest.approx(110.0), "the spindle stands a tool's length over the tip"
    head = result.text.lower()
    assert "measured into the work offset" in head and "holds its gauge length 100.0000 mm" in head
    assert "work offset" in head and "z110.0000" in head
    (tmp_path / "p.nc").write_text(result.text)
    assert postproc.verify(tmp_path / "p.nc", path, machine(name), controller, setup=setup).ok
    called = setup_of(MEASURED.replace("[output]\ntool_call = false", "[tool_numbers]\nunnamed = 1")
                      + LENGTH.replace("0", "1", 1), tmp_path)
    other = postproc.verify(tmp_path / "p.nc", path, machine(name), controller, setup=called)
    assert "verify.state" in {d.code for d in other.diagnostics}, "a program without tool call and length is no other"


@pytest.mark.parametrize(("number", "low", "touches"),
                         [("0", 30.0, False), ("0", 8.0, True), ("3", 8.0, True)])
def test_its_form_is_compared_with_part_and_fixtures(number: str, low: float, touches: bool,
                                                     tmp_path: Path) -> None:
    """A holder of diameter 60 from 20 mm over the tip on, 10 mm from a clamp 3 mm beyond the end of the cut."""
    text = MEASURED.split("[part]")[0] + f"""[tools.{number}]
gauge_length = 100
diameter = 10
corner_radius = 0
flute_length = {low}
holder = [{{diameter = 60, length = {100 - low}}}]
[[bodies.fixtures]]
name = "clamp"
box = {{ low = [33, -40, -20], high = [60, 40, 25] }}
[bodies]
"""
    head = NOTHING if number == "0" else ["UNITS/MM", f"LOADTL/{number}", *NOTHING[1:]]
    result = convert(toolpath(head=head), "mill-3axis", setup=setup_of(text, tmp_path))
    found = [d for d in errors(result) if d.code.startswith("collision.")]
    assert bool(found) is touches, [str(d) for d in result.diagnostics]


def test_its_travel_is_checked_with_its_length(tmp_path: Path) -> None:
    """Z of mill-3axis ends at 400: a tool of 380 mm cannot go to z = 60, one of 100 can."""
    path = toolpath(head=["UNITS/MM", *SPINDLE, "RAPID", "GOTO/0,0,60", "GOTO/0,0,55", "GOTO/10,0,55"])
    for length, ok in ((100, True), (380, False)):
        text = f"[output]\ntool_call = false\n[tools.0]\ngauge_length = {length}\n[clearance]\nmargin = 10\n"
        result = convert(path, "mill-3axis", setup=setup_of(text, tmp_path))
        assert result.ok is ok and ("travel" in {d.code.split(".")[0] for d in errors(result)}) is not ok


def test_without_its_length_the_header_asks_for_it(tmp_path: Path) -> None:
    result = good(convert(toolpath(head=NOTHING), "mill-3axis", setup=setup_of(MEASURED, tmp_path)))
    assert "its length must be added to Z of the work offset" in result.text
    assert any(d.code == "tool.length" and "[tools.0] gauge_length" in d.hint for d in result.diagnostics)


@pytest.mark.parametrize(("name", "controller", "head", "more", "why"), [
    ("fork-head-ab", "generic-iso", NOTHING, "", "other directions"),
    ("uranesx", "generic-iso", NOTHING, "", "other directions"),
    ("linuxcnc-xyzac-trt", "linuxcnc", NOTHING, "", "needs the length"),
    ("mill-3axis", "heidenhain-tnc640", NOTHING, "", "by itself"),
    ("mill-3axis", "linuxcnc", SEVERAL, "", "several tools"),
])
def test_where_it_cannot_be_right_it_is_refused(name: str, controller: str, head: list[str], more: str, why: str,
                                                tmp_path: Path) -> None:
    axes = [f"{line},0.6,0,0.8" if name == "fork-head-ab" and line.startswith("GOTO") else line for line in head]
    result = convert(toolpath(head=axes), name, controller, setup_of(MEASURED + LENGTH + more, tmp_path))
    found = [d for d in errors(result) if d.code == "tool.measured"]
    assert len(found) == 1 and why in found[0].message and found[0].hint and not result.text


@pytest.mark.parametrize(("one", "other"), [
    (["TPRINT/EM", "TLDATA/MILL,20,0,75,0,0"], ["TPRINT/EM", "TLDATA/MILL,6,0,75,0,0"]),
    (["TPRINT/EM", "TLDATA/MILL,20,0,75,0,0"], ["TPRINT/EM", "TLDATA/MILL,20,0,60,0,0"]),
    (["CUTTER/10,0,5,0,0,0,38"], ["CUTTER/10,0,5,0,0,0,90"])])
def test_two_tools_of_one_name_are_not_measured_as_one(one: list[str], other: list[str],
                                                       tmp_path: Path) -> None:
    """Other diameters, lengths and heights: both tools are named by their first lines; the same form again is one tool."""
    of = setup_of(MEASURED + LENGTH, tmp_path)
    begin = ["UNITS/MM", *SPINDLE, *one, *CUT]
    found = errors(convert(toolpath(head=[*begin, *other, *CUT]), "mill-3axis", setup=of))
    second = len(begin) + len(other)
    assert [d.code for d in found] == ["tool.measured"] and "two tools" in found[0].message
    assert found[0].lines == (len(begin) - len(CUT) + 2, second + 2)
    again = convert(toolpath(head=[*begin, *one, *CUT]), "mill-3axis", setup=of)
    assert "tool.measured" not in {d.code for d in errors(again)}


@pytest.mark.parametrize("mode", ["tcp", "tilted"])
def test_modes_that_need_the_length_cannot_be_had(mode: str, tmp_path: Path) -> None:
    path, setup = toolpath(head=NOTHING), setup_of(MEASURED + LENGTH, tmp_path)
    found = errors(convert(path, "mikron-ucp710", "fanuc-30i", setup, output=mode))
    assert [d.code for d in found] == ["output.mode"] and "tool_call = false" in found[0].message


# ---- the length state in the read-back ---------------------------------------------------------------------

TWO = toolpath("LOADTL/1", *SPINDLE, *CUT, "LOADTL/2", *CUT, head=["UNITS/MM"])
LENGTHS = {"different": {"tools": {"1": {"gauge_length": 100.0}, "2": {"gauge_length": 130.0}}}, "not stated": {}}


@pytest.mark.covering
@pytest.mark.parametrize("lengths", LENGTHS)
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_program_without_the_length_or_with_another_one_fails(controller: str, lengths: str,
                                                                tmp_path: Path) -> None:
    """On a table machine, whose words are the same for every length: each block that puts one in force, lost and changed."""
    setup = SetupFile.model_validate(LENGTHS[lengths])
    lines = good(convert(TWO, "mikron-ucp710", controller, setup, output="axes")).text.splitlines()
    pattern = {"siemens-840d": r"\bD1 ?", "heidenhain-tnc640": r"TOOL CALL [12] Z.*"}.get(controller, r"G43 H[12] ?")
    places = [k for k, line in enumerate(lines) if re.search(pattern, line) and not line.startswith((";", "("))]
    assert len(places) == 2
    for k in places:
        edits = [re.sub(pattern, "", lines[k])]
        if controller == "heidenhain-tnc640":
            edits = [re.sub(r"TOOL CALL (\d)", lambda m: f"TOOL CALL {3 - int(m[1])}", lines[k])]
        elif controller != "siemens-840d":
            edits.append(re.sub(r"H(\d)", lambda m: f"H{3 - int(m[1])}", lines[k]))
        for edit in edits:
            (tmp_path / "p.nc").write_text("\n".join([*lines[:k], edit, *lines[k + 1:], ""]))
            found = postproc.verify(tmp_path / "p.nc", TWO, machine("mikron-ucp710"), controller, setup=setup,
                                    options=postproc.Options(output="axes"))
            assert not found.ok and {"verify.state", "verify.tool"} & {d.code for d in found.diagnostics}, edit


# ---- inspect -----------------------------------------------------------------------------------------------


def test_inspect_shows_which_tools_lack_a_number_or_a_spindle(tmp_path: Path) -> None:
    file = tmp_path / "part.apt"
    file.write_text("\n".join([*NAMED, "FINI"]))
    shown = json.loads(CliRunner().invoke(app, ["inspect", str(file), "--json", "-"]).stdout)
    assert shown["tools_without_number"] == ["EM10"] and shown["tools_without_spindle"] == []
    file.write_text("\n".join([*[n for n in NOTHING if "SPINDL" not in n], "FINI"]))
    shown = json.loads(CliRunner().invoke(app, ["inspect", str(file), "--json", "-"]).stdout)
    assert shown["tools_without_number"] == shown["tools_without_spindle"] == ["unnamed"]
    text = CliRunner().invoke(app, ["inspect", str(file)]).stdout
    assert "without a number" in text and "without a spindle record" in text


def test_samples_lack_neither() -> None:
    from tests.postproc.kit import SAMPLES
    from toolpaths.cl.inspect import tools_lacking

    files = [p for p in SAMPLES.rglob("*") if p.suffix in (".cls", ".apt", ".ncl", ".as", ".aptsource", ".clt")]
    lacking = {p.name: names for p in files for names in tools_lacking(toolpaths.read(p)[0]).values() if names}
    assert len(files) > 25 and lacking == {}
