"""Curves of component errors: known values, linear in their parameters, ranges, both approach directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from machines.geometric_error.actual.actual import approach
from machines.geometric_error.tables import curve_banks
from machines.geometric_error.tables.curve_banks import banks
from machines.geometric_error.tables.curves import FINEST, Curve, Fourier, Polynomial, TableCurve

X = np.array([-100.0, 0.0, 50.0, 120.0])
V = np.array([0.01, -0.02, 0.03, 0.0])
CURVES = [TableCurve(X, V), TableCurve(X, V, "spline"), TableCurve(X, np.concatenate([V, 2.0 * V]), both=True),
          TableCurve(X, V, "linear", period=300.0), TableCurve(X, V, "spline", period=300.0), TableCurve(X[:1], V[:1]),
          Fourier(np.array([0.1, 0.2, 0.3, -0.1, 0.05]), 240.0, 10.0), Polynomial(V, (-100.0, 120.0), 10.0, 50.0)]


def test_table_is_linear_between_its_rows() -> None:
    assert TableCurve(X, V).at(np.array([-100.0, -50.0, 25.0, 120.0])) == pytest.approx([0.01, -0.005, 0.005, 0.0],
                                                                                        abs=1e-15)


def test_spline_is_the_cubic_through_the_rows() -> None:
    x = np.linspace(-100.0, 120.0, 50)
    assert TableCurve(X, V, "spline").at(x) == pytest.approx(CubicSpline(X, V)(x), abs=1e-15)


def test_series_and_polynomial_are_what_they_say() -> None:
    x = np.array([-30.0, 77.0])
    phase = 2.0 * np.pi * (x - 10.0) / 240.0
    assert CURVES[6].at(x) == pytest.approx(0.1 + 0.2 * np.cos(phase) + 0.3 * np.cos(2 * phase) - 0.1 * np.sin(phase)
                                            + 0.05 * np.sin(2 * phase), abs=1e-15)
    t = (x - 10.0) / 50.0
    assert CURVES[7].at(x) == pytest.approx(V[0] + V[1] * t + V[2] * t**2, abs=1e-15)


@pytest.mark.parametrize("rule", ["linear", "spline"])
def test_a_period_joins_the_ends(rule: str) -> None:
    curve = TableCurve(X, V, rule, period=300.0)
    x = np.linspace(-100.0, 200.0, 31)
    assert curve.at(x + 900.0) == pytest.approx(curve.at(x), abs=1e-14)
    assert curve.at(np.array([200.0 - 1e-9]))[0] == pytest.approx(V[0], abs=1e-11)
    assert not curve.outside(x + 1e6).any()


def test_each_way_has_its_own_values() -> None:
    curve, x = CURVES[2], np.full(3, 50.0)
    assert curve.at(x, np.array([1.0, -1.0, 0.0])) == pytest.approx([0.03, 0.06, 0.045])


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
def test_value_is_basis_times_parameters(curve: Curve) -> None:
    x, course = np.linspace(-150.0, 150.0, 61), np.resize([1.0, -1.0, 0.0], 61)
    basis = curve.basis(x, course)
    assert basis.shape == (61, len(curve.labels())) == (61, len(curve.values))
    assert curve.at(x, course) == pytest.approx(basis @ curve.values, abs=1e-13)
    other = curve.with_values(np.arange(1.0, len(curve.values) + 1.0))
    assert other.at(x, course) == pytest.approx(basis @ other.values, abs=1e-12)


def test_outside_reports_and_keeps_the_end_value() -> None:
    curve, x = TableCurve(X, V), np.array([-101.0, -100.0, 120.0, 121.0])
    assert curve.outside(x).tolist() == [True, False, False, True]
    assert not curve.outside(x, 2.0).any()
    assert curve.at(x).tolist() == [0.01, 0.01, 0.0, 0.0]


def test_approach_remembers_the_last_motion() -> None:
    q = np.array([[0.0, 5.0], [0.0, 4.0], [1.0, 4.0], [1.0, 4.0], [0.5, 6.0]])
    assert approach(q).tolist() == [[0, 0], [0, -1], [1, -1], [1, -1], [-1, 1]]


def test_curves_of_one_basis_are_evaluated_together_as_one_by_one() -> None:
    rng = np.random.default_rng(8)
    x, turn = np.sort(rng.uniform(-1.0, 1.0, 9)), np.linspace(0.0, 6.0, 7)
    curves: list[Curve] = []
    for _ in range(2):
        curves += [TableCurve(x, rng.normal(size=9)), TableCurve(x, rng.normal(size=18), both=True),
                   TableCurve(turn, rng.normal(size=7),
                                                                                              period=2.0 * np.pi),
                   TableCurve(x, rng.normal(size=9), "spline"), TableCurve(x, rng.normal(size=18), "spline", both=True),
                   TableCurve(turn, rng.normal(size=7), "spline", period=2.0 * np.pi), TableCurve(x[:1], rng.normal(size=1)),
                   Fourier(rng.normal(size=7)), Fourier(rng.normal(size=1)),
                   Fourier(rng.normal(size=7), 0.7, 0.1, (-0.5, 0.5)),
                   Polynomial(rng.normal(size=4), (-0.8, 0.9), 0.2, 0.5), Polynomial(rng.normal(size=1), (-1.0, 1.0))]
    at, course = rng.uniform(-1.5, 1.5, 200), rng.uniform(-1.0, 1.0, 200)
    at[:9] = x
    found = banks(curves)
    assert sorted(k for numbers, _ in found for k in numbers) == list(range(len(curves))) and len(found) < len(curves)
    for direction in (course, 1.0):
        for numbers, bank in found:
            expected = [curves[k].at(at, direction) for k in numbers]
            np.testing.assert_allclose(bank.at(at, direction), expected, rtol=0.0, atol=1e-13)


@pytest.mark.numeric
@pytest.mark.parametrize(("both", "period"), [(False, 0.0), (True, 0.0), (False, 1.8), (True, 1.8)])
def test_tables_have_the_same_bits_in_one_loop_over_positions(both: bool, period: float,
                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    x, at = np.append(-0.9, np.sort(rng.uniform(-0.8, 0.8, 6))), rng.uniform(-1.5, 1.5, 60)
    at[:10] = [*x, -0.9 + 1.8, np.nan, np.nextafter(x[3], -1.0)]
    course = rng.uniform(-1.2, 1.2, 60)
    (_, bank), = banks([TableCurve(x, rng.normal(size=14 if both else 7), both=both, period=period) for _ in range(3)])
    for direction in (course, 0.0):
        by_loop = []
        for wanted in (False, True):
            monkeypatch.setattr(curve_banks, "wanted", lambda *_, found=wanted: found)
            by_loop.append(bank.at(at, direction))
        np.testing.assert_array_equal(*by_loop)


def test_rows_of_one_place_ask_for_no_closer_look() -> None:
    """Two readings half a micrometre apart among rows of 50 mm; a table that repeats ends where it begins again."""
    rows = np.linspace(-350.0, 350.0, 15)
    assert TableCurve(rows, np.zeros(15)).detail == pytest.approx(50.0)
    assert TableCurve(np.sort(np.append(rows, 0.0005)), np.zeros(16)).detail == pytest.approx(700.0 * FINEST)
    assert TableCurve(np.array([0.0, 1.0, 2.0]), np.zeros(3), period=2.5).detail == pytest.approx(0.5)
    assert TableCurve(np.array([3.0]), np.zeros(1)).detail == np.inf
