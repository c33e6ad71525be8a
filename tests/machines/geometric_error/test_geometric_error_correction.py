"""Correction: what is left on the machine with errors, on every machine, at poles, in groups, out of range."""

from __future__ import annotations

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.actual_kinematics import ActualKinematics
from machines.geometric_error.actual.correction import POLE, CorrectedCommands, correct
from machines.geometric_error.actual.model import ErrorModel, doubt
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import parse
from machines.kinematics.base import Kinematics
from tests.machines.error_models import ARCSEC, REACH, joints, model
from toolpaths.arrays import Floats

FIVE = ("mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab", "nutating-head", "linuxcnc-xyzac-trt", "h4a-c-table",
        "h4a-spindle-axis")
FEWER = ("mill-3axis", "mill-4axis", "uranesx")
TOOL = 85.0


def prepared(name: str, n: int = 3000) -> tuple[Kinematics, Actual, Floats, Floats, Floats]:
    kin = machines.load(name).kinematics.with_tool(TOOL)
    q = joints(kin, n, 7)
    return kin, model(kin, 11).on(kin), q, *kin.forward(q)


def commanded(kin: Kinematics, actual: Actual, q: Floats) -> tuple[Floats, Floats]:
    """Where the machine with errors puts the tool for joints, from the joints alone."""
    tip, axis, _ = actual.place(actual.coordinates(q, np.concatenate(kin.forward(q), axis=1)))
    return tip, axis


@pytest.mark.parametrize("name", FIVE)
def test_five_axes_put_tip_and_axis_where_they_belong(name: str) -> None:
    kin, actual, q, tip, axis = prepared(name)
    found = correct(actual, q, tip, axis)
    assert found.tip_before.max() > 0.02 and found.axis_before.max() > 5.0 * ARCSEC
    t, a = commanded(kin, actual, found.q)
    away = np.linalg.norm(a - axis, axis=1)
    assert np.linalg.norm(t - tip, axis=1).max() < 1e-7
    assert found.partial.mean() < 0.1
    assert away[~found.partial].max() < 1e-3 * ARCSEC
    assert found.tip_after == pytest.approx(np.linalg.norm(t - tip, axis=1), abs=2e-9)
    assert found.axis_after == pytest.approx(away, abs=1e-12)


@pytest.mark.parametrize("name", FEWER)
def test_fewer_axes_put_the_tip_there_and_report_the_rest(name: str) -> None:
    kin, actual, q, tip, axis = prepared(name)
    found = correct(actual, q, tip, axis)
    t, a = commanded(kin, actual, found.q)
    assert np.linalg.norm(t - tip, axis=1).max() < 1e-7
    assert a - axis == pytest.approx(found.axis_residual, abs=1e-12)
    assert found.axis_after.max() > 3.0 * ARCSEC
    if name == "mill-4axis":  # A turns about x: only the residual along x is left
        assert np.abs(found.axis_residual[:, 1:]).max() < 1e-8


def near_pole(tilts: Floats) -> tuple[Kinematics, Actual, Floats, Floats, Floats]:
    kin = machines.load("mikron-ucp710").kinematics.with_tool(TOOL)
    q = np.column_stack([np.full((len(tilts), 3), 40.0), tilts, np.full(len(tilts), 0.7)])
    return kin, model(kin, 11).on(kin), q, *kin.forward(q)


def test_near_the_pole_the_turn_fades_and_the_tip_stays() -> None:
    tilts = np.concatenate([[0.0], np.geomspace(1e-6, 0.2, 400)])
    _, actual, q, tip, axis = near_pole(tilts)
    found = correct(actual, q, tip, axis)
    turned = np.abs(found.q - q)[:, 4]
    assert found.tip_after.max() < 1e-7
    assert turned.max() < 1.2 * found.axis_before.max() / POLE
    assert turned[0] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(np.diff(found.q[:, 4])).max() < 0.1 * turned.max()  # no jump where full correction begins
    assert found.axis_after[tilts > 1.01 * POLE].max() < 1e-3 * ARCSEC
    assert found.axis_after.max() <= found.axis_before.max() * 1.05
    assert found.axis_after[0] == pytest.approx(np.abs(found.axis_residual[0, :2]).max(), rel=1.0)


def test_a_tight_axis_tolerance_is_kept_where_a_turn_can() -> None:
    tilts = np.geomspace(2e-3, 0.02, 50)
    _, actual, q, tip, axis = near_pole(tilts)
    loose, tight = correct(actual, q, tip, axis), correct(actual, q, tip, axis, axis_tolerance=1.0 * ARCSEC)
    assert loose.axis_after.max() > 3.0 * ARCSEC
    assert tight.axis_after.max() < 1.2 * ARCSEC
    assert tight.tip_after.max() < 1e-7
    assert np.abs(tight.q - q)[:, 4].max() > np.abs(loose.q - q)[:, 4].max()


