"""Influence of dimensions: printed rows of annex F, the exact closure of perturbed machines, optimal budgets."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize
from typer.testing import CliRunner

import machines
from machines.tolerances.any_machine import MachinePositions, any_machine, positions_of
from machines.tolerances.influence import budget, by_chance, influence, largest, middle_of, poses_over, single
from machines.tolerances.report import rods_of
from machines.tolerances.sensitivity import RodsOfLegs, rod_rows, sensitivity
from postproc.cli.app import app
from tests.machines.tolerances.annex_f import OM, annex_f, annex_f_poses

PRINTED = {
    "drive X x": (0.3333, -0.8911, -0.0624, 1.2478, 0.0, 1.6667), "drive X y": (0.0,) * 6,
    "drive X z": (-0.8905, 2.3805, 0.1667, -3.3333, 0.0, -4.4524),
    "drive Y x": (0.3333, 0.8911, -0.0624, -1.2478, 0.0, -1.6667),
    "drive Z x": (-0.3025, -0.3671, 0.0312, 0.3119, -0.5403, -0.8333),
    "drive Z y": (0.5240, 0.6359, -0.0540, -0.5403, 0.9358, 1.4434),
    "drive Z z": (-1.6164, -1.9614, 0.1667, 1.6667, -2.8868, -4.4524),
    "rod X": (-0.9508, 2.5418, 0.1780, -3.5592, 0.0, -4.7541)}
"""F-16 in the middle: x, y, z and turns of Om per metre (acceptance row 10)"""


@pytest.mark.parametrize("name", PRINTED)
def test_rows_of_the_matrix_of_annex_f(name: str) -> None:
    rods, poses = annex_f(), annex_f_poses(1)
    found = sensitivity(rods, poses.place, poses.turn, OM)[0]
    found[3:] *= 1000.0
    column = [str(one) for one in rods.dimensions].index(name)
    np.testing.assert_allclose(found[:, column], PRINTED[name], atol=6e-5)


def test_largest_influences_of_table_f_2() -> None:
    """P1 in x, y, z: position of Om and turn over the workspace (acceptance row 11)."""
    rods = annex_f()
    found = largest(influence(rods, OM, False), annex_f_poses(5), single(rods.dimensions[:3]))
    np.testing.assert_allclose(found.position, [2.4812, 1.7646, 5.2422], atol=6e-5)
    np.testing.assert_allclose(1000.0 * found.turn, [3.9264, 2.1175, 6.3577], atol=6e-5)


def closed(rods: RodsOfLegs, place: np.ndarray, turn: np.ndarray, point: np.ndarray, column: int, size: float) -> np.ndarray:
    """(6,) move of `point` and turn of the platform when one dimension is off by `size`: the rods' exact closure by Newton.

    Written for itself: rods as lines between displaced joints, rates by differences.
    """
    g, one = rods.legs, rods.dimensions[column]
    q = rods.loops.drives.solve(rods.loops.ends(place[None], turn[None]), g.roots)
    feet = rods.loops.drives.feet(q)[0]
    v = size * np.eye(3)["xyz".find(one.axis) if one.axis in "xyz" else "abc".find(one.axis) if one.axis in "abc"
                         else "tnu".find(one.axis)] if one.axis.strip() else np.zeros(3)

    def turned(w: np.ndarray) -> np.ndarray:
        angle = np.linalg.norm(w)
        k = w / angle if angle else w
        over = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        return np.eye(3) + np.sin(angle) * over + (1 - np.cos(angle)) * over @ over

    def frame(k: int) -> np.ndarray:
        u = g.directions[k]
        inward = np.append(-g.points[k, :2], 0.0)
        inward -= (inward @ u) * u
        inward /= np.linalg.norm(inward)
        return np.stack([np.cross(inward, u), inward, u], axis=1)

    a, b, length = [], [], []
    for rod, (k, shift) in enumerate(zip(rods.leg, rods.shift, strict=True)):
        foot, joint, name = feet[k] + shift, g.joints[k] + turn.T @ shift, rods.names[rod]
        length.append(np.linalg.norm(place + turn @ joint - foot) + size * (one.part == "rod" and one.of == name))
        if one.part == "drive" and one.of == g.names[k]:
            foot = foot + v
        if one.part == "guide" and one.of == g.names[k]:
            pivot = np.zeros(3) if rods.from_origin else g.points[k]
            foot = pivot + turned(v) @ (foot - pivot)
        if one.part == "foot" and one.of == name:
            foot = foot + frame(k) @ v
        if one.part == "joint" and one.of == name:
            joint = joint + v
        a.append(foot)
        b.append(joint)
    a, b, length = np.array(a), np.array(b), np.array(length)

    def gaps(x: np.ndarray) -> np.ndarray:
        now = turned(x[3:]) @ turn
        c = place + turn @ point + x[:3] - now @ point
        return np.linalg.norm(c + b @ now.T - a, axis=1) - length

    x = np.zeros(6)
    for _ in range(4):
        rates = np.stack([(gaps(x + h) - gaps(x - h)) / 2e-4 for h in 1e-4 * np.diag([1, 1, 1, 0.01, 0.01, 0.01])], axis=1)
        rates[:, 3:] *= 100.0
        x = x - np.linalg.solve(rates, gaps(x))
    return x


@pytest.mark.parametrize("name", ["uranesx", "hexaslide-parallel-z", "h4a-c-table"])
def test_every_dimension_is_the_derivative_of_the_exact_closure(name: str) -> None:
    """All 60 dimensions of UraneSX (annex E, acceptance row 12), of a hexaslide and of an H4, off the middle."""
    rods = rods_of(machines.load(name))
    poses = poses_over(rods.legs).part(slice(7, 8))
    point = rods.legs.gauge - [0.0, 0.0, 100.0]
    found = sensitivity(rods, poses.place, poses.turn, point)[0]
    assert found.shape[1] == 6 * len(rods.legs.names) + 7 * len(rods.leg)
    assert name != "uranesx" or found.shape[1] == 60
    for column, one in enumerate(rods.dimensions):
        size = 1e-5 if one.part == "guide" else 1e-2
        ahead, behind = (closed(rods, poses.place[0], poses.turn[0], point, column, s) for s in (size, -size))
        np.testing.assert_allclose((ahead - behind) / (2 * size), found[:, column], rtol=2e-6, atol=1e-7, err_msg=str(one))


@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head", "tricept", "tripod-head", "linuxcnc-pentapod",
                                  "h4-rotary", "h4a-c-table", "linear-delta-ac", "macro-micro"])
def test_dimensions_of_every_kind_move_the_tool_as_their_exact_machine(name: str) -> None:
    """Chains, axes in series, coupled platforms, bars, redundant carriers: the machine with one dimension off by so much,
    solved exactly, against the first order; adjusted rods leave nothing of themselves in the middle."""
    m = machines.load(name)
    whole, positions = any_machine(m, 80.0), positions_of(m, 80.0)
    assert whole is not None
    some = MachinePositions(positions.q[[0, 7, 100]], positions.pose[[0, 7, 100]])
    found, w = whole.influence(some), whole.actual.coordinates(some.q)
    rng = np.random.default_rng(0)
    for column in rng.choice(len(whole.dimensions), 6, replace=False):
        one = whole.dimensions[column]
        size = 1e-5 if one.angular else 1e-3
        ahead, behind = (whole.off(column, s).aim(w) for s in (size, -size))
        np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * size), found[:, :3, column], atol=2e-5 * (1 + np.abs(
            found[:, :3, column]).max()), err_msg=str(one))
        turned = np.cross(found[:, 3:, column], whole.actual.aim(w)[1])
        np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * size), turned, atol=2e-5, err_msg=str(one))
    middle = positions.part(slice(0, 1))
    rods = [k for k, one in enumerate(whole.dimensions) if one.part == "rod"]
    if rods:
        assert np.abs(whole.adjusted(middle, middle, 100.0)[0, :, rods]).max() < 1e-9


def test_arms_and_planes_move_as_their_rods_say() -> None:
    """A rod's length is in no frame: of a rotary Delta and of a planar machine by the loops of the machine itself."""
    for name in ("rotary-delta", "planar-delta"):
        rods = rods_of(machines.load(name))
        middle = middle_of(rods.legs)
        rows = rod_rows(rods, middle.place, middle.turn, rods.legs.gauge)
        s = sensitivity(rods, middle.place, middle.turn, rods.legs.gauge)[0]
        k = [one.part for one in rods.dimensions].index("rod")
        pair = s[:, k] + s[:, k + 1]  # both rods of a pair longer: the platform only moves
        assert np.abs(pair[3:]).max() < 1e-12 and np.abs(pair[:3]).max() > 0.1
        np.testing.assert_allclose(rows.motions[0, :, :3] @ pair[:3], rows.errors[0][:, [k, k + 1]].sum(axis=1), atol=1e-12)


