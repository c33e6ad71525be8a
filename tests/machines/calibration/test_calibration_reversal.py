"""Reversal, set-up errors, the simulator, all six errors of a rotary axis: from known truths."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from machines.calibration.problem import linear, solve
from machines.calibration.reversal import conditioning, cost_without, identify, plan, reversal_matrix, statistics
from machines.calibration.rotary_bench import Bench, mount_jacobian
from machines.calibration.rotary_fit import error_model, fit_rotary
from samples.calibration.rotary_readings import simulate
from toolpaths.arrays import Floats
from toolpaths.units import DEG

ARCSEC = DEG / 3600.0


def closed(rng: np.random.Generator, n: int) -> Floats:
    values = rng.normal(size=n)
    return np.asarray(values - values.mean())


def readings(axis: Floats, indexer: Floats, m: int) -> Floats:
    n = len(axis)
    return np.stack([axis - indexer[(np.arange(n) + k) % n] for k in range(m)])


def test_rank_and_condition_number_of_the_reference() -> None:
    """Acceptance 16: n = 12, rank 13 for m = 1, 24 from m = 2 on; condition number 15.3226 for m = 2."""
    assert conditioning(12, 1).rank == 13
    assert [conditioning(12, m).rank for m in range(2, 13)] == [24] * 11
    assert conditioning(12, 2).condition_number == pytest.approx(15.3226, abs=1e-3)
    numbers = [conditioning(12, m).condition_number for m in range(2, 13)]
    assert all(a > b for a, b in pairwise(numbers))
    assert conditioning(12, 1).condition_number == np.inf


def test_the_system_of_the_reference_entry_by_entry() -> None:
    """C 1.51, n = 3, m = 3."""
    eye, zero, one = np.eye(3), np.zeros(3), np.ones(3)
    wanted = np.block([[eye, -eye], [eye, -eye[[1, 2, 0]]], [eye, -eye[[2, 0, 1]]], [one, zero], [zero, one]])
    assert np.array_equal(reversal_matrix(3, 3), wanted)


@pytest.mark.parametrize(("n", "m"), [(12, 2), (12, 5), (20, 7), (7, 7)])
def test_without_noise_the_truth_comes_back(n: int, m: int) -> None:
    rng = np.random.default_rng(n + m)
    axis, indexer = closed(rng, n), closed(rng, n)
    offsets = rng.normal(size=m)
    found = identify(readings(axis, indexer, m) + offsets[:, None], 1.0)
    assert found.axis == pytest.approx(axis, abs=1e-12)
    assert found.indexer == pytest.approx(indexer, abs=1e-12)
    assert found.offsets == pytest.approx(offsets, abs=1e-12)
    assert np.abs(found.residuals).max() < 1e-13 and found.result.supported
    assert abs(found.axis.sum()) < 1e-12


def test_missing_readings_weights_and_any_shifts() -> None:
    rng = np.random.default_rng(1)
    axis, indexer, shifts = closed(rng, 12), closed(rng, 12), (0, 5, 7)
    data = np.stack([axis - indexer[(np.arange(12) + s) % 12] for s in shifts])
    data[0, 3] = data[2, 8] = np.nan
    found = identify(data, np.full((3, 12), 0.3), shifts=shifts)
    assert found.axis == pytest.approx(axis, abs=1e-12)
    assert np.isnan(found.residuals[0, 3]) and found.result.rank == 25


@pytest.mark.parametrize(("m", "shifts"), [(1, (0,)), (2, (0, 4)), (3, (0, 3, 6))])
def test_what_the_data_do_not_support_is_said(m: int, shifts: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    found = identify(rng.normal(size=(m, 12)), 1.0, shifts=shifts)
    assert not found.result.supported
    assert np.isinf(found.axis_sigma).all() and found.result.not_identifiable


def test_stated_uncertainty_covers_the_truth() -> None:
    """400 trials: 93 to 97 % of the parameters inside their 95 % bounds, and the spread is the stated one."""
    rng = np.random.default_rng(4)
    axis, indexer, inside, errors = closed(rng, 12), closed(rng, 12), [], []
    clean = readings(axis, indexer, 3)
    for _ in range(400):
        found = identify(clean + 0.1 * rng.normal(size=clean.shape), 0.1)
        inside.append(np.abs(found.axis - axis) < 1.959964 * found.axis_sigma)
        errors.append(found.axis - axis)
    assert 0.93 < np.mean(inside) < 0.97
    assert np.std(errors, axis=0) == pytest.approx(found.axis_sigma, rel=0.12)


def test_a_plan_weighs_uncertainty_against_minutes() -> None:
    found = plan(12, 0.1, 0.5, 10.0)
    assert [c.setups for c in found] == list(range(2, 13))
    assert all(a.sigma > b.sigma and a.minutes < b.minutes for a, b in pairwise(found))
    assert found[0].minutes == 2 * (10.0 + 6.0)


def test_statistics_as_defined() -> None:
    values = np.array([1.0, 2.0, np.nan, 4.0])
    found = statistics(values)
    assert found.deviation == pytest.approx(np.std([1, 2, 4], ddof=1)) and found.rms == pytest.approx(np.sqrt(7.0))
    assert found.largest == 4.0 and found.mean == pytest.approx(7.0 / 3.0)


def test_robust_fit_lets_an_outlier_go() -> None:
    rng = np.random.default_rng(6)
    axis, indexer = closed(rng, 12), closed(rng, 12)
    data = readings(axis, indexer, 6) + 0.01 * rng.normal(size=(6, 12))
    data[2, 5] += 3.0
    plain, robust = identify(data, 0.01), identify(data, 0.01, robust=True)
    assert np.abs(robust.axis - axis).max() < 0.2 * np.abs(plain.axis - axis).max()
    assert robust.result.weights.min() < 0.01


def test_groups_that_cannot_be_distinguished() -> None:
    matrix = np.array([[1.0, 1.0, 0.0, 0.0], [2.0, 2.0, 1.0, 0.0], [3.0, 3.0, 5.0, 0.0]])
    found = solve(linear(["a", "b", "c", "d"], matrix, np.array([2.0, 5.0, 11.0]), np.ones(3)))
    assert found.not_identifiable == (("a", "b"), ("d",)) and found.rank == 2
    assert found.values == pytest.approx([1.0, 1.0, 1.0, 0.0]) and not found.supported
    assert np.isinf(found.sigma[[0, 1, 3]]).all() and np.isfinite(found.sigma[2])
    fixed = solve(linear(["a", "b", "c", "d"], matrix, np.array([2.0, 5.0, 11.0]), np.ones(3),
                         np.array([True, False, True, False])))
    assert fixed.supported and fixed.values == pytest.approx([2.0, 0.0, 1.0, 0.0])


# ---- mounting ----------------------------------------------------------------------------------------------

BENCH = Bench(12, 80.0, 120.0, np.array([15.0, -8.0, 0.0]))


def test_mounting_jacobian_is_the_derivative_of_the_exact_chain() -> None:
    zero, jacobian, step = np.zeros((12, 6)), mount_jacobian(BENCH), 1e-5
    for k in range(18):
        mounts = np.zeros((2, 18))
        mounts[0, k], mounts[1, k] = step, -step
        up, down = simulate(BENCH, zero, zero, mounts.reshape(2, 3, 6), order=np.zeros(2))
        assert (up - down) / (2 * step) == pytest.approx(jacobian[:, :, k], abs=1e-7)


def test_set_up_tilts_enter_the_angle_at_second_order() -> None:
    """10 arcsec tilts change the angular reading by far less than 0.01 arcsec: the linear filter need not see them."""
    mounts = np.zeros((1, 3, 6))
    mounts[0, :, 3:5] = 10.0 * ARCSEC
    zero = np.zeros((12, 6))
    assert 0.0 < np.abs(simulate(BENCH, zero, zero, mounts)[0, :, 5]).max() < 0.01 * ARCSEC


def test_reversal_on_simulated_readings() -> None:
    """Exact chain, mounting errors, indexer errors: the axis's angular signature comes back; RX = -ez of the indexer."""
    rng = np.random.default_rng(8)
    axis, indexer = np.zeros((12, 6)), np.zeros((12, 6))
    axis[:, 5], indexer[:, 5] = closed(rng, 12) * 3.0 * ARCSEC, closed(rng, 12) * ARCSEC
    mounts = rng.normal(size=(4, 3, 6)) * [0.01, 0.01, 0.01, *np.full(3, 2.0 * ARCSEC)]
    read = simulate(BENCH, axis, indexer, mounts)[:, :, 5]
    found = identify(read, 0.02 * ARCSEC)
    assert found.axis == pytest.approx(axis[:, 5], abs=1e-4 * ARCSEC)
    assert -found.indexer == pytest.approx(indexer[:, 5], abs=1e-4 * ARCSEC)


