"""Platforms that hinges, a passive leg or rings hold: what follows by closed forms, rates, bounds, files refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import machines
from machines.kinematics import by_samples
from machines.kinematics.legs.attitudes import direction_of
from machines.kinematics.legs.bounds import MovingLoops
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.ring_ends import EndsOnRings
from machines.loader import load_checked
from tests.source import ROOT
from toolpaths.arrays import Floats
from toolpaths.rotations import lengths

HEAD = (ROOT / "machines/data/tripod-head.toml").read_text()
PENTAPOD = (ROOT / "machines/data/linuxcnc-pentapod.toml").read_text().replace(".X]", ".W]").replace(
    "[kinematics.workspace]", "[kinematics.carriers.X]\ndirection = [0.8, 0, 0.6]\n\n[kinematics.workspace]").replace(
    "[control]", "[axes.X]\ntravel = [-400, 400]\nvelocity = 300\nacceleration = 3000\njerk = 50000\nhome = 0\n\n"
    "[control]").replace('module = "pentakins"\n', "")
OTHERS = {
    "lengths": (("drive = \"slide\"", "drive = \"length\""), ("radius = 350", "radius = 350\nheight = 680"),
                ("rod = 700", "rod = 660"), ("travel = [280, 1280]", "travel = [-400, 400]"), ("home = 810.82", "home = 0")),
    "cranks": (("drive = \"slide\"", "drive = \"arm\"\nheight = 580\narm = 300\nroot = -1"), ("rod = 700", "rod = 600"),
               ("z = [-120, 180]", "z = [-70, 80]"), ("tilt = [0, 40]", "tilt = [0, 25]"),
               ("[\"Z\", \"V\", \"W\"]", "[\"A\", \"B\", \"C\"]"), ("axes.Z]", "axes.A]"), ("axes.V]", "axes.B]"),
               ("axes.W]", "axes.C]"), ("travel = [280, 1280]", "travel = [-120, 120]"), ("home = 810.82", "home = 30"))}
"""the head's platform on other drives: 3-RPS and 3-RRS"""
CARRIED = "carried pentapod"
"""on a slide along X next to its own motion, which is redundant"""


@cache
def platform(name: str) -> OnLegs:
    if name == "head":
        found = machines.load("tripod-head").kinematics
    else:
        text = PENTAPOD if name == CARRIED else HEAD
        for old, new in () if name == CARRIED else OTHERS[name]:
            text = text.replace(old, new)
        with TemporaryDirectory() as folder:
            (Path(folder) / "own.toml").write_text(text)
            found = machines.load(Path(folder) / "own.toml").kinematics
    assert isinstance(found, OnLegs)
    return found.with_tool(80.0)


def asked(kin: OnLegs, n: int, seed: int = 0) -> tuple[Floats, Floats]:
    """Tips and tool axes all over the workspace."""
    rng, space = np.random.default_rng(seed), kin.workspace
    tilt, heading = rng.uniform(0.0, space.tilt[1], n), rng.uniform(0.0, 2.0 * np.pi, n)
    return rng.uniform(space.lower, space.upper, (n, 3)) + kin.gauge, direction_of("abc", tilt, heading)


@pytest.mark.parametrize("name", ["head", *OTHERS, CARRIED])
def test_forward_of_inverse_and_rates(name: str) -> None:
    kin = platform(name)
    tip, axis = asked(kin, 300)
    q = kin.inverse(tip, axis)[0]
    if kin.carried_twice:
        q = kin.inverse_with(tip, axis, kin.parameters_at(q) + np.linspace(-9.0, 9.0, len(q))[:, None], q)[0]
    found = kin.forward(q)
    assert np.abs(np.hstack(found) - np.hstack([tip, axis])).max() < 1e-9
    calm = q[:40]
    assert np.abs(kin.jacobian(calm) - by_samples.rates(kin.forward, calm, kin.rotary)).max() < 1e-6


@pytest.mark.parametrize("name", ["head", *OTHERS])
def test_what_follows_is_the_closed_form_of_three_hinges(name: str) -> None:
    """Lee and Shah (1988), hinges at 0, 120 and 240 degrees round a platform of radius r: R_12 = R_21, y = -r R_21,
    x = r (R_11 - R_22) / 2, whatever drives the legs."""
    kin, radius = platform(name), 250.0
    q = kin.inverse(*asked(kin, 200, 1))[0]
    place, turn = kin._platform(q)
    aside = np.column_stack([0.5 * radius * (turn[:, 0, 0] - turn[:, 1, 1]), -radius * turn[:, 1, 0]])
    assert np.abs(turn[:, 0, 1] - turn[:, 1, 0]).max() < 1e-12
    assert np.abs(place[:, :2] - aside).max() < 1e-9 and np.abs(aside).max() > 10.0


@pytest.mark.parametrize("name", ["head", *OTHERS])
def test_the_bound_of_the_third_derivative_holds_along_moves(name: str) -> None:
    """Against differences of the exact motion at 200 places of each move, and within a factor of it that is of use."""
    kin = platform(name)
    q0 = kin.inverse(*asked(kin, 12, 2))[0]
    step = np.where(kin.rotary, 0.01, 4.0) * np.random.default_rng(3).normal(size=q0.shape)
    tip, axis = kin.jets(q0, q0 + step)
    h = 0.02
    for jet, which in ((tip, 0), (axis, 1)):
        at = [np.stack([kin.forward(q0 + (t + k * h) * step)[which] for k in (-2, -1, 1, 2)]) for t in
              np.linspace(0.05, 0.95, 8)]
        third = np.max([np.linalg.norm(0.5 * p[3] - p[2] + p[1] - 0.5 * p[0], axis=1) / h**3 for p in at], axis=0)
        assert (third <= jet.third * (1.0 + 1e-3) + 1e-6).all() and (jet.third < 1e4 * np.maximum(third, 1e-3)).all()


