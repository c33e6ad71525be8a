"""`machine new`: a sheet asked for or at hand, its machine, its drawing; then a program on it, proved."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import machines
from postproc.cli.app import app
from postproc.cli.shared.guard import INTERRUPTED, guarded
from tests.machines.sheet.test_sheet import TRUNNION
from tests.postproc.pipeline.test_machines_of_the_catalogue import PART, TILTED

ANSWERS = ("Our trunnion mill", "brochure of 2023, p. 4", "B C", "none", "X",
           "762", "762 mm", "", "22.9 m/min", "", "508 mm", "upper", "900 ipm", "", "20 in", "", "22.9 m/min", "0.3 g",
           "-35 120", "50 rpm", "", "up", "unlimited", "300 deg/s", "", "anti-clockwise",
           "haas", "-381.02 -254.11", "-381.02 -254.11 -558.4", "-381.05 -254.11 -500.2", "8100 rpm",
           "102 mm to", "102 to 610 mm", "500 mm", "2.8 s")
"""with two that are refused and asked again: a length without its unit, a pivot of two numbers"""


def run(*words: str, answers: str = "") -> Result:
    return CliRunner().invoke(app, words, input=answers)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_questions_make_the_sheet_and_the_machine(folder: Path) -> None:
    got = run("machine", "new", "s.toml", "-o", "asked.toml", answers="\n".join(ANSWERS) + "\n")
    assert got.exit_code == 0, got.output
    assert "has no unit" in got.output and "not three numbers" in got.output
    assert "where B, C lie is not proved" in got.output and "no other figure of the sheet contradicts a jog" in got.output
    Path("t.toml").write_text(TRUNNION)
    assert run("machine", "new", "t.toml", "-o", "typed.toml").exit_code == 0
    asked, typed = machines.load("asked.toml"), machines.load("typed.toml")
    assert asked.structure == typed.structure
    assert [(j.name, j.point.tolist(), j.direction.tolist()) for j in asked.kinematics.chain if j.rotary] == [
        (j.name, j.point.tolist(), j.direction.tolist()) for j in typed.kinematics.chain if j.rotary]
    assert (asked.largest_spindle_speed, typed.largest_spindle_speed) == (8100.0, math.inf)
    assert (asked.limits.lower == typed.limits.lower).all() and (asked.limits.velocity == typed.limits.velocity).all()


def test_an_interruption_keeps_the_answers_and_the_same_command_goes_on(folder: Path,
                                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    """Twenty answers and Ctrl-C: they were lost."""
    class Interrupted(io.StringIO):
        def readline(self, *_: object) -> str:
            line = super().readline()
            if not line:
                raise KeyboardInterrupt
            return line

    kept, words = Path("s.toml.answers"), ["machine", "new", "s.toml", "-o", "m.toml"]
    for begin, end in ((0, 3), (3, 8), (8, 20)):
        monkeypatch.setattr("sys.stdin", Interrupted("\n".join(ANSWERS[begin:end]) + "\n"))
        monkeypatch.setattr("sys.argv", ["postproc", *words])
        assert guarded(app) == INTERRUPTED and list(folder.iterdir()) == [folder / kept]
    assert kept.read_text().splitlines() == [one for one in ANSWERS[:20] if one != "762"]
    kept.write_text(kept.read_text().replace("762 mm", "762"))  # does not fit: this one is asked for, the others stand
    assert run(*words, answers="\n".join(["762 mm", *ANSWERS[20:]]) + "\n").exit_code == 0
    assert sorted(p.name for p in folder.iterdir()) == ["m.toml", "s.toml"]
    assert machines.load("m.toml").largest_spindle_speed == 8100.0


def test_answers_that_end_too_soon_write_nothing(folder: Path) -> None:
    got = run("machine", "new", "s.toml", "-o", "m.toml", answers="Our mill\n")
    assert got.exit_code == 1 and "sheet.unanswered" in got.output and list(folder.iterdir()) == []


def test_faults_write_nothing_and_files_are_not_replaced(folder: Path) -> None:
    Path("s.toml").write_text(TRUNNION.replace('"762 mm"', '"762"'))
    got = run("machine", "new", "s.toml", "-o", "m.toml", "--drawing", "m.svg", "--json", "-")
    assert got.exit_code == 1 and not Path("m.toml").exists() and not Path("m.svg").exists()
    assert [d["lines"] for d in json.loads(got.stdout)["diagnostics"]] == [[7]]
    Path("s.toml").write_text(TRUNNION)
    assert run("machine", "new", "s.toml", "-o", "m.toml", "--drawing", "m.svg").exit_code == 0
    assert Path("m.svg").read_text().startswith("<svg")
    assert run("machine", "new", "s.toml", "-o", "m.toml").exit_code == 2
    assert run("machine", "new", "s.toml", "-o", "m.toml", "--force").exit_code == 0


def test_what_was_understood_is_said_in_both_units(folder: Path) -> None:
    Path("s.toml").write_text(TRUNNION)
    said = run("machine", "new", "s.toml", "-o", "m.toml").output
    assert "Y: -508 to 0 mm (20 in long), 22.86 m/min (900 in/min)" in said
    assert "B: -35 to 120 degrees, 50 turns/min (300 degrees/s)" in said and "C: endless, " in said


def test_machine_check_names_what_no_machine_has(folder: Path) -> None:
    Path("m.toml").write_text('base = "mill-3axis"\n[axes.X]\nvelocity = 30000\n')
    got = run("machine", "check", "m.toml", "--json", "-")
    found = json.loads(got.stdout)["diagnostics"]
    assert got.exit_code == 0 and {d["code"] for d in found} == {"machine.plausible"} and found[0]["lines"] == [3]


def test_from_a_sheet_to_a_proved_program(folder: Path) -> None:
    Path("s.toml").write_text(TRUNNION)
    Path("part.cls").write_text(PART.format(tilted=TILTED["BC"]))
    on = ("-m", "m.toml", "-c", "haas-ngc", "--setup", "p.toml")
    for words in (("machine", "new", "s.toml", "-o", "m.toml"),
                  ("setup", "new", "part.cls", *on[:4], "--yes", "-o", "p.toml", "--gauge-length", "120"),
                  ("convert", "part.cls", *on, "-o", "part.nc"), ("verify", "part.nc", "part.cls", *on)):
        got = run(*words)
        assert got.exit_code == 0, (words, got.output)
