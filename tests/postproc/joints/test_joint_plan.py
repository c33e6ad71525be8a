"""Branches, windings and rewinds of whole programs against a plain search over every state of every pose."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from machines.machine import Limits
from postproc.joints import states
from postproc.joints.lattice import PoseRun
from postproc.joints.plan import JointPreferences, RunSolution, plan_runs
from tests.postproc.joint_kit import DEG, machine, tilted

NAMES = ["mikron-ucp710", "head-table", "fork-head-ab", "nutating-head"]
Cost = tuple[float, float, float, float, float]


def limits_of(name: str, **travel: tuple[float, float]) -> Limits:
    """The limits of a machine with other travel, degrees."""
    m = machine(name)
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    for letter, (low, high) in travel.items():
        lower[m.axis_names.index(letter)], upper[m.axis_names.index(letter)] = low * DEG, high * DEG
    return replace(m.limits, lower=lower, upper=upper)


def wrap(angle: np.ndarray) -> np.ndarray:
    return np.pi - (np.pi - angle) % (2 * np.pi)


def inside(limits: Limits, q: np.ndarray) -> bool:
    return bool(((q >= limits.lower - 1e-9) & (q <= limits.upper + 1e-9)).all())


def seconds(limits: Limits, a: np.ndarray, b: np.ndarray) -> float:
    """Time between joints; rotaries without limits go the shorter path."""
    step = b - a
    step[3:] = np.where(np.isfinite(limits.lower[3:]), step[3:], wrap(step[3:]))
    return float((np.abs(step) / limits.velocity).max())


def plus(a: Cost, *b: float) -> Cost:
    return tuple(x + y for x, y in zip(a, b, strict=True))


UNITS = np.array([1 << 57, 1 << 51, 1 << 45, 1 << 39, 1], dtype=np.int64)
"""a cost as one whole number: poses outside, rewinds, in the cut, wrong side, nanoseconds; so that the least is the least"""


def packed(*cost: np.ndarray | float) -> np.ndarray:
    """Whole numbers of costs given column by column; time in s."""
    *counts, time = cost
    return sum(np.asarray(c, dtype=np.int64) * u for c, u in zip(counts, UNITS, strict=False)) + np.rint(
        np.asarray(time) * 1e9).astype(np.int64)


def unpacked(value: int) -> Cost:
    counts = []
    for u in UNITS.tolist()[:4]:
        counts.append(value // u)
        value %= u
    return (*counts, value * 1e-9)


def apart(limits: Limits, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(A, B) seconds between joints (A, J) and (B, J)."""
    step = b[None] - a[:, None]
    step[..., 3:] = np.where(np.isfinite(limits.lower[3:]), step[..., 3:], wrap(step[..., 3:]))
    return (np.abs(step) / limits.velocity).max(axis=2)


def brute(runs: list[PoseRun], limits: Limits, start: np.ndarray,
          side: tuple[int, int] | None = None) -> Cost:
    """Bellman forwards over every pose with every branch, every turn from -3 to 3, and a rewind at every pose."""
    cost, at = np.zeros(1, dtype=np.int64), start[None]
    after = cost
    for run in runs:
        branches = run.kin.inverse(run.tip, run.axis)
        turns = [range(-3, 4) if np.isfinite(limits.lower[j]) else [0] for j in (3, 4)]
        every = [(b, *k) for b in range(len(branches)) for k in product(*turns)]
        index = {s: k for k, s in enumerate(every)}
        branch, wound = np.array([s[0] for s in every]), 2 * np.pi * np.array([s[1:] for s in every])
        for i in range(len(run.tip)):
            q = branches[branch, i] + np.column_stack([np.zeros((len(every), 3)), wound])
            outside = ~((q >= limits.lower - 1e-9) & (q <= limits.upper + 1e-9)).all(axis=1)
            wrong = 0 if side is None else q[:, side[0]] * side[1] < -1e-9
            visit = packed(outside, 0, 0, wrong, 0.0)
            reached = (cost[:, None] + packed(0, 0, 0, 0, apart(limits, at, q))).min(axis=0) if i == 0 else after
            cost = reached + visit
            rewind = packed(0, 1, not run.rest[i], 0, run.away[i] + apart(limits, q, q))
            cost = np.minimum(cost, (cost[:, None] + rewind + visit[None]).min(axis=0))
            at = q
            if i + 1 < len(run.tip):
                after = onwards(branches, i, every, index, limits, cost)
    return unpacked(int(cost.min()))


