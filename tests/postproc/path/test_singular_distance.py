"""The distance that parallel machines keep from singular positions, and what is said about it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from postproc.setup.model import load_setup
from tests.machines.random_slides import random_slides
from tests.postproc.joint_kit import machine
from tests.postproc.kit import few_sides

SAMPLES = Path(__file__).parents[3] / "samples"
PARALLEL = [name for name in machines.names() if machine(name).kinematics.singular_names]


def places(name: str, count: int) -> np.ndarray:
    kin = machine(name).kinematics
    slides = random_slides(kin, np.random.default_rng(3), count)
    return np.column_stack([slides, np.zeros((count, kin.joints - slides.shape[1]))])


@pytest.mark.parametrize("name", PARALLEL)
def test_distances_against_the_rates_of_the_machine(name: str) -> None:
    """No slide rate moves the tip further than the inverse of the distance allows; near 0 they would be without bound."""
    kin, q = machine(name).kinematics, places(name, 200)
    found = kin.singular_distance(q)
    assert (found > 0.05).all() and (found <= 2.0).all()
    sizes = kin.legs.size if isinstance(kin, OnLegs | LegsWithAxis) else 1.0  # mm per rad of arms
    rates = kin.jacobian(q)[:, :3][:, :, [kin.axis_names.index(name) for name in kin.leg_names]] / sizes
    fastest = np.linalg.svd(rates, compute_uv=False)[:, 0]
    arm = 6.0 if any(kin.turns_tool) else 1.0
    assert (fastest <= arm / found[:, 1]).all()


@pytest.mark.parametrize("name", ["delta-parallel-z", "h4a-c-table", "uranesx"])
def test_between_points_it_is_never_above_dense_truth(name: str) -> None:
    kin, q = machine(name).kinematics, places(name, 30)
    found = kin.singular_distance_between(q)
    t = np.linspace(0, 1, 101)[:, None, None]
    dense = kin.singular_distance((q[:-1] + t * (q[1:] - q[:-1])).reshape(-1, q.shape[1])).reshape(101, len(q) - 1, 2)
    good = np.isfinite(found).all(axis=1)
    assert good.sum() > 20
    assert (found <= np.nanmin(dense, axis=0) + 1e-9)[good].all()
    assert (found >= np.nanmin(dense, axis=0) - 0.12)[good].all()


def test_a_stated_distance_is_kept_or_refused_with_lines() -> None:
    path = few_sides("h4a_dome.cls")
    setup, _ = load_setup(SAMPLES / "h4a.setup.toml")
    assert setup is not None
    kept = postproc.convert(path, machine("h4a-c-table"), setup=setup)
    (noted,) = [d for d in kept.diagnostics if d.code == "singular.distance"]
    assert kept.ok and "stated: at least 0.05" in noted.message
    strict = setup.model_copy(update={"joints": setup.joints.model_copy(update={"singular_distance": 0.9})})
    refused = postproc.convert(path, machine("h4a-c-table"), setup=strict)
    found = [d for d in refused.diagnostics if d.code == "singular.distance"]
    assert found and not refused.text and all(d.lines and "allowed at least 0.9" in d.message for d in found)


def test_serial_machines_have_none() -> None:
    kin = machine("mikron-ucp710").kinematics
    assert kin.singular_names == () and kin.singular_distance(np.zeros((3, 5))).shape == (3, 0)
    assert kin.singular_distance_between(np.zeros((3, 5))).shape == (2, 0)
