"""Platforms of one turn: bars that keep their direction, a rotary axis next to a tilting platform, all their modes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.kinematics.legs.modes import found_modes
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from toolpaths.arrays import Floats

UP = np.array([0.0, 0.0, 1.0])


def symmetric_h4() -> OnLegs:
    found = machines.load("h4-rotary").kinematics
    assert isinstance(found, OnLegs)
    return found


def test_bars_keep_their_direction_while_the_platform_turns() -> None:
    """V-10 written out: B of the front bar at D + d (sin t -+ 1, -cos t), of the back bar at D + d (-sin t +- 1, cos t)."""
    kin, one = symmetric_h4(), symmetric_h4().one_turn
    assert one is not None and kin.loops.kept is not None
    t = np.radians(np.linspace(-45.0, 45.0, 7))
    ends = one.ends(np.column_stack([np.tile([10.0, -20.0, 30.0], (7, 1)), t]))
    s, c = np.sin(t), np.cos(t)
    wanted = 60.0 * np.stack([np.stack([s - 1, s + 1, -s + 1, -s - 1], axis=1), np.stack([-c, -c, c, c], axis=1),
                              np.zeros((7, 4))], axis=2) + [10.0, -20.0, 30.0]
    np.testing.assert_allclose(ends, wanted, atol=1e-12)
    np.testing.assert_allclose(kin.loops.ends(np.tile([10.0, -20.0, 30.0], (7, 1)), one.turn(t)), wanted, atol=1e-12)


def test_joints_of_the_symmetric_h4_by_the_formula_of_the_thesis() -> None:
    """V-11 to V-15, arms outwards: the smaller of both angles; V-18 for the rates."""
    kin, one = symmetric_h4(), symmetric_h4().one_turn
    assert one is not None
    p = np.column_stack(kin.workspace.random(np.random.default_rng(4), 200))
    q = one.inverse(p)
    along = kin.legs.directions
    w = one.ends(p) - kin.legs.points
    sine = 2 * 260.0 * (along[:, 1] * w[:, :, 0] - along[:, 0] * w[:, :, 1])
    cosine, rest = 2 * 260.0 * w[:, :, 2], 260.0**2 + (w * w).sum(axis=2) - 480.0**2
    root = np.sqrt(sine**2 - rest**2 + cosine**2)
    both = [2.0 * np.arctan((-sine + sign * root) / (rest - cosine)) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(q, np.minimum(*both), atol=1e-11)
    rates = one.rates(p, q)
    for j in range(4):
        step = 1e-6 * np.eye(4)[j]
        slope = (one.forward(q + step, p) - one.forward(q - step, p)) / 2e-6
        np.testing.assert_allclose(rates[:, :, j], slope, atol=2e-5)


def test_all_modes_of_the_symmetric_h4() -> None:
    """What Newton finds from many starts; with all arms alike, where all spheres stand about points of one plane, too."""
    kin, one = symmetric_h4(), symmetric_h4().one_turn
    assert one is not None
    p = np.column_stack(kin.workspace.random(np.random.default_rng(6), 6))
    q = np.concatenate([one.inverse(p), np.full((1, 4), np.radians(-50.0))])
    modes = one.modes(q)
    for k in range(len(q)):
        place, _ = found_modes(kin.loops, q[k], kin.home[0])
        mine = modes[np.isfinite(modes[:, k, 0]), k]
        assert len(mine) >= len(place) and len(mine) in (2, 4)
        assert np.linalg.norm(place[:, None] - mine[None, :, :3], axis=2).min(axis=1).max() < 1e-5
    np.testing.assert_allclose(modes[0, :-1], p, atol=1e-9)


def test_the_platform_turns_the_tool_about_itself_where_it_is_asked_to() -> None:
    kin = symmetric_h4().with_tool(50.0)
    tip, spin = np.array([[20.0, -30.0, -170.0]]), 0.5
    q = kin.inverse(tip, UP[None], spin)[0]
    found, axis, turned = kin.pose(q)
    np.testing.assert_allclose(np.column_stack([found, axis, turned]), [[*tip[0], 0.0, 0.0, 1.0, spin]], atol=1e-10)
    assert np.isnan(kin.inverse(tip, np.array([[0.1, 0.0, 0.995]]))).all()


# ---- a rotary axis next to legs -----------------------------------------------------------------------------


def h4a_as_legs(name: str, folder: Path) -> LegsWithAxis:
    """The same machine with the table of kind "legs"."""
    text = (Path(machines.__file__).parent / "data" / f"{name}.toml").read_text("utf-8")
    text = text.replace('kind = "h4-linear"', 'kind = "legs"\nfreedoms = ["x", "y", "z", "a"]')
    text = text.replace("gauge = 200", "gauge = [0, 0, -200]").replace("slide = [", 'drive = "slide"\npoint = [')
    (folder / "legs.toml").write_text(text, encoding="utf-8")
    found = machines.load(folder / "legs.toml").kinematics
    assert isinstance(found, LegsWithAxis)
    return found


@pytest.mark.parametrize("name", ["h4a-c-table", "h4a-spindle-axis"])
def test_the_h4a_is_a_machine_on_legs(name: str, tmp_path: Path) -> None:
    own, legs = machines.load(name).kinematics.with_tool(40.0), h4a_as_legs(name, tmp_path).with_tool(40.0)
    assert isinstance(own, LegsWithAxis)
    p = np.column_stack(own.workspace.random(np.random.default_rng(8), 300))
    tip, axis, _ = own.place(p, np.random.default_rng(9).uniform(-0.8, 0.8, 300))
    np.testing.assert_array_equal(legs.inverse(tip, axis), own.inverse(tip, axis))
    np.testing.assert_array_equal(legs.forward(own.inverse(tip, axis)[0])[0], own.forward(own.inverse(tip, axis)[0])[0])


def turned_quarter(v: Floats) -> Floats:
    """Vectors (N, 3) a quarter turn about z: x becomes y."""
    return np.stack([-v[:, 1], v[:, 0], v[:, 2]], axis=1)


@pytest.mark.parametrize(("name", "sense"), [("h4a-c-table", 1.0), ("h4a-spindle-axis", -1.0)])
def test_tilting_about_y_is_tilting_about_x_seen_from_the_side(name: str, sense: float) -> None:
    """The machine turned a quarter about z: an axis at the spindle then turns about x, against the quarter turn of y."""
    own = machines.load(name).kinematics.with_tool(40.0)
    assert isinstance(own, LegsWithAxis)
    base = own.on_legs
    drives = replace(base.legs, points=turned_quarter(base.legs.points), directions=turned_quarter(base.legs.directions))
    low, high = np.sort(turned_quarter(np.stack([own.workspace.lower, own.workspace.upper])), axis=0)
    loops = replace(base.loops, drives=drives, joints=turned_quarter(base.loops.joints), freedoms=("x", "y", "z", "b"))
    legs = replace(base, loops=loops, workspace=replace(base.workspace, lower=low, upper=high))
    other = replace(own, on_legs=legs, axis=replace(own.axis, tilt="b", sense=sense))
    p = np.column_stack(own.workspace.random(np.random.default_rng(8), 200))
    tip, axis, _ = own.place(p, np.random.default_rng(9).uniform(-0.8, 0.8, 200))
    q = own.inverse(tip, axis)
    found = other.inverse(turned_quarter(tip), turned_quarter(axis))
    np.testing.assert_allclose(found, q, atol=1e-9)
    back = other.forward(found[0])
    np.testing.assert_allclose(np.hstack(back), np.hstack([turned_quarter(tip), turned_quarter(axis)]), atol=1e-9)
    rates, wanted = other.jacobian(found[0]), own.jacobian(q[0])
    for part in (slice(0, 3), slice(3, 6)):
        turned = np.stack([turned_quarter(wanted[:, part, j]) for j in range(5)], axis=2)
        np.testing.assert_allclose(rates[:, part], turned, atol=1e-8)


# ---- files that are refused --------------------------------------------------------------------------------


@pytest.mark.parametrize("phi", [(225, 315, 45, 135), (180, 270, 0, 135)])
def test_v4_is_refused_where_the_condition_number_is_good(phi: tuple[int, ...], tmp_path: Path) -> None:
    """Arrangements of motors whose condition number stays below 3.3 and 18 in the cylinder of table V-33."""
    text, at = (Path(machines.__file__).parent / "data" / "h4-rotary.toml").read_text("utf-8"), np.radians(phi)
    text = re.sub(r"(?m)^z = .*", "z = [-45, 55]", re.sub(r"(?m)^([xy]) = .*", r"\1 = [-110, 110]", text))
    places = zip(*np.array([[-60, 60, 60, -60], [-45, -45, 45, 45]]) + 200.0 * np.stack([np.cos(at), np.sin(at)]),
                 np.cos(at), np.sin(at), strict=True)
    for letter, (x, y, c, s) in zip("ABCU", places, strict=True):
        head, leg = text.split(f"[kinematics.legs.{letter}]\n")
        leg = re.sub(r"point = .*", f"point = [{x}, {y}, 460]", leg, count=1)
        leg = re.sub(r"direction = .*", f"direction = [{-s}, {c}, 0]", leg, count=1)
        leg = re.sub(r"rods = .*", f"rods = [[{-30 * s}, {30 * c}, 0], [{30 * s}, {-30 * c}, 0]]", leg, count=1)
        text = f"{head}[kinematics.legs.{letter}]\n{leg}"
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    machine, found = machines.load_checked(tmp_path / "own.toml")
    assert machine is None and ["with one sign at" in d.message for d in found] == [True], [str(d) for d in found]


@pytest.mark.parametrize(("name", "old", "new", "code", "words"), [
    ("h4-rotary", 'bar = "front"', 'bar = "middle"', "machine.geometry", "'middle' is none of the bars front, back"),
    ("h4-rotary", "[kinematics.bars.back]", "[kinematics.bars.side]\nhinge = [1, 0, 0]\n[kinematics.bars.back]",
     "machine.geometry", "no leg holds the bar 'side'"),
    ("h4-rotary", '"z", "c"]', '"z"]', "machine.geometry", "has 0 turns"),
    ("h4-rotary", "rods = [[0, -20, 0], [0, 20, 0]]\n", "", "machine.mobility", "do not hold the platform everywhere"),
    ("tilting-arms-c-table", '"z", "b"]', '"z", "c"]', "machine.geometry", "a rotary axis goes with a platform"),
    ("tilting-arms-c-table", 'letter = "C"', 'letter = "A"', "machine.axis-letter", "A drives a leg too"),
    ("tilting-arms-c-table", "[kinematics.rotary]", "[kinematics.carriers.P]\ndirection = [1, 0, 0]\n[kinematics.rotary]",
     "machine.geometry", "is carried by no slides"),
    ("tilting-arms-c-table", 'carries = "part"', 'carries = "part"\npivot = [1, 0, 0]', "machine.geometry", "a table turns"),
])
def test_what_does_not_go_together_is_refused(name: str, old: str, new: str, code: str, words: str, tmp_path: Path) -> None:
    text = (Path(machines.__file__).parent / "data" / f"{name}.toml").read_text("utf-8")
    assert old in text
    (tmp_path / "own.toml").write_text(text.replace(old, new), encoding="utf-8")
    machine, found = machines.load_checked(tmp_path / "own.toml")
    assert machine is None and any(d.code == code and words in d.message for d in found), [str(d) for d in found]
