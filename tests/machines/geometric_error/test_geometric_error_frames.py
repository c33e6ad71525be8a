"""Whose directions the errors of a rotary axis have: the bed's unless the file says otherwise; stated when written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from machines.kinematics.serial import Serial
from toolpaths.arrays import Floats
from toolpaths.rotations import rotation


def model(folder: Path, machine: str, text: str) -> ErrorModel:
    (folder / "e.toml").write_text(text)
    return load(folder / "e.toml", machines.load(machine))


def off(found: ErrorModel, machine: str, letter: str, angle: float) -> tuple[Floats, Floats]:
    """(displacement (3,) of the gauge point, nominal turn (3, 3) of the axis) with all other joints at 0."""
    kin = machines.load(machine).kinematics
    assert isinstance(kin, Serial)
    q = np.zeros((1, kin.joints))
    q[0, kin.axis_names.index(letter)] = angle
    joint = next(j for j in kin.chain if j.name == letter)
    return found.on(kin).place(q)[0][0] - kin.forward(q)[0][0], rotation(joint.direction, np.array([angle]))[0]


@pytest.mark.parametrize(("machine", "letter", "bed"), [("mikron-ucp710", "C", "moving"), ("mikron-ucp710", "A", "moving"),
                                                        ("fork-head-ab", "B", "fixed"), ("nutating-head", "C", "fixed")])
def test_the_probe_that_stands_on_the_bed_is_the_default(tmp_path: Path, machine: str, letter: str,
                                                         bed: str) -> None:
    """A radial error along y (C, B: x) of the bed; a table's turns with the part, a head's does not."""
    direction = "Y" if letter == "A" else "X"
    toml = f"[components.E{direction}{letter}]\nmean = 10.0\n"
    unit = np.eye(3)["XYZ".index(direction)]
    for frame in ("", "bed", "fixed", "moving"):
        stated = f'[reference.{letter}]\nframe = "{frame}"\n' if frame else ""
        found, turned = off(model(tmp_path, machine, toml + stated), machine, letter, 0.7)
        expected = turned @ unit if (bed if frame in ("", "bed") else frame) == "moving" else unit
        np.testing.assert_allclose(found, 0.010 * expected, atol=1e-12)


def test_a_constant_of_one_frame_is_a_wave_of_the_other(tmp_path: Path) -> None:
    """e_moving = R(q)^T e_fixed with the turn R of the axis: what a reader of another convention converts by."""
    fixed = model(tmp_path, "mikron-ucp710", '[components.EXC]\ncosine = [10.0]\n[components.EYC]\nsine = [10.0]\n'
                                             '[reference.C]\nframe = "fixed"\n')
    moving = model(tmp_path, "mikron-ucp710",
                   '[components.EXC]\nmean = 10.0\n[reference.C]\nframe = "moving"\n')
    for angle in (0.0, 0.4, 2.0, -3.0):
        one, two = (off(m, "mikron-ucp710", "C", angle)[0] for m in (fixed, moving))
        np.testing.assert_allclose(one, two, atol=1e-12)


def test_what_is_written_states_the_frame(tmp_path: Path) -> None:
    found = model(tmp_path, "mikron-ucp710", "[components.EXC]\nmean = 10.0\n[components.EXA]\nmean = 5.0\n"
                                             '[reference.A]\nframe = "fixed"\n')
    assert found.axes.frame == {"A": "fixed", "C": "moving"}
    text = save(found, tmp_path)[0].read_text()
    assert '[reference.A]\nframe = "fixed"' in text and '[reference.C]\nframe = "moving"' in text
    assert load(tmp_path / "e.toml", machines.load("mikron-ucp710")).axes.frame == found.axes.frame


def test_the_table_of_a_parallel_machine_carries_the_part(tmp_path: Path) -> None:
    assert model(tmp_path, "h4a-c-table", "[components.EXC]\nmean = 1.0\n").axes.frame == {"C": "moving"}
    assert model(tmp_path, "h4a-spindle-axis", "[components.EXB]\nmean = 1.0\n").axes.frame == {"B": "fixed"}
