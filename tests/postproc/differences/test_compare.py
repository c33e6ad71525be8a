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

HEAD = "%\nG21 G90 G17 G40 G49 G80 G94 G91.1\nG54\nG53 G0 Z0\nT1 M6\nS1000 M3\nM8\nG0 X0 Y0\nG43 H1 Z50\nG0 Z2\n"
CUT = "G1 Z-1 F300\nX20\nG2 X20 Y20 J10\nG1 X0\nG0 Z50\n"
SECOND = "G0 X40 Y0\nG0 Z2\nG1 Z-1 F300\nY20\nG0 Z50\n"
END = "G53 G0 Z0\nM5 M9\nM2\n%\n"
SETUP = "[part]\norigin = [0, 0, -150]\n[tools.1]\ngauge_length = 60.0\n"


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
    assert found.tip < 1e-12 and found.backward


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
