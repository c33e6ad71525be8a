"""Every built-in machine with errors from files of every kind of curve, against the second implementation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.correction import POLE, correct
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.files.loader import load
from machines.kinematics.base import Kinematics
from tests.machines.independent_machine import Curve, Errors, Machine
from tests.machines.random_error_files import Draw
from tests.machines.random_slides import random_slides
from toolpaths.arrays import Floats
from toolpaths.units import DEG

NAMES = [name for name in machines.names() if (kin := machines.load(name).kinematics).chain or kin.on_rods]
"""machines whose errors are modelled"""
ARCSEC = DEG / 3600.0
TOOL = 63.0
SIGMA = 0.4


@dataclass(frozen=True)
class Case:
    """One machine with one drawn error file, and joints q (N, J) in its travel."""

    own: Machine
    file: Path
    kin: Kinematics
    model: ErrorModel
    q: Floats

    @property
    def actual(self) -> Actual:
        return self.model.on(self.kin)

    @property
    def nominal(self) -> Floats:
        """(N, 6) tip and axis."""
        return np.concatenate(self.kin.forward(self.q), axis=1)

    def poses(self, q: Floats, approach: Floats | None = None,
              errors: Errors | None = None) -> tuple[Floats, Floats]:
        """(tip, axis) by the second implementation."""
        known = Errors(self.file) if errors is None else errors
        approaches = np.zeros(q.shape) if approach is None else approach
        found = [self.own.pose(x, TOOL, known, w, near) for x, w,
                 near in zip(q, approaches, self.nominal[: len(q)], strict=True)]
        return np.array([tip for tip, _ in found]), np.array([axis for _, axis in found])


def drawn(folder: Path, name: str, seed: int, both: bool = False, n: int = 8, sigma: str = "") -> Case:
    machine, own = machines.load(name), Machine(name)
    file = Draw(folder, own, seed, both=both).write()
    file.write_text(f"{file.read_text()}{sigma}")
    kin, rng = machine.kinematics.with_tool(TOOL), np.random.default_rng(seed)
    if own.kinematics["kind"] == "serial":
        low, high = np.nan_to_num(machine.limits.lower, neginf=-7.0), np.nan_to_num(machine.limits.upper, posinf=7.0)
        q = rng.uniform(low, high, (n, len(low)))
    else:
        q = random_slides(kin, rng, n)
        q = np.column_stack([q, rng.uniform(-0.7, 0.7, n)]) if any(machine.rotary) else q
    return Case(own, file, kin, load(file, machine), q)


@pytest.mark.covering
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_the_machine_with_errors_is_where_the_second_implementation_has_it(name: str, seed: int, tmp_path: Path) -> None:
    """Serial: 4 x 4 products; on rods: six lengths by least squares. All curves, units, signs, frames, both directions."""
    case = drawn(tmp_path, name, seed, both=seed == 1)
    approach = np.random.default_rng(seed).choice([-1.0, 0.0, 1.0], size=case.q.shape)
    tip, axis = case.actual.aim(case.actual.coordinates(case.q, case.nominal), approach)
    wanted = case.poses(case.q, approach)
    assert np.abs(tip - case.nominal[:, :3]).max() > 5e-3
    np.testing.assert_allclose(tip, wanted[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(axis, wanted[1], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_corrected_joints_put_the_tip_of_the_second_implementation_there(name: str, tmp_path: Path) -> None:
    """0.1 um and 0.01 arcsec before formatting, where a turn is free; what is left of the axis is what is reported."""
    case = drawn(tmp_path, name, 7, n=12)
    tip, axis = case.nominal[:, :3], case.nominal[:, 3:]
    found = correct(case.actual, case.q, tip, axis, beyond=True)
    t, a = case.poses(found.q)
    assert np.linalg.norm(t - tip, axis=1).max() < 1e-7
    np.testing.assert_allclose(np.linalg.norm(a - axis, axis=1), found.axis_after, rtol=0.0, atol=1e-9)
    if sum(case.kin.rotary) == 2 or (any(case.kin.rotary) and "h4a" in name):
        free = ~found.partial & (np.abs(np.hypot(axis[:, 0], axis[:, 1])) > POLE)
        assert free.sum() >= 4 and np.linalg.norm(a - axis, axis=1)[free].max() < 0.01 * ARCSEC


@pytest.mark.parametrize("name", NAMES)
def test_first_order_differs_from_the_second_implementation_by_second_order(name: str, tmp_path: Path) -> None:
    """C 1.25: what the transport matrices leave is a product of two errors, so half the errors leave a quarter."""
    case = drawn(tmp_path, name, 4, n=30)
    w, left = case.actual.coordinates(case.q, case.nominal), []
    for size in (8.0, 4.0):
        model = case.model.with_values(size * case.model.values)
        actual = model.on(case.kin)
        tip, axis = actual.aim(w)
        first = actual.deviation(w, model.values)
        left.append([np.abs(tip - case.nominal[:, :3] - first[:, :3]).max(),
                     np.abs(axis - case.nominal[:, 3:] - np.cross(first[:, 3:], case.nominal[:, 3:])).max()])
    np.testing.assert_allclose(np.divide(left[0], left[1]), [4.0, 4.0], rtol=0.03)
    one = case.poses(case.q[:5])[0] - case.nominal[:5, :3]
    first = case.actual.deviation(w, case.model.values)[:5, :3]
    assert np.abs(one - first).max() < 0.02 * np.abs(one).max()


class Spread(Errors):
    """The same file with every constant, coefficient and table value off by its own draw of SIGMA (um, arcsec)."""

    def __init__(self, file: Path, rng: np.random.Generator) -> None:
        self.rng = rng
        super().__init__(file)
        self.toml["location"] = {k: v + SIGMA * rng.normal() for k, v in self.toml["location"].items()}
        for leg in self.toml.get("legs", {}).values():
            for key, value in leg.items():
                if key != "pair":
                    leg[key] = (np.array(value) + SIGMA * rng.normal(size=np.shape(value))).tolist()

    def curve(self, name: str, given: dict[str, Any]) -> Curve:
        moved = dict(given)
        for key in {"mean", "cosine", "sine", "polynomial"} & given.keys():
            value = np.array(given[key], dtype=float)
            moved[key] = (value + SIGMA * self.rng.normal(size=value.shape)).tolist()
        return super().curve(name, moved)

    def rows(self, name: str, values: Floats) -> Floats:
        return values + SIGMA * self.unit(name) * self.rng.normal(size=len(values))


DRAWS = 120


@pytest.mark.parametrize("name", ["nutating-head", "uranesx", "h4a-c-table"])
def test_the_predicted_uncertainty_is_the_spread_of_machines_drawn_at_random(name: str, tmp_path: Path) -> None:
    """Every number of the files is drawn again, by SIGMA um or arcsec; the tips are those of the second implementation."""
    case = drawn(tmp_path, name, 0, n=2, sigma=sigmas(name))
    predicted = uncertainty(case.model, case.actual, case.actual.coordinates(case.q, case.nominal))
    rng = np.random.default_rng(3)
    tips = np.stack([case.poses(case.q, errors=Spread(case.file, rng))[0] for _ in range(DRAWS)])
    spread = tips.std(axis=0, ddof=1)
    assert spread.min() > 1e-4
    np.testing.assert_allclose(spread, predicted.tip, rtol=4.0 / np.sqrt(2.0 * DRAWS))


def sigmas(name: str) -> str:
    """[sigma] of all parameters of a machine."""
    legs = Machine(name).kinematics.get("legs", {})
    return "\n".join(["[sigma]", f"E = {SIGMA}", *(f'"{leg}" = {SIGMA}' for leg in legs), ""])
