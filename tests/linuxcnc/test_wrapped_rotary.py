"""LinuxCNC's own interpreter with WRAPPED_ROTARY = 1: it turns the modulo axis as planned, and as our reader reads it."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from postproc.control.rollover import Rollover
from tests.postproc.control.test_rollover import c_of, converted, positions

pytestmark = pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC's interpreter rs274 is not installed "
                                "(Debian: apt-get install linuxcnc-uspace)")
INI = """[EMC]
MACHINE = wrapped
VERSION = 1.1
[RS274NGC]
PARAMETER_FILE = {folder}/wrapped.var
[TRAJ]
COORDINATES = XYZAC
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
[AXIS_C]
WRAPPED_ROTARY = 1
"""


def turned(text: str, folder: Path) -> np.ndarray:
    """Degrees of C at the end of every move, as LinuxCNC interprets a program."""
    (folder / "wrapped.ini").write_text(INI.format(folder=folder))
    (folder / "wrapped.var").write_text("5161\t0\n")
    (folder / "wrapped.tbl").write_text("".join(f"T{n} P{n} Z0\n" for n in range(1, 6)))
    (folder / "wrapped.ngc").write_text(text)
    done = subprocess.run(["rs274", "-i", "wrapped.ini", "-t", "wrapped.tbl", "-g", "wrapped.ngc"], capture_output=True,
                          text=True, timeout=60, check=False, cwd=folder)
    assert "PROGRAM_END" in done.stdout, (done.stdout + done.stderr)[-500:]
    return np.array([float(m.rsplit(",", 1)[1]) for m in re.findall(r"STRAIGHT_\w+\(([^)]*)\)", done.stdout)])


def changes(column: np.ndarray) -> np.ndarray:
    """What a column comes to, without those that stay."""
    column = np.concatenate([[0.0], column])
    return column[1:][np.abs(np.diff(column)) > 1e-9]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_written_program_winds_the_axis_as_planned(sense: float, tmp_path: Path) -> None:
    result = converted("linuxcnc", "sign", sense)
    ours, theirs = changes(c_of(result)), changes(turned(result.text, tmp_path))
    assert len(ours) > 60 and np.abs(ours).max() > 1000.0
    assert ours == pytest.approx(theirs, abs=1e-4)


def test_words_are_read_as_linuxcnc_reads_them(tmp_path: Path) -> None:
    """Random words of both signs, zeros of both, steps (G91) and machine coordinates; none where the axis stands."""
    some = np.random.default_rng(7)
    blocks = ["G21 G90 G94 F100 G1 X0", "C1"]
    values, kinds = some.uniform(-359.0, 359.0, 200).round(3).tolist(), some.integers(0, 12, 200).tolist()
    for value, kind in zip(values, kinds, strict=True):
        word = {0: "C0", 1: "C-0", 2: f"G91 C{value}\nG90 X0", 3: f"G53 G0 C{value}\nG1 X0"}.get(kind, f"C{value}")
        blocks += [] if word in ("C0", "C-0") and blocks[-1] in ("C0", "C-0") else word.split("\n")
    got, bad = positions("linuxcnc", Rollover("sign"), *(b for b in blocks))
    assert not bad
    theirs = turned("\n".join(["%", *blocks, "M2", "%"]) + "\n", tmp_path)
    stated = np.array([b.startswith(("C", "G53")) for b in blocks if not b.startswith("G90 X0")])
    assert len(got) == stated.sum() > 100
    assert np.isin(np.array(got).round(3), theirs.round(3)).all()
    assert got[-1] == pytest.approx(theirs[-1], abs=1e-3) or blocks[-1].startswith(("G9", "X"))


def test_a_word_where_the_axis_stands_may_turn_it_once_round(tmp_path: Path) -> None:
    """Why such words are neither written nor read: of LinuxCNC itself."""
    assert positions("linuxcnc", Rollover("sign"), "G1 C307.236 F100", "C127.687", "C127.687")[1] == {"gcode.rollover"}
    words = np.random.default_rng(3).uniform(-359.0, 359.0, 300).round(3).tolist()
    pairs = [f"C{w}\nC{abs(w)}" for w in words]
    column = turned("\n".join(["%", "G21 G90 G94 F100 G1 X0", *pairs, "M2", "%"]) + "\n", tmp_path)
    again = np.abs(column[2::2] - column[1::2])
    assert set(again.round(3).tolist()) == {0.0, 360.0}