def series(amplitudes: Floats, angles: Floats) -> Floats:
    """(n, 6) torsors of amplitudes (6, 2, H)."""
    phase = angles[:, None] * np.arange(1, amplitudes.shape[2] + 1)
    return np.asarray(np.einsum("nch,pch->np", np.stack([np.cos(phase), np.sin(phase)], axis=1), amplitudes))


def test_all_six_errors_from_reversal_with_mounting_and_indexer() -> None:
    rng, harmonics = np.random.default_rng(9), 3
    size = np.array([2e-3, 2e-3, 1e-3, 4 * ARCSEC, 4 * ARCSEC, 4 * ARCSEC])
    truth = rng.normal(size=(6, 2, harmonics)) * size[:, None, None] * 1e-2  # small: what is of second order stays below
    indexer = rng.normal(size=(12, 6)) * size * 1e-3
    mounts = rng.normal(size=(5, 3, 6)) * size * 1e-3
    sigma = np.array([1e-6, 1e-6, 1e-6, *np.full(3, 1e-3 * ARCSEC)])
    read = simulate(BENCH, series(truth, BENCH.angles), indexer, mounts)
    found = fit_rotary(BENCH, read, sigma, harmonics)
    noted = np.isfinite(found.sigma)
    assert noted[5].all() and noted[:, :, 1:].sum() >= 20
    assert {name.rsplit(".", 1)[1][-1] for name in found.lost} <= {"1"}  # only first harmonics hide behind the mounting
    off = np.abs(found.amplitudes - truth) / size[:, None, None]
    assert off[noted].max() < 1e-4
    model = error_model(found, "C", "mikron-ucp710")
    assert model.covariance is not None and len(model.names) == 6 * 7
    assert model.axes.frame["C"] == "moving"
    with pytest.raises(ValueError, match="harmonics"):
        fit_rotary(BENCH, read, sigma, 6)


