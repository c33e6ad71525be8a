"""Errors of whole machines from poses, ball-bar and laser: the truth back, its uncertainty, what cannot be reported."""

from __future__ import annotations

import numpy as np
import pytest

import machines
from machines.calibration.machine_fit import Measurements, fit
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import SerialErrors
from tests.machines.error_models import ARCSEC, joints
from toolpaths.arrays import Floats

TOOL = 90.0
TRUTH = {"EC0Y": 8 * ARCSEC, "EB0Z": -6 * ARCSEC, "EA0Z": 4 * ARCSEC, "EY0A": 0.02, "EZ0A": -0.03, "EB0A": 7 * ARCSEC,
         "EC0A": -5 * ARCSEC, "EX0C": 0.025, "EY0C": -0.015, "EA0C": 9 * ARCSEC, "EB0C": -4 * ARCSEC}
SLIDES = ("EC0Y", "EB0Z", "EA0Z")
TABLE = tuple(name for name in TRUTH if name not in SLIDES)


def mikron():
    return machines.load("mikron-ucp710").kinematics.with_tool(TOOL)


def model(values: dict[str, float]) -> ErrorModel:
    return ErrorModel(SerialErrors(constants=values))


def zeros() -> ErrorModel:
    return model(dict.fromkeys(TRUTH, 0.0))


def tips(found: ErrorModel, q: Floats) -> Floats:
    return found.on(mikron()).place(q)[0]


def on_ball(n: int, seed: int = 0) -> Floats:
    """Joints that keep the tip on one ball of the table while A and C turn (R-test)."""
    kin, rng = mikron(), np.random.default_rng(seed)
    a, c = rng.uniform(-0.4, 1.4, n), rng.uniform(-3.0, 3.0, n)
    axis = kin.forward(np.column_stack([np.zeros((n, 3)), a, c]))[1]
    tip = np.tile([120.0, 40.0, 60.0], (n, 1))
    q = kin.inverse(tip, axis, near=np.column_stack([np.zeros((n, 3)), a, c]))
    rows = np.arange(n)
    return np.asarray(q[np.argmin(np.abs(q[:, :, 3] - a), axis=0), rows])


def test_location_errors_of_a_table_table_machine_from_a_ball() -> None:
    q, rng = on_ball(60), np.random.default_rng(1)
    truth, sigma = model(TRUTH), 2e-4
    read = tips(truth, q) - mikron().forward(q)[0] - [0.05, -0.02, 0.03]
    exact = fit(zeros(), mikron(), Measurements("position", q, read, sigma))
    assert exact.result.converged
    noisy = fit(zeros(), mikron(), Measurements("position", q, read + sigma * rng.normal(size=read.shape), sigma))
    noted = np.isfinite(exact.result.sigma[: len(TRUTH)])
    assert exact.result.values[: len(TRUTH)][noted] == pytest.approx(truth.values[noted], abs=1e-9)
    off = (noisy.result.values[: len(TRUTH)] - truth.values)[noted] / noisy.result.sigma[: len(TRUTH)][noted]
    assert np.abs(off).max() < 4.0
    assert noisy.result.cost_after == pytest.approx(180 - exact.result.rank, rel=0.35)


def test_a_fit_that_the_data_cannot_support_names_what_is_missing() -> None:
    q = on_ball(40)
    q[:, 3] = 0.3
    found = fit(zeros(), mikron(), Measurements("position", q, np.zeros((40, 3)), 1e-3), TABLE)
    assert not found.result.supported
    assert found.result.not_identifiable == (("EY0A", "EZ0A", "EY0C", "ball.y", "ball.z"),)


