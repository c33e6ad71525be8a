"""What a pose leaves open: the spin of platforms that turn in every direction, carriers of those that move by themselves."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.kinematics import by_samples
from machines.kinematics.base import SPIN, Kinematics
from machines.kinematics.legs.on_legs import OnLegs
from machines.loader import load_checked
from tests.machines.random_slides import poses_over_workspace
from toolpaths.arrays import Floats

CASES = [("hexapod", 0.0, True), ("hexapod", 95.0, True), ("hexaslide-cone", 60.0, True), ("macro-micro", 0.0, False),
         ("macro-micro", 130.0, True)]
OFF = np.array([140.0, -90.0, 35.0])
"""mm that the part stands off the axes of the machine, where carriers bring it"""


@cache
def opened(name: str, length: float, spins: bool) -> OnLegs:
    kin = machines.load(name).kinematics.with_tool(length)
    kin = kin.with_free_spin() if spins else kin
    assert isinstance(kin, OnLegs) and kin.open_parameters
    return kin


def places(kin: OnLegs, n: int = 60, seed: int = 3) -> tuple[Floats, Floats, Floats]:
    """(tip, axis, parameters) all over the workspace and its room; carriers bring the tool as far as OFF."""
    rng = np.random.default_rng(seed)
    tip, axis = poses_over_workspace(replace(kin, carriers=kin.carriers[:0], carriers_at=kin.carriers_at[:0],
                                             axis_names=kin.axis_names[:6], rotary=kin.rotary[:6]), rng, n)
    tip = 0.6 * (tip - tip.mean(axis=0)) + tip.mean(axis=0)
    apart = 0.5 * kin.parameters_apart * rng.uniform(-1.0, 1.0, (n, len(kin.open_parameters)))
    if kin.carried_twice:
        tip = tip + OFF
        carried = kin.inverse(tip, axis)[0][:, kin.carriers_at]
        apart[:, apart.shape[1] - len(kin.carriers):] += carried
    return tip, axis, apart


@pytest.mark.parametrize("case", CASES)
def test_forward_of_the_inverse_whatever_is_left_open(case: tuple[str, float, bool]) -> None:
    kin = opened(*case)
    tip, axis, parameters = places(kin)
    q = kin.inverse_with(tip, axis, parameters)[0]
    assert np.isfinite(q).all()
    found = kin.pose(q)
    np.testing.assert_allclose(np.hstack(found[:2]), np.hstack([tip, axis]), rtol=0, atol=2e-9)
    near = kin.pose(q, np.hstack([tip + 15.0, axis]))  # as a block before would have it
    np.testing.assert_allclose(np.hstack(near[:2]), np.hstack([tip, axis]), rtol=0, atol=2e-9)
    np.testing.assert_allclose(kin.parameters_at(q), parameters, rtol=0, atol=2e-9)
    np.testing.assert_allclose(kin.inverse_like(tip + 1.0, axis, q), kin.inverse_with(tip + 1.0, axis, parameters),
                               atol=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_rates_and_bounds_where_it_changes_along_a_move(case: tuple[str, float, bool]) -> None:
    """The Jacobian by differences; the bound of moves that turn the tool about itself and carry it, against dense truth."""
    kin = opened(*case)
    tip, axis, parameters = places(kin, 25)
    q = kin.inverse_with(tip, axis, parameters)[0]
    np.testing.assert_allclose(kin.jacobian(q), by_samples.rates(lambda some: kin.forward(some), q, kin.rotary), atol=1e-5)
    turned = parameters + 0.05 * kin.parameters_apart
    moved = kin.inverse_with(tip + np.array([3.0, -2.0, 1.0]), axis, turned)[0]
    jets = kin.jets(q, moved)
    for t in np.linspace(0.0, 1.0, 9):
        h, seen = t - 0.5, kin.forward(q + t * (moved - q))
        for jet, there in zip(jets, seen, strict=True):
            value = np.stack([np.broadcast_to(v + h * (f + 0.5 * h * s), len(q)) for v, f, s in zip(
                jet.value, jet.first, jet.second, strict=True)], axis=1)
            assert (np.linalg.norm(value - there, axis=1) <= jet.third * abs(h) ** 3 / 6.0 + 1e-8).all()
            assert np.isfinite(jet.third).all() and (np.asarray(jet.third) < 1e6).all()


def test_carriers_of_a_redundant_machine_bring_its_platform_to_rest() -> None:
    kin = opened("macro-micro", 130.0, False)
    tip, axis, _ = places(kin)
    q = kin.inverse(tip, axis)[0]
    np.testing.assert_allclose(kin.rig(q).place, np.tile(kin.workspace.middle, (len(q), 1)), atol=1e-9)
    room = kin.parameters_apart
    np.testing.assert_array_equal(room, 0.5 * (kin.workspace.upper - kin.workspace.lower))


@pytest.mark.parametrize("name", ["mikron-ucp710", "h4a-c-table", "uranesx", "planar-delta-z"])
def test_a_machine_without_redundancy_leaves_nothing_open(name: str) -> None:
    kin: Kinematics = machines.load(name).kinematics
    assert kin.with_free_spin() is kin and kin.open_parameters == () and kin.parameters_apart.shape == (0,)
    q = np.tile(machines.load(name).home, (3, 1))
    tip, axis = kin.forward(q)
    assert kin.parameters_at(q).shape == (3, 0)
    np.testing.assert_array_equal(kin.inverse_like(tip, axis, q), kin.inverse(tip, axis, near=q))


def test_six_axes_leave_the_spin_open_where_it_is_asked_for() -> None:
    kin = machines.load("hexapod").kinematics
    assert kin.open_parameters == () and kin.with_free_spin().open_parameters == (SPIN,)
    assert machines.load("macro-micro").kinematics.with_free_spin().open_parameters == (SPIN, "X", "Y", "Z")


def test_carriers_that_move_where_another_does_are_refused(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('base = "macro-micro"\n[kinematics.carriers.Y]\ndirection = [1, 0, 0]\n')
    machine, found = load_checked(tmp_path / "own.toml")
    assert machine is None and any("where one another move it already" in str(d) for d in found), [str(d) for d in found]
    (tmp_path / "own.toml").write_text('base = "planar-delta-z"\n[kinematics.carriers.X]\ndirection = [1, 0, 0]\n[axes.X]\n'
                                       "travel = [0, 9]\nvelocity = 9\nacceleration = 9\njerk = 99\nhome = 0\n")
    machine, found = load_checked(tmp_path / "own.toml")
    assert machine is None and any("where the platform moves it already" in str(d) for d in found)