# ---- all six, on the axis where it is ----------------------------------------------------------------------

FRAMES = {("mikron-ucp710", "C"): ([1, 0, 0], [0, -1, 0], [0, 0, -1]),
          ("mikron-ucp710", "A"): ([0, 1, 0], [0, 0, -1], [-1, 0, 0]),
          ("fork-head-ab", "A"): ([0, 1, 0], [0, 0, 1], [1, 0, 0]), ("fork-head-ab", "B"): ([0, 0, 1], [1, 0, 0], [0, 1, 0])}
"""axes of the readings in the machine: z where what moves turns to, a table against the machine's axis"""


@pytest.mark.parametrize(("name", "letter"), FRAMES)
def test_six_errors_move_the_tool_as_the_measured_body_moves(name: str, letter: str) -> None:
    """What was measured of head or table, put together again by rotation matrices in the bed, is what the model does."""
    import machines

    rng, bench = np.random.default_rng(21), Bench(12, 80.0, 120.0, np.array([15.0, -8.0, 0.0]))
    size = np.repeat([0.01, 5.0 * ARCSEC], 3)
    first = rng.normal(size=(6, 2)) * (size * [0, 0, 1, 0, 0, 1])[:, None]  # what the mounting does not hide
    series = first[:, 0] * np.cos(bench.angles)[:, None] + first[:, 1] * np.sin(bench.angles)[:, None]
    second = rng.normal(size=(6, 2)) * size[:, None]
    series += second[:, 0] * np.cos(2 * bench.angles)[:, None] + second[:, 1] * np.sin(2 * bench.angles)[:, None]
    read = simulate(bench, series, np.zeros((12, 6)), np.zeros((3, 3, 6)))
    fitted = fit_rotary(bench, read, size, 2)
    kin = machines.load(name).kinematics.with_tool(50.0)
    table = name == "mikron-ucp710"
    actual = error_model(fitted, letter, carries_part=table).on(kin)
    q = np.zeros((12, 5))
    q[:, :3] = [30.0, -40.0, 25.0]
    index = kin.axis_names.index(letter)
    start = kin.forward(q[:1])[0][0]
    q[:, index] = bench.angles
    point = next(j.point for j in kin.chain if j.name == letter) + (0.0 if table else q[0, :3])
    frame = np.array(FRAMES[name, letter], dtype=float).T
    for k, (angle, e) in enumerate(zip(bench.angles, series, strict=True)):
        turned = Rotation.from_rotvec(frame[:, 2] * angle)
        small = Rotation.from_rotvec(frame @ e[3:])
        if table:  # the part moves by turned * small about its point; the tool stands in the bed
            wanted = small.inv().apply(turned.inv().apply(start - point) - frame @ e[:3]) + point
        else:
            wanted = turned.apply(small.apply(start - point) + frame @ e[:3]) + point
        assert actual.place(q[k:k + 1])[0][0] == pytest.approx(wanted, abs=2e-5)


def test_what_the_instrument_alone_leaves_is_what_the_axis_did() -> None:
    """A perfect axis: nothing is left without it; else at least what the axis's own steps spread by."""
    rng = np.random.default_rng(21)
    axis, indexer = closed(rng, 12), closed(rng, 12)
    offsets = rng.normal(size=(4, 1))
    assert cost_without(readings(0.0 * axis, indexer, 4) + offsets, 1.0) < 1e-24
    assert cost_without(readings(axis, indexer, 4) + offsets, 1.0) > 1.0
    assert cost_without(readings(0.0 * axis, indexer, 4) + offsets, 1.0, offsets=False) > 1.0
    bench, sigma, unit = Bench(12), np.full(6, 1e-6), np.array([1e-3, 1e-3, 1e-3, ARCSEC, ARCSEC, ARCSEC])
    turned, still = rng.normal(size=(12, 6)) * unit, np.zeros((12, 6))
    mounts = rng.normal(size=(3, 3, 6)) * unit
    read = [simulate(bench, moved, turned, mounts) for moved in (still, turned)]
    alone = [fit_rotary(bench, one, sigma, 2).cost_instrument for one in read]
    assert alone[0] < 1e-3 * alone[1]
