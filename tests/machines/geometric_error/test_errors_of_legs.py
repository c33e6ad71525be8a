"""Platforms on any legs with dimensional errors: exact closure, first order, correction, bounds, files and their faults."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import machines
from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.leg_frame import frame_of
from machines.geometric_error.actual.leg_rates import legs_motion
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.files.loader import load, load_checked
from machines.kinematics.legs.on_legs import OnLegs
from tests.machines.error_models import ARCSEC, joints, rod_errors
from tests.machines.geometric_error.test_geometric_error_rates import BOUND, worst_share
from tests.machines.kinematics.test_legs import ARMS
from toolpaths.arrays import Floats

NAMES = ("hexapod", "hexaslide-cone", "planar-delta-z", "arms", "tripod-head", "h4-rotary")
TOOL = 70.0


@cache
def kinematics(name: str) -> OnLegs:
    if name != "arms":
        found = machines.load(name).kinematics
    else:
        with TemporaryDirectory() as folder:
            (Path(folder) / "arms.toml").write_text(ARMS)
            found = machines.load(Path(folder) / "arms.toml").kinematics
    assert isinstance(found, OnLegs)
    return found.with_tool(TOOL)


def model(name: str, seed: int = 0) -> ErrorModel:
    """Every dimension, the spindle, and the carrier of a machine that has one."""
    carrier = {"EA0Z": 4.0 * ARCSEC, "EZ0Z": 0.01} if name == "planar-delta-z" else {}
    return ErrorModel(SerialErrors(constants={"EA0S": 4.0 * ARCSEC, "EX0S": 0.02, **carrier}),
                      rod_errors(kinematics(name), seed))


def places(name: str, n: int) -> tuple[ErrorModel, Actual, Floats]:
    found = model(name, 4)
    actual = found.on(kinematics(name))
    return found, actual, actual.coordinates(joints(kinematics(name), n))


@pytest.mark.parametrize("name", NAMES)
def test_the_sensitivity_is_the_derivative_of_the_exact_closure(name: str) -> None:
    """E-15 and E-16 for every drive, every parameter against differences, tip and tool axis."""
    found, _, w = places(name, 3)
    kin, axis = kinematics(name), found.zero().on(kinematics(name)).aim(w)[1]
    rates = found.on(kin).sensitivity(w)
    assert rates.shape[2] == len(found.names)
    for k, label in enumerate(found.names):
        step = 2e-6 if angular(label, found.rods) else 1e-3
        up, down = (found.with_values(sign * step * np.eye(len(found.names))[k]).on(kin).aim(w) for sign in (1.0, -1.0))
        size, turns = np.abs(rates[:, :, k]).max(), np.cross(rates[:, 3:, k], axis)
        assert (up[0] - down[0]) / (2.0 * step) == pytest.approx(rates[:, :3, k], abs=1e-5 * size + 1e-10 / step), label
        assert (up[1] - down[1]) / (2.0 * step) == pytest.approx(turns, abs=1e-5 * size + 1e-12 / step), label


@pytest.mark.parametrize("name", NAMES)
def test_no_errors_are_the_nominal_machine_and_the_rest_is_of_second_order(name: str) -> None:
    found, _, w = places(name, 60)
    kin = kinematics(name)
    tip, axis = found.zero().on(kin).aim(w)
    nominal = kin.forward(joints(kin, 60))
    assert np.array_equal(tip, w[:, :3]) and np.abs(np.hstack(nominal) - np.hstack([tip, axis])).max() < 1e-9
    left = []
    for size in (0.2, 0.1):
        actual = found.with_values(size * found.values).on(kin)
        left.append(np.abs(actual.aim(w)[0] - tip - actual.deviation(w, size * found.values)[:, :3]).max())
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.05) and left[0] < 1e-2


@pytest.mark.parametrize("name", NAMES)
def test_the_tool_goes_where_it_should(name: str) -> None:
    """The tip in full, the axis where the platform turns it."""
    _, actual, w = places(name, 60)
    kin = kinematics(name)
    turns = actual.turns == 2
    w = w[kin.workspace.tilt[1] - np.hypot(*w[:, 3:5].T) > 1e-3] if turns else w
    tip, axis = kin.forward(actual.joints(w))
    found = correct(actual, actual.joints(w), tip, axis)
    assert found.tip_before.min() > 1e-3 and found.tip_after.max() < 1e-7
    assert (found.axis_after.max() < 1e-9) == turns
    back = actual.aim(actual.coordinates(found.q))
    assert np.abs(back[0] - tip).max() < 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_a_second_solution_of_the_loops_agrees(name: str) -> None:
    """scipy on the stretches of the rods, their ends written out drive by drive; more rods than freedoms share them."""
    kin, errors = kinematics(name), rod_errors(kinematics(name), 2)
    frame = frame_of(kin)
    assert frame is not None
    actual, q = ErrorModel(rods=errors).on(kin), joints(kin, 3, 2)
    found = actual.place(actual.coordinates(q))
    free = [i for i, n in enumerate("xyzabc") if n in frame.freedoms]
    swings = len(kin.loops.bar_names) if frame.on_bars else 0
    for row, tip, axis, side in zip(q, *found, strict=True):
        nominal = kin.pose(row[None])
        turn = kin._platform(row[None])[1][0]
        shift = row[kin.carriers_at] @ kin.carriers
        place = nominal[0][0] + TOOL * turn[:, 2] - turn @ kin.gauge - shift
        ends = [_rod(kin, errors, r, row[kin.legs_at]) for r in range(len(frame.leg))]
        level = Rotation.from_matrix(turn).as_rotvec()[2]

        def stretches(x: Floats, place: Floats = place, turn: Floats = turn, ends: list = ends,
                      level: float = level) -> Floats:
            six = np.zeros(6)
            six[free] = x[:len(free)]
            spun = Rotation.from_rotvec(six[3:] * 1e-2).as_matrix() @ turn
            moved = place + six[:3]
            rods = [moved + spun @ (b if swings == 0 else _on_bar(kin, errors, r, b, x[len(free):] * 1e-2 - level)) - a
                    for r, (a, b, _) in enumerate(ends)]
            gaps = [(np.sum(rod**2) / length - length) / 2.0 for rod, (_, _, length) in zip(rods, ends, strict=True)]
            return np.array([*gaps, *_hinges(kin, errors, rods)])

        x = np.zeros(6)
        x[free] = least_squares(stretches, np.zeros(len(free) + swings), method="lm", jac="3-point", xtol=1e-15, ftol=1e-15,
                                gtol=1e-15).x[:len(free)]
        spun = Rotation.from_rotvec(x[3:] * 1e-2).as_matrix() @ turn
        assert tip == pytest.approx(place + x[:3] + shift + spun @ (kin.gauge - [0.0, 0.0, TOOL]), abs=2e-7)
        assert np.abs(np.stack([side, axis]) - spun.T[[0, 2]]).max() < 1e-8


def _hinges(kin: OnLegs, errors, rods: list[Floats]) -> list[float]:
    """mm by which rods leave the planes of their hinges, which stand on their guides."""
    found = []
    for k, hinge in zip(kin.loops.hinged, () if kin.loops.holds is None else kin.loops.holds.normals, strict=True):
        turns = [Rotation.from_euler("XYZ", angles).as_matrix() for angles in (
            errors.guide[k], errors.bearing(f"{errors.legs[k]}.hinge_turn"))]
        found.append(float(turns[0] @ turns[1] @ hinge @ rods[k]))
    return found


def _on_bar(kin: OnLegs, errors, r: int, end: Floats, swings: Floats) -> Floats:
    """The joint of rod r from the reference point, in directions of the platform; `end` without hinge and swing."""
    assert kin.clearance is not None and kin.loops.kept is not None
    leg = kin.clearance.leg[r]
    name = f"bars.{kin.loops.bar_names[kin.loops.bars[leg]]}"
    tilt = Rotation.from_euler("XYZ", errors.bearing(f"{name}.hinge_turn")).as_matrix()
    swing = Rotation.from_rotvec([0.0, 0.0, swings[kin.loops.bars[leg]]]).as_matrix()
    hinge = kin.loops.joints[leg] + errors.bearing(f"{name}.hinge")
    return hinge + tilt @ swing @ (kin.loops.kept[leg] + end - kin.loops.joints[leg])


def _rod(kin: OnLegs, errors, r: int, q: Floats) -> tuple[Floats, Floats, float]:
    """(foot, platform joint, length) of rod r with its errors."""
    sizes, drives = kin.clearance, kin.legs
    assert sizes is not None
    k, s = sizes.leg[r], sizes.shift[r]
    turn, u = Rotation.from_euler("XYZ", errors.guide[k]).as_matrix(), drives.directions[k]
    x = drives.arms[k] if drives.arm[k] else kin.workspace.middle - drives.points[k]
    x = x - (x @ u) * u
    x = x / np.linalg.norm(x)
    own, stands = np.column_stack([x, np.cross(u, x), u]) @ errors.carriage[r], q[k] + errors.drive[k]
    foot, length = drives.points[k] + errors.rail[k] + turn @ s, drives.lengths[k] + errors.length[r]
    if drives.slide[k]:
        foot = foot + stands * turn @ u + own
    elif drives.arm[k]:
        foot = foot + Rotation.from_rotvec(stands * turn @ u).as_matrix() @ (turn @ drives.arms[k] + own)
    else:
        foot, length = foot + errors.carriage[r], length + stands
    return foot, kin.loops.joints[k] + s + errors.platform[r], length


@pytest.mark.parametrize("name", ["hexapod", "hexaslide-cone", "arms", "tripod-head", "linuxcnc-pentapod", "h4-rotary"])
def test_no_error_changes_faster_than_its_bound(name: str) -> None:
    kin = kinematics(name)
    sizes = {"h4-rotary": (1e-4, 1e-3, 2e-2), "linuxcnc-pentapod": (1e-3, 3e-2)}.get(name, (1e-3, 0.3))
    assert 0.02 < worst_share(kin, model(name, 3), sizes) <= BOUND


@pytest.mark.parametrize("name", ["hexapod", "hexaslide-cone", "arms", "tripod-head"])
def test_no_motion_of_the_platform_changes_by_more_than_its_bound(name: str) -> None:
    """d(place, turn)/dq at places in reach, one drive alone and all: arms bend it, legs of changing length stretch it."""
    kin, frame = kinematics(name), frame_of(kinematics(name))
    assert frame is not None
    q, loops, worst = joints(kin, 20, 5), frame.loops(frame.zero), 0.0
    alone = np.eye(q.shape[1])[np.arange(20) % q.shape[1]]
    for size in (0.002 * alone, np.full(q.shape, 0.0005)) if name == "arms" else (1.0 * alone, np.full(q.shape, 0.3)):
        near, far = (legs_motion(loops, frame.leg, x, kin._platform(x), size) for x in (q, q + size))
        moved = np.hypot(np.linalg.norm(far.shift - near.shift, axis=1),
                         loops.lever * np.linalg.norm(far.turn - near.turn, axis=1))
        assert (near.shift_change < 1e3).all()
        worst = max(worst, float((moved / (near.shift_change + 1e-12)).max()))
    assert 0.1 < worst <= 1.0


@pytest.mark.parametrize("name", [*NAMES[:3], "tripod-head", "h4-rotary"])
def test_a_file_says_it_all(name: str, tmp_path: Path) -> None:
    """Written and read again: rods, drives (an arm's in arcsec, others' in um), carriers."""
    found = model(name, 6)
    if name == "hexapod":  # no guides
        assert found.rods is not None
        found = replace(found, rods=replace(found.rods, guide=0.0 * found.rods.guide))
    found = replace(found, name=name, machine=name)
    save(found, tmp_path, "")
    again = load(tmp_path / f"{name}.toml", machines.load(name))
    assert again.names == found.names and again.values == pytest.approx(found.values, rel=1e-10)


@pytest.mark.parametrize(("name", "text", "code", "words"), [
    ("hexapod", "[legs.X]\nguide = [1, 0, 0]\n", "error-model.legs", "changes its length"),
    ("hexapod", "[legs.Q]\nrail = [1, 0, 0]\n", "error-model.legs", "no leg 'Q'"),
    ("hexapod", "[legs.X]\npair = 10\n", "error-model.legs", "says where its rods are"),
    ("hexapod", "[legs.X]\nlength = [1, 2]\n", "error-model.legs", "2 entries for 1 rods"),
    ("hexapod", "[location]\nEA0X = 1\n", "error-model.axis", "X moves a leg of hexapod"),
    ("uranesx", "[legs.X]\ndrive = 1\n", "error-model.legs", "third number"),
    ("planar-delta-z", "[legs.A]\ndrive = 3000\n", "error-model.large", "A.drive is up to 0.8333 degrees"),
    ("hexapod", "[legs.X]\nring = 3\n", "error-model.legs", "take ring out"),
    ("tripod-head", "[legs.Z]\nring = 3\n", "error-model.legs", "it has Z.hinge_turn, V.hinge_turn, W.hinge_turn"),
    ("h4-rotary", "[bars.side]\nhinge = [1, 0, 0]\n", "error-model.legs", "it has bars.front.hinge"),
    ("uranesx", "[passive.P]\nsquare = 4\n", "error-model.legs", "uranesx has no passive"),
    ("planar-delta-z", "[location]\nEX0Z = 1\n", "error-model.no-effect", "moves nothing")])
def test_what_cannot_be_is_refused(name: str, text: str, code: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text(text)
    found, faults = load_checked(tmp_path / "e.toml", machines.load(name))
    assert found is None and [d.code for d in faults] == [code] and words in f"{faults[0]} {faults[0].hint}"
