"""The spin of six-axis machines planned: the search against every way, paths that convert only so, tools that are held."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import machines
import postproc
from machines.machine import Machine
from machines.reach import reach
from postproc.joints.run_roads import ParameterCurve, RunRoad
from postproc.joints.spin_loop import cheapest_spins
from postproc.joints.spin_plan import planned_spins
from postproc.pipeline.result import PostResult
from postproc.verification.second_witness import second_witness
from postproc.witness.machine import rods
from tests.machines.random_slides import poses_over_workspace
from tests.postproc.kit import codes, convert, good, setup_of, toolpath
from toolpaths.arrays import Floats
from toolpaths.compiled import compiled
from toolpaths.shape import Curves
from toolpaths.toolpath import Toolpath

LEANING = ["MULTAX/ON", "RAPID", "GOTO/-139,-24,-80,0.20167,-0.45442,0.86766", "GOTO/-139.88,-23.71,-94.74",
           "GOTO/-130,-23.71,-94.74", "GOTO/-130,-15,-94.74,0.18,-0.44,0.8797", "GOTO/-139.88,-15,-94.74",
           "GOTO/-139.88,-23.71,-94.74,0.20167,-0.45442,0.86766", "RAPID", "GOTO/-139,-24,-80"]
"""where legs with less travel than the catalogue's reach only with the tool turned about itself"""
LEVEL = ["GOTO/0,0,-170", "FEDRAT/MMPM,900", "GOTO/10,0,-180", "GOTO/30,20,-180"]
LENGTH = "[tools.1]\ngauge_length = 60\n"


@cache
def level(text: str) -> PostResult:
    """A level path on the hexapod with a set-up."""
    return good(convert(toolpath("RAPID", *LEVEL), "hexapod", setup=setup_of(text)))


