"""The part's place on the table: the search against closed forms, limits that hold, what is refused and why."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.orientation.passes.contact import Contact
from postproc.orientation.passes.passes import work_of
from postproc.orientation.plans.orient import orient
from postproc.placement.place import PlacementChoice, _proved, place
from postproc.placement.place_times import TimedPlace, limiting_times
from postproc.placement.rigid_move import moved
from postproc.placement.search import EQUAL
from postproc.placement.space import ANGLES, angles_of, matrix, space_of
from postproc.setup.model import LinkClearance, PartPlacement, Placement, SetupFile, ToolSetup, part_placement
from postproc.setup.place import PlaceBox, PlacementLimits
from tests.postproc.kit import machine
from toolpaths.diagnostics import Diagnostic, error, has_errors
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

HEAD = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW"]


def passes(link: tuple[float, float], count: int = 3, length: float = 80.0, feed: int = 60000) -> Toolpath:
    """Level passes along `link`, 1 mm from each other, 3-axis; `feed` in mm/min."""
    along, up = np.array([*link, 0.0]) * length, np.array([0.0, 0.0, 5.0])
    lines = []
    for k in range(count):
        adjacent = k * np.array([-link[1], link[0], 0.0])
        for word, tip in (("RAPID", adjacent + up), ("RAPID", adjacent), ("", along + adjacent),
                          ("RAPID", along + adjacent + up)):
            lines += [word] * bool(word) + ["GOTO/{:.6f},{:.6f},{:.6f}".format(*tip)]
    path, found = toolpaths.read_bytes("\n".join([*HEAD, f"FEDRAT/MMPM,{feed}", *lines, "FINI"]).encode(),
                                       file="passes.apt")
    assert not has_errors(found), found
    return path


STEADY = 15000
"""mm/min: never reached within 80 mm under that jerk"""


def jerk_only(m: Machine) -> Machine:
    """No limit but jerk, the same on every slide; at STEADY none is asked for more than the file of the machine allows."""
    free = np.full(len(m.rotary), 1e9)
    return replace(m, limits=replace(m.limits, velocity=free, acceleration=free, jerk=np.where(m.rotary, 1e12, 5000.0)))


def setup_of(origin: tuple[float, float, float] = (0.0, 0.0, 0.0), length: float = 100.0,
             **limits: object) -> SetupFile:
    return SetupFile(part=PartPlacement(origin=origin), placement=PlacementLimits.model_validate(limits),
                     tools={"1": ToolSetup(gauge_length=length)})


def placed(path: Toolpath, m: Machine, setup: SetupFile) -> PlacementChoice:
    choice, found = place(path, m, setup)
    assert choice is not None, [str(d) for d in found]
    return choice


def refused(path: Toolpath, m: Machine, setup: SetupFile) -> Diagnostic:
    choice, found = place(path, m, setup)
    assert choice is None
    return next(d for d in found if has_errors([d]))


def test_turning_aims_a_vertex_of_the_box_along_the_passes() -> None:
    """Under jerk alone, J on each slide, a straight path D takes (32 D/J)^(1/3) along an axis; along the
    diagonal of X and Y each goes D/sqrt(2): 2^(-1/6) of it."""
    m = jerk_only(machine("mill-3axis"))
    choice = placed(passes((1.0, 0.0), 1, feed=STEADY), m, setup_of(turn=(0.0, 90.0)))
    assert choice.found.now.cutting == pytest.approx(np.cbrt(32 * 80 / 5000.0), rel=1e-3)
    assert choice.best.cutting / choice.found.now.cutting == pytest.approx(2 ** (-1 / 6), rel=2e-3)
    assert choice.best.place[ANGLES] == pytest.approx(45 * DEG, abs=1.0 * DEG)


def test_listed_turns_are_the_only_ones() -> None:
    m = jerk_only(machine("mill-3axis"))
    choice = placed(passes((1.0, 0.0), 1, feed=STEADY), m, setup_of(turns=[0.0, 30.0, 90.0]))
    assert choice.best.place[ANGLES] == pytest.approx(30 * DEG)
    assert choice.best.cutting / choice.found.now.cutting == pytest.approx(np.cbrt(np.cos(30 * DEG)), rel=2e-3)


def test_the_seconds_are_those_of_orient() -> None:
    """The choice of orientations, asked about the new set-up, finds the same time with the axes of the file."""
    path, m, setup = passes((1.0, 0.0), 1), machine("mikron-ucp710"), setup_of(x=(-50.0, 50.0), turns=[0.0, 30.0])
    choice = placed(path, m, setup)
    for part, one in ((setup.part, choice.found.now), (choice.part, choice.best)):
        oriented, _ = orient(path, m, setup.model_copy(update={"part": part}), Options())
        assert oriented is not None
        assert one.seconds == pytest.approx(oriented.plans["keep"].seconds, rel=1e-7)
    assert choice.best.seconds <= choice.found.now.seconds * (1.0 + EQUAL)


def test_a_part_outside_travel_finds_a_place_inside() -> None:
    """Travel of X is 1000 mm, the pass 80 mm: from 480 it goes beyond 500."""
    setup = setup_of((480.0, 0.0, 0.0), x=(400.0, 480.0))
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"), setup)
    assert "travel: axis X at 560.000 mm" in str(choice.found.now.refused)
    assert 400.0 <= choice.best.place[0] <= 420.0
    assert choice.best.margins(choice.work.machine)[0] == pytest.approx(420.0 - choice.best.place[0], abs=1e-3)


def test_what_lacks_most_travel_is_said() -> None:
    """From 440 the pass still ends 20 mm beyond the travel of X."""
    fault = refused(passes((1.0, 0.0)), machine("mill-3axis"), setup_of((480.0, 0.0, 0.0), x=(440.0, 480.0)))
    assert fault.code == "place.none"
    assert "axis X lacks 20.000 mm at one end of its travel" in fault.message


def test_turning_the_part_finds_the_longer_travel() -> None:
    """A way of 900 mm fits along X (1000) and not along Y (800)."""
    setup = setup_of((0.0, -400.0, 0.0), x=(-450.0, 450.0), y=(-450.0, 450.0), turns=[0.0, 90.0, -90.0])
    setup = setup.model_copy(update={"clearance": LinkClearance(distance=60.0)})
    choice = placed(passes((0.0, 1.0), length=900.0), machine("mill-3axis"), setup)
    assert "axis Y" in str(choice.found.now.refused)
    assert abs(choice.best.place[ANGLES]) == pytest.approx(90 * DEG)
    assert (choice.best.margins(choice.work.machine) >= 0.0).all()


def test_limits_and_table_hold() -> None:
    """Every place that is timed is inside the limits, and the part inside the table's box."""
    table = PlaceBox(low=(-100.0, -60.0, -50.0), high=(100.0, 60.0, 50.0))
    setup = setup_of(x=(-90.0, 90.0), y=(-40.0, 40.0), turn=(0.0, 180.0), point=(40.0, 0.0, 0.0), table=table)
    choice = placed(passes((1.0, 0.0), 1), machine("mill-3axis"), setup)
    for one in choice.known:
        if np.isfinite(one.seconds) and one is not choice.found.now:
            assert choice.space.holds(one.place)
    assert choice.space.holds(choice.best.place)
    corners = choice.space.placement(choice.best.place).points(choice.space.corners)
    assert (corners >= np.array(table.low) - 1e-6).all() and (corners <= np.array(table.high) + 1e-6).all()


