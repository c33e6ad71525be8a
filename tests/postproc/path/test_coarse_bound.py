"""The cheap bound of blocks: never below the closer one, and with it the same points and the same worst deviation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import machines
from machines.kinematics import chain_loop
from machines.kinematics.serial import Serial
from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.path import bound, coarse_bound, linearise
from postproc.path.bound import SHORT, CurveBlocks, bounds
from tests.postproc.joint_kit import DEG, machine, segments
from toolpaths.shape import Curves

CHAINS = sorted(name for name in machines.names() if isinstance(machines.load(name).kinematics, Serial))
pytestmark = pytest.mark.numeric


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loops as they stand, of as few blocks as there are."""
    for module in (chain_loop, coarse_bound):
        monkeypatch.setattr(module, "compiled", lambda function: function)
    monkeypatch.setattr(chain_loop, "pays", lambda n: True)


def blocks(name: str, size: float, count: int = 40, seed: int = 3) -> CurveBlocks:
    """Short moves whose joints stand on one branch at both ends, and the lines between their tips."""
    kin, rng = machine(name).kinematics.with_tool(80.0), np.random.default_rng(seed)
    q0 = rng.uniform(-1, 1, (count, kin.joints)) * np.where(kin.rotary, 1.3, 150.0)
    q1 = q0 + rng.normal(0, size, (count, kin.joints)) * np.where(kin.rotary, 0.02, 3.0)
    (start, axis0), (end, axis1) = kin.forward(q0), kin.forward(q1)
    q0, q1 = nearest_solution(kin, start, axis0, q0), nearest_solution(kin, end, axis1, q1)
    n = np.flatnonzero(np.isfinite(q0).all(axis=1) & np.isfinite(q1).all(axis=1))
    curves: Curves = segments(start, end, axis0, axis1).take(n)
    return CurveBlocks(curves, np.zeros(len(n)), np.ones(len(n)), q0[n], q1[n], kin.forward(q0[n]), kin.forward(q1[n]))


@pytest.mark.parametrize("name", CHAINS)
def test_bends_are_above_those_of_the_closer_bound(name: str, interpreted: None) -> None:
    kin, b = machine(name).kinematics.with_tool(80.0), blocks(name, 1.0)
    coarse = chain_loop.coarse_bends(kin.chain, kin.axis_names, -80.0 * kin.tool_axis, b.q0, b.q1)
    assert coarse is not None
    q = b.q0 + np.linspace(0.0, 1.0, 21)[:, None, None] * (b.q1 - b.q0)
    for found, x in zip(coarse, zip(*(kin.forward(one) for one in q), strict=True), strict=True):
        bent = np.linalg.norm(np.diff(np.stack(x), 2, axis=0), axis=2).max(axis=0) * 400.0
        assert (bent <= found * (1.0 + 1e-6) + 1e-6).all()
        assert name.startswith("mill") or (bent > 0.05 * found).any()


@pytest.mark.parametrize("size", [0.02, 1.0, 4.0])
@pytest.mark.parametrize("name", CHAINS)
def test_the_cheap_bound_is_never_below_the_closer_one(name: str, size: float, interpreted: None) -> None:
    kin, b = machine(name).kinematics.with_tool(80.0), blocks(name, size)
    coarse = coarse_bound.coarse_bounds(kin, b.curves, (b.q0, b.q1), b.start, b.end, SHORT)
    assert coarse is not None
    for cheap, close in zip(coarse, bounds(Control(machine(name), "axes", np.zeros(3)), kin, b, 1e9, 1e9), strict=True):
        assert (cheap >= close).all()
        assert size == 4.0 or np.isfinite(cheap).any()


@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head"])
def test_the_same_points_and_the_same_worst_with_it_and_without(name: str, interpreted: None,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    kin, b = machine(name).kinematics.with_tool(80.0), blocks(name, 0.15, 60)
    control, found, looked = Control(machine(name), "axes", np.zeros(3)), [], []
    close = bound.bounds
    monkeypatch.setattr(bound, "bounds", lambda *given: looked.append(len(given[2])) or close(*given))
    monkeypatch.setattr(coarse_bound, "FIRST", 3)
    for many in (10**9, 1):
        monkeypatch.setattr(bound, "MANY", many)
        looked.append(0)
        found.append(linearise.linearise(control, kin, b.curves, b.q0, b.q1, np.zeros(len(b), dtype=bool), 0.02, 0.1 * DEG))
    for one, other in zip(*(vars(piece).values() for piece in found), strict=True):
        np.testing.assert_array_equal(one, other)
    without, with_it = (sum(looked[at:to]) for at, to in ((0, looked.index(0, 1)), (looked.index(0, 1), None)))
    assert with_it < 0.8 * without


@pytest.mark.parametrize("name", ["mikron-ucp710", "fork-head-ab"])
def test_ends_beside_the_line_and_turns_along_it_are_in_the_cheap_bound(name: str, interpreted: None) -> None:
    """Lines beside the blocks, lines along which the axis turns at another place, and arcs, of which it says nothing."""
    kin, b = machine(name).kinematics.with_tool(80.0), blocks(name, 0.3)
    beside, along = np.array([0.02, -0.01, 0.03]), 0.2 * (b.curves.end - b.curves.start)
    for first, last in ((beside, beside), (beside, 0.0), (0.0, along), (-along, 0.0)):
        lines = segments(b.curves.start + first, b.curves.end + last, b.curves.axis0, b.curves.axis1)
        cheap = coarse_bound.coarse_bounds(kin, lines, (b.q0, b.q1), b.start, b.end, SHORT)
        assert cheap is not None and np.isfinite(cheap).any()
        for t in np.linspace(0.0, 1.0, 11):
            off = lines.deviation(*kin.forward(b.q0 + t * (b.q1 - b.q0)), np.full(len(lines), t))
            assert (cheap[0] >= off[0]).all() and (cheap[1] >= off[1]).all()
    arcs = replace(b.curves, is_arc=np.arange(len(b)) % 2 == 0)
    found = coarse_bound.coarse_bounds(kin, arcs, (b.q0, b.q1), b.start, b.end, SHORT)
    assert found is not None and np.isinf(found[:, ::2]).all() and np.isfinite(found[:, 1::2]).any()
