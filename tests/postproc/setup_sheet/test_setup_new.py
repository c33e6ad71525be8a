"""postproc setup new: what it writes converts and is proved, nothing is invented in silence, one list of what is missing."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import shlex
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.cli.shared.guard import INTERRUPTED, guarded
from postproc.cli.shared.says import answer_line as LINE
from postproc.controllers.model import load_controller
from postproc.setup.model import load_setup, part_placement
from postproc.setup_sheet.facts import facts_of
from postproc.setup_sheet.make import SetupSheet, new_setup
from postproc.setup_sheet.questions import ASSUMED_FEED, ASSUMED_SPEED, GivenAnswers, Question, parsed, questions_of
from tests.postproc.kit import SAMPLES, machine
from tests.practice_files import CASES, SHAPES, practice_file

MACHINES = (("mill-3axis", "haas-ngc"), ("head-table", "fanuc-30i"), ("mikron-ucp710", "linuxcnc"))
FITTING = [("pocket.cls", "uranesx", "linuxcnc"), ("five_faces.cls", "mikron-ucp710", "heidenhain-tnc640"),
           ("dialects/solidworks.clt", "head-table", "siemens-840d"), ("indexed_4axis.cls", "mill-4axis", "linuxcnc"),
           ("systems/upside_down.cls", "mikron-ucp710", "fanuc-30i"), ("joints/turned_over.cls", "trunnion-bc", "haas-ngc"),
           ("dialects/inch_creo.ncl", "mill-3axis", "generic-iso")]
"""samples on machines of their size, every control"""


def run(*words: object, stdin: str = "", code: int = 0) -> Any:
    result = CliRunner().invoke(app, [*map(str, words)], input=stdin)
    assert result.exit_code == code, result.output
    return result


def sheet(file: Path, name: str, controller: str, given: GivenAnswers | None = None) -> SetupSheet:
    path, found = toolpaths.read(file)
    return new_setup(path, machine(name), controller, Options(), given or GivenAnswers(), None, True, found)


def proved(file: Path, made: SetupSheet, name: str, controller: str, folder: Path) -> Any:
    """The conversion with the set-up as its text has it; every fault fails the test."""
    assert made.text, [str(d) for d in made.diagnostics]
    written = folder / "new.setup.toml"
    written.write_text(made.text)
    setup, found = load_setup(written)
    assert setup is not None and not found, found
    path, found = toolpaths.read(file)
    result = postproc.convert(path, machine(name), controller, setup, diagnostics=found)
    assert result.ok and result.comparison is not None, [str(d) for d in result.diagnostics]
    return result


def bare(folder: Path, case: str = "nothing but points", shape: str = "nx") -> Path:
    one = next(s for s in SHAPES if s.name == shape)
    made = folder / f"part.{one.ending}"
    made.write_text(practice_file(one, CASES[case]))
    return made


@pytest.mark.covering
@pytest.mark.parametrize(("name", "controller"), MACHINES)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("shape", [s.name for s in SHAPES])
def test_what_is_written_converts(shape: str, case: str, name: str, controller: str, tmp_path: Path) -> None:
    file = bare(tmp_path, case, shape)
    made = sheet(file, name, controller)
    result = proved(file, made, name, controller, tmp_path)
    setup = tomllib.loads(made.text)
    assumed = {key for key, answer in made.answers if answer.source == "assumed" and answer.value != "off"}
    assumed |= {"tool_numbers"} if any(one.assumed for one in made.facts.named) else set()
    x, y = (np.array(setup["part"][key]) for key in ("x_axis", "y_axis"))
    low = (toolpaths.read(file)[0].tip @ [x[2], y[2], np.cross(x, y)[2]]).min()
    chosen = low < 0.0 or any(setup["part"]["origin"])  # below the table's origin, or where travel alone has room
    assumed |= {"part.origin"} if name != "mill-3axis" and chosen else set()
    assert set(setup.get("assumed", [])) == assumed
    assert {d.message.split(" = ")[0] for d in result.diagnostics if d.code == "setup.assumed"} == assumed
    assert result.text.count("ASSUMED") == len(assumed)
    for line in made.text.splitlines():  # every value with its reason
        assert line.startswith(("#", "[", "assumed =")) or not line or re.search(r"#\s+\S", line), line
    rpm, feeds = result.job.toolpath.events, result.toolpath.feed
    if "spindle" in CASES[case]:
        assert any(e.word == "SPINDL" and ASSUMED_SPEED in e.values for e in rpm)
    else:
        assert "spindle" not in made.text.replace("# spindle", ""), "the file states it"
    assert np.isfinite(feeds).any() == ("feed" not in CASES[case])
    assert setup["output"].get("feed") == (ASSUMED_FEED if "feed" in CASES[case] else None)


@pytest.mark.covering(of=("name", "controller"))
@pytest.mark.parametrize(("sample", "name", "controller"), FITTING)
def test_samples_convert_with_what_is_written(sample: str, name: str, controller: str, tmp_path: Path) -> None:
    made = sheet(SAMPLES / sample, name, controller)
    assert proved(SAMPLES / sample, made, name, controller, tmp_path).text


@pytest.mark.parametrize(("case", "name", "controller"), [("far off", "delta-star", "linuxcnc"),
                                                          ("complete", "hexaslide-cone", "generic-iso")])
def test_parts_come_into_the_workspace_of_parallel_machines(case: str, name: str, controller: str, tmp_path: Path) -> None:
    """Not where rods that hang the other way would reach, and by the length of platform and tool below it."""
    made = sheet(file := bare(tmp_path, case), name, controller)
    assert made.text and made.fit is not None and made.fit.tried == 2, [str(d) for d in made.diagnostics]
    path, box = toolpaths.read(file)[0], machine(name).kinematics.workspace
    assert box is not None
    middle = made.fit.setup.part.origin + 0.5 * (path.tip.min(axis=0) + path.tip.max(axis=0))
    assert (np.abs(middle - box.middle)[:2] < 100.0).all() and -400.0 < middle[2] - box.middle[2] < -40.0


@pytest.mark.parametrize(("case", "name"), [("from below", "mikron-ucp710"), ("from the side", "mill-3axis"),
                                            ("from below", "mill-3axis")])
def test_the_tool_comes_from_above(case: str, name: str, tmp_path: Path) -> None:
    file = bare(tmp_path, case)
    made = sheet(file, name, "linuxcnc")
    setup = proved(file, made, name, "linuxcnc", tmp_path).setup
    placement, _ = part_placement(setup)
    assert placement is not None
    path, _ = toolpaths.read(file)
    np.testing.assert_allclose(placement.directions(path.axis)[:, 2], 1.0, atol=1e-12)


def test_a_system_that_is_upside_down_turns_no_part_over(tmp_path: Path) -> None:
    """The MSYS of the file hangs upside down, the tool axes do not: the part stays as it is."""
    text = practice_file(SHAPES[0], CASES["complete"]).replace(
        "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000",
        "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,-1.0000000,0.0000000").replace(
        "0.00000,0.00000,1.00000", "0.00000,0.00000,-1.00000")
    file = tmp_path / "part.cls"
    file.write_text(text)
    path, _ = toolpaths.read(file)
    assert path.frames[0].rotation[2][2] == -1.0 and (path.axis[:, 2] == 1.0).all()
    made = sheet(file, "mikron-ucp710", "linuxcnc")
    assert tomllib.loads(made.text)["part"]["x_axis"] == [1.0, 0.0, 0.0]
    assert tomllib.loads(made.text)["part"]["y_axis"] == [0.0, 1.0, 0.0]
    proved(file, made, "mikron-ucp710", "linuxcnc", tmp_path)


def test_free_numbers_for_all_tools_at_once(tmp_path: Path) -> None:
    lines = ["UNITS/MM", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,100"]
    for name, load in (("A", "LOAD/TOOL,2"), ("B", "LOAD/TOOL,0"), ("C", "LOAD/TOOL,0"), ("D", "LOAD/TOOL,2")):
        lines += [f"TOOL PATH/{name},TOOL,EM{name}", load, "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/0,0,5", "GOTO/0,0,0",
                  "GOTO/9,0,0", "RAPID", "GOTO/9,0,5", "END-OF-PATH"]
    file = tmp_path / "four.cls"
    file.write_text("\n".join(lines) + "\n")
    made = sheet(file, "mill-3axis", "linuxcnc")
    result = proved(file, made, "mill-3axis", "linuxcnc", tmp_path)
    numbers = tomllib.loads(made.text)["tool_numbers"]
    assert numbers == {"EMA": 2, "EMB": 1, "EMC": 3, "EMD": 4} and len(set(numbers.values())) == 4
    assert [int(n) for n in re.findall(r"^T(\d+)\b", result.text, re.MULTILINE)] == [2, 1, 3, 4]


def test_questions_are_asked_and_answered(tmp_path: Path) -> None:
    file, out = bare(tmp_path), tmp_path / "s.toml"
    words = ("setup", "new", file, "-m", "head-table", "-c", "fanuc-30i", "-o", out)
    got = run(*words, stdin="one\n2.5\n\n\nfast\n-3\n8000 rpm\n350 mm/min\nflood\n")
    assert "2.5 is not a whole number" in got.stderr and "number in the magazine" in got.stderr
    assert "'fast' is not a number" in got.stderr and "-3 is not above 0" in got.stderr
    setup = tomllib.loads(out.read_text())
    assert setup["tools"]["1"]["spindle"] == {"rpm": 8000, "direction": "clockwise"}
    assert setup["output"] == {"default": "auto", "feed": 350, "coolant": "flood", "operations": {"SLOT": "auto"}}
    assert setup.get("assumed", []) == ["part.origin"] and setup["tool_numbers"] == {"EM10": 1}
    assert "ASSUMED: the CL file states none" in out.read_text()  # the units
    before = out.read_text()
    assert run(*words, "--yes", code=2).stderr and out.read_text() == before, "no file is replaced without --force"
    run(*words, "--yes", "--force", "--feed", "70")
    assert tomllib.loads(out.read_text())["output"]["feed"] == 70 and out.read_text() != before


def test_an_interruption_says_the_options_that_hold_the_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                                capsys: pytest.CaptureFixture[str]) -> None:
    """Ctrl-C behind some answers: they were lost."""
    words = ["setup", "new", str(bare(tmp_path)), "-m", "head-table", "-c", "fanuc-30i", "-o", str(tmp_path / "s.toml")]
    lines = iter(["7\n", "\n", "8000\n"])

    def answer(_: str) -> str:
        line = next(lines, None)
        if line is None:
            raise KeyboardInterrupt
        return line

    monkeypatch.setattr("postproc.cli.setup_new.answer_line", answer)
    monkeypatch.setattr("sys.argv", ["postproc", *words])
    assert guarded(app) == INTERRUPTED and not (tmp_path / "s.toml").exists()
    options = capsys.readouterr().err.rpartition("goes on from there: ")[2].split()
    assert options == ["--tool-number", "EM10=7", "--spindle", "7=8000"]
    monkeypatch.undo()
    run(*words, *options, stdin="\n350\nflood\n\n")
    assert "7" in tomllib.loads((tmp_path / "s.toml").read_text())["tools"]


def test_numbers_of_tools_are_answers(tmp_path: Path) -> None:
    file, out = bare(tmp_path), tmp_path / "s.toml"
    words = ("setup", "new", file, "-m", "mill-3axis", "-o", out, "--yes", "--force")
    got = run(*words)
    assert tomllib.loads(out.read_text())["assumed"][-1] == "tool_numbers"
    assert "tool_numbers: EM10 = T1 is assumed" in got.stderr
    run(*words, "--tool-number", "em10=7")
    setup = tomllib.loads(out.read_text())
    assert setup["tool_numbers"] == {"EM10": 7} and "tool_numbers" not in setup["assumed"] and "7" in setup["tools"]
    assert setup["machine"] == "mill-3axis"
    assert "needs a number" in run(*words, "--tool-number", "EM6=7", code=1).stderr
    assert "is not NAME=number" in run(*words, "--tool-number", "7", code=2).stderr
    two = bare(tmp_path, "two tools of one number")
    words = ("setup", "new", two, "-m", "mill-3axis", "-o", out, "--yes", "--force")
    run(*words)
    (name,) = [name for name, n in tomllib.loads(out.read_text())["tool_numbers"].items() if n != 1]
    taken = run(*words, "--tool-number", f"{name}=1", code=1).stderr
    free = re.search(r"--tool-number (\S+)", taken)
    assert "setup.number_taken" in taken and free
    run(*words, "--tool-number", free[1])


def test_gauge_lengths_are_asked_for_where_words_depend_on_them(tmp_path: Path) -> None:
    file, out = tmp_path / "five.cls", tmp_path / "s.toml"
    file.write_bytes((SAMPLES / "dialects" / "nx.cls").read_bytes())
    words = ("setup", "new", file, "-m", "head-table", "-o", out)
    run(*words, stdin="120.5\n\n")  # the next tool is offered the last answer
    assert {n: t["gauge_length"] for n, t in tomllib.loads(out.read_text())["tools"].items()} == {"1": 120.5, "2": 120.5}
    run(*words, "--force", "--gauge-length", "2=90", "--gauge-length", "150")
    assert {n: t["gauge_length"] for n, t in tomllib.loads(out.read_text())["tools"].items()} == {"1": 150, "2": 90}
    got = run(*words, "--force", "--yes", "--gauge-length", "7=90", code=1)
    assert "setup.no_such_tool" in got.stderr and "T1, T2" in got.stderr


def test_gauge_lengths_are_asked_for_where_no_place_fits_without(tmp_path: Path) -> None:
    """The table of this machine lies below the travel of its spindle, which would have to cut itself. Each is asked once."""
    file = tmp_path / "part.cls"
    lines = (SAMPLES / "five_faces.cls").read_text().splitlines()
    file.write_text("\n".join(line for line in lines if not line.startswith("SPINDL")) + "\n")
    path, found = toolpaths.read(file)
    asked: list[str] = []

    def answer(question: Question) -> float | str:
        asked.append(question.key)
        return "" if question.optional else 180.0 if question.kind == "gauge_length" else 900.0

    typed = new_setup(path, machine("haas-umc-750"), "haas-ngc", Options(), GivenAnswers(), answer, False, found)
    first = ["tools.1.gauge_length", "tools.1.spindle", "tools.2.gauge_length", "tools.2.spindle"]
    assert asked == [*first, "tools.1.gauge_length", "tools.2.gauge_length", "output.origin"], asked  # left empty at first
    assert "gauge_length = 180 " in typed.text and "travel is checked with it" in typed.text


def test_what_nobody_answers_is_one_list(tmp_path: Path) -> None:
    file, out = bare(tmp_path), tmp_path / "s.toml"
    got = run("setup", "new", file, "-m", "mill-3axis", "-o", out, "--json", "-", stdin="\n900\n", code=1)
    assert not out.exists()
    values = json.loads(got.stdout)
    (fault,) = [d for d in values["diagnostics"] if d["severity"] == "error"]
    assert fault["code"] == "setup.unanswered" and fault["message"].startswith("2 values")
    assert "--feed MM/MIN" in fault["message"] and "--coolant KIND" in fault["message"]
    assert values["answers"] == [{"key": "tools.1.spindle", "value": 900.0, "source": "answered"}]


@pytest.mark.parametrize("machine_name", ["mill-3axis", "head-table"])
def test_convert_reports_all_that_is_missing_at_once_and_the_command_it_offers_works(machine_name: str,
                                                                                   tmp_path: Path,
                                                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "part.cls"
    bare(tmp_path, "from the side" if machine_name == "head-table" else "nothing but points")
    if machine_name == "head-table":
        lines = file.read_text().splitlines()
        file.write_text("\n".join(x for x in lines if not x.startswith(("SPINDL", "FEDRAT", "LOAD"))) + "\n")
    words = ("convert", file, "-m", machine_name, "-c", "haas-ngc", "-o", "p.nc")
    got = run(*words, code=1)
    expected = {"tool.number", "spindle.not_started", "feed.missing"}
    assert set(re.findall(r"error \[([\w.]+)\]", got.stderr)) == expected
    assert ("where the part stands on the table" in got.stderr) == (machine_name == "head-table"), "it depends on it"
    offered = re.search(r"(postproc setup new .*?\.toml) asks", got.stderr)
    assert offered
    run(*shlex.split(offered[1])[1:], "--yes")
    run(*words, "--setup", "part.setup.toml")
    assert Path("p.nc").exists()


def test_a_refusal_by_travel_names_a_place_that_works(tmp_path: Path) -> None:
    file, out, setup = bare(tmp_path, "far off"), tmp_path / "p.nc", tmp_path / "s.toml"
    words = ("convert", file, "-m", "mill-3axis", "-c", "linuxcnc", "-o", out)
    got = run(*words, code=1)
    found = re.search(r"\[part\] (origin = \[.*?\]), (x_axis = \[.*?\]), (y_axis = \[.*?\]) in the set-up", got.stderr)
    assert found and "place.found" in got.stderr
    for command in ("time", "report"):
        page = ("-o", tmp_path / "r.html") if command == "report" else ()
        other = CliRunner().invoke(app, [command, *map(str, (*words[1:-2], *page))])
        assert found[0] in other.stderr, f"{command} says what place finds, too"
    setup.write_text("[part]\n" + "\n".join(found.groups()) + "\n")
    run(*words, "--setup", setup)
    assert out.exists()


def test_where_no_place_fits_nothing_says_move_the_part(tmp_path: Path) -> None:
    """Two cuts farther apart than the travel is long: remedies that contradict each other are none."""
    file = tmp_path / "long.apt"
    file.write_text("UNITS/MM\nLOADTL/1\nSPINDL/RPM,3000,CLW\nFEDRAT/500,MMPM\nRAPID\nGOTO/0,0,50\nGOTO/0,0,0\nGOTO/10,0,0\n"
                    "GOTO/2000,0,0\nGOTO/2010,0,0\nGOTO/2020,0,0\nRAPID\nGOTO/2020,0,50\nFINI\n")
    got = run("convert", file, "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.nc", code=1)
    assert "in each of the 4 attitudes looked at it is outside travel" in got.stderr and "move the part" not in got.stderr
    travel = float(np.max(machine("mill-3axis").limits.upper - machine("mill-3axis").limits.lower))
    assert f"; at best axis X lacks {2020.0 - travel:.3f} mm of travel, both ends together" in got.stderr, "by hand"


def test_what_no_place_puts_right_is_explained(tmp_path: Path) -> None:
    made = sheet(SAMPLES / "five_faces.cls", "mill-3axis", "linuxcnc")
    assert not made.text
    notes = [d for d in made.diagnostics if d.code == "place.found"]
    assert notes and "however the part is turned, mill-3axis cannot take every tool axis" in notes[0].message
    assert any(d.code == "reach.axis" for d in made.diagnostics)


def test_faults_that_no_set_up_answers_are_refused_at_once() -> None:
    path, found = toolpaths.read(SAMPLES / "pocket.cls")
    turned = replace(path, operations=tuple(replace(op, turning=True) for op in path.operations))
    made = new_setup(turned, machine("mill-3axis"), "linuxcnc", Options(), GivenAnswers(), None, True, found)
    assert not made.text and {d.code for d in made.diagnostics if d.severity == 2} == {"convert.turning"}
    assert made.questions == ()


def test_assumed_names_what_the_set_up_states(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text('assumed = ["output.feed"]\n')
    setup, found = load_setup(file)
    assert setup is None and "output.feed" in found[0].message and found[0].lines
    file.write_text('assumed = ["output.feed"]\n[output]\nfeed = 5.0\n')
    assert load_setup(file)[0] is not None


def test_answers_are_numbers_within_limits() -> None:
    path, _ = toolpaths.read_bytes(practice_file(SHAPES[0], CASES["nothing but points"]), file="p.cls")
    spec, _ = load_controller("linuxcnc")
    assert spec is not None
    speed, feed, coolant = questions_of(facts_of(path, machine("mill-3axis"), spec, Options()))
    assert parsed(speed, "8000,5") == (8000.5, "") and parsed(feed, "")[1] == "a value is needed"
    assert parsed(speed, "inf")[0] is None and parsed(speed, "nan")[0] is None and parsed(feed, "0")[0] is None
    assert parsed(feed, "600 mm/min") == parsed(feed, "600") == (600.0, "") and parsed(feed, "20 ipm") == (508.0, "")
    assert parsed(coolant, "") == ("off", "") and parsed(coolant, "Mist") == ("mist", "")
    assert parsed(coolant, "oil")[0] is None


def test_a_length_may_come_with_its_unit() -> None:
    length = Question("gauge_length", 1, "T1: gauge length", None, 100.0)
    assert parsed(length, '4.5 in') == parsed(length, '4.5"') == (pytest.approx(114.3), "")
    assert parsed(length, "120 mm") == parsed(length, "120") == (120.0, "") and parsed(length, "120 kg")[0] is None


def test_the_largest_speed_of_the_machine_is_asked_and_taken_at_most() -> None:
    path, _ = toolpaths.read_bytes("UNITS/MM\nLOADTL/1\nFEDRAT/MMPM,100\nGOTO/0,0,5\nGOTO/1,0,5\n")
    slow = replace(machine("mill-3axis"), largest_spindle_speed=900.0)
    spec, _ = load_controller("linuxcnc")
    assert spec is not None
    facts = facts_of(path, slow, spec, Options())
    (speed,) = [q for q in questions_of(facts) if q.kind == "spindle"]
    assert not facts.refused and speed.assumed == 900 and "at most 900" in speed.prompt()
    assert parsed(speed, "900") == (900.0, "") and "at most 900" in parsed(speed, "901")[1]
    stated, _ = toolpaths.read_bytes("UNITS/MM\nLOADTL/1\nSPINDL/RPM,901,CLW\nFEDRAT/MMPM,100\nGOTO/0,0,5\nGOTO/1,0,5\n")
    assert "spindle.too_fast" in [d.code for d in facts_of(stated, slow, spec, Options()).refused]


def test_of_a_cutting_speed_the_turns_at_the_diameter_are_offered() -> None:
    path, _ = toolpaths.read_bytes("UNITS/MM\nLOADTL/1\nCUTTER/10,0\nSPINDL/SMM,157.08,CLW\nFEDRAT/MMPM,100\nGOTO/0,0,5\n"
                                   "GOTO/1,0,5\nGOTO/1,1,5\nGOTO/1,1,9\n")
    spec, _ = load_controller("linuxcnc")
    assert spec is not None
    facts = facts_of(path, machine("mill-3axis"), spec, Options())
    (speed,) = [q for q in questions_of(facts) if q.kind == "spindle"]
    assert not facts.refused and (speed.default, speed.assumed) == (5000, 5000) and "SPINDL/SMM,157.08" in speed.text
    for said, diameter, offered in (("157.08,MAXRPM,3000", "10", 3000), ("0.0000001", "10", None), ("157.08", "1e-6", None)):
        text = f"UNITS/MM\nLOADTL/1\nCUTTER/{diameter},0\nSPINDL/SMM,{said},CLW\nFEDRAT/MMPM,100\n"
        path, _ = toolpaths.read_bytes(f"{text}GOTO/0,0,5\nGOTO/1,0,5\nGOTO/1,1,5\nGOTO/1,1,9\n")
        assert [q.default for q in questions_of(facts_of(path, machine("mill-3axis"), spec, Options()))
                if q.kind == "spindle"] == [offered], said


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo terminals are of Unix")
def test_a_question_on_a_terminal_stays_on_its_line(tmp_path: Path) -> None:
    """A progress bar that is redrawn ten times a second wiped it out."""
    import pty

    nx = next(shape for shape in SHAPES if shape.name == "nx")
    (file := tmp_path / "part.cls").write_text(practice_file(nx, CASES["no spindle"]))
    code = "import sys; from postproc.cli.app import main; sys.exit(main())"
    ours, theirs = pty.openpty()
    words = ["setup", "new", str(file), "-m", "mill-3axis", "-o", str(tmp_path / "s.toml")]
    command = subprocess.Popen([sys.executable, "-c", code, *words], stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    said = b""
    while b"rev/min: " not in said:
        said += os.read(ours, 4096)
    assert b"\x1b" not in said
    assert not select.select([ours], [], [], 0.5)[0], "nothing is written behind the question"
    os.write(ours, b"3000\n")
    said += _until_closed(ours)
    assert command.wait(60) == 0 and b"1 question" in said
    ours, theirs = pty.openpty()
    wrong = subprocess.Popen([sys.executable, "-c", code, "machine", "check", str(file)], stderr=theirs)
    os.close(theirs)
    assert b"explained with an example: postproc explain file.syntax" in _until_closed(ours), "where a person reads"
    assert wrong.wait(60) == 1


def _until_closed(terminal: int) -> bytes:
    """All that comes from a terminal until its end, which is reported as an error."""
    said = b""
    with contextlib.suppress(OSError):
        while part := os.read(terminal, 4096):
            said += part
    os.close(terminal)
    return said


def test_the_unit_of_a_file_that_states_none_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Millimetres were taken in silence on a terminal, where somebody could have been asked."""
    (file := tmp_path / "part.apt").write_text("LOADTL/1\nSPINDL/RPM,900,CLW\nCOOLNT/OFF\nFEDRAT/20\nRAPID\nGOTO/0,0,2\n"
                                               "GOTO/0,0,0\nGOTO/1,0,0\nRAPID\nGOTO/1,0,2\nFINI\n")
    words = ("setup", "new", file, "-m", "mill-3axis", "-o", out := tmp_path / "s.toml", "--force")
    assert "unit of the CL file" not in run(*words).output, "answers of a file hold values alone"
    monkeypatch.setattr("postproc.cli.setup_new._terminal", lambda: True)
    said = run(*words, stdin="cm\ninch\n")
    assert "'cm' is not one of mm, inch" in said.stderr and "1 question asked\n" in said.stdout
    assert "--units inch" in said.stdout and "answered (--units inch" in out.read_text()
    made = run("convert", file, *words[3:5], "-c", "linuxcnc", "--setup", out, "--units", "inch", "-o", tmp_path / "p.nc")
    program = (tmp_path / "p.nc").read_text()
    assert "G21" in program and "CL file read with --units inch" in program and "(units inch" not in program
    assert "program in mm, CL file in inch" in made.stdout, "the header named inches above a program in mm"
    silent = run(*words, "--units", "mm").output + (said := run(*words, "--yes").output)
    assert "unit of the CL file" not in silent and "0 questions asked\n" in said
    file.write_text(file.read_text().replace("FEDRAT/20", "FEDRAT/20,IPM"))
    assert "[inch]" in run(*words, stdin="\n").stderr and "--units inch" in out.read_text(), "offered is what was read"
    run(*words, "--yes")
    assert "inch, ASSUMED: its feeds are in inches; where its lengths are in mm, write" in out.read_text()


