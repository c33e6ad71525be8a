"""Blocks of the shop round tool calls, indexing moves, operations and stops: written, read back as what they
are, refused where they would change what the proof stands on."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import machines
import postproc
from machines.hooks import HooksModel
from machines.machine import Machine
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.setup.model import OutputSettings, SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.control.test_clamps import CONTROLS, SETUP, clamping, indexed, point
from tests.postproc.kit import codes, tilted, toolpath
from toolpaths.diagnostics import DiagnosticError, Severity
from toolpaths.toolpath import Toolpath

PLACES = ("tool", "index", "operation", "stop")
OWN = {"fanuc-30i": ("G65 P9{:03d} T{{tool_number}}", "G65"), "haas-ngc": ("M{}", ""), "linuxcnc": ("M{} P1 Q2", ""),
       "generic-iso": ("M{} P{{tool_number}}", ""),
       "siemens-840d": ('CYCLE{}("{{operation}}",{{tool_number}},"{{tool_name}}")', ""),
       "heidenhain-tnc640": ("TCH PROBE {} {{work_offset}} Q1=+{{tool_number}}", "TCH PROBE")}
"""a block of each control by a number, and its passive word where that is not the block's first"""


def hooks_of(controller: str) -> HooksModel:
    """A block of its own at each place."""
    text, word = OWN[controller]
    blocks = {f"{when}_{place}": (text.format(101 + 10 * k + j),)
              for k, place in enumerate(PLACES) for j, when in enumerate(("before", "after"))}
    passive = (word,) if word else tuple(dict.fromkeys(re.split(r"[ (]", b)[0] for (b,) in blocks.values()))
    return HooksModel(**blocks, passive=passive)


@cache
def work() -> Toolpath:
    """Two operations with a stop between them, tools of their own, sides of their own."""
    lines = ["UNITS/MM"]
    for k, angle in ((1, 77.0), (2, -50.0)):
        axis = tilted(40.0, angle)
        lines += [f"TOOL PATH/OP{k},TOOL,T{k}", "MSYS/0,0,0,1,0,0,0,1,0", f"LOAD/TOOL,{k}", "SPINDL/RPM,1000,CLW",
                  "COOLNT/FLOOD", "RAPID", point(45 * axis, axis), "FEDRAT/MMPM,500", point(30 * axis, axis), "RAPID",
                  point(45 * axis, axis), *(["OPSTOP"] if k == 1 else []), "FEDRAT/MMPM,300", point(31 * axis, axis),
                  "RAPID", point(45 * axis, axis), "END-OF-PATH"]
    return toolpath(*lines, head=[])


@cache
def machine_of(controller: str) -> Machine:
    return replace(clamping(), hooks=hooks_of(controller))


@cache
def converted(controller: str, output: str = "auto") -> PostResult:
    options = Options(output=output)
    return postproc.convert(work(), machine_of(controller), controller, SETUP, options)


def own_blocks(controller: str, text: str) -> list[tuple[int, str]]:
    """(line, number) of the blocks of the shop."""
    head = {"fanuc-30i": r"G65 P9", "siemens-840d": "CYCLE", "heidenhain-tnc640": "TCH PROBE "}.get(controller, "M")
    return [(n, m[1]) for n, line in enumerate(text.splitlines())
            if (m := re.match(rf"(?:N?\d+ )?{head}(1[0-3][1-2])\b", line))]


def verdict(result: PostResult, text: str) -> set[str]:
    assert result.job is not None
    return {d.code for d in read_back(text, result.job, "test.apt", gcode="edited.nc")[1] if d.severity is Severity.ERROR}