def onwards(branches: np.ndarray, i: int, every: list[tuple[int, ...]], index: dict[tuple[int, ...], int], limits: Limits,
            cost: np.ndarray) -> np.ndarray:
    """Costs at the next pose: every rotary axis the shorter path on its own branch."""
    after = np.full(len(every), 1 << 61, dtype=np.int64)
    for s, c in zip(every, cost.tolist(), strict=True):
        course = branches[s[0], i + 1] - branches[s[0], i]
        course[3:] = wrap(course[3:])
        added = np.rint((branches[s[0], i, 3:] + course[3:] - branches[s[0], i + 1, 3:]) / (2 * np.pi)).astype(int)
        to = (s[0], *(int(k + a) if np.isfinite(w) else 0 for k, a, w in zip(s[1:], added, limits.lower[3:], strict=True)))
        if to in index:
            after[index[to]] = c + packed(0, 0, 0, 0, (np.abs(course) / limits.velocity).max())
    return after


def measured(found: list[RunSolution], runs: list[PoseRun], limits: Limits, start: np.ndarray,
             side: tuple[int, int] | None = None) -> Cost:
    """The cost of what was planned, gone through pose by pose; every pose and every rewind stands where it should."""
    cost: Cost = (0, 0, 0, 0, 0)
    at = start

    def visit(q: np.ndarray) -> tuple[float, ...]:
        return (not inside(limits, q), 0, 0, side is not None and q[side[0]] * side[1] < -1e-9, 0)

    for solution, run in zip(found, runs, strict=True):
        rewinds = {r.row: r for r in solution.rewinds}
        tip, axis = run.kin.forward(solution.q)
        assert np.abs(tip - run.tip).max() < 1e-7 and np.abs(axis - run.axis).max() < 1e-9
        for i, q in enumerate(solution.q):
            cost = plus(plus(cost, 0, 0, 0, 0, seconds(limits, at, q)), *visit(q))
            if i and i - 1 not in rewinds:
                assert np.abs((q - at)[3:]).max() < np.pi + 1e-9, "no whole turn in the cut"
            at = q
            if i in rewinds:
                r = rewinds[i]
                assert np.array_equal(r.before, at) and r.cuts == (not run.rest[i])
                tip, axis = run.kin.forward(r.after[None])
                assert np.abs(tip[0] - run.tip[i]).max() < 1e-7 and np.abs(axis[0] - run.axis[i]).max() < 1e-9
                cost = plus(plus(cost, 0, 1, float(r.cuts), 0, float(run.away[i]) + seconds(limits, at, r.after)),
                            *visit(r.after))
                at = r.after
    return cost


def random_case(name: str, rng: np.random.Generator) -> tuple[list[PoseRun], Limits, np.ndarray]:
    m = machine(name)
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    for j in (3, 4):
        middle, half = rng.uniform(-150, 150), rng.uniform(150, 420)
        lower[j], upper[j] = (middle - half) * DEG, (middle + half) * DEG
        if rng.random() < 0.2:
            lower[j], upper[j] = -np.inf, np.inf
        elif j == 3 and rng.random() < 0.6:
            lower[j], upper[j] = -rng.uniform(10, 60) * DEG, rng.uniform(60, 120) * DEG
    runs = []
    for _ in range(int(rng.integers(1, 4))):
        n = int(rng.integers(3, 7))
        axis = tilted(rng.uniform(12, 40), rng.uniform(0, 360) + np.arange(n) * rng.uniform(-20, 150))
        runs.append(PoseRun(m.kinematics, rng.uniform(-20, 20, (n, 3)), axis, rng.random(n) < 0.3, rng.uniform(0, 3, n)))
    return runs, replace(m.limits, lower=lower, upper=upper), np.append(np.zeros(3), rng.uniform(-3, 3, 2))


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", NAMES)
def test_as_cheap_as_the_search_over_every_state(name: str) -> None:
    """Travel so short that many cases need rewinds, or cannot be done at all."""
    rng, rewound = np.random.default_rng(8), 0
    for _ in range(4):
        runs, limits, start = random_case(name, rng)
        got, want = measured(plan_runs(runs, limits, start), runs, limits, start), brute(runs, limits, start)
        assert got[:3] == want[:3]
        assert got[4] == pytest.approx(want[4], abs=1e-6)
        rewound += want[1] > 0
    assert rewound >= 1 or name == "fork-head-ab", "its axes never wind up"


