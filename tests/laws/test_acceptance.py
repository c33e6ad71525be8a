"""Figures that documents print for the linear Deltas, recomputed: `pytest -s tests/laws/test_acceptance.py` prints them.

Source: Company 2000, chapter III and annex C. Where the printed number carries fewer digits than the recomputed one, the
latter is the target; the tolerance is the fair one for its recipe.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest

import machines
from machines.analysis.singularity import growth, safe_radius
from machines.analysis.transmission import condition_number, speed_acceleration, speed_transmission, worst
from machines.kinematics.legs.on_legs import OnLegs

UP = np.array([0.0, 0.0, 1.0])


class Row(NamedTuple):
    """A number of the documents: what, how, printed, target, relative tolerance, and what computes it."""

    what: str
    recipe: str
    printed: str
    target: float
    tolerance: float
    compute: Callable[[], float]


def delta(name: str) -> OnLegs:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs)
    return kinematics


def conditioning(name: str) -> float:
    """Worst condition number over x, y within 250 mm and z within 200 mm."""
    kinematics = delta(name)
    np.testing.assert_array_equal(kinematics.workspace.upper, [250.0, 250.0, 200.0])
    return worst(partial(condition_number, kinematics.transmits), kinematics.workspace).value


def motor_speed() -> float:
    """m/s at 2 m/s of the spindle."""
    kinematics = delta("uranesx")
    return 2.0 * worst(partial(speed_transmission, kinematics.transmits), kinematics.workspace).value


def motor_acceleration() -> float:
    """m/s2 at 35 m/s2 and 2 m/s: the separate maxima of both terms added."""
    kinematics = delta("uranesx")
    bent = worst(partial(speed_acceleration, kinematics.on_rods), kinematics.workspace).value
    return 35.0 * motor_speed() / 2.0 + 1000.0 * bent * 2.0**2


SPREAD = 550.0 + 250.0 * np.sqrt(2.0)
ROWS = {
    1: [Row("slides along x: worst condition number", "roots (+, -, +), box 0.5 x 0.5 x 0.4 m", "2.25", 2.246, 0.003,
            lambda: conditioning("delta-parallel-x"))],
    2: [Row("slides along z, radius 0.85, L 1.4", "any common root", "2.38", 2.382, 0.002,
            lambda: conditioning("delta-parallel-z")),
        Row("slides along z, radius 0.70, L 1.35", "any common root", "2.69", 2.694, 0.002,
            lambda: conditioning("delta-parallel-z-compact"))],
    3: [Row("star at z 0.85, L 1.5", "u radial at 0, 120, 240 degrees", "1.80", 1.798, 0.002,
            lambda: conditioning("delta-star"))],
    4: [Row("UraneSX motor speed at 2 m/s, m/s", "largest row norm of J^-1", "2.76", 2.761, 0.001, motor_speed)],
    5: [Row("UraneSX motor acceleration at 35 m/s2 and 2 m/s, m/s2", "separate maxima added", "56.37", 56.41, 0.002,
            motor_acceleration)],
    7: [Row("A of III-37", "alpha 100 mm, rho 250 sqrt(2) mm", "2.05", 2.040, 0.002,
            lambda: growth(SPREAD, 1300.0, 100.0)),
        Row("factor of III-42", "same", "0.116", 0.1136, 0.002, lambda: safe_radius(SPREAD, 1300.0, 100.0))],
}


@pytest.mark.parametrize(("number", "row"), [(n, row) for n, rows in ROWS.items() for row in rows])
def test_printed_number(number: int, row: Row) -> None:
    found = row.compute()
    print(f"\n{number}: {row.what}: {found:.5g} (printed {row.printed}, target {row.target} within "
          f"{100 * row.tolerance:g} %; {row.recipe})")
    assert found == pytest.approx(row.target, rel=row.tolerance)


def test_closed_form_forward_of_inverse_is_identity() -> None:
    """Number 6: III-11 as corrected, on UraneSX at 10^5 places, within 1e-9 mm of the place; our own forward as well."""
    kinematics = delta("uranesx")
    place, _ = kinematics.workspace.random(np.random.default_rng(6), 100_000)
    q = kinematics.inverse(place, np.tile(UP, (len(place), 1)))[0]
    ours = np.abs(kinematics.forward(q)[0] - place).max()
    printed = np.abs(closed_form(*q.T) - place).max()
    print(f"\n6: UraneSX forward of inverse: ours within {ours:.1e} mm, III-11 within {printed:.1e} mm (allowed 1e-9 mm)")
    assert ours < 1e-9 and printed < 1e-9


def closed_form(q1: np.ndarray, q2: np.ndarray, q3: np.ndarray) -> np.ndarray:
    """III-11 with B and D exchanged and E = r - R + D: y = A z + B, x = C z + D, the lower root z."""
    f, length = 150.0 - 700.0, 1300.0
    a = (q2 - q3) / (np.sqrt(3) * f)
    b = (q3 - q2) * (q3 + q2) / (2 * np.sqrt(3) * f)
    c = (2 * (q2 - q1) - a * f * np.sqrt(3)) / (-3 * f)
    d = ((q1 - q2) * (q1 + q2) - b * np.sqrt(3) * f) / (-3 * f)
    e = f + d
    two, one, none = a**2 + c**2 + 1, 2 * (a * b + c * e - q1), e**2 + b**2 + q1**2 - length**2
    z = (-one - np.sqrt(one**2 - 4 * two * none)) / (2 * two)
    return np.stack([c * z + d, a * z + b, z], axis=1)
