"""`postproc time` as people and programs call it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from postproc.cli.app import app
from postproc.cycle_time.estimate import timed
from tests.postproc.kit import SAMPLES, TOOLS
from tests.postproc.time_kit import blocks, model

PROGRAM = "G21 G90 G94 G17 G64 P0.01\nG0 X0 Y0 Z300\nF3000\n" + "\n".join(
    f"G1 X{(i * i) % 17} Y{(3 * i) % 23 + i}" + f" F{1500 + 700 * (i % 5)}" * (i % 9 == 0)
    for i in range(1, 32)) + "\nG0 Z350\nM2\n"


def call(*words: object) -> Result:
    return CliRunner().invoke(app, ["time", *(str(word) for word in words)])


def figures(*words: object) -> dict:
    result = call(*words, "--json", "-")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "part.ngc").write_text(PROGRAM)
    return tmp_path / "part.ngc"


def check(values: dict) -> None:
    low, high = values["band_s"]
    assert 0.0 < values["lower_bound_s"] <= values["cycle_time_s"]
    assert low < values["cycle_time_s"] < high
    assert sum(op["time_s"] for op in values["operations"]) == pytest.approx(values["cycle_time_s"], rel=1e-5)
    held = sum(sum(axis.values()) for axis in values["limiting"].values())
    assert values["feed_s"] + held <= values["cycle_time_s"]
    assert all(set(axis) == {"velocity_s", "acceleration_s", "jerk_s"} for axis in values["limiting"].values())


def test_a_cl_file(tmp_path: Path) -> None:
    values = figures(SAMPLES / "pocket.cls", "-m", "mill-3axis", "-c", "linuxcnc", "--setup", TOOLS)
    check(values)
    assert [op["operation"] for op in values["operations"]] == ["POCKET", "CONTOUR", "DRILL_CORNERS"]
    assert any(place["cl_line"] for place in values["most_expensive"])
    assert values["causes"]["tool_change_s"] >= 10.0 and len(values["most_expensive"]) == 10


def test_a_cl_file_is_timed_with_its_errors_corrected() -> None:
    given = SAMPLES / "pocket.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", TOOLS
    values = figures(*given, "--error-model", SAMPLES / "errors" / "mikron-ucp710.toml")
    check(values)
    assert values["cycle_time_s"] != figures(*given)["cycle_time_s"]
    wrong = call(*given, "--error-model", "nowhere.toml")
    assert wrong.exit_code == 1 and "nowhere.toml" in wrong.output


def test_a_program_under_every_model(program: Path) -> None:
    times = {}
    for name in ("linuxcnc", "lookahead", "ideal"):
        values = figures(program, "-m", "mill-3axis", "--model", name)
        check(values)
        times[name] = values["cycle_time_s"]
    assert times["ideal"] < times["lookahead"]
    text = call(program, "-m", "mill-3axis").stdout
    assert "95 % between" in text and "NC line" in text


def test_the_same_program_for_another_control(program: Path) -> None:
    program.write_text(PROGRAM.replace("G64 P0.01", ""))
    values = figures(program, "-m", "mill-3axis", "-c", "generic-iso")
    check(values)
    assert values["model"] == "control" and "corner_tolerance" in values["assumed"]


SLOW = """G21 G90 G94 G17 G64 P0.01
M3 S1000
G0 X0 Y0 Z300
F60
G1 X100
G4 P3
G93 G1 Y100 F1
G94 F60
G0 X0 Y0
G98 G84 Z295 R300 F100
G80
M5
M2
"""
"""200 mm of cuts in 160 s (G94 and G93), a dwell of 3 s, a tap of 5 mm at 100 mm/min out and back, rapids"""


@pytest.mark.parametrize("name", ["linuxcnc", "lookahead", "ideal"])
def test_the_feed_override_is_of_cuts_alone(tmp_path: Path, name: str) -> None:
    (tmp_path / "part.ngc").write_text(SLOW)
    given = tmp_path / "part.ngc", "-m", "mill-3axis", "-c", "linuxcnc", "--model", name
    whole, half, double = figures(*given), figures(*given, "--override", 50), figures(*given, "--override", 200)
    assert [v["feed_override_percent"] for v in (whole, half, double)] == [100.0, 50.0, 200.0]
    for other, factor in ((half, 2.0), (double, 0.5)):
        longer = 160.0 * (factor - 1.0)
        assert other["cycle_time_s"] - whole["cycle_time_s"] == pytest.approx(longer, abs=0.5)
        assert other["lower_bound_s"] - whole["lower_bound_s"] == pytest.approx(longer, abs=0.5)
        assert other["rapids_s"] == pytest.approx(whole["rapids_s"], abs=0.02)
        assert other["causes"]["dwell_s"] == whole["causes"]["dwell_s"] == pytest.approx(3.0, abs=0.01)
        check(other)
    assert "feed override 50 %: of feeds, not of rapids, taps and dwells" in call(*given, "--override", 50).stdout
    assert "override" not in call(*given).stdout.replace("model", "")


def test_the_feed_override_of_a_cl_file() -> None:
    given = SAMPLES / "pocket.cls", "-m", "mill-3axis", "-c", "linuxcnc", "--setup", TOOLS
    whole, half = figures(*given), figures(*given, "--override", 50)
    assert half["cutting_s"] > 1.6 * whole["cutting_s"] and half["rapids_s"] == pytest.approx(whole["rapids_s"], rel=1e-3)


def test_a_log_calibrates_into_a_file(program: Path, tmp_path: Path) -> None:
    truth = model("control").model_copy(update={"corner_tolerance": 0.004, "stated_share": 0.4, "override": 0.9})
    b = blocks(PROGRAM.removesuffix("M2\n"))
    stamps = timed(b, truth).begin + np.random.default_rng(0).normal(0.0, 1e-3, len(b))
    rows = "".join(f"{n},{t:.4f}\n" for n, t in zip(b.line, np.maximum.accumulate(stamps), strict=True))
    (tmp_path / "log.csv").write_text(f"nc_line,time_s\n{rows}")
    shop = tmp_path / "shop.toml"
    common = (program, "-m", "mill-3axis", "--model", "lookahead")
    values = figures(*common, "--calibrate", tmp_path / "log.csv", "-o", shop)
    found = values["calibration"]["parameters"]
    c = values["calibration"]
    assert found["corner_tolerance"]["value"] < 0.008
    assert c["modelled_after_s"] == pytest.approx(c["measured_s"], rel=0.005)
    assert found["override"]["value"] == pytest.approx(0.9, rel=0.02)
    assert values["calibration"]["rms_after_s"] < 0.2 * values["calibration"]["rms_before_s"]
    again = figures(program, "-m", "mill-3axis", "--model", shop)
    assert again["cycle_time_s"] == values["cycle_time_s"] and again["band_s"] == values["band_s"]
    before = figures(*common)
    width = [v["band_s"][1] - v["band_s"][0] for v in (again, before)]
    assert width[0] < 0.6 * width[1]


@pytest.mark.parametrize(("words", "code", "message"), [
    (("none.ngc", "-m", "mill-3axis"), 1, "time.open"),
    (("{program}", "-m", "mill-99"), 1, "mill-99"),
    (("{program}", "-m", "mill-3axis", "--model", "crystal-ball"), 1, "crystal-ball"),
    (("{program}", "-m", "mill-3axis", "--calibrate", "none.csv"), 1, "time.open"),
    (("{program}", "-m", "mill-3axis", "-o", "x.toml"), 2, "--calibrate"),
    (("{program}", "-m", "mill-3axis", "--units", "feet"), 2, "feet"),
    (("{program}", "-m", "mill-3axis", "--override", "0"), 2, "--override"),
    (("{program}", "-m", "mill-3axis", "--json", "{program}"), 2, "would replace"),
    (("{program}",), 2, "--machine"),
])
def test_wrong_use(program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], code: int,
                   message: str) -> None:
    monkeypatch.chdir(tmp_path)
    result = call(*(word.format(program=program) for word in words))
    assert result.exit_code == code and message in result.output and "Traceback" not in result.output


def test_faults_of_the_program(program: Path) -> None:
    program.write_text("%\nG21 G90 G94\nG1 X10\nG777 X3\nM2\n%\n")
    result = call(program, "-m", "mill-3axis", "--json", "-")
    assert result.exit_code == 1 and "gcode.unknown_code" in result.output
