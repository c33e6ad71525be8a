"""STOP and OPSTOP: spindle and coolant run again before the tool cuts on, on every control, and the read-back knows it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import machines
import postproc
from machines.loader import load_checked
from postproc.setup.model import SetupFile
from tests.postproc.kit import convert, good, machine, shop_file, toolpath
from toolpaths.toolpath import Toolpath

CONTROLLERS = ("linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc")
HEAD = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,30",
        "GOTO/0,0,0"]
AWAY = ["RAPID", "GOTO/20,0,30"]
OFF_AXIS = SetupFile.model_validate({"part": {"origin": (20.0, -15.0, 10.0)}, "clearance": {"distance": 60.0},
                                     "tools": {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 85.0}}})
CASES = {
    "in a cut": ["STOP", "GOTO/20,0,0"],
    "optional": ["OPSTOP", "GOTO/20,0,0"],
    "several": ["STOP", "OPSTOP", "STOP", "GOTO/10,0,0", "OPSTOP", "GOTO/20,0,0"],
    "right before a tool change": [*AWAY, "STOP", "LOADTL/2", "RAPID", "GOTO/0,0,30", "GOTO/0,0,1"],
    "right behind a tool change": [*AWAY, "LOADTL/2", "STOP", "RAPID", "GOTO/0,0,30", "GOTO/0,0,1"],
    "in a cycle": ["GOTO/20,0,0", *AWAY, "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/30,0,0", "STOP", "GOTO/40,0,0",
                   "CYCLE/OFF"],
    "behind the last cut": ["GOTO/20,0,0", *AWAY, "STOP"],
    "spindle off before it": ["GOTO/20,0,0", *AWAY, "SPINDL/OFF", "COOLNT/OFF", "STOP", "RAPID", "GOTO/0,0,30"],
    "spindle changed behind it": ["STOP", "SPINDL/RPM,2000,CCLW", "COOLNT/MIST", "GOTO/20,0,0"],
    "spindle stopped and started behind it": ["STOP", "SPINDL/OFF", "SPINDL/RPM,1000,CLW", "GOTO/20,0,0"],
    "switched off behind it": ["GOTO/20,0,0", *AWAY, "STOP", "COOLNT/OFF", "SPINDL/OFF", "RAPID", "GOTO/0,0,30"],
    "drawn out of a bore with the spindle standing": ["SPINDL/OFF", "STOP", "GOTO/10,0,20"],
    "among blocks that a switch leaves out": ["OPSKIP/ON", "GOTO/5,0,0", "STOP", "GOTO/10,0,0", "OPSKIP/OFF", "GOTO/20,0,0"],
    "at the end of blocks that a switch leaves out": ["OPSKIP/ON", "GOTO/5,0,0", "STOP", "OPSKIP/OFF", "GOTO/20,0,0"],
}
PLACES = {"uranesx": (0.0, 0.0, -270.0)}
CUT = re.compile(r"(?:^|\s)(G0?[123]|G8[1-9]|G7[34]|MCALL CYCLE8\d|CP? |M99)(?![\d.])")
RAPID = re.compile(r"(?:^|\s)G0?0(?![\d.])")


def path_of(case: str) -> Toolpath:
    return toolpath("GOTO/10,0,0", *CASES[case], head=HEAD)


def standing_cuts(text: str, stops: bool = True, switch: bool = False) -> list[str]:
    """Blocks that cut while the spindle stands, by a walk of its own through the words; stops stop it where
    `stops`, blocks with / are left out where `switch` is on."""
    turning, cutting, found = False, False, []
    for raw in text.splitlines():
        block = re.sub(r"\(.*?\)|;.*|^\s*%.*", "", raw).strip()
        skipped, block = block.startswith("/"), re.sub(r"^/?\s*(N?\d+)?\s*(?=\D)|^/", "", block)
        if not block or (skipped and switch):
            continue
        if RAPID.search(block) or "FMAX" in block or block.startswith(("MCALL", "G80")):
            cutting = "CYCLE" in block
        elif CUT.search(block) or (block.startswith("L ") and "FMAX" not in block):
            cutting = True
        if re.search(r"M6\b|TOOL CALL \d", block):
            turning = False
        if re.search(r"(?<!\w)M[34]\b", block):
            turning = True
        if re.search(r"(?<!\w)M5\b", block):
            turning = False
        if cutting and not turning and re.search(r"[XYZ][-+.\d]", block) and not re.fullmatch(r"(G1 |L )?Z[+\d.]+.*", block):
            found.append(raw)
        if block.startswith("L "):
            cutting = False
        if stops and re.search(r"(?<!\w)M[01]\b", block):
            turning = False
    return found


KINDS = (*CONTROLLERS[3:5], CONTROLLERS[0]), (*CONTROLLERS[3:5], CONTROLLERS[2]), (*CONTROLLERS[3:5], CONTROLLERS[5]), \
    (*CONTROLLERS[3:5], CONTROLLERS[1])
"""each kind of control: its own words, and in turn one of those with the same"""


@pytest.mark.covering
@pytest.mark.parametrize(("case", "controller"),
                         [(case, name) for k, case in enumerate(CASES) for name in KINDS[k % 4]])
def test_nothing_is_cut_with_a_standing_spindle(case: str, controller: str) -> None:
    text = good(convert(path_of(case), "mikron-ucp710", controller, OFF_AXIS)).text
    for stops in (True, False):
        for switch in (True, False):
            assert not standing_cuts(text, stops, switch)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_nor_in_programs_that_can_be_taken_up(controller: str) -> None:
    for kind in ("restart", *(("subprograms",) if controller not in CONTROLLERS[:2] else ())):
        setup = OFF_AXIS.model_copy(update={"output": OFF_AXIS.output.model_copy(update={kind: True})})
        result = good(convert(path_of("in a cut"), "mikron-ucp710", controller, setup))
        for text in (result.text, *(result.files or {}).values()):
            stop = re.search(r"\bM0\n(.*\n.*\n)", text)
            assert stop is None or (re.search(r"\bM3\b", stop[1]) and re.search(r"\bM8\b", stop[1]))
        assert any(re.search(r"\bM0\b", text) for text in (result.text, *(result.files or {}).values()))


@pytest.mark.parametrize(("name", "controller"), [
    ("fork-head-ab", "heidenhain-tnc640"), ("head-table", "siemens-840d"), ("mill-4axis", "haas-ngc"),
    ("uranesx", "generic-iso"), ("linuxcnc-xyzac-trt", "linuxcnc")])
def test_nor_on_other_machines(name: str, controller: str) -> None:
    path = toolpath("GOTO/10,0,0", *CASES["several"], head=HEAD)
    place = PLACES.get(name, (0.0, 0.0, 0.0))
    setup = OFF_AXIS.model_copy(update={"part": OFF_AXIS.part.model_copy(update={"origin": place}),
                                        "clearance": OFF_AXIS.clearance.model_copy(update={"distance": 40.0})})
    result = convert(path, name, controller, setup)
    assert not standing_cuts(good(result).text)


def test_what_a_stop_that_cuts_nothing_more_leaves_off() -> None:
    """No spindle for nothing: before another stop, a tool change, the end, or where the file has switched it off."""
    def behind(case: str) -> list[str]:
        lines = good(convert(path_of(case), "mill-3axis", "fanuc-30i", OFF_AXIS)).text.splitlines()
        return [b for b in lines[max(k for k, b in enumerate(lines) if b in ("M0", "M1")):] if re.search(r"M[348]\b", b)]
    assert behind("behind the last cut") == behind("spindle off before it") == []
    assert behind("right before a tool change") == ["S1000 M3", "M8"]
    several = good(convert(path_of("several"), "mill-3axis", "fanuc-30i", OFF_AXIS)).text.splitlines()
    at = several.index("M0")
    assert several[at:at + 5] == ["M0", "M1", "M0", "S1000 M3", "M8"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stops")


def stopping(folder: Path, what: str) -> machines.machine.Machine:
    """mill-3axis whose file says what a stop switches off."""
    file = folder / f"mill-{what.replace(' ', '-')}.toml"
    file.write_text(f'base = "mill-3axis"\n[control]\nstop = "{what}"\n')
    return machines.load(file)


def verified(folder: Path, text: str, mill: machines.machine.Machine, controller: str | Path) -> list[str]:
    program = folder / "program.nc"
    program.write_text(text)
    found = postproc.verify(program, path_of("in a cut"), mill, controller, setup=OFF_AXIS).diagnostics
    return [d.message.split(",")[0] for d in found if d.code.startswith("verify.")]


SPINDLE, COOLANT = "spindle is stopped (M5)", "coolant is off"


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_read_back_stops_where_the_control_does(controller: str, folder: Path) -> None:
    """A program without the restated blocks, on machines whose stops switch off both, the spindle alone, or nothing."""
    mill = machine("mill-3axis")
    lines = good(convert(path_of("in a cut"), "mill-3axis", controller, OFF_AXIS)).text.splitlines(keepends=True)
    at = next(k for k, b in enumerate(lines) if re.search(r"\bM0\b", b))
    assert re.search(r"\bM3\b", lines[at + 1]) and re.search(r"\bM8\b", lines[at + 2])
    text = "".join(lines[:at + 1] + lines[at + 3:])
    assert verified(folder, "".join(lines), mill, controller) == []
    assert verified(folder, text, stopping(folder, "spindle and coolant"), controller) == [SPINDLE, COOLANT]
    assert verified(folder, text, stopping(folder, "spindle"), controller) == [SPINDLE]
    assert verified(folder, text, stopping(folder, "nothing"), controller) == []
    by_default = [] if controller == "linuxcnc" else [SPINDLE, COOLANT]
    assert verified(folder, text, mill, controller) == by_default
    optional = re.sub(r"\bM0\b", "M1", text)
    assert [m for m in verified(folder, optional, mill, controller) if "times" not in m] == by_default


def test_a_controller_file_says_what_its_stops_switch_off(folder: Path) -> None:
    lines = good(convert(path_of("in a cut"), "mill-3axis", "fanuc-30i", OFF_AXIS)).text
    text = lines.replace("M0\nS1000 M3\nM8\n", "M0\n")
    assert text != lines
    spec = shop_file(folder, '[stops]\nswitch_off = "nothing"\n', "fanuc-30i")
    assert verified(folder, text, machine("mill-3axis"), spec) == []


def test_a_stop_in_a_block_that_moves_acts_at_its_end(folder: Path) -> None:
    lines = good(convert(path_of("in a cut"), "mill-3axis", "haas-ngc", OFF_AXIS)).text
    joined = re.sub(r"(\nG1 [^\n]*|\nX10\.)\nM0\n", r"\1 M0\n", lines)
    assert joined != lines and verified(folder, joined, machine("mill-3axis"), "haas-ngc") == []


def test_a_key_of_the_machine_that_is_no_answer_is_refused(folder: Path) -> None:
    file = folder / "bad.toml"
    file.write_text('base = "mill-3axis"\n[control]\nstop = "everything"\n')
    _, found = load_checked(file)
    assert len(found) == 1 and "spindle and coolant" in found[0].message and found[0].lines == (3,)