@pytest.fixture(scope="module")
def short_legs(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """The hexapod with legs of 150 to 400 mm."""
    file = tmp_path_factory.mktemp("short") / "short.toml"
    file.write_text('base = "hexapod"\n' + "".join(f"[axes.{a}]\ntravel = [150, 400]\n" for a in "XYZUVW"))
    return machines.load(file)


def leaning() -> Toolpath:
    lines = LEANING.copy()
    lines.insert(3, "FEDRAT/MMPM,1000")
    return toolpath(*lines)


def with_spin(machine: Machine, text: str) -> PostResult:
    return postproc.convert(leaning(), machine, setup=setup_of(f"[joints]\nspin = {text}\n{LENGTH}"))


@pytest.mark.parametrize("by", [lambda plain: plain, compiled], ids=["plain", "compiled"])
def test_the_search_is_as_cheap_as_the_best_of_all_ways(by: Callable[..., Any]) -> None:
    rng = np.random.default_rng(1)
    cost, edges, last = rng.uniform(size=(4, 3)), rng.uniform(size=(4, 3, 3)), rng.uniform(size=3)
    value, choice = last.copy(), np.zeros((4, 3), dtype=np.int64)
    by(cheapest_spins)(cost, edges, value, choice)
    ways = {way: sum(cost[k, way[k]] + edges[k, way[k], way[k + 1]] for k in range(4)) + last[way[4]]
            for way in itertools.product(range(3), repeat=5)}
    for first in range(3):
        best = min((w for w in ways if w[0] == first), key=lambda w: ways[w])
        taken = [first]
        for k in range(4):
            taken.append(int(choice[k, taken[-1]]))
        assert tuple(taken) == best and value[first] == pytest.approx(ways[best], rel=1e-12)


def test_the_curve_runs_through_its_ends_without_corners_and_without_overshoot() -> None:
    nodes, values = np.linspace(0.0, 5.0, 6), np.array([0.1, 0.1, 0.6, 0.6, -0.2, 0.3])[:, None]
    curve = ParameterCurve(np.array([0.0, 0.5, 5.0]), nodes, values, (0,), 0.5, 0.01, True)
    at = np.linspace(0.0, 5.0, 5001)
    found = curve.at(at)[:, 0]
    assert found[0] == pytest.approx(0.1) and found[-1] == pytest.approx(0.3)
    assert found.min() >= -0.2 and found.max() <= 0.6
    assert np.abs(np.diff(found, 2)).max() < 3e-6 and np.abs(np.diff(found, 3)).max() < 3e-8
    parts = curve.parts()
    assert parts[0] == 1 and 4 <= parts[1] <= 9
    cut = np.concatenate([[0.0], np.linspace(0.5, 5.0, parts[1] + 1)])
    assert np.abs(np.interp(at, cut, curve.at(cut)[:, 0]) - found).max() < 0.08


def test_a_path_that_only_a_turned_platform_reaches_is_converted_and_proved(short_legs: Machine) -> None:
    """Without a word in the set-up; at spin 0 it is refused for the travel of a leg, in the cut and on the way to it."""
    refused = with_spin(short_legs, '"zero"')
    assert not refused.ok and "travel.exceeded" in codes(refused.diagnostics)
    result = good(with_spin(short_legs, '"needed"'))
    assert result.path is not None and result.comparison is not None and result.witness is not None
    (name, low, high), = result.path.opened
    assert name == "spin" and 0.2 < low <= high < 1.3
    assert {"joints.spin_needed", "joints.opened"} <= codes(result.diagnostics)
    assert "turned about its own axis by" in result.text
    assert result.comparison.tip_bound < 0.01 and result.comparison.bounded_cuts == result.comparison.cuts
    assert not result.witness.findings and not result.witness.not_compared
    limits, q = short_legs.limits, result.path.q
    assert (q >= limits.lower).all() and (q <= limits.upper).all()


def test_a_path_that_needs_another_spin_at_its_end_than_at_its_beginning(short_legs: Machine) -> None:
    """From 12 to 35 degrees here, from -12 to -35 there, in one run: it turns under way, with planned feeds."""
    first, last = "0.20167,-0.45442,0.86766", "0.20167,0.45442,0.86766"
    path = toolpath("MULTAX/ON", "RAPID", f"GOTO/-139,-24,-80,{first}", "FEDRAT/MMPM,1000",
                    f"GOTO/-139.88,-23.71,-94.74,{first}", "GOTO/-130,-12,-94.74,0.18,-0.24,0.954",
                    "GOTO/-130,0,-94.74,0.17,0,0.98544",
                    "GOTO/-130,12,-94.74,0.18,0.24,0.954", f"GOTO/-139.88,23.71,-94.74,{last}", "RAPID", "GOTO/-139,24,-80")
    setup = setup_of(f"[joints]\nspin = \"planned\"\n[clearance]\nmargin = 5\n{LENGTH}")
    result = good(postproc.convert(path, short_legs, setup=setup, options=postproc.Options(feed="planned")))
    assert result.path is not None and result.comparison is not None and result.witness is not None
    low, high = np.degrees(result.path.opened[0][1:])
    assert low < -10.0 and high > 12.0
    assert result.comparison.tip_bound < 0.01 and result.comparison.bounded_cuts == result.comparison.cuts
    assert not result.witness.findings


def test_what_converts_without_is_left_byte_for_byte() -> None:
    one, other = (level(text + LENGTH) for text in ("", '[joints]\nspin = "zero"\n'))
    assert one.text.split("G54\n")[1] == other.text.split("G54\n")[1] and one.path is not None and one.path.opened == ()


@pytest.mark.parametrize("spin", ["25", '"planned"'])
def test_the_spin_that_is_asked_for(spin: str) -> None:
    result = level(f"[joints]\nspin = {spin}\n{LENGTH}")
    assert result.path is not None and result.job is not None
    cuts = np.isfinite(result.path.u)
    found = np.degrees(result.job.kinematics(0).parameters_at(result.path.q[cuts]))
    assert np.abs(found).max() < 75.0 and (spin != "25" or np.abs(found - 25.0).max() < 0.5)


def test_a_tool_that_keeps_its_spin_is_not_turned() -> None:
    free = level(f"[joints]\nspin = 25\n{LENGTH}keeps_spin = true\n")
    assert free.path is not None and free.path.opened[0][1:] == (0.0, 0.0)


def test_the_second_witness_holds_the_spin_of_a_tool_that_keeps_it() -> None:
    """A program made for a round tool turned by 25 degrees, held against the set-up of one that is not round."""
    path, kept = toolpath("RAPID", *LEVEL), setup_of(f"{LENGTH}keeps_spin = true\n")
    turned = level(f"[joints]\nspin = 25\n{LENGTH}")
    assert turned.job is not None and turned.comparison is not None
    found = second_witness(path.source, kept, turned.options, turned.job, turned.comparison)[1]
    assert any(d.code == "witness.spin" and "25.0" in d.message for d in found), [str(d) for d in found]
    held = level(f"{LENGTH}keeps_spin = true\n")
    assert held.witness is not None and "turns of tools about themselves" in [one.what for one in held.witness.compared]


def test_the_second_witness_finds_the_spin_by_the_rods_alone() -> None:
    """Up to 70 degrees off what it starts from, and what is put in where the tool is not there."""
    kin = machines.load("hexapod").kinematics.with_tool(60.0)
    tip, axis = poses_over_workspace(kin, np.random.default_rng(5), 40)
    q = kin.inverse(tip, axis, np.linspace(-1.2, 1.2, 40))[0]
    witness = rods(tomllib.loads(Path("machines/data/hexapod.toml").read_text()))
    length = np.full(40, 60.0)
    assert witness.misfit(q, kin.axis_names, tip, axis, length).max() < 1e-6
    for way in 0.005 * np.eye(3):
        assert witness.misfit(q, kin.axis_names, tip + way, axis, length).min() > 1e-4


@pytest.mark.parametrize(("tip", "axis"), [([70.35, 63.34, -94.95], [0.278274, 0.245122, 0.928697]),
                                           ([34.31, -141.49, -141.77], [0.379676, 0.038278, 0.924327])])
def test_the_spin_lets_the_tool_be_drawn_back_too(tip: list[float], axis: list[float]) -> None:
    """The spin that is best at the part does not reach 60 mm above it; the planned one does."""
    whole = machines.load("hexapod")
    machine = replace(whole, limits=replace(whole.limits, lower=np.full(6, 150.0), upper=np.full(6, 420.0)))
    kin, at, up = machine.kinematics.with_tool(60.0).with_free_spin(), np.array(tip), np.array(axis)
    none = np.zeros((1, 3))
    curves = Curves(at[None], at[None] + [[4.0, 0.0, 0.0]], up[None], up[None], np.zeros(1, dtype=bool), none, none,
                    np.zeros(1))
    road = RunRoad(kin, np.concatenate([at, up]), curves, np.array([0.4]), np.nan)

    def drawn(tips: Floats, axes: Floats) -> Floats:
        return tips + 60.0 * axes

    reached = []
    for back in (None, drawn):
        spin = planned_spins([road], [()], machine, 0.05, None, back)[0].values[:1]
        q = kin.inverse_with((at + 60.0 * up)[None], up[None], spin)[0]
        reached.append(bool(((q >= 150.0) & (q <= 420.0)).all()) and bool((reach(kin, q).values >= 0.0).all()))
    assert reached == [False, True]
