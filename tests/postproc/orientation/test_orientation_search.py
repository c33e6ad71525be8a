"""The search of tool axes: joints, times on shared knots, vertices of any table, cores, what the machine cannot run."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import turned, turned_all
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.initial_axes import around
from postproc.orientation.candidates.ranking import Ranking
from postproc.orientation.candidates.vertices import TwoAxisTable, closed_form, rotation
from postproc.orientation.passes import parallel_map
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.parallel_map import CHUNK, PassFault, each_pass
from postproc.orientation.passes.passes import Pass, PassContext, work_of
from postproc.orientation.passes.poses import held_poses
from postproc.orientation.passes.reasons import Touching
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.plans import plans_of, table_of
from postproc.orientation.plans.shortest_sequence import groupwise, seconds
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.kit import SAMPLES, machine
from tests.postproc.orientation.part_choice import part
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

HEAD = ["UNITS/MM", "CUTTER/10,5", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,15000", "MULTAX"]


def strips(links: Sequence[float], length: float = 60.0, axis: str = "0,0,1") -> Toolpath:
    """Level strips from the origin at angles (degrees), a rapid to each."""
    lines = list(HEAD)
    for link in links:
        x, y = length * np.cos(link * DEG), length * np.sin(link * DEG)
        lines += ["RAPID", f"GOTO/0,0,5,{axis}", f"GOTO/0,0,0,{axis}", f"GOTO/{x:.6f},{y:.6f},0,{axis}"]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]).encode(), file="strips.apt")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


def work(path: Toolpath, m: Machine, setup: SetupFile | None = None) -> PassContext:
    made, found = work_of(path, m, setup or SetupFile(), Options())
    assert made is not None, found
    return made


def part_pass(name: str, number: int = 2) -> tuple[Machine, Pass]:
    """A curved pass of the test part, where the machine reaches it."""
    m = machine(name)
    setup, _ = load_setup(SAMPLES / ("h4a.setup.toml" if name.startswith("h4a") else "tools.setup.toml"))
    return m, work(toolpaths.read(SAMPLES / "test_part.cls")[0], m, setup).passes[number]


def leaning(rng: np.random.Generator, count: int, most: float = 0.6) -> Floats:
    axes = np.column_stack((rng.uniform(-most, most, (count, 2)), np.ones(count)))
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def chosen(path: Toolpath, m: Machine, workers: int | None = 1) -> OrientationChoice:
    choice, found = orient(path, m, SetupFile(), Options(), workers=workers)
    assert choice is not None, found
    return choice


@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "linuxcnc-xyzac-trt", "fork-head-ab"])
def test_joints_of_a_pass_follow_from_four_poses(name: str) -> None:
    """The affine joints of held axes against the inverse at every row and site."""
    m, one = part_pass(name)
    axes = leaning(np.random.default_rng(1), 5)
    for axis, (q, refused) in zip(axes, held_poses(one, m, axes), strict=True):
        tip = np.concatenate([one.tip, *(s.tip for s in one.stretches)]) + one.shift(axis)
        found_tip, found_axis = one.kin.forward(q)
        assert refused is None or refused.kind == "travel"
        assert np.abs(found_tip - tip).max() < 1e-9 and angle_between(found_axis, axis).max() < 1e-9


@pytest.mark.covering
@pytest.mark.parametrize("name", ["mikron-ucp710", "h4a-c-table"])
@pytest.mark.parametrize("jerk", [True, False])
def test_times_on_shared_knots_are_those_of_plans(name: str, jerk: bool) -> None:
    """Within 1e-3 of plans on knots of their own, whatever the axis."""
    m, one = part_pass(name)
    m = m if jerk else replace(m, limits=replace(m.limits, jerk=np.full(len(m.limits.jerk), np.inf)))
    made = [one for one in turned_all(one, leaning(np.random.default_rng(2), 6, 0.4), m) if not one.refused]
    ranking = Ranking(turned(one, one.axis, m))
    assert len(made) > 3
    for each in made:
        assert ranking.seconds(each) == pytest.approx(each.seconds, rel=1e-3)
    assert np.ptp([each.seconds for each in made]) > 3e-3 * made[0].seconds


def test_vertices_of_any_table() -> None:
    """Every solution uses the same share of each slide's limit, whatever two axes turn the part; at most 16 of them."""
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(40):
        first, second = leaning(rng, 2, 2.0)
        table = TwoAxisTable(first, second, np.linalg.qr(rng.normal(size=(3, 3)))[0], bool(rng.integers(2)))
        limit, f = rng.uniform(1.0, 3.0, 3), leaning(rng, 1, 3.0)[0]
        angles = closed_form(table, f, limit)
        found += len(angles)
        assert len(angles) <= 16
        for t1, t2 in angles[:, ::-1] if table.swapped else angles:
            used = np.abs(table.rates @ rotation(second, -t2) @ rotation(first, -t1) @ f) / limit
            np.testing.assert_allclose(used, used[0], rtol=1e-7)
    assert found > 200