@pytest.mark.parametrize("controller", CONTROLS)
def test_each_block_stands_at_its_place_with_its_values(controller: str) -> None:
    result = converted(controller)
    assert result.ok, [str(d) for d in result.diagnostics]
    order = [number for _, number in own_blocks(controller, result.text)]
    tool, index, stop = ["101", "102"], ["111", "112"], ["131", "132"]
    assert order[0] == "121" and order[-1] == "122" and order.count("121") == order.count("122") == 2
    for pair, count in ((tool, 2), (stop, 1)):
        assert [n for n in order if n in pair] == pair * count
    both = [n for n in order if n in index]
    assert both == index * (len(both) // 2) and len(both) >= 6
    text = "\n".join(line for line in result.text.splitlines() if "10" in line)
    if controller in ("siemens-840d", "fanuc-30i"):
        assert re.search(r'CYCLE101\("OP2",2,"T2"\)|G65 P9101 T2\b', text)
    if controller == "fanuc-30i":
        assert [m[1] for m in re.finditer(r"G65 P9121 T(\d)", result.text)] == ["1", "2"]
    if controller == "heidenhain-tnc640":
        assert "TCH PROBE 101 datum number 1 Q1=+2" in text


@pytest.mark.covering
@pytest.mark.parametrize("third", range(3))
@pytest.mark.parametrize("controller", CONTROLS)
def test_each_block_that_is_left_out_is_caught(controller: str, third: int) -> None:
    """Every third block of a control, from another one on for each."""
    result = converted(controller)
    lines = result.text.splitlines()
    for n, number in own_blocks(controller, result.text)[third::3]:
        assert "verify.hook" in verdict(result, "\n".join(lines[:n] + lines[n + 1:]) + "\n"), number


VALUES = {"tool_number": "G65 P{} A{{tool_number:02d}}", "tool_name": "G65 P{} ({{tool_name}})",
          "operation": "G65 P{} ({{operation}})", "work_offset": "G65 P{} W{{work_offset:02d}}"}
OTHER = {"tool_number": ("A01", "A02"), "tool_name": ("(T1)", "(T2)"), "operation": ("(OP1)", "(OP2)"),
         "work_offset": ("W54", "W55")}


@pytest.mark.parametrize("value", VALUES)
def test_each_value_that_is_another_is_caught(value: str) -> None:
    """A call that measures a tool, or sets an offset, with the number of another one."""
    blocks = {f"{when}_{place}": (VALUES[value].format(9010 + 10 * k + j),)
              for k, place in enumerate(PLACES) for j, when in enumerate(("before", "after"))}
    result = postproc.convert(work(), replace(clamping(), hooks=HooksModel(**blocks, passive=("G65",))), "fanuc-30i", SETUP,
                              Options(output="axes"))
    assert result.ok and not verdict(result, result.text)
    lines, (one, other) = result.text.splitlines(), OTHER[value]
    # between two operations a block may name either
    places = [n for n, line in enumerate(lines) if line.startswith("G65") and one in line
              and (value != "operation" or n < lines.index("M1") or "P903" in line)]
    assert len(places) >= 5
    for n in places[::3]:
        changed = [*lines[:n], lines[n].replace(one, other), *lines[n + 1:]]
        assert "verify.hook" in verdict(result, "\n".join(changed) + "\n"), lines[n]


@pytest.mark.parametrize("controller", CONTROLS)
def test_modal_codes_are_stated_again_behind_them(controller: str) -> None:
    """A macro may leave another code of motion: the next block that moves states its own."""
    result = converted(controller, "axes")
    lines = [line for line in result.text.splitlines() if not re.match(r"(\d+ )?[(;]", line)]
    text = "\n".join(lines)
    for n, _ in own_blocks(controller, text):
        after = next((line for line in lines[n + 1:] if re.search(r"(?<![A-Z])[XYZAC][-+=]?[\dD]", line)), "G0")
        assert re.search(r"G0|G1|\bL ", after), after


def test_blocks_of_the_set_up_take_the_place_of_the_machines() -> None:
    setup = SETUP.model_copy(update={"hooks": HooksModel(before_tool=("(TOOL {tool_number} IS COMING)",))})
    result = postproc.convert(work(), machine_of("fanuc-30i"), "fanuc-30i", setup, Options())
    assert result.ok and "(TOOL 2 IS COMING)" in result.text and "P9101" not in result.text and "P9102" in result.text


@pytest.mark.parametrize(("controller", "block", "passive", "code"), [
    ("fanuc-30i", "G91 G28 Z0.", (), "hooks.code"), ("fanuc-30i", "M8", (), "hooks.code"),
    ("fanuc-30i", "M31", (), "hooks.code"), ("fanuc-30i", "M31 G91", ("M31",), "hooks.code"),
    ("fanuc-30i", "M31 X10.", ("M31",), "hooks.code"), ("fanuc-30i", "G91", ("G91",), "hooks.passive"),
    ("fanuc-30i", "M10", (), "hooks.code"), ("fanuc-30i", "M3", ("M3",), "hooks.passive"),
    ("siemens-840d", "TRAFOOF", (), "hooks.code"), ("siemens-840d", "CYCLE977(1)", (), "hooks.code"),
    ("siemens-840d", "R1=5", (), "hooks.code"), ("heidenhain-tnc640", "L Z+0 R0 FMAX M91", (), "hooks.code"),
    ("heidenhain-tnc640", "TCH PROBE 412", (), "hooks.code"), ("heidenhain-tnc640", "M13", ("M13",), "hooks.passive")])
def test_what_moves_or_changes_a_state_is_refused(controller: str, block: str, passive: tuple[str, ...],
                                                  code: str) -> None:
    machine = replace(clamping(), hooks=HooksModel(before_index=(block,), passive=passive))
    result = postproc.convert(work(), machine, controller, SETUP, Options(output="axes"))
    assert result.text == "" and code in codes(result.diagnostics)
    assert all(d.hint for d in result.diagnostics if d.severity is Severity.ERROR)


def test_a_fault_of_hooks_and_passive_codes_names_its_file_and_line(tmp_path: Path) -> None:
    """A code among those of the controller file had neither."""
    (own := tmp_path / "own.toml").write_text('base = "fanuc-30i"\n[program]\npassive = [\n"M31",\n"G91"]\n')
    (setup := tmp_path / "s.toml").write_text('[hooks]\npassive = ["M3"]\nbefore_tool = [\n"(A)",\n"M8"]\n')
    result = postproc.convert(work(), "mill-3axis", own, setup)
    found = [(Path(d.file).name, d.lines) for d in result.diagnostics if d.code in ("hooks.passive", "hooks.code")]
    assert found == [("own.toml", (5,)), ("s.toml", (2,)), ("s.toml", (5,))], found


@pytest.mark.parametrize(("controller", "block", "passive"), [
    ("fanuc-30i", "M31", ("M31",)), ("fanuc-30i", "M19 P90", ("M19",)), ("fanuc-30i", "(NOTE)", ()),
    ("siemens-840d", "CYCLE977(1)", ("CYCLE977",)), ("siemens-840d", 'MSG("HELLO")', ()),
    ("siemens-840d", "L9000 P2", ("L9000",)), ("heidenhain-tnc640", "TCH PROBE 412", ("TCH PROBE",)),
    ("heidenhain-tnc640", "TCH PROBE 412", ("TCH PROBE 412",))])
def test_the_hint_followed_passes(controller: str, block: str, passive: tuple[str, ...]) -> None:
    machine = replace(clamping(), hooks=HooksModel(before_index=(block,), passive=passive))
    result = postproc.convert(work(), machine, controller, SETUP, Options(output="axes"))
    assert result.ok and block in result.text, [str(d) for d in result.diagnostics]


def test_a_passive_code_hides_no_other_word_of_its_block() -> None:
    """A block with a passive code was once left out as a whole, its motion too."""
    machine = replace(clamping(), hooks=HooksModel(passive=("M31", "G65")))
    result = postproc.convert(work(), machine, "fanuc-30i", SETUP, Options(output="axes"))
    assert result.ok and not verdict(result, result.text.replace("M30", "M31\nM30"))
    for moved in ("M31 G0 X1.", "G0 X1. M31", "G0 X1. G65 P9"):
        assert verdict(result, re.sub(r"(?m)^(G1 .*)$", rf"{moved}\n\1", result.text, count=1)), moved


# ---- stops between tools -----------------------------------------------------------------------------------

def stopping(path: Toolpath, controller: str, on: bool = True) -> PostResult:
    setup = SETUP.model_copy(update={"output": OutputSettings(stop_between_tools=on)})
    return postproc.convert(path, machines.load("mikron-ucp710"), controller, setup, Options(output="axes"))


@pytest.mark.parametrize("controller", CONTROLS)
def test_an_optional_stop_between_tools_with_all_stated_behind_it(controller: str) -> None:
    result, without = stopping(indexed(), controller), stopping(indexed(), controller, False)
    assert result.ok and without.ok, [str(d) for d in result.diagnostics]
    stop = re.compile(r"(?m)^(?:N?\d+ )?M0?1$")
    assert len(stop.findall(result.text)) == 1 and not stop.findall(without.text)
    before, after = stop.split(result.text)
    assert re.search(r"M5\b", before.splitlines()[-1]) and re.search(r"M6|TOOL CALL 2", after) and re.search(r"M3\b", after)
    left = stop.sub("", result.text)
    assert "verify.stop" in verdict(result, left if controller != "heidenhain-tnc640" else left.replace("\n\n", "\n"))


def test_where_the_file_stops_there_itself_no_second_stop_is_written() -> None:
    path = toolpath("RAPID", "GOTO/0,0,40", "GOTO/0,0,30", "OPSTOP", "LOADTL/2", "RAPID", "GOTO/0,0,40",
                    "GOTO/0,0,20")
    result = stopping(path, "fanuc-30i")
    assert result.ok and len(re.findall(r"(?m)^M1$", result.text)) == 1


def test_keys_of_a_machine_file(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text('base = "mikron-ucp710"\n[hooks]\nbefore_tool = ["M31"]\npassive = ["M31"]\n')
    assert machines.load(file).hooks.places == {"before_tool": ("M31",)}
    for wrong in ('before_tool = ["M31 {tool}"]', 'before_tool = ["M31\\nM32"]', 'passive = ["x"]'):
        file.write_text(f'base = "mikron-ucp710"\n[hooks]\n{wrong}\n')
        with pytest.raises(DiagnosticError):
            machines.load(file)
    assert SetupFile(hooks=HooksModel(after_stop=("M31",))).hooks.after_stop == ("M31",)
