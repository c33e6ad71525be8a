"""Two programs: what is written otherwise is the same, what moves or turns otherwise is found with its lines."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.differences.distance import gap
from postproc.differences.order import in_order

HEAD = "%\nG21 G90 G17 G40 G49 G80 G94 G91.1\nG54\nG53 G0 Z0\nT1 M6\nS1000 M3\nM8\nG0 X0 Y0\nG43 H1 Z50\nG0 Z2\n"
CUT = "G1 Z-1 F300\nX20\nG2 X20 Y20 J10\nG1 X0\nG0 Z50\n"
SECOND = "G0 X40 Y0\nG0 Z2\nG1 Z-1 F300\nY20\nG0 Z50\n"
END = "G53 G0 Z0\nM5 M9\nM2\n%\n"
SETUP = ("[part]\norigin = [0, 0, -150]\n[tools.1]\ngauge_length = 60.0\n[tools.2]\ngauge_length = 80.0\n"
         "[tools.3]\ngauge_length = 80.0\n")


DRILLS = "G0 X60 Y0\nG98 G81 X60 Y0 Z-5 R2 F100\nX70\nG80\n"
EXPANDED = "G0 X60 Y0\n" + "".join(f"G0 X{x}\nG0 Z2\nG1 Z-5 F100\nG0 Z50\n" for x in (60, 70))
THIRD = "G53 G0 Z0\nM5 M9\nT2 M6\nS2000 M3\nM8\nG0 X0 Y40\nG43 H2 Z50\nG0 Z2\nG1 Z-1 F200\nX30\nX40\nG0 Z50\n"
WHOLE = HEAD + CUT + SECOND + DRILLS + THIRD + END


def _compared(folder: Path, a: str, b: str, *words: str) -> tuple[dict[str, object], str]:
    (folder / "a.ngc").write_text(a, encoding="utf-8")
    (folder / "b.ngc").write_text(b, encoding="utf-8")
    (folder / "s.toml").write_text(SETUP, encoding="utf-8")
    target = folder / "out.json"
    ran = CliRunner().invoke(app, ["compare", str(folder / "a.ngc"), str(folder / "b.ngc"), "-m", "mill-3axis",
                                   "-c", "linuxcnc", "--setup", str(folder / "s.toml"), "--json", str(target), *words])
    assert ran.exit_code == 0, ran.output
    return json.loads(target.read_text("utf-8")), ran.output


def test_what_is_written_otherwise_is_the_same(tmp_path: Path) -> None:
    cut = CUT.replace("X20\n", "G1 X7.5\nX13\nX20 F300\n", 1)
    other = HEAD.replace("G21 G90", "(NOTE)\nN5 G21\nN6 G90") + cut + SECOND + END
    values, text = _compared(tmp_path, HEAD + CUT + SECOND + END, other)
    assert values["same"] is True and values["cuts"] == 2 and values["states"] == [] and values["lone"] == []
    assert values["worst_cut"]["tip_mm"] < 1e-9 and "cuts: the same, 2 in A" in text
    assert values["cycle_time_s"][0] == pytest.approx(values["cycle_time_s"][1], rel=0.02)


def test_an_arc_by_chords_is_as_far_off_as_its_chords(tmp_path: Path) -> None:
    """A half circle of radius 10 by 8 chords: r (1 - cos(pi / 16)) at the middle of each."""
    steps = [math.pi * (k + 1) / 8 for k in range(8)]
    chords = "".join(f"G1 X{20 - 10 * math.sin(t):.6f} Y{10 - 10 * math.cos(t):.6f}\n" for t in steps)
    values, _ = _compared(tmp_path, HEAD + CUT + END, HEAD + CUT.replace("G2 X20 Y20 J10\n", chords) + END)
    assert values["same"] is False
    assert values["worst_cut"]["tip_mm"] == pytest.approx(10 * (1 - math.cos(math.pi / 16)), rel=0.02)
    assert values["worst_cut"]["line_a"] == 13 and 13 <= values["worst_cut"]["line_b"] <= 20


@pytest.mark.parametrize(("old", "new", "what", "a", "b"), [
    ("X20\n", "X20 F310\n", "feed", "300 mm/min", "300 mm/min, then 310 mm/min"),
    ("S1000", "S1200", "spindle", "1000 rev/min", "1200 rev/min"),
    ("M3", "M4", "spindle", "1000 rev/min", "1000 rev/min anti-clockwise"),
    ("M8\n", "", "coolant", "flood", "off")])
def test_states_that_differ_are_named(old: str, new: str, what: str, a: str, b: str, tmp_path: Path) -> None:
    values, text = _compared(tmp_path, HEAD + CUT + END, (HEAD + CUT + END).replace(old, new, 1))
    assert [(s["what"], s["a"], s["b"]) for s in values["states"]] == [(what, a, b)]
    assert values["same"] is False and "different" in text and what in text


def test_a_cut_that_one_alone_has_is_named_with_its_line(tmp_path: Path) -> None:
    values, text = _compared(tmp_path, HEAD + CUT + SECOND + END, HEAD + CUT + END)
    cuts = values["lone"]
    assert [(one["program"], one["line"]) for one in cuts] == [("a", 18)] and cuts[0]["length_mm"] == pytest.approx(23.0)
    assert values["same"] is False and "in one program alone" in text
    assert _compared(tmp_path, HEAD + CUT + END, HEAD + SECOND + CUT.replace("G1 Z-1", "G0 X0 Y0\nG0 Z2\nG1 Z-1") + END)[0][
        "worst_cut"]["tip_mm"] < 1e-9


def test_another_direction_is_another_cut(tmp_path: Path) -> None:
    there_and_back = HEAD + "G1 Z-1 F300\nX30\nX0\nG0 Z50\n" + END
    values, _ = _compared(tmp_path, there_and_back, there_and_back)
    assert values["same"] is True
    straight = np.column_stack([np.linspace(0, 30, 5), np.zeros(5), np.zeros(5)])
    up = np.tile([0.0, 0.0, 1.0], (5, 1))
    found = gap(straight, up, straight[::-1].copy(), up)
    assert found.tip < 1e-12 and found.reordered


def test_two_machines_and_controls_and_a_picture(tmp_path: Path) -> None:
    samples = Path(__file__).parents[3] / "samples"
    for name, machine, controller in (("a.ngc", "mikron-ucp710", "linuxcnc"), ("b.h", "trunnion-bc", "heidenhain-tnc640")):
        ran = CliRunner().invoke(app, ["convert", str(samples / "test_part.cls"), "-m", machine, "-c", controller, "-o",
                                       str(tmp_path / name), "--setup", str(samples / "tools.setup.toml")])
        assert ran.exit_code == 0, ran.output
    both = ["compare", str(tmp_path / "a.ngc"), str(tmp_path / "b.h"), "-m", "mikron-ucp710", "-m", "trunnion-bc",
            "-c", "linuxcnc", "-c", "heidenhain-tnc640",
            "--setup", str(samples / "tools.setup.toml"), "--figure", str(tmp_path / "f.svg")]
    ran = CliRunner().invoke(app, both)
    assert ran.exit_code == 0 and "cuts: the same" in ran.output, ran.output
    assert b"<svg" in (tmp_path / "f.svg").read_bytes()
    assert CliRunner().invoke(app, [*both, "-m", "mill-3axis"]).exit_code == 2


@pytest.mark.parametrize(("old", "new", "cuts", "named"), [
    ("G0 X40 Y0\nG0 Z2\n", "G0 Z-3\nG0 X40 Y0\nG0 Z2\n", True, "between cuts: different"),  # a rapid through the part
    ("G43 H1 Z50\n", "G43 H1 Z50\nG0 Z-10\n", True, "between cuts: different"),
    ("X40\nG0 Z50\nG53", "X40\nG0 Z-20\nG0 Z50\nG53", True, "between cuts: different"),  # behind the last cut
    ("G98", "G99", True, "between cuts: different"),
    ("G43 H2", "G43 H1", False, "length"),
    ("G43 H2", "G43 H3", False, "length register"),  # of the same length
    ("M8\nG0 X0 Y40", "G0 X0 Y40", False, "coolant"),
    ("S2000 M3", "S2000", False, "standing"),
    ("X30\n", "G41 D2 X30\n", False, "left"),
    ("X30\n", "X30\nG4 P2\n", False, "dwell"),
    ("G0 X40 Y0\n", "G4 P5\nG0 X40 Y0\n", True, "dwell between cuts"),
    ("G81 X60 Y0 Z-5 R2", "G82 P1 X60 Y0 Z-5 R2", False, "dwell"),
    ("G81 X60 Y0 Z-5 R2", "G83 Q1 X60 Y0 Z-5 R2", False, "rapids of the cycle"),
    ("X60 Y0 Z-5 R2 F100\nX70", "X70 Y0 Z-5 R2 F100\nX60", False, "10.0000"),
    ("G54\n", "G55\n", False, "work offset"),
    ("G0 X40 Y0\n", "M0\nG0 X40 Y0\n", True, "M0 before cut 2"),
    ("X30\n", "X30\nM1\n", True, "M1 in cut 5"),
    ("M5 M9\nM2", "M5 M9\nT3 M6\nM2", True, "tool change to T3 at the end"),
    ("T2 M6", "T3 M6", False, "in one program alone"),
    ("X30\nX40", "X30\nX40\nX30\nX40", False, "other order"),  # a spring pass
    ("G54\n", "G54\nG64 P1\n", False, "smoothing"),
    ("Z-1 F200\nX30\n", "Z-1 F200\nX20\nX30\n", True, "the same")])
def test_planted_changes_are_never_the_same(old: str, new: str, cuts: bool, named: str, tmp_path: Path) -> None:
    assert WHOLE.count(old)
    values, text = _compared(tmp_path, WHOLE, WHOLE.replace(old, new, 1))
    assert values["same_cuts"] is cuts and values["same"] is (named == "the same") and named in text, text
    assert "not compared: " in text


def test_a_feed_that_changes_at_another_place_is_found(tmp_path: Path) -> None:
    a, b = (WHOLE.replace("X30\nX40\n", f"X{x} \nF100 X40\n") for x in (20, 30))
    state = _compared(tmp_path, a, b)[0]["states"]
    assert [(s["what"], s["a"][:8], s["b"][:8]) for s in state] == [("feed changes at", "x 20.000", "x 30.000")]
    timed = WHOLE.replace("G1 Z-1 F200\nX30\nX40\n", "G93 G1 Z-1 F20\nX30 F10\nX40 F10\nG94\n")
    state = _compared(tmp_path, timed, timed.replace("X40 F10", "X40 F5"))[0]["states"]
    assert [(s["what"], s["a"], s["b"]) for s in state] == [("inverse time", "15 s", "21 s")]


def test_a_cycle_and_its_moves_are_the_same(tmp_path: Path) -> None:
    values, text = _compared(tmp_path, WHOLE, WHOLE.replace(DRILLS, EXPANDED))
    assert values["same"] is True, text


def test_inches_are_the_same(tmp_path: Path) -> None:
    a = HEAD + "G1 Z-1 F300\nX20\nG0 Z50\n" + END
    b = HEAD.replace("G21", "G20").replace("Z50", "Z1.968504").replace("Z2", "Z.078740").replace("G54", "G54 G64 P0") + \
        "G1 Z-.039370 F11.811\nX.787402\nG0 Z1.968504\n" + END
    values, text = _compared(tmp_path, a.replace("G54", "G54 G64 P0"), b)
    assert values["same"] is True, text


def test_order_of_curves() -> None:
    """A circle run the other way round, and one run twice, are the same set of places."""
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = 10.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    assert in_order(circle, circle.copy(), 0.0) and in_order(circle, circle[::3].copy(), 0.04)
    assert not in_order(circle, circle[::-1].copy(), 0.0) and not in_order(circle, np.vstack([circle, circle]), 0.0)


def test_one_cut_more_among_many_alike_is_found_at_once(tmp_path: Path) -> None:
    """Cuts between the same two places: a search for common runs of all of them takes time by the square of their number."""
    one = "G1 Z-1 F300\nX20\nG0 Z5\nG0 X0\n"
    values, _ = _compared(tmp_path, HEAD + 300 * one + END, HEAD + 301 * one + END)
    assert len(values["lone"]) == 1 and not values["apart"] and values["same"] is False


def test_lines_of_a_subprogram_come_with_its_file(tmp_path: Path) -> None:
    for name, far in (("one", 20), ("two", 25)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "p.nc").write_text("%\nO0001\nG21 G90 G17 G40 G49 G80 G94\nG54\nT1 M6\nS1000 M3\nG0 X0. Y0.\n"
                                              "G43 H1 Z50.\nM98 P2000\nG0 Z50.\nM30\n%\n", encoding="utf-8")
        (tmp_path / name / "O2000.nc").write_text(f"%\nO2000\nG0 Z2.\nG1 Z-1. F300.\nX{far}.\nM99\n%\n", encoding="utf-8")
    ran = CliRunner().invoke(app, ["compare", str(tmp_path / "one/p.nc"), str(tmp_path / "two/p.nc"), "-m", "mill-3axis",
                                   "-c", "fanuc-30i", "--json", str(tmp_path / "o.json")])
    assert ran.exit_code == 0 and "O2000.nc:5" in ran.output, ran.output
    worst = json.loads((tmp_path / "o.json").read_text("utf-8"))["worst_cut"]
    assert (worst["line_a"], worst["file_a"], worst["tip_mm"]) == (5, "O2000.nc", pytest.approx(5.0))