def test_neighbours_of_an_axis() -> None:
    centre = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(angle_between(around(centre, centre, 0.1), centre),
                               np.full(8, 0.1), atol=1e-12)
    start = np.array([np.sin(0.5), 0.0, np.cos(0.5)])
    adjacent = around(start, centre, 0.1)
    np.testing.assert_allclose(angle_between(adjacent, centre), [0.4, 0.6, 0.5, 0.5], atol=1e-12)
    np.testing.assert_allclose(angle_between(adjacent, start), 0.1, rtol=2e-2)


def test_groups_are_moved_together() -> None:
    """One pass over the groups, each to its best against the others as they are."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        states = [rng.uniform(0, 1, 3) for _ in range(6)]
        links = [rng.uniform(0, 1, (a, b)) for a, b in itertools.pairwise([1, *[3] * 6, 1])]
        groups = [([0, 2, 4], [[k] * 3 for k in range(3)]), ([1, 3, 5], [[k] * 3 for k in range(3)])]
        picked = groupwise([0] * 6, groups, states, links)
        first = min(([a, 0] * 3 for a in range(3)), key=lambda p: seconds(p, states, links))
        best = min(([first[0], b] * 3 for b in range(3)), key=lambda p: seconds(p, states, links))
        assert picked == best


def test_the_choice_does_not_depend_on_the_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forked workers hand back what one process finds, to the last digit."""
    monkeypatch.setattr(parallel_map, "CHUNK", 2)
    monkeypatch.setattr(parallel_map, "_FEWEST", 2)
    path, m = strips([0.0, 20.0, 40.0]), machine("mikron-ucp710")
    alone, shared = chosen(path, m, 1), chosen(path, m, 2)
    for name in ("keep", "per-pass", "whole-part", "auto"):
        assert alone.plans[name].seconds == shared.plans[name].seconds
        for a, b in zip(alone.plans[name].picked, shared.plans[name].picked, strict=True):
            assert a.axis.tolist() == b.axis.tolist() and b.one in shared.work.passes[b.one.number:b.one.number + 1]
    assert [len(one.rejected) for one in alone.tried] == [len(one.rejected) for one in shared.tried]


@pytest.mark.parametrize("workers", [1, 2])
def test_faults_name_the_line_of_their_pass(workers: int) -> None:
    made = work(strips([0.0] * 5 * CHUNK), machine("mikron-ucp710"))
    noted: list[tuple[str, int, int]] = []

    def failing(number: int, before: int | None) -> int:
        assert before == (None if number % CHUNK == 0 else number - 1)
        if number == 4 * CHUNK + 3:
            raise ArithmeticError("no")
        return number

    with pytest.raises(PassFault, match="no") as fault:
        each_pass(failing, made, AllowedAxes(1.0), "trying", lambda *args: noted.append(args), workers)
    assert fault.value.line == made.passes[4 * CHUNK + 3].line
    assert noted[-1][0] == "trying" and noted[-1][2] == 5 * CHUNK and 3 * CHUNK <= noted[-1][1] < 5 * CHUNK


def test_the_pass_before_lends_its_axis() -> None:
    """Fewer plans, and no slower."""
    m = machine("mikron-ucp710")
    passes = work(toolpaths.read(SAMPLES / "test_part.cls")[0], m).passes
    for one, other in itertools.pairwise(passes[:3]):
        before = tried(one, m, AllowedAxes(60.0 * DEG))
        alone, lent = tried(other, m, AllowedAxes(60.0 * DEG)), tried(other, m,
                                                                      AllowedAxes(60.0 * DEG), before)
        assert lent.best.seconds < alone.best.seconds * 1.002
        assert lent.swift.seconds + lent.swift.rapids < (alone.swift.seconds + alone.swift.rapids) * 1.002


def test_rapids_count_in_whole_plans() -> None:
    """The fastest axis minds the rapids of its pass, the best only its cuts."""
    choice = part()
    found, plans = choice.tried, choice.plans
    assert plans["auto"].seconds == min(plan.seconds for plan in plans.values())
    assert plans["whole-part"].seconds <= plans["keep"].seconds
    assert all(one.swift.seconds + one.swift.rapids <= (one.best.seconds + one.best.rapids) * 1.001 for one in found)
    assert any(one.swift.rapids < 0.999 * one.best.rapids for one in found)


@pytest.mark.covering
@pytest.mark.parametrize(("name", "walls"), [("mikron-ucp710", True), ("mikron-ucp710", False), ("trunnion-bc", True),
                                             ("head-table", False), ("mill-4axis", True), ("nutating-head", True),
                                             ("uranesx", False)])