def test_nobody_is_asked_for_what_no_answer_puts_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers and speeds were asked for, then the file was refused for a tool that it never loads."""
    cut = "RAPID\nGOTO/0,0,9\nGOTO/9,0,0\n"
    (file := tmp_path / "part.cls").write_text(
        f"UNITS/MM\nTPRINT/T1\nLOADTL/0\n{cut}TOOLNO/7,MILL,10,0\n{cut}TOOLNO/8,MILL,6,0\n{cut}LOADTL/7\n{cut}FINI\n")
    said = run("setup", "new", file, "-m", "mill-3axis", "-o", tmp_path / "s.toml", stdin="1\n2\n", code=1)
    assert "tool.not_loaded" in said.stderr and "number in the magazine" not in said.output


def test_rapids_that_would_leave_their_line_are_feed_moves(tmp_path: Path) -> None:
    """A rapid up and aside from the cut, far off the table: found with the place, and said with its reason."""
    (file := tmp_path / "part.apt").write_text(
        "UNITS/MM\nLOADTL/1\nSPINDL/RPM,900,CLW\nFEDRAT/MMPM,200\nRAPID\nGOTO/812,-333,190\nGOTO/812,-333,140\n"
        "GOTO/862,-333,140\nGOTO/862,-313,140\nRAPID\nGOTO/812,-333,190\nFINI\n")
    made = sheet(file, "mikron-ucp710", "fanuc-30i")
    result = proved(file, made, "mikron-ucp710", "fanuc-30i", tmp_path)
    assert result.ok and tomllib.loads(made.text)["output"]["rapids_as_feed"] is True
    straight = sheet(file, "mikron-ucp710", "linuxcnc")
    assert straight.text and "rapids_as_feed" not in straight.text, "a control whose rapids are straight needs none"


def test_who_knows_where_the_part_stands_says_so(tmp_path: Path) -> None:
    """An option or an answer is taken as it is, and not assumed; where it is out of travel, the place that fits is named."""
    file, out = bare(tmp_path), tmp_path / "s.toml"
    words = ("setup", "new", file, "-m", "haas-umc-750", "-c", "haas-ngc", "-o", out, "--yes", "--force")
    assert "part.origin is assumed: travel alone has chosen" in run(*words).stderr
    found = tomllib.loads(out.read_text())["part"]["origin"]
    at = [found[0] + 3.0, found[1] - 2.0, found[2] - 40.0]
    said = run(*words, "--origin", ",".join(map(str, at)))
    setup = tomllib.loads(out.read_text())
    assert setup["part"]["origin"] == at and "part.origin" not in setup["assumed"] and "said to stand" in said.stdout
    refused = run(*words, "--origin", "0,0,0", code=1).stderr
    assert "travel.exceeded" in refused and refused.count("[part] origin = ") == 1
    assert "is not X,Y,Z in mm" in run(*words, "--origin", "0,0", code=2).stderr


def test_a_place_that_was_offered_is_accepted_or_another_stated(tmp_path: Path) -> None:
    path, found = toolpaths.read(bare(tmp_path))
    given = GivenAnswers(spindle={0: 3000.0}, feed=300.0, coolant="off", tool_number={"EM10": 1})

    def made(answer: str) -> SetupSheet:
        def ask(question: Question) -> float | str:
            if question.kind == "gauge_length":
                return ""
            assert question.kind == "origin"
            return parsed(question, answer)[0] or ""

        return new_setup(path, machine("haas-umc-750"), "haas-ngc", Options(), given, ask, False, found, "G54")

    offered, other = made(""), made("-380 -250 -300")
    assert offered.fit is not None and other.fit is not None and not offered.fit.setup.assumed
    assert offered.fit.place.stated and other.fit.setup.part.origin == (-380.0, -250.0, -300.0)


@pytest.mark.parametrize("name", ['EM"10\\n', "EM\x7f10", "EM\x0110", "Фреза\u2028Ø10\x85"])
def test_odd_characters_of_names_stay_inside_their_quotes(name: str, tmp_path: Path) -> None:
    nx = next(shape for shape in SHAPES if shape.name == "nx")
    text = practice_file(nx, CASES["no tool number"]).replace("EM10", name).replace("SLOT", "SL\x7fOT")
    (file := tmp_path / "a\nb.cls").write_text(text, encoding="utf-8")
    made = sheet(file, "mill-3axis", "haas-ngc")
    assert "\x7f" not in made.text and tomllib.loads(made.text)["description"] == "a\nb.cls"
    proved(file, made, "mill-3axis", "haas-ngc", tmp_path)


def test_a_comma_that_may_part_thousands_is_asked_again() -> None:
    speed = Question("spindle", 1, "T1: spindle speed", None, 1000.0)
    for text in ("12,000", "1,500"):  # 12000 rev/min was taken as 12
        value, wrong = parsed(speed, text)
        assert value is None and text.replace(",", "") in wrong and text.replace(",", ".") in wrong
    assert [parsed(speed, text)[0] for text in ("150,5", "0,125", "12000", "12.5")] == [150.5, 0.125, 12000.0, 12.5]


def test_wrong_registers_and_a_closed_standard_input_are_no_faults_of_ours(tmp_path: Path,
                                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    nx = next(shape for shape in SHAPES if shape.name == "nx")
    (file := tmp_path / "part.cls").write_text(practice_file(nx, CASES["no spindle"]))
    words = ["setup", "new", file, "-m", "mill-3axis", "-o", tmp_path / "s.toml"]
    assert "no register" in run(*words, "--yes", "--work-offset-code", 'G54"', code=2).output
    monkeypatch.setattr("postproc.cli.setup_new.answer_line", lambda question: setup_new_line(monkeypatch, question))
    assert "setup.unanswered" in run(*words, code=1).output


def setup_new_line(monkeypatch: pytest.MonkeyPatch, question: str) -> str:
    with monkeypatch.context() as closed:
        closed.setattr(sys, "stdin", None)  # as `<&-` leaves it
        return LINE(question)


@pytest.mark.parametrize("record", ["SPINDL/CCLW", "SPINDL/ON,CCLW", "SPINDL/RPM,0,CCLW"])
def test_a_direction_without_a_speed_is_that_of_the_file(record: str, tmp_path: Path) -> None:
    """The set-up said clockwise, and the program started the spindle with M3 and M4 behind it."""
    nx = next(shape for shape in SHAPES if shape.name == "nx")
    (file := tmp_path / "part.cls").write_text(practice_file(nx, CASES["complete"]).replace("SPINDL/RPM,3000,CLW", record))
    made = sheet(file, "mill-3axis", "haas-ngc")
    assert 'spindle = { rpm = 1000, direction = "anti-clockwise" }' in made.text
    assert made.questions[0].text.endswith("spindle speed, anti-clockwise")
    text = proved(file, made, "mill-3axis", "haas-ngc", tmp_path).text
    assert re.search(r"\bM4\b", text) and not re.search(r"\bM3\b", text)
    (tmp_path / "other.toml").write_text(made.text.replace("anti-clockwise", "clockwise"))
    other, _ = load_setup(tmp_path / "other.toml")
    path, found = toolpaths.read(file)
    again = postproc.convert(path, machine("mill-3axis"), "haas-ngc", other, diagnostics=found)
    assert again.ok and not re.search(r"\bM3\b", again.text)


def test_commands_that_are_offered_quote_names_with_spaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    nx = next(shape for shape in SHAPES if shape.name == "nx")
    (file := tmp_path / "my part (1).cls").write_text(practice_file(nx, CASES["no spindle"]))
    options = ("--units", "mm", "--dialect", "nx", "--allow-unknown", "SHOPWORD", "--tolerance", "0.02")
    got = run("convert", file, "-m", "mill-3axis", "-c", "haas-ngc", "-o", "p.nc", *options, code=1)
    offered = re.search(r"postproc (setup new .*) asks for all", got.stderr)
    assert offered is not None
    file.write_text(file.read_text().replace("COOLNT/FLOOD", "COOLNT/FLOOD\nSHOPWORD/7"))
    got = run(*shlex.split(offered[1]), "--yes", *options)
    following = re.search(r"next: postproc (.*)", got.stdout)
    assert following is not None
    run(*shlex.split(following[1]))
    assert (tmp_path / "my part (1).nc").exists()


def test_a_gauge_length_below_the_cutter_is_warned_of(tmp_path: Path) -> None:
    nx = next(shape for shape in SHAPES if shape.name == "nx")
    (file := tmp_path / "part.cls").write_text(practice_file(nx, CASES["complete"]))
    for length, count in ((5.0, 1), (75.0, 0)):  # the cutter of the file is 75 mm long
        made = sheet(file, "head-table", "haas-ngc", GivenAnswers(gauge_length={0: length}))
        assert made.text and [d.code for d in made.diagnostics].count("setup.short_tool") == count



@pytest.mark.parametrize("stdin", ["", "\n"])
def test_answers_that_end_leave_open_what_may_be_empty_too(stdin: str, tmp_path: Path) -> None:
    """From the null device gauge lengths were taken as not known; behind one empty answer it ended with a fault."""
    words = ["setup", "new", SAMPLES / "pocket.cls", "-m", "mikron-ucp710", "-o", tmp_path / "s.toml"]
    said = run(*words, stdin=stdin, code=1).stderr
    assert "--gauge-length 1=MM" in said and "--gauge-length 2=MM" in said and "--yes" in said
    assert not (tmp_path / "s.toml").exists()


@pytest.mark.parametrize(("given", "advised"), [((), False), (("--gauge-length", "1=80"), True)])
def test_shorter_tools_are_advised_where_one_has_a_length(given: tuple[str, ...], advised: bool, tmp_path: Path) -> None:
    part = tmp_path / "far.apt"
    part.write_text("UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/-390,0,50\nGOTO/-390,0,0\n"
                    "GOTO/390,0,0\nRAPID\nGOTO/390,0,50\nFINI\n")
    said = run("setup", "new", part, "-m", "haas-umc-750", "-c", "haas-ngc", "--yes", "-o", tmp_path / "s.toml", *given,
               code=1).output
    assert "a machine with more travel" in said and ("shorter tools, or a file" in said) == advised