def test_side_of_the_tilt_axis_comes_before_time_but_after_travel() -> None:
    """A preferred negative, as the search says; without the wish A is positive."""
    name, rng = "mikron-ucp710", np.random.default_rng(3)
    for _ in range(5):
        runs, _, start = random_case(name, rng)
        limits = limits_of(name, A=(-60, 60))
        found = plan_runs(runs, limits, start, JointPreferences(side={3: -1}))
        got, want = measured(found, runs, limits, start, (3, -1)), brute(runs, limits, start, (3, -1))
        assert got[:4] == want[:4] and got[3] == 0.0
        assert got[4] == pytest.approx(want[4], abs=1e-6)
        assert all((s.q[:, 3] < 0).all() for s in found)


def test_start_angle_chooses_the_winding() -> None:
    run = PoseRun(machine("mikron-ucp710").kinematics, np.zeros((5, 3)), tilted(30, np.linspace(0, 40, 5)))
    for turns in (-2, 0, 3):
        limits = limits_of("mikron-ucp710", C=(-1500, 1500))
        q = plan_runs([run], limits, np.zeros(5), JointPreferences(start={4: turns * 360 * DEG + 0.1}))[0].q
        assert abs(q[0, 4] / DEG - turns * 360) <= 185


def test_fine_segments_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Following continuous tracks between events gives what one segment per pose gives."""
    rng, structure = np.random.default_rng(5), states._structure
    for name in NAMES:
        runs, limits, start = random_case(name, rng)
        coarse = plan_runs(runs, limits, start)
        monkeypatch.setattr(states, "_structure", lambda lattice: np.ones(lattice.poses - 1, dtype=bool))
        fine = plan_runs(runs, limits, start)
        monkeypatch.setattr(states, "_structure", structure)
        a, b = (measured(x, runs, limits, start) for x in (coarse, fine))
        assert a[:3] == b[:3] and a[4] == pytest.approx(b[4], abs=1e-6)


def test_rewinds_of_a_spiral_are_the_fewest_and_stand_where_the_tool_does_not_cut() -> None:
    """Ten turns with C within +-400 degrees, from -270: 670 degrees, then two turns for each rewind, so five of them."""
    n = 10 * 72 + 1
    phi = np.arange(n) * 5.0
    rest = np.arange(n) % 18 == 0
    run = PoseRun(machine("mikron-ucp710").kinematics, np.zeros((n, 3)), tilted(30, phi), rest)
    limits = limits_of("mikron-ucp710", C=(-400, 400), A=(0, 120))
    found = plan_runs([run], limits, np.zeros(5))[0]
    assert len(found.rewinds) == 5 and found.outside == 0
    assert not any(r.cuts for r in found.rewinds) and all(rest[r.row] for r in found.rewinds)
    whole = plan_runs([replace(run, rest=None)], limits, np.zeros(5))[0]
    assert len(whole.rewinds) == 5 and all(r.cuts for r in whole.rewinds)
    assert plan_runs([run], limits, np.zeros(5), may_rewind=False)[0].outside > 0


def test_tool_along_the_table_all_the_way_takes_the_table_as_it_stands() -> None:
    """Between two runs at C 70 and 110 a third along C takes one of them; the linking path is the shorter for it."""
    m = machine("mikron-ucp710")
    tip = np.linspace(0, 1, 4)[:, None] * [10.0, 5, 0]
    leaning = [PoseRun(m.kinematics, tip, np.tile(tilted(30, phi), (4, 1))) for phi in (70.0, 110.0)]
    upright = PoseRun(m.kinematics, tip, np.tile([0.0, 0, 1], (4, 1)))
    first, middle, last = plan_runs([leaning[0], upright, leaning[1]], m.limits, m.home)
    assert np.ptp(middle.q[:, 4]) < 1e-9
    ends = first.q[-1, 4], last.q[0, 4]
    assert min(ends) - 1e-9 <= middle.q[0, 4] <= max(ends) + 1e-9


def test_rejected_candidates_say_by_how_much() -> None:
    """A within -30 to 120: the branch with A -40 is outside on every pose, so it is not among those that go through."""
    m = machine("mikron-ucp710")
    run = PoseRun(m.kinematics, np.zeros((6, 3)), tilted(20, np.linspace(10, 60, 6)))
    found = plan_runs([run], m.limits, m.home)[0]
    assert [round(x.q[3] / DEG) for x in found.rejected_starts] == [-round(found.q[0, 3] / DEG)]
    assert found.rejected_starts[0].extra_cost[4] >= 0.0
