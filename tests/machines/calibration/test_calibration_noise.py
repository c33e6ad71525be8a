"""What a fit leaves against the stated noise: false refusals, coverage of 95 % bounds, what few readings and outliers do."""

from __future__ import annotations

import numpy as np
import pytest

from machines.calibration.noise import CHANCE, NORMAL, Noise, noise_of
from machines.calibration.problem import linear, solve
from machines.calibration.reversal import identify

STEPS, SETUPS = 12, 3
RUNS = 150


def covered(times: float, readings: int, seed: int, robust: bool = False) -> float:
    """Part of the true values inside the 95 % bounds of straight fits of 3 unknowns whose noise is `times` the stated."""
    rng, inside = np.random.default_rng(seed), 0
    for _ in range(RUNS):
        matrix, truth = rng.normal(size=(readings, 3)), rng.normal(size=3)
        observed = matrix @ truth + times * rng.normal(size=readings)
        found = solve(linear(("a", "b", "c"), matrix, observed, np.ones(readings)), robust)
        inside += int((np.abs(found.values - truth) <= NORMAL * found.sigma).sum())
    return inside / (3 * RUNS)


@pytest.mark.covering
@pytest.mark.parametrize("times", [1.0, 3.0, 10.0])
@pytest.mark.parametrize(("readings", "robust"), [(8, False), (40, False), (40, True)])
def test_bounds_hold_the_truth_whatever_the_noise(times: float, readings: int, robust: bool) -> None:
    assert 0.90 <= covered(times, readings, readings, robust) <= 0.995


@pytest.mark.parametrize("times", [1.0, 3.0, 10.0])
def test_bounds_of_a_reversal_hold_the_truth(times: float) -> None:
    rng = np.random.default_rng(7)
    inside = []
    for _ in range(60):
        axis, indexer = (one - one.mean() for one in rng.normal(size=(2, STEPS)) * 5.0)
        met = (np.arange(STEPS) + np.arange(SETUPS)[:, None]) % STEPS
        readings = axis - indexer[met] + times * 0.1 * rng.normal(size=(SETUPS, STEPS))
        found = identify(readings, 0.1)
        inside.append(np.abs(found.axis - axis) <= NORMAL * found.axis_sigma)
    assert 0.90 <= np.mean(inside) <= 0.99


@pytest.mark.parametrize("readings", [4, 12, 400])
@pytest.mark.parametrize("robust", [False, True])
def test_readings_at_their_stated_noise_are_rarely_refused(readings: int, robust: bool) -> None:
    rng = np.random.default_rng(readings)
    found = [noise_of(rng.normal(size=readings), 0, robust) for _ in range(2000)]
    assert np.mean([one is not None and one.meets for one in found]) > 0.99
    assert np.mean([one is not None and one.more > CHANCE for one in found]) > 0.99


def test_noise_that_is_not_the_stated_one_is_seen() -> None:
    rng = np.random.default_rng(3)
    for times in (0.2, 2.0, 4.848, 10.0):
        found = noise_of(times * rng.normal(size=40), 4)
        assert found is not None and not found.meets and found.left == pytest.approx(times, rel=0.3)
    assert noise_of(np.ones(4), 4) is None


def test_outliers_do_not_make_a_robust_fit_a_bad_one() -> None:
    rng = np.random.default_rng(4)
    readings = rng.normal(size=100)
    readings[:5] += 100.0
    plain, robust = noise_of(readings, 3), noise_of(readings, 3, robust=True)
    assert plain is not None and robust is not None and not plain.meets and robust.meets


def test_few_readings_widen_the_bounds_as_students_t_has_it() -> None:
    assert Noise(0.5, 3.0).scale == Noise(1.0, 3.0).scale == 1.0
    assert np.sqrt(Noise(2.0, 3.0).scale) == pytest.approx(2.0 * 3.18245 / NORMAL, rel=1e-5)
    assert np.sqrt(Noise(2.0, 1e6).scale) == pytest.approx(2.0, rel=1e-5)
