"""The cheap bound under singular values against the values themselves."""

import numpy as np

from machines.legs_mobility import least_singular
from machines.mobility import LEAST


def test_the_least_singular_value_is_exact_below_the_limit_and_bounded_above() -> None:
    rng = np.random.default_rng(7)
    seen = set()
    for case in range(60):
        rows = rng.normal(size=(20, 6 + case % 3, (3, 6)[case % 2]))
        rows[..., -1] *= 10.0 ** -(case % 6)
        exact = np.linalg.svd(rows, compute_uv=False)[:, -1].min()
        found = least_singular(rows)
        seen.add(found < LEAST)
        assert found <= exact * (1.0 + 1e-9)
        assert found >= LEAST or found == exact
    assert seen == {False, True}