def test_a_group_turns_as_one_and_its_tips_are_exact() -> None:
    kin, actual, q, _, _ = prepared("mikron-ucp710", 60)
    q[:, 3:] = np.where(np.arange(60)[:, None] < 30, [0.5, 1.0], [-0.7, 0.2])
    tip, axis = kin.forward(q)
    group = np.where(np.arange(60) < 30, 0, -1)
    found = correct(actual, q, tip, axis, group=group)
    assert np.ptp(found.q[:30, 3:], axis=0).max() == 0.0
    assert np.ptp(found.q[30:, 3:], axis=0).min() > 0.0
    assert found.tip_after.max() < 1e-7
    assert found.axis_after[30:].max() < 1e-3 * ARCSEC
    assert 0.0 < found.axis_after[:30].max() < found.axis_before[:30].max()
    assert np.linalg.norm(found.axis_residual[:30].mean(axis=0)) < 1e-2 * ARCSEC
    still = correct(actual, q, tip, axis, turn=False)
    assert np.array_equal(still.q[:, 3:], q[:, 3:])
    assert still.tip_after.max() < 1e-7


def test_beyond_the_measured_range_is_refused_unless_asked_for() -> None:
    kin = machines.load("mill-3axis").kinematics
    actual = model(kin).on(kin)
    q = np.array([[0.0, 0.0, 0.0], [REACH + 1.0, 0.0, 0.0]])
    tip, axis = kin.forward(q)
    refused = correct(actual, q, tip, axis)
    assert np.isfinite(refused.q[0]).all() and np.isnan(refused.q[1]).all()
    assert refused.unmeasured.tolist() == [[False] * 3, [True, False, False]]
    asked = correct(actual, q, tip, axis, beyond=True)
    assert asked.tip_after.max() < 1e-7


def test_each_way_of_approach_gets_its_own_correction() -> None:
    kin = machines.load("mill-3axis").kinematics
    both = TableCurve(np.array([-500.0, 500.0]), np.array([0.02, 0.02, -0.01, -0.01]), both=True)
    actual = ErrorModel(SerialErrors((Component(parse("EXX"), both),))).on(kin)
    q = np.zeros((3, 3))
    way = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0.0, 0, 0]])
    found = correct(actual, q, *kin.forward(q), direction=way)
    assert found.q[:, 0] == pytest.approx([-0.02, 0.01, -0.005], abs=1e-9)


def test_nothing_to_correct_changes_nothing() -> None:
    kin, _, q, tip, axis = prepared("mikron-ucp710", 50)
    found = correct(model(kin).zero().on(kin), q, tip, axis)
    assert found.q == pytest.approx(q, abs=1e-9)
    assert found.tip_before.max() == 0.0


@pytest.mark.parametrize("name", ["mikron-ucp710", "h4a-c-table", "uranesx"])
def test_the_machine_with_errors_as_kinematics(name: str) -> None:
    kin, actual, q, tip, axis = prepared(name, 200)
    real = ActualKinematics(kin, model(kin, 11))
    near = np.concatenate([tip, axis], axis=1)
    t, a = real.forward(q, near)
    assert t == pytest.approx(commanded(kin, actual, q)[0], abs=1e-12)
    back = real.inverse(t, a / np.linalg.norm(a, axis=1, keepdims=True)) if real.branches > 1 or name != "uranesx" else None
    if back is not None:
        nearest = np.nanmin(np.abs(back - q).max(axis=2), axis=0)
        inside = np.abs(np.sin(np.arccos(a[:, 2]))) > 2.0 * POLE
        assert np.quantile(nearest[inside], 0.9) < 1e-5
    assert real.with_tool(10.0).tool_length == 10.0


def test_doubt_against_trials() -> None:
    """J Sigma J^T against the spread of exact tips over 400 drawn machines."""
    kin, _, q, _, _ = prepared("mikron-ucp710", 5)
    full, rng = model(kin, 11), np.random.default_rng(5)
    sigma = 0.1 * np.abs(full.values) + 1e-7
    known = ErrorModel(full.axes, covariance=np.diag(sigma**2))
    predicted = doubt(known, known.on(kin), q)
    draws = np.stack([known.with_values(full.values + rng.normal(size=len(sigma)) * sigma).on(kin).place(q)[0]
                      for _ in range(400)])
    assert draws.std(axis=0, ddof=1) == pytest.approx(predicted.tip, rel=0.15)
    assert (predicted.tip_worst >= predicted.tip.max(axis=1)).all()
    with pytest.raises(ValueError, match="no covariance"):
        doubt(full, full.on(kin), q)


def test_all_is_told(recwarn: pytest.WarningsRecorder) -> None:
    _, actual, q, tip, axis = prepared("mikron-ucp710", 4)
    q = q.copy()
    q[0] = np.nan
    found = correct(actual, q, tip, axis)
    assert isinstance(found, CorrectedCommands) and np.isnan(found.q[0]).all() and np.isfinite(found.q[1:]).all()
    assert not recwarn.list