def test_auto_is_the_least_of_all_on_every_machine(name: str, walls: bool) -> None:
    """A fan of strips or one of walls in turn, timed in full."""
    m = machine(name)
    setup, _ = load_setup(SAMPLES / ("delta.setup.toml" if name == "uranesx" else "tools.setup.toml"))
    assert setup is not None
    path = strips([0.0, 90.0, 0.0], 100.0) if walls else strips([0.0, 35.0])
    choice, found = orient(path, m, setup, Options(), workers=1)
    assert choice is not None, found
    least = min(plan.seconds for plan in choice.plans.values())
    assert np.isfinite(least) and choice.plans["auto"].seconds == least
    assert choice.plans["whole-part"].seconds <= choice.plans["keep"].seconds
    for plan in choice.plans.values():
        assert plan.seconds == pytest.approx(plan.cuts.sum() + plan.rapids.sum() + plan.links.sum(), rel=1e-12)


def test_axes_that_the_machine_does_not_have_are_refused() -> None:
    """A machine of four axes cannot lean in x: within 60 degrees it leans in y instead, within 10 there is
    nothing, which is said once for all passes, with their lines."""
    path = strips([90.0] * 3, axis="0.6,0,0.8")
    choice, found = orient(path, machine("mill-4axis"), SetupFile(), Options())
    assert choice is not None and all(abs(made.axis[0]) < 1e-12 for made in choice.plans["auto"].picked)
    assert choice.plans["keep"].seconds == np.inf and np.isfinite(choice.plans["auto"].seconds)
    choice, found = orient(path, machine("mill-4axis"), SetupFile(), Options(max_tilt=10.0))
    errors = [d for d in found if d.code == "orient.reach"]
    assert choice is None and len(errors) == 1 and errors[0].count == 3 and len(errors[0].lines) == 3
    assert "out of reach" in errors[0].message and "pass 0 and 2 more" in errors[0].message


def test_an_axis_outside_travel_is_replaced_with_a_warning() -> None:
    """A ends at 20 degrees: passes that lean by 30 get another axis, `keep` is reported as impossible."""
    m = machine("mikron-ucp710")
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    lower[m.axis_names.index("A")], upper[m.axis_names.index("A")] = -20.0 * DEG, 20.0 * DEG
    m = replace(m, limits=replace(m.limits, lower=lower, upper=upper))
    choice, found = orient(strips([0.0, 20.0], axis="0,-0.5,0.8660254037844386"), m, SetupFile(), Options())
    assert choice is not None, found
    assert [d.code for d in found if d.code.startswith("orient")] == ["orient.own_reach"]
    assert choice.plans["keep"].seconds == np.inf and np.isfinite(choice.plans["auto"].seconds)
    assert all(made.rotary()["A"] < 20.0 + 1e-6 for made in choice.plans["auto"].picked)


def test_states_that_touch_are_in_no_plan_but_keep() -> None:
    """Bodies that the upright tool touches: every other plan leans."""
    class Ceiling:
        def touching(self, one: Pass, axis: Floats) -> Touching | None:
            return Touching(1, 2, "ceiling", -1.0, 0.0, 0) if axis[2] > 0.97 else None

    made, allowed = work(strips([0.0, 30.0, 60.0]), machine("mikron-ucp710")), AllowedAxes(60.0 * DEG, Ceiling())
    results = [tried(one, made.machine, allowed) for one in made.passes]
    plans = plans_of(table_of(made, results, allowed, workers=1)).named
    assert plans["keep"].touches and not any(plans[name].touches for name in ("per-pass", "whole-part", "auto"))
    assert all(one.gains[0] == np.inf for one in results)


def test_axes_are_looked_for_with_the_spin_that_the_setup_allows() -> None:
    """A leg too short for no spin: none is found at 0 and none at -40 degrees, with the spin planned or at 40 degrees there is."""
    text = ("TOOL PATH/LINES,TOOL,BALL8\nTLDATA/MILL,8.0,4.0,75.0,0.0,0.0\nLOAD/TOOL,1\nRAPID\n"
            "GOTO/-20,0,30,0,0,1\nFEDRAT/MMPM,900\nGOTO/-20,0,0\nGOTO/20,0,0\nRAPID\nGOTO/20,0,30\nEND-OF-PATH\n")
    toolpath, whole = toolpaths.read_bytes(text)[0], machine("hexapod")
    narrow = replace(whole, limits=replace(whole.limits, upper=np.append(170.0, whole.limits.upper[1:])))

    def found(spin: str | float) -> bool:
        setup = SetupFile.model_validate({"part": {"origin": (0.0, 0.0, -100.0)}, "tools": {"1": {"gauge_length": 100.0}},
                                          "joints": {"spin": spin}})
        return orient(toolpath, narrow, setup, Options(max_tilt=10.0))[0] is not None
    assert [found(spin) for spin in ("zero", -40.0, 40.0, "planned")] == [False, False, True, True]