def test_ends_on_rings_go_round_no_faster_than_their_bounds() -> None:
    """k of `ring_ends.py` and what its derivatives add to the loops, by differences of the ends seen from the platform."""
    kin = machines.load("linuxcnc-pentapod").kinematics.with_tool(80.0)
    assert isinstance(kin, OnLegs)
    q0 = kin.inverse(*asked(kin, 20, 5))[0]
    step, h = 0.5 * np.random.default_rng(6).normal(size=q0.shape), 0.02

    def at(t: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Place, turn, rods, and the rate of their ends seen from the platform, turned with it."""
        poses = [kin._platform(q0 + (t + k * h) * step) for k in (-1.0, 0.0, 1.0)]
        before, _, after = ((kin.loops.ends(place, turn) - place[:, None]) @ turn for place, turn in poses)
        place, turn = poses[1]
        return (place, turn, kin.loops.ends(place, turn) - kin.legs.feet(q0 + t * step),
                (after - before) @ np.swapaxes(turn, 1, 2) / (2.0 * h))

    middle = at(0.5)
    jets = MovingLoops(kin.loops, *middle[:2], q0 + 0.5 * step, step).jets()
    assert kin.loops.rings is not None
    away = kin.legs.points - middle[0][:, None]
    rings = EndsOnRings(kin.loops.rings, away, middle[1][:, :, 2], kin.loops.arms(middle[1]))
    assert np.abs(rings.moved(jets.first) - middle[3]).max() < 1e-4 * np.abs(middle[3]).max()
    lever, longest = kin.loops.lever, lengths(away) + 12.0
    good = jets.third < 1e4
    most = rings.at_most(jets.first, jets.spin, longest, jets.bend * lever, lever)
    for t in np.linspace(0.1, 0.9, 5):
        (_, r0, _, k0), (_, r1, rods, k1), (_, r2, _, k2) = (at(t + x * h) for x in (-1.0, 0.0, 1.0))
        first, second = (k2 - k0) / (2.0 * h), (k2 - 2.0 * k1 + k0) / h**2
        w, w1 = _spin((r2 - r0) / (2.0 * h), r1), _spin((r2 - 2.0 * r1 + r0) / h**2, r1)
        adds = np.cross(2.0 * w1, k1) + np.cross(w, np.cross(w, k1)) + np.cross(w, first) + second
        for seen, bound, near in ((lengths(k1), most.moved, 0.9), (lengths(np.cross(w, k1) + first), most.bent, 0.3),
                                  (np.abs((rods * adds).sum(axis=2)) / lengths(rods), most.third, 0.1)):
            assert (seen <= bound * 1.001 + 1e-6)[good].all() and (seen / bound)[good].max() > near


def _spin(rate: Floats, turn: Floats) -> Floats:
    """(N, 1, 3): the skew part of rate R^T, of R' the turn's w, of R'' its w'."""
    skew = rate @ np.swapaxes(turn, 1, 2)
    return 0.5 * np.stack([skew[:, 2, 1] - skew[:, 1, 2], skew[:, 0, 2] - skew[:, 2, 0], skew[:, 1, 0] - skew[:, 0, 1]],
                          axis=1)[:, None]


@pytest.mark.parametrize(("old", "new", "code", "words"), [
    ("hinged = true\n", "", "machine.geometry", "is none of"),
    ('freedoms = ["z", "a", "b"]', 'freedoms = ["x", "y", "z", "a", "b", "c"]', "machine.geometry", "z a b"),
    ('freedoms = ["z", "a", "b"]', 'freedoms = ["x", "y", "z"]', "machine.geometry", "wrist"),
    ("[kinematics.carriers.Y]\ndirection = [0, 1, 0]\n", "", "machine.geometry", "1 carriers"),
    ("direction = [0, 1, 0]", "direction = [1, 0, 0]", "machine.geometry", "carriers X, Y"),
    ("hinged = true", "lean = 20\nhinged = true", "", ""),
    ("[kinematics.carriers.X]", "[kinematics.passive.M]\npoint = [0, 0, 500]\nhinge = [0, 0, 1]\n\n[kinematics.carriers.X]",
     "machine.geometry", "not square"),
    ("[kinematics.carriers.X]", "[kinematics.passive.M]\npoint = [0, 0, 500]\nhinge = [1, 0, 0]\n\n[kinematics.carriers.X]",
     "machine.geometry", "take 6 of six"),
    ("[kinematics.carriers.X]", '[kinematics.legs.Z]\ndrive = "slide"\npoint = [350, 0, 0]\njoint = [250, 0, 0]\nrod = 700\n'
     "hinge = [0, 0, 1]\n\n[kinematics.carriers.X]", "machine.geometry", "leaves the plane"),
    ("[kinematics.carriers.X]", '[kinematics.legs.Z]\ndrive = "slide"\npoint = [350, 0, 0]\njoint = [250, 0, 0]\nrod = 700\n'
     "hinge = [0.6, 0.8, 0]\n\n[kinematics.carriers.X]", "", ""),
])
def test_what_does_not_go_together_is_refused(old: str, new: str, code: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(HEAD.replace(old, new))
    machine, found = load_checked(tmp_path / "own.toml")
    assert (machine is None) == bool(code) and all(d.hint for d in found if d.code == code)
    assert not code or any(d.code == code and words in d.message + d.hint for d in found), [str(d) for d in found]