def test_rods_adjusted_in_the_middle_leave_nothing_there() -> None:
    """F.3.4: and less elsewhere, of all parts but guides."""
    rods = rods_of(machines.load("uranesx"))
    middle, poses = middle_of(rods.legs), poses_over(rods.legs)
    assert np.abs(influence(rods, rods.legs.gauge, True)(middle)).max() < 1e-15
    groups = single(rods.dimensions)
    before, after = (largest(influence(rods, rods.legs.gauge, adjust), poses, groups).position for adjust in (False, True))
    parts = np.array([one.part for one in rods.dimensions])
    assert after[parts == "rod"].max() == 0.0
    assert after[parts == "drive"].sum() < before[parts == "drive"].sum()


def test_errors_by_chance_have_the_deviation_of_their_matrix() -> None:
    s, spread = np.random.default_rng(0).normal(size=(6, 30)), np.linspace(0.5, 1.5, 30)
    for normal, variance in ((True, 1.0), (False, 1.0 / 3.0)):
        found = by_chance(s, spread, 40_000, normal)
        covariance = variance * (s * spread**2) @ s.T
        drawn = np.random.default_rng(5).multivariate_normal(np.zeros(3), covariance[:3, :3], 40_000)
        assert found.position[0] == pytest.approx(np.linalg.norm(drawn, axis=1).mean(), rel=0.02)
        assert found.position[1] < found.position[2] < found.position[3]


