"""Moves from rest to rest: closed forms against ruckig and the printed formulas, the laws, and no way-points anywhere."""

from __future__ import annotations

import ast
from typing import Any, ClassVar

import numpy as np
import pytest
import ruckig

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.rest_to_rest import PointToPointMode, rest_seconds, rest_to_rest
from tests.postproc.feedrate_kit import MIKRON
from tests.source import ROOT, nodes, product

LIMITS = JointLimits(np.array([100.0, 50.0, 3.0]), np.array([1000.0, 800.0, 20.0]),
                     np.array([5000.0, 60000.0, 300.0]))


def moves(count: int, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """From micrometres to metres; some joints stand still."""
    rng = np.random.default_rng(seed)
    travel = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-4.0, 3.0, (count, 1)) * [1.0, 1.0, 0.05]
    travel[rng.random((count, 3)) < 0.2] = 0.0
    q0 = rng.normal(size=(count, 3))
    return q0, q0 + travel


@pytest.mark.parametrize("law", PointToPointMode)
def test_closed_form_equals_ruckig(law: PointToPointMode) -> None:
    """Duration to the sample: the last one is the first multiple of the step at which all stands still."""
    q0, q1 = moves(60)
    seconds = rest_seconds(q0, q1, LIMITS, law)
    for i, one in enumerate(seconds):
        made = rest_to_rest(q0[i], q1[i], LIMITS, law)
        assert one - 1e-9 <= made.t[-1] < one + 1e-3 + 1e-9
        assert np.array_equal(made.q[0], q0[i]) and np.array_equal(made.q[-1], q1[i])
        assert np.all(np.concatenate((made.qd[-1], made.qdd[-1], made.qddd[-1])) == 0.0)


def ruckig_seconds(travel: float, v: float, a: float, j: float) -> float:
    wanted, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    wanted.current_position, wanted.target_position = [0.0], [travel]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [v], [a], [j]
    assert ruckig.Ruckig(1).calculate(wanted, found) == ruckig.Result.Working
    return float(found.duration)


@pytest.mark.parametrize("j", [2e3, 1e5, np.inf])
def test_duration_of_one_joint_is_ruckigs(j: float) -> None:
    limits = JointLimits(np.array([90.0]), np.array([1100.0]), np.array([j]))
    travel = 10.0 ** np.linspace(-5.0, 3.5, 60)
    found = rest_seconds(np.zeros((60, 1)), -travel[:, None], limits, PointToPointMode.DOG_LEG)
    np.testing.assert_allclose(found, [ruckig_seconds(one, 90.0, 1100.0, j) for one in travel], rtol=1e-9)


def test_laws() -> None:
    """Straight stays on the line and uses the joint that allows least; dog-leg joints end one by one; together otherwise."""
    q0, q1 = np.array([1.0, 2.0, 3.0]), np.array([41.0, -18.0, 3.1])
    straight, leg, together = (rest_to_rest(q0, q1, LIMITS, law) for law in PointToPointMode)
    share = (straight.q - q0) / (q1 - q0)
    np.testing.assert_allclose(share, share[:, :1] * np.ones(3), atol=1e-12)
    used = straight.usage(LIMITS)
    assert used.worst == pytest.approx(1.0, abs=2e-2) and straight.t[-1] >= leg.t[-1]
    ends = [leg.t[np.flatnonzero(leg.qd[:, j])[-1]] for j in range(3)]
    assert ends[2] < ends[1] < ends[0]
    last = [together.t[np.flatnonzero(np.abs(together.qd[:, j]) > 1e-4)[-1]] for j in range(3)]
    assert together.t[-1] == leg.t[-1] and max(last) - min(last) < 0.02
    for made in (straight, leg, together):
        assert made.usage(LIMITS).worst <= 1.0 + 1e-6


