"""What decides: travel, holder, indexing time, the rotary axis that the tool leaves free; each with its counterfactual."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import postproc
from machines.machine import Machine, Timing
from postproc.base.options import Options, Orientation
from postproc.orientation.candidates.candidate_times import turned, turned_all
from postproc.orientation.candidates.free_rotary import common_angles, free_value, held_angles
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.pass_bodies import pass_bodies
from postproc.orientation.passes.passes import work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.reoriented import reoriented
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile, load_setup
from tests.benchmarks.bench_orientation_limits import chosen, compared, strips, whole
from tests.postproc.kit import SAMPLES, TOOLS, machine, toolpath
from tests.postproc.orientation.test_orientation_paper import jerk_only
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG


@cache
def setup_of(name: str) -> SetupFile:
    setup, _ = load_setup(SAMPLES / "h4a.setup.toml" if "h4a" in name else TOOLS)
    assert setup is not None
    return setup


def on(name: str, path: Toolpath, m: Machine | None = None, max_tilt: float = 60.0) -> OrientationChoice:
    return chosen(path, m or machine(name), setup_of(name), max_tilt)


def quick(name: str, clamp: float = 0.05) -> Machine:
    """A machine that clamps its rotary axes in no time, so that few passes show what many do."""
    return replace(machine(name), timing=Timing(0.0, clamp, clamp))


def written(name: str, path: Toolpath, controller: str = "linuxcnc",
            plan: Orientation = "auto") -> PostResult:
    """Converted with a plan, and read back."""
    result = postproc.convert(path, quick(name), controller, setup_of(name),
                              Options(orient=plan, max_tilt=40.0))
    assert result.ok and result.comparison is not None, [str(d) for d in result.diagnostics]
    return result


def standing(result: PostResult, letter: str) -> set[float]:
    """Where an axis stands in the cuts, degrees."""
    assert result.path is not None
    rows = np.isfinite(result.path.u)
    return set(np.round(np.degrees(result.path.q[rows, result.machine.axis_names.index(letter)]), 3).tolist())


def near(angle: float, found: set[float]) -> bool:
    """One angle, the one expected within two degrees, in either direction round."""
    return len(found) == 1 and abs(abs(next(iter(found))) - angle) < 2.0


def test_travel_decides() -> None:
    """A level pass wants A = 45; a trunnion that tilts to 30 degrees leaves another axis, slower but better than the own."""
    m = machine("mikron-ucp710")
    upper = np.where([name == "A" for name in m.axis_names], 30.0 * DEG, m.limits.upper)
    free = on("mikron-ucp710", strips([0.0])).tried[0]
    narrow = on("mikron-ucp710", strips([0.0]), replace(m, limits=replace(m.limits, upper=upper))).tried[0]
    assert free.best.rotary()["A"] == pytest.approx(45.0, abs=1.0)
    assert 20.0 < abs(narrow.best.rotary()["A"]) <= 30.0 + 1e-6 and narrow.aimed is None
    assert free.best.seconds < 0.999 * narrow.best.seconds < 0.95 * narrow.own.seconds
    noted = [str(lost.why) for lost in narrow.rejected if lost.kind == "travel"]
    assert any(why.startswith("travel: axis A at 45.000 degrees, allowed -30.000 to 30.000") for why in noted)


def test_indexing_time_decides() -> None:
    """Eight strips gain half a second by turning once: more than nothing, less than clamps of 5 s cost."""
    fast, slow = (on("", strips([0.0] * 8), quick("mikron-ucp710", clamp)) for clamp in (0.0, 5.0))
    assert {made.rotary()["A"] for made in fast.plans["auto"].picked} != {0.0}
    assert fast.plans["auto"].seconds < fast.plans["keep"].seconds - 0.3
    assert {made.rotary()["A"] for made in slow.plans["auto"].picked} == {0.0}
    assert slow.plans["auto"].seconds == slow.plans["keep"].seconds
    assert slow.plans["per-pass"].seconds > slow.plans["keep"].seconds + 3.0
    cuts = [choice.plans["per-pass"].cuts.sum() for choice in (fast, slow)]
    assert cuts[0] == pytest.approx(cuts[1], rel=1e-9)


def walled(*walls: tuple[float, float], holder: float) -> SetupFile:
    """Walls from y to y, 90 mm high, and a holder of that diameter 70 mm above the tip."""
    fixtures = [{"name": f"wall at {low:g}", "box": {"low": (-150.0, low, -20.0), "high": (150.0, high, 90.0)}}
                for low, high in walls]
    tool = {"gauge_length": 140.0, "flute_length": 30.0, "shank": [{"diameter": 14.0, "length": 40.0}],
            "holder": [{"diameter": holder, "length": 70.0}]}
    return SetupFile.model_validate_json(json.dumps({"bodies": {"fixtures": fixtures}, "tools": {"1": tool}}))


def behind(*walls: tuple[float, float], holder: float = 56.0) -> PassSearch:
    """A strip along x between walls."""
    return chosen(strips([0.0]), machine("mikron-ucp710"), walled(*walls, holder=holder)).tried[0]


def test_the_holder_decides() -> None:
    """Two axes are equally fast; a wall where the first leans to leaves the other, were the holder not so thick."""
    right, left = (60.0, 80.0), (-80.0, -60.0)
    first = behind(left).best
    assert first.axis[1] > 0.3 and first.rotary()["A"] == pytest.approx(45.0, abs=1.0)
    other = behind(right)
    assert other.best.axis[1] < -0.3 and other.best.seconds == pytest.approx(first.seconds, rel=1e-3)
    noted = [str(lost.why) for lost in other.rejected if lost.kind == "touches"]
    assert any(why.startswith("holder of T1 touches fixture wall at 60 by ") for why in noted)
    thin = behind(right, holder=14.0)
    assert not any(lost.kind == "touches" for lost in thin.rejected)
    assert thin.best.seconds == pytest.approx(first.seconds, rel=1e-3)


def test_between_two_walls_the_tool_leans_as_far_as_it_can() -> None:
    """Neither vertex is free: the best is on the ridge between vertex and upright, as far out as the holder lets it."""
    walls = ((-80.0, -60.0), (60.0, 80.0))
    found = behind(*walls)
    assert 20.0 < found.best.rotary()["A"] < 40.0 and not found.best.touching
    work, _ = work_of(strips([0.0]), machine("mikron-ucp710"), walled(*walls, holder=56.0), Options())
    assert work is not None
    bodies, _ = pass_bodies(work, "")
    one, allowed = work.passes[0], AllowedAxes(60.0 * DEG, bodies)
    a, c = (g.ravel() * DEG for g in np.meshgrid(np.arange(10.0, 45.0, 3.5), np.arange(30.0, 60.0, 5.0)))
    axes = np.column_stack([np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)])
    grid = turned_all(one, np.vstack([axes, -axes * [1.0, 1.0, -1.0]]), machine("mikron-ucp710"),
                      allowed.touching)
    least = next(each.seconds for each in sorted(grid, key=lambda each: each.seconds) if not each.touching)
    assert found.best.seconds < 1.002 * least


def test_a_table_turned_under_a_standing_tool_gains_what_the_square_gives() -> None:
    """Under equal jerks the level box reaches sqrt 2 farther along its diagonal: times go with the cube root."""
    m = jerk_only(machine("mikron-ucp710"))
    found = on("mikron-ucp710", strips([20.0], "16,1"), m).tried[0]
    angle = (20.0 - found.best.held / DEG) % 90.0
    assert found.own.one.fixed.startswith("the cutter is not a ball") and angle == pytest.approx(45.0, abs=0.3)
    level = turned(found.own.one, found.own.axis, m, held=20.0 * DEG)
    assert found.best.seconds / level.seconds == pytest.approx(2.0 ** (-1.0 / 6.0), rel=1e-3)
    assert found.best.axis.tolist() == found.own.axis.tolist()


def test_angles_worth_holding() -> None:
    """Equal ones the least turned first; none where no joint is free or where it turns nothing."""
    def angles(name: str, lines: list[str] | None = None) -> list[float]:
        path = toolpath(*lines) if lines else strips([30.0], "16,1")
        work, found = work_of(path, machine(name), setup_of(name), Options())
        assert work is not None, found
        one = work.passes[0]
        return np.round(held_angles(one, machine(name), one.axis) / DEG, 1).tolist()

    assert angles("mikron-ucp710") == [-15.0, 75.0, -105.0, 165.0]
    assert angles("h4a-c-table")[:2] == [30.0, -150.0]
    assert angles("mill-4axis") == [] and angles("mill-3axis") == [] and angles("nutating-head") == []
    leaning = ["CUTTER/16,1", "MULTAX", "RAPID", "GOTO/0,0,5,0,0.6,0.8", "GOTO/40,0,0,0,0.6,0.8"]
    assert angles("mikron-ucp710", leaning) == []


def test_a_ball_on_the_h4a_stands_up_and_the_table_turns() -> None:
    """Of all axes within 40 degrees and all angles of the table: upright, strips along y turned along x."""
    found = on("h4a-c-table", strips([90.0]), max_tilt=40.0).tried[0]
    assert found.own.one.fixed == "" and near(90.0, {found.best.rotary()["C"]})
    assert found.best.axis[2] > np.cos(2.0 * DEG) and found.best.seconds < 0.8 * found.own.seconds
    aside = on("h4a-c-table", strips([0.0]), max_tilt=40.0).tried[0]
    assert aside.best.seconds == pytest.approx(aside.own.seconds, rel=0.02)
    assert aside.own.seconds == pytest.approx(found.best.seconds, rel=0.02)


@pytest.mark.slow
def test_the_h4a_turns_its_table_once() -> None:
    """Strips along y are slow on the H4a: turned by 90 degrees they run along x, worth it for twelve, not for two."""
    many, few = (strips([90.0] * count, "16,1") for count in (12, 2))
    choice = on("h4a-c-table", many, quick("h4a-c-table"), 40.0)
    auto = choice.plans["auto"]
    assert near(90.0, {made.held / DEG for made in auto.picked})
    assert all(made.axis.tolist() == [0.0, 0.0, 1.0] for made in auto.picked)
    assert auto.seconds < 0.99 * choice.plans["keep"].seconds and auto.cuts.sum() < 0.8 * choice.plans["keep"].cuts.sum()
    kept = on("h4a-c-table", few, max_tilt=40.0).plans
    assert {free_value(made) for made in kept["auto"].picked} == {0.0} and kept["per-pass"].seconds > kept["keep"].seconds


def test_the_turned_table_is_written_and_proved() -> None:
    """The program of the H4a holds C through all cuts; with the axes of the file it stays at home."""
    path = strips([90.0] * 3, "16,1")
    assert near(90.0, standing(written("h4a-c-table", path, plan="per-pass"), "C"))
    plain = postproc.convert(path, machine("h4a-c-table"), "linuxcnc", setup_of("h4a"))
    assert plain.ok and standing(plain, "C") == {0.0}


def test_an_angle_for_passes_in_many_directions() -> None:
    """Each pass alone would stand elsewhere: common is the angle of the least time of all, planned at every 5 degrees."""
    m, directions = machine("mikron-ucp710"), [0.0, 20.0, 75.0]
    work, _ = work_of(strips(directions, "16,1"), m, setup_of(""), Options())
    assert work is not None
    owns = [turned(one, one.axis, m) for one in work.passes]
    found = common_angles(owns) / DEG
    angles = np.arange(-90.0, 90.0, 5.0)
    planned = [sum(turned(one, one.axis, m, held=angle * DEG).seconds for one in work.passes) for angle in angles]
    assert angles[int(np.argmin(planned))] in np.round(found, 6)
    alone = {round(held_angles(one, m, one.axis)[0] / DEG) for one in work.passes}
    assert len(alone) == 3
    level, _ = work_of(strips(directions, "16,1"), machine("mill-4axis"), setup_of(""), Options())
    assert level is not None
    assert not len(common_angles([turned(one, one.axis, level.machine) for one in level.passes]))


@pytest.mark.parametrize(("controller", "plan", "count"), [
    ("siemens-840d", "per-pass", 2), ("heidenhain-tnc640", "per-pass", 2),
    pytest.param("linuxcnc", "auto", 12, marks=pytest.mark.slow)])
def test_a_flat_cutter_on_a_trunnion(controller: str, plan: Orientation, count: int) -> None:
    """C at 45 degrees, A at 0, in planes or as machine coordinates; tips and axes of the file are as they were."""
    path = strips([0.0] * count, "16,1")
    result = written("mikron-ucp710", path, controller, plan)
    assert near(45.0, standing(result, "C")) and standing(result, "A") == {0.0}
    assert result.toolpath is not None
    assert result.toolpath.tip.tolist() == path.tip.tolist() and result.toolpath.axis.tolist() == path.axis.tolist()


def test_passes_that_keep_their_angle_are_held_where_they_were_counted() -> None:
    """Behind a pass held at an angle a free axis would stay there: it is held where its time was counted."""
    m = machine("mikron-ucp710")
    work, _ = work_of(strips([0.0, 45.0], "16,1"), m, setup_of(""), Options())
    assert work is not None
    first, second = work.passes
    spun, own = turned(first, first.axis, m, held=45.0 * DEG), turned(second, second.axis, m)
    assert np.isnan(own.held) and free_value(own) == 0.0
    path = reoriented(work, (spun, own))
    assert path.spin is not None and np.unique(np.round(path.spin / DEG, 6)).tolist() == [0.0, 45.0]
    result = postproc.convert(path, m, "linuxcnc", setup_of(""))
    assert result.ok and standing(result, "C") == {0.0, 45.0}
    assert reoriented(work, (turned(first, first.axis, m), own)).equals(work.toolpath)


def test_a_turned_part_is_held_as_a_straight_one() -> None:
    """Turned by 20 degrees on the table, a pass gains as one that runs 20 degrees aside."""
    setup = setup_of("").model_copy(update={"part": setup_of("").part.model_copy(update={
        "x_axis": (np.cos(20.0 * DEG), np.sin(20.0 * DEG), 0.0), "y_axis": (-np.sin(20.0 * DEG), np.cos(20.0 * DEG), 0.0)})})
    m = machine("mikron-ucp710")
    placed, found = orient(strips([10.0], "16,1"), m, setup)
    straight = on("mikron-ucp710", strips([30.0], "16,1"))
    assert placed is not None, found
    assert placed.tried[0].best.seconds == pytest.approx(straight.tried[0].best.seconds, rel=1e-6)
    result = postproc.convert(placed.toolpath("per-pass"), m, "linuxcnc", setup)
    assert result.ok and standing(result, "C") == {round(placed.tried[0].best.held / DEG, 3)}


@pytest.mark.parametrize(("direction", "cap"), [(25.0, 4.0), pytest.param(0.0, 2.5, marks=pytest.mark.slow)])
def test_search_next_to_a_full_grid(direction: float, cap: float) -> None:
    """Every axis of a coarse grid within the cap planned in full: none is better by more than half a percent."""
    m = machine("mikron-ucp710")
    work, _ = work_of(strips([direction]), m, setup_of(""), Options())
    assert work is not None
    one = work.passes[0]
    assert -0.02 < compared("strip", one, m, AllowedAxes(cap * DEG), one.axis, cap * DEG, cap / 5.0 * DEG) < 0.005


def test_auto_next_to_all_sequences() -> None:
    """Strips in two directions, every sequence of axes of a grid: `auto` is within half a percent of the best."""
    free = replace(machine("mikron-ucp710"), timing=Timing(0.0, 0.0, 0.0))
    keep, auto, least = whole(free, strips([0.0, 0.0, 70.0, 70.0], length=160.0), 4.0 * DEG, 1.3 * DEG)
    assert auto <= keep and -0.03 < auto / least - 1.0 < 0.005
