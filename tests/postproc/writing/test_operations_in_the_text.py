"""Operations in the text: places to take a program up, and subprograms of the same file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import toolpaths
from postproc.cli.app import app
from postproc.compile.program import Command, Program, Section
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, convert, good, tool_setup
from tests.postproc.program_kit import LOAD, blocks, command, lines, program, step
from toolpaths.diagnostics import has_errors

GOLDEN = Path(__file__).parents[2] / "golden"


def two_operations() -> Program:
    return program([step("rapid", Z=50.0), step("feed", X=1.0, F=100.0), step("feed", X=2.0, F=100.0)],
                   {0: [command("OPERATION_START", "ROUGH"), *LOAD], 2: [command("OPERATION_START", "finish (2)")]})


@pytest.mark.parametrize(("controller", "start", "then"), [
    ("fanuc-30i", ["(FINISH  2 )", "N200 G17 G40 G80 G90 G94"], "G1 X2. F100."),
    ("haas-ngc", ["(FINISH  2 )", "N200 G17 G40 G80 G90 G94"], "G1 X2. F100."),
    ("siemens-840d", ["; finish (2)", "G17 G40 G90 G94"], "G1 X2 F100"),
    ("heidenhain-tnc640", ["* - finish (2)"], "L X+2 R0 F100")])
def test_modal_codes_are_stated_again_at_each_operation(controller: str, start: list[str], then: str) -> None:
    text = [b for b in blocks(controller, two_operations()) if b != "\0"]
    assert text[-len(start) - 1:] == [*start, then]


def test_linuxcnc_is_written_as_if_there_were_no_operations() -> None:
    plain = program([step("rapid", Z=50.0), step("feed", X=1.0, F=100.0), step("feed", X=2.0, F=100.0)], {0: LOAD})
    assert lines("linuxcnc", two_operations()) == lines("linuxcnc", plain)


@pytest.mark.parametrize(("controller", "calls", "subs"), [
    ("fanuc-30i", ["M98 P1001", "M98 P1002"], ["O1001", "M99", "O1002", "M99", "%"]),
    ("haas-ngc", ["M97 P1001", "M97 P1002"], ["N1001", "M99", "N1002", "M99", "%"]),
    ("heidenhain-tnc640", ["CALL LBL 1001", "CALL LBL 1002"], ["LBL 1001", "LBL 0", "LBL 1002", "LBL 0"])])
def test_operations_become_subprograms_behind_the_end(controller: str, calls: list[str],
                                                      subs: list[str]) -> None:
    text = [b.split(" ", 1)[1] if controller.startswith("h") and b[0].isdigit() else b
            for b in lines(controller, two_operations(), subprograms=True)]
    end = text.index("M30")
    assert [b for b in text[:end] if b in calls] == calls
    assert [b for b in text[end:] if b in subs] == subs
    cut = [b for b in text if "X2" in b or "X+2" in b]
    assert len(cut) == 1 and text.index(cut[0]) > end


def test_the_same_blocks_stand_in_subprograms() -> None:
    plain, made = (lines("fanuc-30i", two_operations(), subprograms=flag) for flag in (False, True))
    own = {"M98 P1001", "M98 P1002", "O1001", "O1002", "M99"}
    assert sorted(b for b in made if b not in own) == sorted(plain)


def test_subprograms_before_the_main_program(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "linuxcnc"\n[subprograms]\ncall = "o{number} call"\nbegin = ["o{number} sub"]\n'
                    'end = ["o{number} endsub"]\nplace = "before"\n')
    text = lines(str(shop), two_operations(), subprograms=True)
    assert text.index("o1001 sub") < text.index("o1002 endsub") < text.index("G54") < text.index("o1001 call")


def test_a_controller_without_subprograms_writes_one_program() -> None:
    assert lines("generic-iso", two_operations(), subprograms=True) == lines("generic-iso", two_operations())


def test_blocks_with_a_number_of_their_own_get_no_other(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "fanuc-30i"\n[format]\nsequence_step = 5\n')
    text = lines(str(shop), two_operations(), subprograms=True)
    assert "O1001" in text and "N200 G17 G40 G80 G90 G94" in text and "%" in text
    assert sum(b.endswith("M98 P1001") and b.startswith("N") for b in text) == 1


@pytest.mark.parametrize(("controller", "machine"), [("fanuc-30i", "mikron-ucp710"), ("haas-ngc", "trunnion-bc"),
                                                     ("heidenhain-tnc640", "mikron-ucp710")])
def test_subprograms_read_back_as_the_part(controller: str, machine: str) -> None:
    path, found = toolpaths.read(GOLDEN / "three_laws.cls")
    assert not has_errors(found)
    result = good(convert(path, machine, controller, with_subprograms()))
    plain = good(convert(path, machine, controller))
    assert result.comparison is not None and plain.comparison is not None
    assert sum(c in result.text for c in ("P1001", "P1002", "P1003", "LBL 1001\n", "LBL 1002\n", "LBL 1003\n")) == 3
    assert len(result.text.splitlines()) >= len(plain.text.splitlines()) + 9
    assert result.comparison.worst_tip == plain.comparison.worst_tip


def with_subprograms() -> SetupFile:
    usual = tool_setup()
    return usual.model_copy(update={"output": usual.output.model_copy(update={"subprograms": True})})


def test_subprograms_are_refused_where_there_are_none() -> None:
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls")
    result = convert(path, "mikron-ucp710", "generic-iso", with_subprograms())
    assert not result.ok and "output.subprograms" in {d.code for d in result.diagnostics}


def test_siemens_subprograms_are_files_of_their_own_and_read_back() -> None:
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls")
    result = good(convert(path, "mikron-ucp710", "siemens-840d", with_subprograms()))
    assert result.files is not None and list(result.files) == [f"THREE_LAWS_{n}.SPF" for n in (1001, 1002, 1003)]
    assert [line.split(" ")[1] for line in result.text.splitlines() if "THREE_LAWS_" in line] == [
        "THREE_LAWS_1001", "THREE_LAWS_1002", "THREE_LAWS_1003"]
    for text in result.files.values():
        assert "N10 " in text and text.splitlines()[-1].endswith(" M17")
    assert "CYCLE800(0" not in result.text and "CYCLE800(0" in result.files["THREE_LAWS_1002.SPF"]


def test_klartext_operations_in_files_of_their_own_read_back(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "heidenhain-tnc640"\n[subprograms]\ncall = "CALL PGM {name}_{number}.H"\n'
                    'begin = ["BEGIN PGM {name}_{number} MM"]\nend = ["END PGM {name}_{number} MM"]\n'
                    'place = "files"\nfile = "{name}_{number}.H"\n')
    path, _ = toolpaths.read(GOLDEN / "three_laws.cls")
    result = good(convert(path, "mikron-ucp710", shop, with_subprograms()))
    assert result.files is not None and len(result.files) == 3
    assert all(text.startswith("0 BEGIN PGM THREE_LAWS_100") for text in result.files.values())


def test_the_command_writes_the_files_next_to_the_program(tmp_path: Path) -> None:
    setup, out = tmp_path / "s.toml", tmp_path / "part.mpf"
    setup.write_text((SAMPLES / "tools.setup.toml").read_text() + "\n[output]\nsubprograms = true\n")
    done = CliRunner().invoke(app, ["convert", str(GOLDEN / "three_laws.cls"), "-m", "mikron-ucp710", "-c", "siemens-840d",
                                    "-o", str(out), "--setup", str(setup)])
    assert done.exit_code == 0, done.output
    assert sorted(p.name for p in tmp_path.iterdir()) == [*(f"PART_{n}.SPF" for n in (1001, 1002, 1003)), "part.mpf",
                                                          "s.toml"]
    again = CliRunner().invoke(app, ["verify", str(out), str(GOLDEN / "three_laws.cls"), "-m", "mikron-ucp710",
                                     "-c", "siemens-840d", "--setup", str(setup)])
    assert again.exit_code == 0, again.output
    (tmp_path / "PART_1002.SPF").unlink()
    assert CliRunner().invoke(app, ["verify", str(out), str(GOLDEN / "three_laws.cls"), "-m", "mikron-ucp710",
                                    "-c", "siemens-840d", "--setup", str(setup)]).exit_code == 1


def switched(controller: str) -> list[str]:
    made = program([step("rapid", X=0.0), step("feed", X=1.0, F=100.0), step("feed", X=2.0, F=100.0),
                    step("feed", X=3.0, F=100.0), step("feed", X=4.0, F=100.0)],
                   {2: [Command("FLOOD_ON", skip=True)], 4: [command("RESTATE")]})
    skip = np.array([False, False, True, True, False])
    return blocks(controller, replace(made, skip=skip))


def test_blocks_that_a_switch_leaves_out_begin_with_a_slash() -> None:
    assert switched("fanuc-30i") == ["G0 X0.", "G1 X1. F100.", "/M8", "/X2.", "/X3.", "G94 G1 X4. F100."]
    assert switched("heidenhain-tnc640") == ["L X+0 R0 FMAX", "L X+1 F100", "/M8", "/L X+2", "/L X+3", "L X+4 R0 F100"]


def test_the_slash_stands_before_the_number() -> None:
    made = program([step("rapid", X=0.0)])
    text = lines("siemens-840d", replace(made, skip=np.array([True])))
    assert "/N30 G0 X0" in text
    assert "/3 L X+0 R0 FMAX" in lines("heidenhain-tnc640", replace(made, skip=np.array([True])))


def test_a_mode_does_not_hide_the_feed_mode_before_it() -> None:
    made = program([step("feed", X=1.0, F=2.0, inverse=True), step("feed", X=2.0, F=300.0)],
                   {1: [command("ENTER_SECTION", 1.0)]}, sections=(Section(0, "axes"), Section(1, "tcp")))
    assert blocks("siemens-840d", made)[-1] == "G94 G1 X2 F300"