def test_samples_are_derivatives_of_each_other() -> None:
    made = rest_to_rest(np.zeros(5), np.array([300.0, -20.0, 1.0, 0.4, 0.0]), MIKRON,
                        PointToPointMode.SYNCHRONISED)
    for low, high in ((made.q, made.qd), (made.qd, made.qdd)):
        slope = (low[2:] - low[:-2]) / 2e-3
        np.testing.assert_allclose(slope, high[1:-1], atol=2e-3 * np.abs(high).max() + 1e-9)


def test_limits_of_acceleration_only() -> None:
    """Triangle: 2 sqrt(D/A); trapezium: D/V + V/A; no jerk stated."""
    limits = JointLimits(np.array([100.0]), np.array([1000.0]), np.array([np.inf]))
    q1 = np.array([[2.5], [50.0]])
    np.testing.assert_allclose(rest_seconds(np.zeros((2, 1)), q1, limits, "dog-leg"), [0.1, 0.6], rtol=1e-12)
    made = rest_to_rest(np.zeros(1), q1[1], limits, "straight")
    assert made.qd.max() == pytest.approx(100.0) and made.usage(limits).acceleration[0] <= 1.0 + 1e-6


def test_nothing_moves_takes_no_time() -> None:
    for law in PointToPointMode:
        assert rest_seconds(np.ones((2, 3)), np.ones((2, 3)), LIMITS, law).tolist() == [0.0, 0.0]
        assert rest_to_rest(np.ones(3), np.ones(3), LIMITS, law).t.tolist() == [0.0]


def test_bad_moves_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        rest_seconds(np.array([[0.0]]), np.array([[np.nan]]), JointLimits(*np.ones((3, 1))), "straight")
    free = JointLimits(np.array([1.0]), np.array([np.inf]), np.array([np.inf]))
    with pytest.raises(ValueError, match="without limits"):
        rest_seconds(np.array([[0.0]]), np.array([[1.0]]), free, "dog-leg")
    with pytest.raises(ValueError, match="not a valid PointToPointMode"):
        rest_seconds(np.array([[0.0]]), np.array([[1.0]]), free, "curved")


class Watched:
    """Stands for ruckig.InputParameter and notes which of its attributes are set."""

    real = ruckig.InputParameter
    names: ClassVar[set[str]] = set()

    def __init__(self, joints: int) -> None:
        self.__dict__["inner"] = Watched.real(joints)

    def __setattr__(self, name: str, value: object) -> None:
        Watched.names.add(name)
        setattr(self.__dict__["inner"], name, value)


class Planner:
    """Stands for ruckig.Ruckig and looks at what it is asked."""

    real = ruckig.Ruckig

    def __init__(self, joints: int) -> None:
        self.inner = Planner.real(joints)

    def calculate(self, wanted: Watched, found: Any) -> Any:
        inner = wanted.__dict__["inner"]
        assert not inner.intermediate_positions
        return self.inner.calculate(inner, found)


def test_way_points_are_never_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ruckig, "InputParameter", Watched)
    monkeypatch.setattr(ruckig, "Ruckig", Planner)
    for law in PointToPointMode:
        rest_to_rest(np.zeros(3), np.ones(3), LIMITS, law)
    assert Watched.names == {"current_position", "target_position", "max_velocity", "max_acceleration", "max_jerk",
                             "synchronization"}


def test_one_module_imports_ruckig() -> None:
    users, names = set(), set()
    for file in product():
        for node in nodes(file):
            if isinstance(node, ast.Import) and any(name.name.split(".")[0] == "ruckig" for name in node.names):
                users.add(file.relative_to(ROOT).as_posix())
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "ruckig":
                users.add(file.relative_to(ROOT).as_posix())
            name = getattr(node, "attr", getattr(node, "value", ""))
            if isinstance(name, str):
                names.add(name)
    assert users == {"postproc/feedrate/rest_to_rest.py"}
    assert not any(name.startswith(("intermediate_pos", "per_section")) for name in names)
