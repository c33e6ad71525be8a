"""Times side by side, what if, tables by tool and cause, CSV and the drawing, as the command line gives them."""

from __future__ import annotations

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from postproc.cli.app import app
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate, timed, total
from postproc.cycle_time.shares import operations, shares
from postproc.time_study.side_by_side import names, short
from postproc.time_study.tables import by_tool
from postproc.time_study.time_figure import along_path, time_figure
from postproc.time_study.what_if import machine_with, model_with, parsed
from tests.postproc.time_kit import blocks, machine, model
from toolpaths.diagnostics import DiagnosticError

TWO_TOOLS = """G21 G90 G94 G17 G64 P0.01
T1 M6
G0 X0 Y0 Z300
F600
G1 X100
G1 Y50
T2 M6
G0 X0
F1200
G1 Y100
"""
"""T1 cuts 150 mm at 600 mm/min, T2 50 mm at 1200"""


def call(*words: object) -> Result:
    return CliRunner().invoke(app, ["time", *(str(word) for word in words)])


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "part.ngc").write_text(TWO_TOOLS + "M2\n")
    return tmp_path / "part.ngc"


@cache
def two_tools() -> MotionBlocks:
    return blocks(TWO_TOOLS, machine("mill-3axis", timing=True))


@cache
def of_two_tools() -> Estimate:
    return estimate(two_tools(), machine("mill-3axis", timing=True), model("linuxcnc"), with_band=False)


def test_the_table_by_tool_is_the_program() -> None:
    e = of_two_tools()
    rows = by_tool(e, shares(e))
    assert [row["tool"] for row in rows] == [1, 2] and [row["changes"] for row in rows] == [1, 1]
    assert [row["cut_mm"] for row in rows] == pytest.approx([150.0, 50.0])
    assert [row["in_cut_s"] for row in rows] == pytest.approx([15.0, 2.5], abs=0.3)
    assert sum(float(str(row["time_s"])) for row in rows) == pytest.approx(e.seconds, rel=1e-6)
    change = machine("mill-3axis", timing=True).timing.tool_change
    assert float(str(rows[1]["time_s"])) == pytest.approx(2.5 + change, abs=1.0)
    same = operations(e, shares(e))
    assert [row["operation"] for row in same] == ["T1", "T2"]
    assert [row["tool_change_s"] for row in same] == pytest.approx([change, change], abs=0.1), "both were those of T1"
    assert [row["time_s"] for row in same] == pytest.approx([row["time_s"] for row in rows])


def test_cuts_count_by_the_tip_on_the_part_whatever_the_words_are() -> None:
    """On a turning table: once round at 50 mm, then out and round at once, a spiral of 25 to 50 mm; rapids do not count."""
    at = machine("mikron-ucp710")
    text = "G21 G90 G94 G17\nG0 Z100\nG0 X50\nF3000\nG1 C360\nG1 X25\nG1 X50 C450\nG0 C0\n"
    e = estimate(blocks(text, at), at, model("linuxcnc"), with_band=False)
    row, = by_tool(e, shares(e))
    phi = np.linspace(0.0, np.pi / 2.0, 2001)
    spiral = (25.0 + phi * 50.0 / np.pi) * np.exp(1j * phi)
    expected = 100.0 * np.pi + 25.0 + float(np.abs(np.diff(spiral)).sum())
    assert row["cut_mm"] == pytest.approx(expected, rel=3e-4)


def test_what_if_is_the_machine_with_that_value() -> None:
    m = machine("mill-3axis", timing=True)
    asked = parsed("X.acceleration=1.3, jerk=2,tool_change=0.5,corner_tolerance=3", m)
    other = machine_with(m, asked)
    assert np.allclose(other.limits.acceleration / m.limits.acceleration, [1.3, 1.0, 1.0])
    assert np.allclose(other.limits.jerk / m.limits.jerk, 2.0) and np.allclose(other.limits.velocity, m.limits.velocity)
    assert other.timing.tool_change == pytest.approx(0.5 * m.timing.tool_change)
    assert model_with(model("lookahead"), asked).stated_share == pytest.approx(3.0)
    e = total(two_tools(), timed(two_tools(), model("linuxcnc")))
    quick = blocks(TWO_TOOLS, other)
    assert e - total(quick, timed(quick, model("linuxcnc"))) == pytest.approx(m.timing.tool_change, abs=0.2)


@pytest.mark.parametrize("text", ["Q.velocity=2", "X.acceleration", "X.acceleration=", "X.acceleration=-1", "jerk=nan",
                                  "jerk=1e9", "=2", "X.acceleration=1,2", ""])
def test_a_wrong_what_if_is_reported(text: str) -> None:
    with pytest.raises(DiagnosticError) as fault:
        parsed(text, machine())
    assert [d.code for d in fault.value.diagnostics] == ["time.what_if"]


def test_every_variant_has_a_name_of_its_own() -> None:
    assert names([("a", ""), ("a", "")]) == ["a", "a (2)"]
    assert names([("a", ""), ("a", "jerk=2"), ("a", "")]) == ["as it is", "jerk=2", "as it is (2)"]
    assert short([Path("x/a.nc"), Path("y/a.nc"), Path("x/b.nc"), Path("x/b.nc")]) == ["x/a.nc", "y/a.nc", "b.nc", "b.nc"]


