"""Programs as a machinist wants them: restart points, files, block numbers, headers, own retract levels, clean ends."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import toolpaths
from postproc.cli.app import app
from postproc.controllers.model import load_controller
from postproc.pipeline.result import PostResult
from postproc.report.summary import as_dict, as_text
from postproc.setup.model import SetupFile
from tests.postproc.kit import convert, good, tool_setup, toolpath
from tests.postproc.program_kit import command, lines, program, step

GOLDEN = Path(__file__).parents[2] / "golden"
CONTROLLERS = ("fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
MACHINE = {"haas-ngc": "trunnion-bc"}
OWN_OFFSET = {"fanuc-30i": "G59", "haas-ngc": "G59", "siemens-840d": "G506", "heidenhain-tnc640": "datum number 6"}


def setup(code: str = "G54", **output: object) -> SetupFile:
    usual = tool_setup()
    return usual.model_copy(update={"work_offset_code": code, "output": usual.output.model_copy(update=output)})


def three_laws(controller: str, made: SetupFile) -> PostResult:
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls")
    return good(convert(path, MACHINE.get(controller, "mikron-ucp710"), controller, setup=made))


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", [*CONTROLLERS, "linuxcnc"])
def test_every_restart_point_states_offset_units_and_smoothing(controller: str) -> None:
    spec, _ = load_controller(controller)
    assert spec is not None
    offset = spec.program.work_offsets.get("G55", "G55").split("\n")
    smoothing = spec.program.path_tolerance[0].split("(")[0].split(" P")[0].split(" E")[0]
    safe = [] if "{" in spec.program.preamble[0] else [spec.program.preamble[0]]
    texts = [three_laws(controller, setup("G55", restart=restart)).text for restart in (True, False)]
    for wanted in (*offset, smoothing, *safe):
        stated = [sum(re.sub(r"^N?\d+ ", "", line).startswith(wanted) for line in text.splitlines()) for text in texts]
        assert stated[0] == stated[1] + 2, wanted


def command_line(folder: Path, name: str, source: str, controller: str, keys: str) -> object:
    made = folder.parent / "s.toml"
    made.write_text((GOLDEN.parents[1] / "samples/tools.setup.toml").read_text() + f"\n[output]\n{keys}\n")
    return CliRunner().invoke(app, ["convert", source, "-m", "mikron-ucp710", "-c", controller, "-o", str(folder / name),
                                    "--setup", str(made), "--json", str(folder.parent / "s.json")])


@pytest.mark.parametrize(("controller", "file", "keys"), [
    ("siemens-840d", "{name}_1001.SPF", "subprograms = true"), ("heidenhain-tnc640", "{name}_1001.H", "files = true")])
def test_files_bear_the_name_of_the_output(tmp_path: Path, controller: str, file: str, keys: str) -> None:
    source, out = str(GOLDEN / "three_laws.cls"), tmp_path / "out"
    for name in ("left.nc", "right.nc"):
        done = command_line(out, name, source, controller, keys)
        assert done.exit_code == 0 and "file.replaced" not in done.output, done.output
    assert {file.format(name=name) for name in ("LEFT", "RIGHT")} <= {p.name for p in out.iterdir()}
    figures = json.loads((tmp_path / "s.json").read_text())
    assert figures["files"][0] == str(out / file.format(name="RIGHT")) and len(figures["files"]) == 3
    assert f"subprograms next to it: {file.format(name='RIGHT')}, " in done.output


def test_files_of_another_program_are_not_replaced_in_silence(tmp_path: Path) -> None:
    source, out = str(GOLDEN / "three_laws.cls"), tmp_path / "out"
    assert "file.replaced" not in command_line(out, "left.nc", source, "fanuc-30i", "files = true").output
    assert "file.replaced" not in command_line(out, "left.nc", source, "fanuc-30i", "files = true").output
    other = command_line(out, "right.nc", source, "fanuc-30i", "files = true")
    assert other.exit_code == 0 and "file.replaced" in other.output and "O1001, O1002, O1003" in other.output
    before = (out / "O1001").read_bytes()
    own = command_line(out, "o1001", source, "fanuc-30i", "files = true")
    assert own.exit_code == 1 and "file.own_name" in own.output and (out / "O1001").read_bytes() == before


@pytest.mark.covering
@pytest.mark.parametrize(("keys", "step"),
                         [({}, 10), ({"subprograms": True}, 10), ({"subprograms": True}, 1001)])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_no_block_number_stands_twice(controller: str, keys: dict[str, object], step: int,
                                      tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text(f'base = "{controller}"\n[format]\nsequence_step = {step}\n')
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls")
    text = good(convert(path, MACHINE.get(controller, "mikron-ucp710"), shop, setup=setup(**keys))).text
    numbers = re.findall(r"^/?(?:N)?(\d+) ", text, re.MULTILINE)
    assert len(numbers) > 10 and len(set(numbers)) == len(numbers)


def test_operations_bear_the_next_hundred(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "fanuc-30i"\n[format]\nsequence_step = 10\n')
    text = three_laws(str(shop), setup()).text
    numbers = [int(n) for n in re.findall(r"^N(\d+)", text, re.MULTILINE)]
    labels = [int(n) for n in re.findall(r"^N(\d+) G17 G40", text, re.MULTILINE)]
    assert numbers == sorted(numbers) and len(labels) == 3 and not any(n % 100 for n in labels[1:])


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "generic-iso"])
def test_no_comment_holds_the_end_of_the_file(controller: str) -> None:
    path = toolpath("PPRINT/COOLANT 50% FULL", "RAPID", "GOTO/0,0,50", "GOTO/1,0,50")
    text = good(convert(path, "mill-3axis", controller)).text
    assert text.count("%") == 2 and text.startswith("%") and text.endswith("%\n")


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_work_offset_is_named_as_the_control_names_it(controller: str) -> None:
    result = three_laws(controller, setup("G59"))
    head = next(line for line in result.text.splitlines() if "IN MACHINE" in line.upper())
    assert f"WORK OFFSET {OWN_OFFSET[controller].upper()} IN MACHINE" in head.upper()
    assert f"work offset {OWN_OFFSET[controller]}: X" in as_text(result, "a.nc")
    assert as_dict(result, "a.nc")["files"] == []


@pytest.mark.parametrize(("controller", "options"), [
    ("fanuc-30i", ("G43.4", "G68.2")), ("haas-ngc", ("TCPC", "DWO")), ("siemens-840d", ("5-AXIS", "SWIVEL")),
    ("heidenhain-tnc640", ("OPTION 9", "OPTION 8"))])
def test_the_head_names_the_options_that_modes_need(controller: str, options: tuple[str, ...]) -> None:
    needs = " ".join(line for line in three_laws(controller, setup()).text.upper().splitlines() if "NEEDS" in line)
    assert all(option in needs for option in options)
    flat = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/1,0,50"), "mill-3axis", controller)).text
    assert not [t for t in flat.upper().splitlines() if "NEEDS" in t and "G05.1" not in t]


@pytest.mark.parametrize(("controller", "key"), [("fanuc-30i", "1008#0"), ("haas-ngc", "MAPPED"), ("siemens-840d", "30310"),
                                                 ("heidenhain-tnc640", "M127"), ("linuxcnc", "WRAPPED_ROTARY")])
def test_positions_beyond_a_turn_name_the_setting_that_they_need(controller: str, key: str) -> None:
    axes = ("X", "Y", "Z", "C")
    far = lines(controller, program([step("rapid", X=0.0, C=359.0), step("feed", X=1.0, C=720.0, F=100.0)], letters=axes))
    near = lines(controller, program([step("rapid", X=0.0, C=359.0), step("feed", X=720.0, C=1.0, F=100.0)], letters=axes))
    assert any("NEEDS" in t.upper() and key in t.upper() and " C" in t for t in far)
    assert not any("NEEDS" in t.upper() and key in t.upper() for t in near)


@pytest.mark.covering
@pytest.mark.covering
@pytest.mark.parametrize("level", [8, 20])
@pytest.mark.parametrize("controller", [*CONTROLLERS, "linuxcnc"])
def test_a_tap_with_a_retract_level_of_its_own_is_a_cycle(controller: str, level: int) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", f"CYCLE/TAP,DEPTH,12,MMPR,1.0,CLEAR,3,RETURN,{level}", "GOTO/25,10,0",
                    "GOTO/25,20,0", "CYCLE/OFF")
    result = good(convert(path, "mill-3axis", controller))
    assert result.program is not None and [(h.retract, h.initial) for h in result.program.holes] == [(level, level)] * 2
    assert result.comparison is not None and result.comparison.worst_tip < 1e-6


@pytest.mark.parametrize("controller", [*CONTROLLERS, "linuxcnc", "generic-iso"])
def test_spindle_and_coolant_are_switched_off_once_at_the_end(controller: str) -> None:
    off = program([step("rapid", X=1.0)], {0: [command("START_SPINDLE_CLOCKWISE", 100.0), command("FLOOD_ON")],
                                           1: [command("COOLANT_OFF"), command("STOP_SPINDLE_TURNING")]})
    on = program([step("rapid", X=1.0)], {0: [command("START_SPINDLE_CLOCKWISE", 100.0), command("FLOOD_ON")]})
    for made in (off, on, program([step("rapid", X=1.0)])):
        words = " ".join(lines(controller, made)).split()
        assert words.count("M5") == words.count("M9") == 1


def test_text_that_is_passed_on_leaves_the_end_as_it_is() -> None:
    made = program([step("rapid", X=1.0)], {1: [command("STOP_SPINDLE_TURNING"), command("INSERT", "M3")]})
    assert " ".join(lines("fanuc-30i", made)).split().count("M5") == 2
