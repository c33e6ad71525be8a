"""Columns come back as they were put in, within half a step; what is no number stays none."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.page.columns import Column, packed, unpacked


@pytest.mark.parametrize("values", [
    [], [0.0], [1.0, -1.0, 1e5, -1e5], [np.nan, 3.0, np.nan, np.nan, -2.0], [214748.3, -214748.3, 214748.3],
    [0.00004, 0.00006]])
def test_a_column_comes_back(values: list[float]) -> None:
    given = np.array(values)
    found = unpacked(*packed([Column("first", given, 1e-4), Column("second", given[::-1], 1e-3)]))
    for name, wanted, step in (("first", given, 1e-4), ("second", given[::-1], 1e-3)):
        assert np.array_equal(np.isnan(found[name]), np.isnan(wanted))
        assert np.nanmax(np.abs(found[name] - wanted), initial=0.0) <= 0.5001 * step


def test_what_32_bits_cannot_hold_is_no_value_and_disturbs_nothing() -> None:
    found = unpacked(*packed([Column("x", np.array([1.0, 1e9, np.inf, 2.0]), 1e-3)]))["x"]
    assert found[[0, 3]] == pytest.approx([1.0, 2.0]) and np.isnan(found[[1, 2]]).all()


def test_smooth_figures_take_few_bytes() -> None:
    """A tenth of what the same numbers take as they stand."""
    at = np.arange(20_000) * 1e-3
    data, _ = packed([Column("x", 50.0 * np.sin(at), 1e-3)])
    assert len(data) < 8 * len(at) / 10