def test_ball_bar_gives_the_squareness_of_the_slides() -> None:
    n, angle = 72, np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    circle = 100.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    q = np.concatenate([circle, circle[:, [0, 2, 1]], circle[:, [2, 0, 1]]])
    q = np.column_stack([q, np.zeros((3 * n, 2))])
    kin = mikron()
    centre = kin.forward(np.zeros((1, 5)))[0][0]
    truth = model({k: TRUTH[k] for k in SLIDES})
    read = np.linalg.norm(truth.on(kin).place(q)[0] - centre - [0.01, 0.0, -0.02], axis=1) - 0.004
    zero = model(dict.fromkeys(SLIDES, 0.0))
    found = fit(zero, kin, Measurements("distance", q, read, 1e-4, centre=centre))
    assert found.result.supported
    assert found.model.values == pytest.approx(truth.values, abs=1e-10)
    assert found.setup["bar.length"] == pytest.approx(0.004, abs=1e-8)


def test_laser_along_x_gives_the_positioning_table() -> None:
    from machines.geometric_error.actual.serial_errors import Component
    from machines.geometric_error.tables.curves import TableCurve
    from machines.geometric_error.tables.names import parse

    kin, name = mikron(), parse("EXX")
    assert name is not None
    x, values = np.linspace(-300.0, 300.0, 13), np.random.default_rng(3).normal(size=13) * 0.01
    q = np.zeros((13, 5))
    q[:, 0] = x
    truth = ErrorModel(SerialErrors((Component(name, TableCurve(x, values - values[0])),)))
    start = ErrorModel(SerialErrors((Component(name, TableCurve(x, 0.0 * x)),)))
    read = truth.on(kin).place(q)[0][:, 0] - kin.forward(q)[0][:, 0]
    laser = Measurements("along", q, read, 1e-4, toward=np.array([1.0, 0.0, 0.0]), zeroed=False)
    assert fit(start, kin, laser).model.values == pytest.approx(truth.values, abs=1e-12)
    free = fit(start, kin, Measurements("along", q, read, 1e-4, toward=np.array([1.0, 0.0, 0.0])))
    assert len(free.result.not_identifiable) == 1  # a constant shift is the laser's zero as well
    with pytest.raises(ValueError, match="not a parameter"):
        fit(start, kin, laser, ("EYY",))


def delta_truth(seed: int) -> tuple[ErrorModel, ErrorModel]:
    kin = machines.load("uranesx").kinematics
    frame = rod_frame(kin.on_rods)
    zero = RodErrors.none(kin.axis_names, rod_names(frame, kin.axis_names))
    rng = np.random.default_rng(seed)
    values = np.where([".rail." in n or n.endswith(".length") for n in zero.names],
                      rng.normal(size=60) * 0.03, 0.0)
    return ErrorModel(rods=zero.with_values(values)), ErrorModel(rods=zero)


def test_slides_of_a_delta_from_measured_poses_and_what_that_gains() -> None:
    """60 dimensions cannot be known from tips to the micrometre, poses can: predicted, and corrected."""
    kin = machines.load("uranesx").kinematics.with_tool(60.0)
    truth, start = delta_truth(4)
    q, rng = joints(kin, 120, 5), np.random.default_rng(6)
    w = truth.on(kin).coordinates(q)
    read = truth.on(kin).place(w)[0] - w
    wanted = ("X.rail", "Y.rail", "Z.rail", "X1.length", "Y1.length", "Z1.length", "X2.length", "Y2.length",
              "Z2.length")
    measured = Measurements("position", q, read + 5e-4 * rng.normal(size=read.shape), 5e-4, zeroed=False)
    found = fit(start, kin, measured, wanted)
    assert found.result.converged
    other = joints(kin, 300, 8)
    tip, axis = kin.forward(other)
    corrected = correct(found.model.on(kin), other, tip, axis).q
    actual = truth.on(kin)
    before = np.linalg.norm(actual.place(actual.coordinates(other))[0] - tip, axis=1).max()
    after = np.linalg.norm(actual.place(actual.coordinates(corrected))[0] - tip, axis=1).max()
    assert before > 0.03 and after < 0.05 * before