def test_an_axis_of_any_of_the_machines_may_be_asked_for() -> None:
    asked = parsed("A.velocity=2", machine(), machine("mikron-ucp710"))
    assert machine_with(machine(), asked).limits.velocity.tolist() == machine().limits.velocity.tolist()
    changed = machine_with(machine("mikron-ucp710"), asked).limits.velocity / machine("mikron-ucp710").limits.velocity
    assert changed.tolist() == [1.0, 1.0, 1.0, 2.0, 1.0]


def test_a_what_if_without_effect_is_named_and_messages_come_once(program: Path) -> None:
    result = call(program, program, "-m", "mill-3axis", "--what-if", "X.jerk=0.5", "--what-if", "tool_change=0.5",
                  "--json", "-")
    found = json.loads(result.stdout)["diagnostics"]
    assert [(d["code"], d["message"].split()[1]) for d in found] == [("time.no_effect", "X.jerk=0.5")]
    assert call(program, "-m", "mill-3axis", "--what-if", "").exit_code == 2


def test_side_by_side_and_files(program: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.ngc"
    other.write_text(TWO_TOOLS.replace("F600", "F1200") + "M2\n")
    given = program, other, "-m", "mill-3axis", "--what-if", "tool_change=0.5"
    result = call(*given, "--json", "-", "--csv", tmp_path / "t.csv", "--figure", tmp_path / "f.svg")
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)["variants"]
    assert [row["name"] for row in rows] == ["part.ngc, as it is", "part.ngc, tool_change=0.5", "other.ngc, as it is",
                                             "other.ngc, tool_change=0.5"]
    assert rows[2]["difference_s"] == pytest.approx(-7.5, abs=0.3)
    assert rows[1]["difference_s"] == pytest.approx(-5.0, abs=0.1)
    table = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert {row["table"] for row in table} == {"program", "tool", "operation", "cause"}
    wanted = "other.ngc, as it is", "T1", "cut_mm"
    found = [row for row in table if (row["program"], row["row"], row["quantity"]) == wanted]
    assert float(found[0]["value"]) == pytest.approx(150.0)
    assert "programmed feed" in (tmp_path / "f.svg").read_text()
    text = call(*given).stdout
    assert "to the first" in text and text.count("\n") == 5


def test_equal_causes_are_one_line(program: Path) -> None:
    text = call(program, "-m", "mill-3axis").stdout
    lost = text[text.index("losses against"):]
    assert lost.count("tool change") <= 2 and "most at NC line" in lost and "by tool:" in text


def test_a_total_in_the_place_of_a_log(program: Path) -> None:
    text = call(program, "-m", "mill-3axis", "--model", "lookahead", "--calibrate", "0:00:30").stdout
    assert "fit to 0:00:30: 1 section, 30.00 s measured" in text
    assert call(program, program, "-m", "mill-3axis", "--calibrate", "30").exit_code == 2


def test_the_drawing_shows_speed_and_feed_along_the_path() -> None:
    e = of_two_tools()
    drawn = along_path(e, shares(e))
    assert drawn.at[-1] == pytest.approx(float(np.linalg.norm(np.diff(e.blocks.xyz, axis=0), axis=1).sum()) / 1000.0)
    feeds = drawn.feed[np.isfinite(drawn.feed)]
    assert set(np.round(feeds, 6)) == {600.0, 1200.0}
    assert (drawn.speed[np.isfinite(drawn.feed)] <= feeds * (1.0 + 1e-9)).all()
    first, again = (time_figure(e, shares(e), "part.ngc", ".svg") for _ in range(2))
    assert first == again and time_figure(e, shares(e), "part.ngc", ".png")[:4] == b"\x89PNG"


TIP = """G21 G90 G17 G40 G49 G80 G94 G98 G54
T1 M6
G43.4 H1
G0 X1. Y2. Z50.
G1 X5. A10. F3000.
G1 X9. A60.
G1 X20. A10.
G49
M2
"""


def test_gauge_lengths_that_nobody_states_widen_the_band(tmp_path: Path) -> None:
    """A program under the control's own kinematics: whatever the length is, its time lies in the band."""
    (tmp_path / "tip.nc").write_text(TIP)
    given = tmp_path / "tip.nc", "-m", "mikron-ucp710", "-c", "fanuc-30i"
    result = call(*given, "--json", "-")
    values = json.loads(result.stdout)
    assert "time.length" in result.stderr
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 230\n")
    stated = call(*given, "--setup", tmp_path / "s.toml", "--json", "-")
    known = json.loads(stated.stdout)
    assert "time.length" not in stated.stderr
    assert abs(known["cycle_time_s"] / values["cycle_time_s"] - 1.0) > 0.03
    low, high = values["band_s"]
    assert low < known["cycle_time_s"] < high
    assert values["doubts_s"]["gauge lengths not known"] > 0.02 * values["cycle_time_s"]
    assert "gauge lengths not known" not in known["doubts_s"]
