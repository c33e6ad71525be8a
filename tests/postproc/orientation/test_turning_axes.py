"""Axes that turn along cuts: slopes by differences, what is kept, what is limited, programs proved, never slower."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from postproc.base.program_time import ProgramTime
from postproc.controllers.model import ControllerFile, load_controller
from postproc.cycle_time.conversion import program_clock
from postproc.feedrate.limits import JointLimits
from postproc.orientation.figures.turned_axes import panels_of, turned_panels
from postproc.orientation.passes.passes import work_of
from postproc.orientation.turning.block_time import block_time
from postproc.orientation.turning.cutting_runs import CuttingRun, runs_of
from postproc.orientation.turning.planned_time import PlannedTime
from postproc.orientation.turning.reach_along import reach_along
from postproc.orientation.turning.tilt_limits import SHARE
from postproc.orientation.turning.tilt_search import TiltField, TiltSearch
from postproc.orientation.turning.tilted_axes import TiltBasis, turned_axes
from postproc.orientation.turning.turned_toolpath import turned_toolpath
from postproc.orientation.turning.turning_choice import TurningChoice, turning_choice
from postproc.orientation.turning.turning_report import as_text, noted
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.pipeline.stages import staged
from postproc.pipeline.turned_axes import turned_by_clock
from postproc.setup.model import SetupFile, load_setup
from postproc.setup.orientation import AxisLimits, OrientationLimits
from tests.postproc.kit import machine, toolpath
from tests.postproc.orientation.turning_cases import BALL, CONE, OPTIONS, context, only_run, searched, swing, with_cone
from toolpaths.arrays import Floats
from toolpaths.diagnostics import error, read_value
from toolpaths.rotations import angle_between
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

RADIUS = 3.0


@pytest.fixture(scope="module")
def search() -> TiltSearch:
    return searched(swing(), with_cone())


@pytest.fixture(scope="module")
def best(search: TiltSearch) -> TiltField:
    return search.found("planned", 15)


@pytest.fixture(scope="module")
def choice() -> TurningChoice:
    return turning_choice(context(swing(), with_cone()), OPTIONS)


def slope_by_differences(value: Callable[[Floats], float], at: Floats, way: Floats, step: float) -> float:
    return (value(at + step * way) - value(at - step * way)) / (2.0 * step)


def leaned(run: CuttingRun) -> TiltField:
    """A run whose axes all lean over by some degrees."""
    basis = TiltBasis.over(run.length, 8.0)
    return TiltField(run, basis, np.tile([0.05, 0.03, 0.0], (basis.count, 1)))


def smooth_way(shape: tuple[int, int]) -> Floats:
    turn = np.linspace(0.0, 9.0, shape[0])[:, None]
    return np.sin(turn + np.arange(shape[1])) * (1.0 + 0.3 * np.arange(shape[1]))


def test_the_slope_of_the_planned_time_is_that_of_differences(search: TiltSearch, best: TiltField) -> None:
    stretch = search.run.stretches[0]
    timed = PlannedTime(stretch, search.most)
    way = search.joints(best) - stretch.q
    seconds, slope = timed.seconds(stretch.q)
    assert seconds == pytest.approx(search.seconds("planned", search.kept()), rel=1e-4)
    found = slope_by_differences(lambda q: timed.seconds(q)[0], stretch.q, way, 0.05)
    assert abs(found) > 0.1 * seconds
    assert float((slope * way).sum()) == pytest.approx(found, rel=0.02)


def test_the_slope_of_the_time_by_blocks_is_that_of_differences() -> None:
    q = np.cumsum(smooth_way((12, 3)), axis=0)
    limits = JointLimits(np.array([2.0, 0.5, 9.0]), np.array([3.0, 1.0, 2.0]), np.full(3, np.inf))
    fed, way = np.full(11, 0.4), smooth_way((12, 3))
    found = slope_by_differences(lambda at: block_time(at, limits, fed)[0], q, way, 1e-6)
    assert float((block_time(q, limits, fed)[1] * way).sum()) == pytest.approx(found, rel=1e-6)
    one = JointLimits(np.array([4.0]), np.array([8.0]), np.array([np.inf]))
    alone = block_time(np.array([[0.0], [8.0]]), one, np.zeros(1))
    assert alone[0] == pytest.approx(8.0 / 4.0 + 4.0 / 8.0)


def test_slopes_of_penalties_are_those_of_differences() -> None:
    found = searched(swing(normals=True), with_cone(lead=[-26.0, 24.0], tilt=[-20.0, 20.0], off_centre=24.0))
    limits = replace(found.limits, slack=1e-4)
    axis = turned_axes(found.run.axis, 0.1 * smooth_way(found.run.axis.shape))
    way = smooth_way(axis.shape)
    over = limits.penalty_of_axes(axis)
    assert over[0] > 0.1
    assert float((over[1] * way).sum()) == pytest.approx(
        slope_by_differences(lambda at: limits.penalty_of_axes(at)[0], axis, way, 1e-7), rel=1e-4)
    q = np.concatenate([one.q for one in found.run.stretches]) + 3.0
    tight = replace(limits, lower=q.min(axis=0) - 1.0, upper=q.min(axis=0) + 0.1)
    way = smooth_way(q.shape)
    beyond = tight.penalty_of_joints(q)
    assert beyond[0] > 0.1
    assert float((beyond[1] * way).sum()) == pytest.approx(
        slope_by_differences(lambda at: tight.penalty_of_joints(at)[0], q, way, 1e-6), rel=1e-4)


def test_the_basis_sums_to_one_and_the_field_is_inside_the_longest_coefficient() -> None:
    basis = TiltBasis.over(50.0, 8.0)
    values = basis.at(np.linspace(0.0, 50.0, 301)).toarray()
    assert values.min() >= 0.0
    assert np.allclose(values.sum(axis=1), 1.0, atol=1e-12)
    assert basis.count == 7 + 3


def test_the_angle_is_what_the_field_says_across_the_axis() -> None:
    axis = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    field = np.array([[0.1, 0.0, 5.0], [0.0, -0.2, 0.0]])
    assert angle_between(turned_axes(axis, field), axis) == pytest.approx([0.1, 0.2])
    assert turned_axes(axis, 3.0 * axis).tolist() == axis.tolist()


def test_the_search_gains_and_keeps_the_cone_and_the_ball(search: TiltSearch, best: TiltField) -> None:
    before, now = (search.seconds("planned", one) for one in (search.kept(), best))
    assert now < 0.9 * before
    turned = angle_between(best.axes, search.run.axis) / DEG
    assert 1.0 < turned.max() <= CONE
    assert 0.0 < search.limits.off_path(best.axes) <= SHARE * OPTIONS.tolerance


def test_a_field_is_smooth_along_the_cut(best: TiltField) -> None:
    """Its second derivative is bounded by its coefficients and the distance of its knots (de Boor)."""
    step = float(np.diff(best.basis.knots).max())
    s = np.linspace(0.0, best.run.length, 2001)
    bend = np.diff(best.at(s), n=2, axis=0) / (s[1] - s[0]) ** 2
    assert np.linalg.norm(bend, axis=1).max() < 12.0 * np.radians(CONE) / step**2


def test_what_is_outside_a_limit_is_broken_and_the_own_axes_are_not() -> None:
    """Each limit by itself: travel of the joints, an angle from the normal, the ball's path between two poses."""
    search = searched(swing(normals=True), with_cone(lead=(-5.0, 40.0)))
    limits, axes, q = search.limits, search.run.axis, search.joints(search.kept())
    assert not limits.broken(axes, q)
    over = q.copy()
    over[len(q) // 2, 0] = limits.upper[0] + 1e-3
    assert limits.broken(axes, over) and limits.broken(axes, np.full_like(q, np.nan))
    for lean, only in ((-0.6, replace(limits, slack=1e9)), (0.1, limits)):
        field = np.zeros_like(axes)
        field[len(axes) // 2, 0] = lean
        assert only.broken(turned_axes(axes, field), q), "one pose is turned, its neighbours are not"
    free = replace(limits, row=limits.row[:0], side=limits.side[:0], most=limits.most[:0])
    assert not replace(free, slack=1e9).broken(turned_axes(axes, np.full_like(axes, 0.3)), q)


def test_lead_tilt_and_dead_centre_hold_at_every_pose() -> None:
    """Own axes: 25 degrees off the normal. Inside 24 to 27 with a lead and a tilt that they nearly fill, less is gained."""
    keys = {"off_centre": 24.0, "lead": [-5.0, 25.0], "tilt": [-25.0, 25.0]}
    found = searched(swing(normals=True), with_cone(**keys))
    made = found.found("planned", 15)
    assert made.field.any()
    assert found.seconds("planned", made) < found.seconds("planned", found.kept())
    at = found.run.contact
    axes, own = made.axes[at.line], found.run.axis[at.line]
    lead, tilt = (np.arctan2(np.einsum("ki,ki->k", axes, side), np.einsum("ki,ki->k", axes, at.normal)) / DEG
                  for side in (at.travel, at.right))
    was = [np.arctan2(np.einsum("ki,ki->k", own, side), np.einsum("ki,ki->k", own, at.normal)) / DEG
           for side in (at.travel, at.right)]
    for now, before, (low, high) in ((lead, was[0], (-5.0, 25.0)), (tilt, was[1], (-25.0, 25.0))):
        assert (now >= np.minimum(low, before) - 1e-6).all()
        assert (now <= np.maximum(high, before) + 1e-6).all()
    assert angle_between(axes, at.normal).min() / DEG > 24.0 - 1e-6


def test_the_toolpath_keeps_the_ball_the_time_of_cuts_and_what_is_no_cut(choice: TurningChoice) -> None:
    path, made = choice.work.toolpath, choice.toolpath
    assert choice.runs[0].turned
    assert np.abs((path.tip + RADIUS * path.axis) - (made.tip + RADIUS * made.axis)).max() < 1e-9
    assert angle_between(path.axis, made.axis).max() / DEG <= CONE + 1e-9
    cuts = np.flatnonzero(path.kind == Kind.FEED)
    seconds = [np.linalg.norm(one.tip[cuts] - one.tip[cuts - 1], axis=1) / one.feed[cuts] for one in (path, made)]
    assert seconds[1] == pytest.approx(seconds[0], rel=1e-9)
    assert np.linalg.norm(made.tip[cuts] - made.tip[cuts - 1], axis=1) != pytest.approx(seconds[0] * 50.0, rel=1e-3)
    assert angle_between(made.axis[0], made.axis[1]) < 1e-9, "the rapids that lead to the cut stand as it begins"


def test_two_cuts_next_to_each_other_turn_each_by_its_own_field() -> None:
    work, _ = only_run(swing(cuts=2), with_cone())
    first, second = runs_of(work, Tolerance(OPTIONS.tolerance, OPTIONS.axis_tolerance * DEG), 1.0)
    path, made = work.toolpath, turned_toolpath(work, [leaned(second)])
    before = slice(0, int(work.moves.row[first.rows[1]]) + 1)
    assert np.array_equal(made.axis[before], path.axis[before]), "nothing of the first cut, nor the rapid that draws back"
    assert np.array_equal(made.feed[before], path.feed[before], equal_nan=True)
    both = turned_toolpath(work, [leaned(first), leaned(second)])
    assert (angle_between(both.axis, path.axis) > 1e-3).all(), "every rapid leads to a cut or draws back from it"


@pytest.mark.parametrize("between", [["$$ ->FEATNO/FINISH"], ["CUTTER/10,5", "LOADTL/2"]])
def test_rapids_of_another_operation_or_tool_keep_their_axes(between: list[str]) -> None:
    """Two rapids behind the first cut and two before the second, all along the axis that the second begins with."""
    x = np.linspace(-20.0, 20.0, 9)
    rows = [f"{np.sin(0.01 * at):.9f},0,{np.cos(0.01 * at):.9f}" for at in x]
    cut = ["RAPID", f"GOTO/{x[0]},0,0,{rows[0]}", *(f"GOTO/{at},0,0,{row}" for at, row in zip(x[1:], rows[1:], strict=True))]
    cut.insert(2, "FEDRAT/MMPM,3000")
    above = ["RAPID", f"GOTO/{x[0]},0,30,{rows[0]}"]
    records = [*cut, "RAPID", f"GOTO/{x[-1]},0,20,{rows[-1]}", *above, *between, *above, *cut, "RAPID",
               f"GOTO/{x[-1]},0,20,{rows[-1]}"]
    first = len(x) + 2  # positions of the first
    path = toolpath("$$ ->FEATNO/ROUGH", *records, head=BALL)
    work = context(path, with_cone())
    last = runs_of(work, Tolerance(OPTIONS.tolerance, OPTIONS.axis_tolerance * DEG), 1.0)[-1]
    made = turned_toolpath(work, [leaned(last)])
    assert np.array_equal(made.axis[:first], path.axis[:first]) and np.array_equal(made.tip[:first], path.tip[:first])
    assert (angle_between(made.axis[first:], path.axis[first:]) > 1e-3).all()


FLAT = ["UNITS/MM", "CUTTER/6,1", *BALL[2:]]


@pytest.mark.parametrize(("path", "keys", "why"), [
    ({"head": FLAT}, {}, "not a ball"), ({}, {"cone": None}, "states no cone"),
    ({"middle": "COOLNT/OFF"}, {}, ""),
    ({}, {"lead": [0.0, 30.0]}, "none is known"), ({"middle": "CUTCOM/LEFT,3"}, {}, "compensates the radius")],
    ids=["flat", "no cone", "stop", "normals", "cutcom"])
def test_what_keeps_its_axes_says_why(path: dict[str, Any], keys: dict[str, object], why: str) -> None:
    _, run = only_run(swing(**path), with_cone(**keys))
    assert bool(run.fixed) == bool(why)
    assert any(part in run.fixed for part in why.split("|"))


def test_an_arc_keeps_its_axes() -> None:
    path = toolpath("RAPID", "GOTO/-10,0,20,0,0,1", "RAPID", "GOTO/-10,0,0,0,0,1", "FEDRAT/MMPM,1000",
                    "CIRCLE/0,0,0,0,0,1,10", "GOTO/10,0,0", "GOTO/20,0,0", "RAPID", "GOTO/20,0,20", head=BALL)
    assert "arcs" in only_run(path, with_cone())[1].fixed


def test_limits_of_an_operation_go_before_those_of_all() -> None:
    limits = OrientationLimits(cone=5.0, off_centre=3.0, operations={"FINISH": AxisLimits(cone=12.0, contact_radius=0.5)})
    assert (limits.of("ROUGH").cone, limits.of("FINISH").cone) == (5.0, 12.0)
    assert (limits.of("FINISH").off_centre, limits.of("FINISH").contact_radius) == (None, 0.5)
    assert OrientationLimits(operations={"A": AxisLimits(cone=1.0)}).turns
    assert not OrientationLimits(lead=(0.0, 5.0)).turns


@pytest.mark.parametrize("controller", ["linuxcnc", pytest.param("siemens-840d", marks=pytest.mark.slow)])
def test_the_program_is_proved_faster_and_says_so(controller: str) -> None:
    made = convert(swing(), machine("mikron-ucp710"), controller, with_cone(), OPTIONS, clock=program_clock())
    assert made.ok, [str(d) for d in made.diagnostics]
    assert made.turning is not None
    assert made.turning.programs["turned"].seconds < 0.97 * made.turning.programs["keep"].seconds
    assert made.choice is not None
    assert made.choice.toolpath("auto").equals(made.toolpath), "what Python takes from the choice"
    assert made.witness is not None
    assert not made.witness.findings
    assert {one.what for one in made.witness.compared} >= {"positions", "feeds"}
    assert "turned along 1 of 1 cuts" in made.text
    assert "no tool axis was turned" not in made.text
    assert "gained" in as_text(made.turning)


def test_feeds_that_are_not_scaled_are_found_by_the_second_witness(choice: TurningChoice) -> None:
    """The same axes with the feeds of the file: cuts that became shorter are faster than programmed."""
    path, right = choice.work.toolpath, choice.toolpath
    spec, name = control()
    made = PostResult("", OPTIONS, choice.work.machine, spec, name, SetupFile(), (), right, source=path.source)
    assert (proved := staged(made)).ok, [str(d) for d in proved.diagnostics]
    wrong = staged(replace(made, toolpath=replace(right, feed=path.feed)))
    assert "witness.feed" in {d.code for d in wrong.diagnostics}


def control() -> tuple[ControllerFile, str]:
    return read_value(load_controller("linuxcnc")), "linuxcnc"


def clock_of(seconds: dict[tuple[int, ...], float]) -> Callable[..., ProgramTime]:
    def clock(made: PostResult, band: bool = False) -> ProgramTime:
        assert made.turning is not None
        value = seconds.get(made.turning.picked, 99.0)
        return ProgramTime(value, (value, value), 0.0, "made up", np.full(len(made.turning.work.moves), value))
    return clock


def made_of(choice: TurningChoice) -> PostResult:
    spec, name = control()
    return PostResult("", OPTIONS, choice.work.machine, spec, name, SetupFile(), (), choice.toolpath, turning=choice)


def test_what_is_slower_on_the_control_is_not_taken(choice: TurningChoice) -> None:
    keep = made_of(choice.taking([0]))
    taken, _ = turned_by_clock(choice, keep, made_of, clock_of({(0,): 10.0}))
    assert taken.picked == (0,)
    assert taken.gain == 0.0
    taken, made = turned_by_clock(choice, keep, made_of, clock_of({(0,): 10.0, (2,): 9.0}))
    assert taken.picked == (2,)
    assert made.turning is not None
    assert made.turning.picked == (2,)


def test_a_cut_whose_program_is_refused_keeps_its_axes(choice: TurningChoice) -> None:
    def refused(some: TurningChoice) -> PostResult:
        made = made_of(some)
        return made if not any(some.picked) else made.with_found([error("collision.touch", "it touches", lines=[12])])
    taken, _ = turned_by_clock(choice, made_of(choice.taking([0])), refused, clock_of({}))
    assert taken.picked == (0,)
    assert taken.passed == ("it touches",)
    assert "it touches" in " ".join(d.message for d in noted(taken))


def test_reach_along_the_path_ends_where_a_joint_does(search: TiltSearch, best: TiltField) -> None:
    """At the reach of jerk, one joint's jerk is at its limit, by differences of the joints along the path in time."""
    stretch, most = search.run.stretches[0], search.most
    own, now = (reach_along(stretch, one, most) for one in (search.kept(), best))
    assert now.seconds < own.seconds
    assert own.speed.max() <= (1.0 + 1e-3) * own.velocity.max()
    assert (own.speed <= own.velocity * 1.05).all()
    assert np.isfinite(own.jerk).all()
    assert (own.acceleration >= 0.0).all()


def test_equation_3_of_the_paper_is_what_the_joints_along_a_path_say() -> None:
    """X''' = J q''' + 2 J' q'' + J'' q' with turning axes, by differences in time, on a machine whose table turns twice."""
    kin = machine("mikron-ucp710").kinematics
    q0, rate = np.array([5.0, -3.0, 40.0, 0.5, 0.8]), np.array([20.0, 10.0, -5.0, 0.6, -0.9])
    bend, jolt = np.array([3.0, -8.0, 2.0, 0.4, 0.7]), np.array([30.0, 11.0, -9.0, 1.5, -2.0])

    def q(t: Floats) -> Floats:
        t = t[:, None]
        return q0 + rate * t + bend * t**2 / 2.0 + jolt * t**3 / 6.0

    h = 2e-3
    t = h * np.arange(-2.0, 3.0)
    tip = kin.forward(q(t))[0]
    third = (tip[4] - 2.0 * tip[3] + 2.0 * tip[1] - tip[0]) / (2.0 * h**3)
    jacobian = kin.jacobian(q(t))[:, :3]
    first, second = (jacobian[3] - jacobian[1]) / (2.0 * h), (jacobian[3] - 2.0 * jacobian[2] + jacobian[1]) / h**2
    assert jacobian[2] @ jolt + 2.0 * first @ bend + second @ rate == pytest.approx(third, rel=1e-3, abs=0.05)
    assert np.abs(2.0 * first @ bend + second @ rate).max() > 0.1 * np.abs(third).max(), "the axes turn"


def test_the_drawing_shows_the_cut_that_gains_most(choice: TurningChoice) -> None:
    from matplotlib.figure import Figure

    sheet = Figure()
    turned_panels(sheet, sheet.add_gridspec(3, 2), 0, choice)
    speeds, _, angles = sheet.axes
    own, now = speeds.lines[0], speeds.lines[2]
    assert len(panels_of(choice)) == 3
    assert np.trapezoid(1.0 / np.asarray(now.get_ydata()), now.get_xdata()) < np.trapezoid(
        1.0 / np.asarray(own.get_ydata()), own.get_xdata())
    assert np.max(angles.lines[0].get_ydata()) <= CONE == pytest.approx(angles.lines[1].get_ydata()[0])
    assert panels_of(choice.taking([0])) == panels_of(None) == ()


def test_normals_of_the_part_mesh_are_known_along_a_cut(tmp_path: Path) -> None:
    """A block whose top is z = 0: its normal is z at every pose, and a lead in the set-up is no reason to keep the axes."""
    block = trimesh.creation.box((200.0, 100.0, 20.0))
    block.apply_translation([0.0, 0.0, -10.0])
    block.export(tmp_path / "block.stl")
    x = np.arange(-20.0, 21.0, 2.0)
    axis = np.column_stack((np.sin(0.3) * np.cos(x / 9.0), np.sin(0.3) * np.sin(x / 9.0), np.full(len(x), np.cos(0.3))))
    tip = np.column_stack((x, 0.0 * x, 3.0 + 0.0 * x)) - RADIUS * axis
    goto = ["GOTO/" + ",".join(f"{v:.9f}" for v in (*p, *a)) for p, a in zip(tip, axis, strict=True)]
    path = toolpath("RAPID", goto[0], "FEDRAT/MMPM,2000", *goto[1:], head=BALL)
    setup = tmp_path / "s.toml"
    setup.write_text('[bodies]\npart = "block.stl"\n[orientation]\ncone = 5.0\nlead = [-60.0, 60.0]\n')
    options = replace(OPTIONS, setup=str(setup))
    work, found = work_of(path, machine("mikron-ucp710"), read_value(load_setup(str(setup))), options)
    assert work is not None, found
    run = runs_of(work, Tolerance(0.01, 1e-3), 1.0)[0]
    assert run.fixed == ""
    assert len(run.contact) == 2 * (len(x) - 1)
    assert run.contact.normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(run.contact), 1)), abs=1e-6)