def test_a_part_beyond_its_table_is_reported() -> None:
    """It is within travel where it stands now, and still refused; the limits alone would let it stay."""
    table = PlaceBox(low=(-100.0, -60.0, -50.0), high=(100.0, 60.0, 50.0))
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"),
                    setup_of((60.0, 0.0, 0.0), x=(-90.0, 90.0), table=table))
    assert str(choice.found.now.refused) == "the part stands 40.000 mm beyond the table in x"
    assert choice.best.place[0] <= 20.0


def test_steps_keep_to_the_bores() -> None:
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"),
                    setup_of((300.0, 0.0, 0.0), x=(-110.0, 400.0), step=25.0))
    assert (choice.best.place[0] + 110.0) / 25.0 == pytest.approx(round((choice.best.place[0] + 110.0) / 25.0), abs=1e-9)
    assert choice.best.seconds < choice.found.now.seconds


def test_without_limits_it_says_what_to_write() -> None:
    fault = refused(passes((1.0, 0.0)), machine("mill-3axis"), setup_of())
    assert fault.code == "place.limits"
    assert "[placement] x = [" in fault.hint


def test_the_same_again() -> None:
    m, setup = machine("mikron-ucp710"), setup_of(x=(-50.0, 50.0), turns=[0.0, 45.0])
    first, second = (placed(passes((1.0, 0.0), 1), m, setup) for _ in range(2))
    assert (first.best.place == second.best.place).all()
    assert first.best.seconds == second.best.seconds
    assert first.looked == second.looked


def test_among_equals_the_roomiest() -> None:
    """Home is 200 mm away in X, so that up to that Y costs no time: the part goes where Y has most travel left."""
    choice = placed(passes((1.0, 0.0)), machine("mill-3axis"),
                    setup_of((200.0, 90.0, 0.0), y=(-100.0, 100.0)))
    assert choice.best.place[1] == pytest.approx(-1.0, abs=2.0)
    m = choice.work.machine
    good = [one for one in choice.known if np.isfinite(one.seconds) and choice.space.holds(one.place)]
    equal = [one for one in good if one.seconds <= min(one.seconds for one in good) * (1.0 + EQUAL)]
    assert len({one.shares(m) for one in equal}) > 1
    assert choice.best.shares(m) == max(one.shares(m) for one in equal)


def test_angles_and_back() -> None:
    rng = np.random.default_rng(4)
    for angles in rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (50, 3)):
        assert angles_of(matrix(angles)) == pytest.approx(angles, abs=1e-12)
    upright = matrix(np.array([0.4, np.pi / 2, 0.3]))
    assert matrix(angles_of(upright)) == pytest.approx(upright, abs=1e-12)