def test_a_budget_costs_least() -> None:
    """Against a general optimiser; the limit is used up."""
    rods = rods_of(machines.load("rotary-delta"))
    dims, most = rods.dimensions[-6:] + rods.dimensions[:3], np.array([1.0, 2.0, 0.5, 1.0, 3.0, 1.0, 0.2, 0.0, 1.0])
    cost = {"drive": 4.0}
    price = np.array([cost.get(one.part, 1.0) for one in dims])
    found = budget(dims, most, 0.02, cost)
    assert found[7] == np.inf
    use = most > 0.0
    assert np.linalg.norm(most[use] * found[use]) == pytest.approx(0.02)
    other = minimize(lambda t: (price[use] / np.exp(t)).sum() * 1e-3, np.full(use.sum(), np.log(1e-3)), method="SLSQP",
                     constraints={"type": "ineq", "fun": lambda t: 1.0 - ((most[use] * np.exp(t) / 0.02) ** 2).sum()})
    assert (price[use] / found[use]).sum() == pytest.approx((price[use] / np.exp(other.x)).sum(), rel=1e-5)


def test_the_command_writes_table_and_figure(tmp_path: Path) -> None:
    run, table, figure = CliRunner(), tmp_path / "t.csv", tmp_path / "t.svg"
    done = run.invoke(app, ["machine", "tolerance", "planar-delta", "--error", "0.02", "--cost", "guide=3", "--csv",
                            str(table), "--figure", str(figure), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
    assert [row["dimension"] for row in rows] == [row["dimension"] for row in found["dimensions"]]
    assert found["budget"]["cost"] < found["budget"]["cost_of_equal_tolerances"]
    assert figure.read_text("utf-8").startswith("<?xml")
    assert "sensitivity.adjust" in run.invoke(app, ["machine", "tolerance", "mill-3axis", "--adjust"]).stderr
    dear = run.invoke(app, ["machine", "tolerance", "mill-3axis", "--error", "0.02", "--cost", "axis Y a=1000", "--json",
                            "-"])
    rows = {row["dimension"]: (row["tolerance"] or 0.0) * row["position"] for row in json.loads(dear.stdout)["dimensions"]}
    assert max(rows, key=lambda name: rows[name]) == "axis Y a"
    assert "did you mean 'axis Y a'" in run.invoke(app, ["machine", "tolerance", "mill-3axis", "--error", "0.02", "--cost",
                                                         "axis Y aa=1"]).stderr
    assert run.invoke(app, ["machine", "tolerance", "planar-delta", "--cost", "guide=3"]).exit_code == 2
