"""Placing on parallel machines: against a grid of places that are all planned, inside reach, off singular positions."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.orientation.passes.passes import work_of
from postproc.placement.place import place
from postproc.placement.place_times import Timer
from postproc.placement.reasons import MarginLacks
from postproc.placement.region import Sampled, Slabs, region_of
from postproc.placement.search import PlaceSearch
from postproc.placement.space import ANGLES, Space, matrix, space_of
from postproc.setup.model import PartPlacement, Placement, RewindSettings, SetupFile, load_setup, part_placement
from postproc.setup.place import PlacementLimits
from tests.postproc.kit import SAMPLES, few_sides, machine
from tests.postproc.placement.test_placement import passes, placed, refused, setup_of
from toolpaths.arrays import Floats
from toolpaths.rotations import squared

DELTA = "uranesx"


def on_delta(**limits: object) -> SetupFile:
    return setup_of((0.0, 0.0, -270.0), **limits)


def slow() -> Machine:
    """The Delta with a tenth of its acceleration and jerk, so that no feed binds."""
    m = machine(DELTA)
    limits = replace(m.limits, velocity=0.2 * m.limits.velocity, acceleration=0.1 * m.limits.acceleration,
                     jerk=0.1 * m.limits.jerk)
    return replace(m, limits=limits)


def timer_of(setup: SetupFile, m: Machine, space: Space, least: float = 0.05) -> Timer:
    """A new one."""
    work, _ = work_of(passes((1.0, 0.0), 2, 120.0), m,
                      setup.model_copy(update={"part": PartPlacement()}), Options())
    assert work is not None
    return Timer(work, space, least)


@pytest.mark.parametrize("count", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_as_good_as_a_grid(count: int) -> None:
    """Dexterity varies over the workspace: no place of a grid, all planned, is better than what is found."""
    setup = setup_of((-240.0, 0.0, -270.0), x=(-240.0, 120.0), y=(-240.0, 240.0), turns=[0.0, 90.0])
    choice = placed(passes((1.0, 0.0), 2, 120.0), slow(), setup)
    timer = timer_of(setup, slow(), choice.space)
    grid = [np.array([x, y, -270.0, turn, 0.0, 0.0]) for x, y, turn in
            product(np.linspace(-240, 120, count), np.linspace(-240, 240, count), choice.space.dims[ANGLES].values)]
    tried = [timer.tried(one) for one in grid]
    times = [one.seconds for one in tried if np.isfinite(one.seconds)]
    assert len(times) > count**2
    assert choice.best.seconds <= min(times)
    assert max(one.cutting for one in tried if np.isfinite(one.seconds)) > 1.15 * min(one.cutting for one in tried)
    assert choice.best.seconds < 0.95 * choice.found.now.seconds


def test_from_outside_the_workspace() -> None:
    choice = placed(passes((1.0, 0.0), 2, 120.0), machine(DELTA),
                    setup_of((200.0, 0.0, -270.0), x=(-250.0, 250.0)))
    assert "reach" in str(choice.found.now.refused)
    assert (choice.best.margins(choice.work.machine) > 0.0).all()
    assert choice.best.singular >= 0.05


def test_nowhere_in_the_workspace() -> None:
    fault = refused(passes((1.0, 0.0), 2, 120.0), machine(DELTA),
                    setup_of((200.0, 0.0, -270.0), x=(190.0, 250.0)))
    assert fault.code == "place.none"
    assert "workspace x lacks 60 mm" in fault.message
    joints = SetupFile().joints.model_copy(update={"singular_distance": 0.6})
    fault = refused(passes((1.0, 0.0), 2, 120.0), machine(DELTA), on_delta(x=(-90.0, 120.0)).model_copy(
        update={"joints": joints}))
    assert "platform (direct) lacks 0.08184 of the stated distance" in fault.message


def test_stated_distance_from_singular_positions_is_kept() -> None:
    """A part that comes nearer than is stated is moved away; where there is no more distance, it stands nowhere."""
    m, limits = machine(DELTA), PlacementLimits(x=(-240.0, 120.0))
    now = Placement(matrix(np.array([np.pi / 2, 0.0, 0.0])), np.array([-240.0, 0.0, -270.0]))
    space = space_of(limits, now, (np.zeros(3), np.zeros(3)))
    timer = timer_of(on_delta(), m, space, 0.518155)
    found = PlaceSearch(timer, space).run()
    assert "platform (direct) comes to 0.5181 of a singular position" in str(found.now.refused)
    assert found.best is not None
    assert found.best.singular >= 0.518155
    assert PlaceSearch(timer_of(on_delta(), m, space, 0.99), space).run().best is None


@pytest.mark.parametrize("name", [DELTA, "mikron-ucp710", "trunnion-bc"])
def test_margins_are_those_of_the_poses(name: str) -> None:
    """What the region says of a place is what the joints of all poses have left there; serial ones exactly."""
    setup = on_delta(x=(-150.0, 100.0), y=(-100.0, 100.0), turn=(0.0, 180.0)) if name == DELTA else \
        setup_of(x=(-150.0, 100.0), y=(-100.0, 100.0), turn=(0.0, 180.0))
    now, _ = part_placement(setup)
    assert now is not None
    space = space_of(setup.placement, now, (np.zeros(3), np.zeros(3)))
    timer = timer_of(setup, machine(name), space)
    rng = np.random.default_rng(5)
    for turn in (0.0, 0.7):
        region, why = region_of(timer.work, space, np.array([turn, 0.0, 0.0]), 0.05)
        assert region is not None, why
        places = np.column_stack([rng.uniform(-150, 100, 4), rng.uniform(-100, 100, 4), np.full(4, setup.part.origin[2])])
        for at, margin in zip(places, region.margins(places), strict=True):
            made = timer.tried(np.concatenate([at, [turn, 0.0, 0.0]]))
            slides = made.margins(timer.machine)[~np.array(timer.machine.rotary)]
            assert margin <= slides.min() + 1e-6
            assert (margin >= 0.0) == (not made.refused)


def test_an_axis_that_rewinds_leaves_the_places_of_one_without_ends(tmp_path: Path) -> None:
    """Where C of a whole turn ends in the middle of a cut it is unwound, at every place of the part."""
    turns = np.radians(np.linspace(0.0, 1080.0, 40))
    (tmp_path / "cone.apt").write_text("UNITS/MM\nMULTAX/ON\nLOADTL/1\nSPINDL/RPM,900,CLW\nFEDRAT/MMPM,300\n" + "".join(
        f"GOTO/{12 * c:.4f},{12 * s:.4f},0,{0.6 * c:.6f},{0.6 * s:.6f},0.8\n" for c, s in zip(np.cos(turns), np.sin(turns),
                                                                                         strict=True)))
    path, m = toolpaths.read(tmp_path / "cone.apt")[0], machine("trunnion-bc")
    c = np.array(m.axis_names) == "C"
    ends = replace(m, limits=replace(m.limits, lower=np.where(c, np.radians(-200.0), m.limits.lower),
                                     upper=np.where(c, np.radians(200.0), m.limits.upper)))
    assert m.endless[c]
    found, space = [], space_of(PlacementLimits(), Placement(np.eye(3), np.zeros(3)), (np.zeros(3), np.zeros(3)))
    for one, allowed in ((ends, True), (m, True), (ends, False)):
        work, _ = work_of(path, one, SetupFile(rewind=RewindSettings(allowed=allowed)), Options(), turning=False)
        assert work is not None
        found.append(region_of(work, space, np.zeros(3), 0.05))
    (region, _), (same, _), (none, why) = found
    places = np.array([[0.0, 0.0, 0.0], [40.0, -30.0, -90.0], [300.0, 0.0, 50.0]])
    assert region is not None and same is not None
    np.testing.assert_allclose(region.margins(places), same.margins(places), atol=1e-9)
    assert none is None and "axis C" in str(why), "a set-up that forbids rewinds"


def test_deepest_is_no_worse_than_any_place() -> None:
    limits = PlacementLimits(x=(-300.0, 300.0), y=(-300.0, 300.0), z=(-200.0, 200.0))
    space = space_of(limits, Placement(np.eye(3), np.zeros(3)), (np.zeros(3), np.zeros(3)))
    work = timer_of(setup_of(), machine("mikron-ucp710"), space).work
    region, _ = region_of(work, space, np.array([0.4, 0.0, 0.0]), 0.05)
    assert region is not None
    low, high = space.room(np.array([0.4, 0.0, 0.0]))
    centre, margin, _ = region.deepest(low, high)
    rng = np.random.default_rng(6)
    assert region.margins(centre[None])[0] == pytest.approx(margin)
    assert region.margins(rng.uniform(low, high, (2000, 3))).max() <= margin + 1e-6


def test_most_margin_of_slabs_in_any_direction() -> None:
    """Rows as they are where rotary joints turn: nowhere in the box is the least of all margins greater."""
    rng = np.random.default_rng(9)
    for _ in range(5):
        slabs = Slabs(rng.normal(size=(300, 3)), rng.uniform(20.0, 200.0, 300), rng.integers(0, 3, 300),
                      ("X", "Y", "Z"))
        low, high = np.array([-80.0, -50.0, 0.0]), np.array([60.0, 50.0, 30.0])
        centre, margin, what = slabs.deepest(low, high)
        assert ((centre >= low) & (centre <= high)).all()
        near = np.clip(centre + rng.normal(scale=3.0, size=(3000, 3)), low, high)
        every = slabs.margins(np.vstack([rng.uniform(low, high, (3000, 3)), near]))
        assert every.max() <= margin + 1e-3
        assert every.max() >= margin - 3.0
        values = slabs.g @ centre + slabs.c
        assert str(what).startswith(f"axis {slabs.names[slabs.joint[values.argmin()]]} lacks")


def test_poses_that_stand_for_all_keep_their_distance() -> None:
    """The singular distance of a placed part is that of its own joints."""
    choice = placed(passes((1.0, 0.0), 2, 120.0), machine(DELTA), on_delta(x=(-100.0, 0.0)))
    timer = timer_of(on_delta(), machine(DELTA), choice.space)
    made = timer.tried(choice.best.place)
    kin = choice.work.passes[0].kin
    tips = choice.space.placement(choice.best.place).points(np.concatenate([one.tip for one in choice.work.passes]))
    q = kin.inverse(tips, np.tile([0.0, 0.0, 1.0], (len(tips), 1)), near=machine(DELTA).home)[0]
    assert made.singular <= kin.singular_distance(q).min() + 1e-9
    assert made.singular == pytest.approx(choice.best.singular)


def test_a_place_that_only_its_links_make_worse_is_not_taken() -> None:
    """On the UraneSX the cuts of the sample get faster away from [part], the links of the program longer: it
    is the program that counts, and the part stays."""
    setup, found = load_setup(SAMPLES / "delta.setup.toml")
    assert setup is not None and not found
    limits = PlacementLimits(x=(-100.0, 100.0), turns=[0.0])
    part = few_sides("test_part.cls", lines=340)
    choice, more = place(part, machine(DELTA), setup.model_copy(update={"placement": limits}))
    assert choice is not None, more
    assert min(one.seconds for one in choice.known) < choice.found.now.seconds
    assert choice.best is choice.found.now and "place.kept" in {d.code for d in more}
    assert choice.program[0] == choice.program[1] > 0.0


class Leaning(Sampled):
    """A lean that is at its limit wherever the part stands; the rest of the margin is greatest at (30, 0, -20)."""

    def _values(self, places: Floats) -> Floats:
        rest = 100.0 - np.linalg.norm(places - [30.0, 0.0, -20.0], axis=1)
        return np.stack([np.minimum(rest, 0.0), rest], axis=1)

    def _deciding(self, place: Floats) -> MarginLacks:
        return MarginLacks("tilt", 0.0, "degrees")


def test_where_the_lean_decides_the_rest_chooses_the_place() -> None:
    place, margin, _ = Leaning(machine("tricept"), (), 0.0).deepest(np.full(3, -80.0), np.full(3, 80.0))
    assert margin == 0.0 and np.abs(place - [30.0, 0.0, -20.0]).max() < 4.0


def test_a_turn_that_is_a_quarter_but_for_noise_is_written_as_one() -> None:
    noise = np.array([[-1.0, 1.02866e-09, 0.0], [0.0, -1.0, 0.0], [1e-6, 0.0, 1.0]])
    np.testing.assert_array_equal(squared(noise), [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1e-6, 0.0, 1.0]])