def test_a_moved_work_is_that_of_the_moved_part() -> None:
    """Cut and smoothed once and moved, or moved, cut and smoothed: the same poses."""
    path, m = passes((0.6, 0.8)), machine("mikron-ucp710")
    there = PartPlacement(origin=(10.0, -20.0, 30.0), x_axis=(0.6, 0.8, 0.0), y_axis=(-0.8, 0.6, 0.0))
    base, _ = work_of(path, m, setup_of(), Options())
    again, _ = work_of(path, m, setup_of().model_copy(update={"part": there}), Options())
    frame, _ = part_placement(SetupFile(part=there))
    assert base is not None and again is not None and frame is not None
    once = moved(base, frame)
    assert once.space.radius == pytest.approx(again.space.radius)
    assert once.moves.tip == pytest.approx(again.moves.tip, abs=1e-9)
    for a, b in zip(once.passes, again.passes, strict=True):
        assert a.tip == pytest.approx(b.tip, abs=1e-9)
        for c, d in zip(a.stretches, b.stretches, strict=True):
            assert c.tip == pytest.approx(d.tip, abs=1e-9)


def test_surfaces_are_moved_with_the_part() -> None:
    """Lead and tilt of an axis against a known contact are the same before and after."""
    base, _ = work_of(passes((0.6, 0.8)), machine("mikron-ucp710"), setup_of(), Options())
    assert base is not None
    rng = np.random.default_rng(8)
    normal, link = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 5, 3)))
    known = replace(base, passes=tuple(replace(one, contact=Contact(normal, link, np.arange(5))) for one in base.passes))
    there = Placement(matrix(np.array([0.7, 0.2, -0.4])), np.array([1.0, 2.0, 3.0]))
    axes = rng.normal(size=(4, 3))
    for a, b in zip(known.passes, moved(known, there).passes, strict=True):
        assert b.contact.lead(there.directions(axes)) == pytest.approx(a.contact.lead(axes), abs=1e-12)
        assert b.axis == pytest.approx(there.directions(a.axis[None])[0])


def test_the_space_states_what_it_places() -> None:
    """[part] for a place gives that place back, about a point away from the origin."""
    now = Placement(matrix(np.array([0.3, 0.0, 0.0])), np.array([5.0, 6.0, 7.0]))
    limits = PlacementLimits(point=(40.0, 20.0, 10.0), x=(-100.0, 100.0), turn=(-180.0, 180.0))
    space = space_of(limits, now, (np.zeros(3), np.array([80.0, 40.0, 20.0])))
    assert space.placement(space.now).origin == pytest.approx(now.origin)
    there = space.snapped(space.now + np.array([12.3456789, 9.0, 0.0, 1.0, 0.0, 0.0]))
    back, found = part_placement(SetupFile(part=space.part(there)))
    assert back is not None and not found
    again = space_of(limits, back, (np.zeros(3), np.ones(3)))
    assert again.now == pytest.approx(there, abs=1e-8)
    assert there[1] == space.now[1]


def tried_at(x: float, seconds: float) -> TimedPlace:
    return TimedPlace(np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0]), seconds, seconds, 0.0, seconds, np.zeros(3), np.zeros(3),
                      np.inf)


@pytest.mark.parametrize(("good_from", "taken", "failures"),
                         [(-1.0, 0.0, 0), (250.0, 300.0, 1), (np.inf, 7.0, 6)])
def test_places_that_cannot_be_converted_are_left(good_from: float, taken: float, failures: int) -> None:
    """After a failure the farthest place is next, not the neighbour; at last the part stays where it is."""
    known = [tried_at(25.0 * k, 1.0 + 0.01 * k) for k in range(13)]
    now = tried_at(7.0, 9.0)
    wrong = error("workspace.z", "passed by 61 mm")
    proof = SimpleNamespace(options=Options(), of=lambda one: (
        (1.0, None) if one is now or one.place[0] > good_from else (np.nan, wrong)))
    timer = SimpleNamespace(known=lambda: known, space=SimpleNamespace(holds=lambda place: True))
    best, found = _proved(proof, timer, known[0], now)
    assert best is not None and best.place[0] == taken
    assert [d.code for d in found] == ["place.passed_over"] * failures


def test_where_no_place_can_be_converted_the_first_reason_is_said() -> None:
    known = [tried_at(25.0 * k, 1.0 + 0.01 * k) for k in range(13)]
    now = replace(tried_at(7.0, 9.0), refused="outside travel")
    wrong = error("link.blocked", "the links stay inside no workspace", hint="lower clearance.margin")
    proof = SimpleNamespace(options=Options(), of=lambda one: (np.nan, wrong))
    timer = SimpleNamespace(known=lambda: known, space=SimpleNamespace(holds=lambda place: True))
    best, found = _proved(proof, timer, known[0], now)
    assert best is None
    assert [(d.code, d.hint) for d in found] == [("place.proof", wrong.hint)] and wrong.message in found[0].message


def test_seconds_of_holes_are_limited_by_no_axis() -> None:
    assert limiting_times([(3.0, ""), (2.0, "X jerk"), (1.0, "feed"), (4.0, "X jerk")]) == {"X jerk": 6.0, "feed": 1.0}
