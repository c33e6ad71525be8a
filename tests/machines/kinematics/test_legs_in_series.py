"""Platforms in series with rotary axes: tables under a Delta, the wrist of a Tricept, by matrices written out."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.curves import Fourier
from machines.geometric_error.tables.names import DIRECTIONS, parse
from machines.kinematics import by_samples
from machines.kinematics.legs.attitudes import direction_of
from machines.kinematics.legs.in_series import LegsInSeries
from machines.loader import load_checked
from tests.machines.error_models import ARCSEC, rod_errors
from tests.source import ROOT
from toolpaths.arrays import Floats
from toolpaths.rotations import rotation

NAMES = ("linear-delta-ac", "tricept")
TOOL = 70.0


@cache
def kinematics(name: str) -> LegsInSeries:
    found = machines.load(name).kinematics
    assert isinstance(found, LegsInSeries)
    return found.with_tool(TOOL)


def asked(kin: LegsInSeries, n: int, seed: int = 0) -> tuple[Floats, Floats]:
    rng, space = np.random.default_rng(seed), kin.workspace
    axis = direction_of("abc", rng.uniform(0.2, 1.0, n), rng.uniform(0.0, 2.0 * np.pi, n))
    return rng.uniform(0.5 * space.lower, 0.5 * space.upper, (n, 3)) + kin.on_legs.gauge, axis


def turn(axis: tuple[float, float, float], angle: float) -> Floats:
    return np.asarray(rotation(np.array(axis), np.array([angle]))[0])


def test_a_delta_over_tables_by_matrices_written_out() -> None:
    """Slides at 90, 210, 330 degrees, tables C over A through (0, 0, -150), rods of 900 mm: seen from the machine."""
    kin = kinematics("linear-delta-ac")
    q = kin.inverse(*asked(kin, 40))[1]
    tip, axis = kin.forward(q)
    pivot = np.array([0.0, 0.0, -150.0])
    for row, t, a in zip(q, tip, axis, strict=True):
        back = turn((1, 0, 0), -row[4]) @ turn((0, 0, 1), -row[3])
        gauge = back @ (t - pivot) + pivot + TOOL * np.array([0.0, 0.0, 1.0])
        assert back @ a == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
        place = gauge + np.array([0.0, 0.0, 100.0])
        for k, heading in enumerate(np.radians([90.0, 210.0, 330.0])):
            out = np.array([np.cos(heading), np.sin(heading), 0.0])
            assert np.linalg.norm(place + 120.0 * out - 500.0 * out - row[k] * np.array([0, 0, 1])) == pytest.approx(900.0)


def test_a_tricept_by_its_middle_leg_written_out() -> None:
    """The middle leg goes through (0, 0, 1550) and turns about x of the base first, then about y of its own: its turn is
    Rx Ry; the wrist turns the tool about z, then x, at 200 mm below the platform."""
    kin = kinematics("tricept")
    q = kin.inverse(*asked(kin, 40))[0]
    tip, axis = kin.forward(q)
    for row, t, a in zip(q, tip, axis, strict=True):
        wrist = t + (TOOL + 200.0) * a  # where its axes meet
        # platform: C = O - d R z with R = Rx(u) Ry(v), the wrist 200 mm further
        away = np.array([0.0, 0.0, 1550.0]) - wrist
        z = away / np.linalg.norm(away)
        v, u = np.arcsin(z[0]), np.arctan2(-z[1], z[2])
        frame = turn((1, 0, 0), u) @ turn((0, 1, 0), v)
        assert frame[:, 2] == pytest.approx(z, abs=1e-12)
        assert frame @ turn((0, 0, 1), row[3]) @ turn((1, 0, 0), row[4]) @ [0, 0, 1] == pytest.approx(a, abs=1e-10)
        place = wrist + 200.0 * z
        for k, heading in enumerate(np.radians([90.0, 210.0, 330.0])):
            out = np.array([np.cos(heading), np.sin(heading), 0.0])
            rod = place + frame @ (220.0 * out) - 500.0 * out - [0.0, 0.0, 1550.0]
            assert np.linalg.norm(rod) == pytest.approx(1300.0 + row[k], abs=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_forward_of_every_branch_and_rates(name: str) -> None:
    kin = kinematics(name)
    tip, axis = asked(kin, 200, 1)
    branches = kin.inverse(tip, axis)
    assert len(branches) == 2 and np.isfinite(branches).all() and np.abs(branches[0] - branches[1]).max(axis=1).min() > 0.1
    for q in branches:
        assert np.abs(np.hstack(kin.forward(q)) - np.hstack([tip, axis])).max() < 1e-9
    calm = branches[0][:20]
    assert np.abs(kin.jacobian(calm) - by_samples.rates(kin.forward, calm, kin.rotary)).max() < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_the_bound_of_the_third_derivative_holds_along_moves(name: str) -> None:
    kin = kinematics(name)
    q0 = kin.inverse(*asked(kin, 12, 2))[0]
    step = np.where(kin.rotary, 0.02, 3.0) * np.random.default_rng(3).normal(size=q0.shape)
    h = 0.02
    for jet, which in zip(kin.jets(q0, q0 + step), (0, 1), strict=True):
        at = [np.stack([kin.forward(q0 + (t + k * h) * step)[which] for k in (-2, -1, 1, 2)])
              for t in np.linspace(0.05, 0.95, 6)]
        third = np.max([np.linalg.norm(0.5 * p[3] - p[2] + p[1] - 0.5 * p[0], axis=1) / h**3 for p in at], axis=0)
        assert (third <= jet.third * (1.0 + 1e-3) + 1e-6).all()


def errors(kin: LegsInSeries) -> ErrorModel:
    """Every dimension, every component of the rotary axes, some of their locations, the spindle."""
    rng, parts, constants = np.random.default_rng(2), [], {"EA0S": 4.0 * ARCSEC, "EX0S": 0.02}
    for letter in kin.axes_with_errors:
        parts += [Component(parse(f"E{d}{letter}"), Fourier(rng.normal(size=5) * (3.0 * ARCSEC if k >= 3 else 0.01)))
                  for k, d in enumerate(DIRECTIONS)]
        constants |= {f"EY0{letter}": 0.02, f"E{'C' if letter == 'A' else 'B'}0{letter}": 5.0 * ARCSEC}
    return ErrorModel(SerialErrors(tuple(parts), constants), rod_errors(kin, 4))


@pytest.mark.parametrize("name", NAMES)
def test_errors_of_rods_and_axes_are_corrected_and_their_sensitivity_is_the_derivative(name: str) -> None:
    kin = kinematics(name)
    tip, axis = asked(kin, 30, 4)
    q, model = kin.inverse(tip, axis)[0], errors(kin)
    actual, nominal = model.on(kin), model.zero().on(kin)
    w = actual.coordinates(q)
    assert np.abs(np.hstack(nominal.aim(w)) - np.hstack([tip, axis])).max() < 1e-9
    found = correct(actual, q, tip, axis)
    assert found.tip_before.min() > 5e-3 and found.tip_after.max() < 1e-7 and found.axis_after.max() < 1e-9
    rates, one = nominal.sensitivity(w[:2]), np.eye(len(model.names))
    for k, label in list(enumerate(model.names))[::7]:
        step = 2e-6 if angular(label, model.rods) else 1e-3
        up, down = (model.with_values(sign * step * one[k]).on(kin).aim(w[:2]) for sign in (1.0, -1.0))
        size, turns = np.abs(rates[:, :, k]).max(), np.cross(rates[:, 3:, k], axis[:2])
        assert (up[0] - down[0]) / (2.0 * step) == pytest.approx(rates[:, :3, k], abs=1e-5 * size + 1e-8), label
        assert (up[1] - down[1]) / (2.0 * step) == pytest.approx(turns, abs=1e-5 * size + 1e-10), label


@pytest.mark.parametrize(("name", "old", "new", "words"), [
    ("tricept", "point = [0, 0, -200]\n\n[kinematics.spindle_axes.A]", "point = [0, 5, -200]\n\n[kinematics.spindle_axes.A]",
     "pass each other"),
    ("tricept", "[kinematics.spindle_axes.A]\ndirection = [1, 0, 0]\npoint = [0, 0, -200]\n", "", "needs two axes"),
    ("tricept", "direction = [1, 0, 0]\npoint = [0, 0, -200]", "direction = [0, 0, 1]\npoint = [0, 0, -200]", "same dir"),
    ("linear-delta-ac", "axes.A]\ndirection = [1, 0, 0]", "axes.A]\ndirection = [0, 0, 1]", "same direction"),
    ("linear-delta-ac", "[kinematics.table_axes.A]", "[kinematics.table_axes.B]\ndirection = [0, 1, 0]\n\n"
     "[kinematics.table_axes.A]", "3 rotary axes"),
    ("linear-delta-ac", "[kinematics.table_axes.A]", "[kinematics.carriers.U]\ndirection = [1, 0, 0]\n\n"
     "[kinematics.table_axes.A]", "4 directions"),
])
def test_what_does_not_go_together_is_refused(name: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    text = (ROOT / f"machines/data/{name}.toml").read_text()
    assert old in text
    (tmp_path / "own.toml").write_text(text.replace(old, new))
    machine, found = load_checked(tmp_path / "own.toml")
    assert machine is None and any(words in d.message for d in found), [str(d) for d in found]
    assert all(d.hint for d in found if d.code == "machine.geometry")
