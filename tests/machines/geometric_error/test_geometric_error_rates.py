"""Errors of a machine never change faster than the bound says: every kind of curve, map and axis, single errors reach it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.error_rates import pivot_rates, standing_arm
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.exchange.bed_frame import RotatedCurve
from machines.geometric_error.tables.curves import Curve, Fourier, Polynomial, TableCurve
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.names import parse
from machines.kinematics.base import Kinematics
from machines.kinematics.serial import Serial
from tests.machines.error_models import joints, model, rod_errors, serial_errors
from tests.machines.geometric_error.test_geometric_error_serial import NAMES, kinematics
from toolpaths.arrays import Floats

RNG = np.random.default_rng(5)
STEPS = 40
BOUND = 1.0 + 1e-9
REACH = {False: (-900.0, 900.0), True: (-2.5, 2.5)}
"""mm; rad"""
CURVES: dict[str, Curve] = {
    "linear": TableCurve(np.array([-3.0, -1.0, 0.5, 4.0]), RNG.normal(size=4)),
    "linear, two approach directions": TableCurve(np.array([-3.0, -1.0, 0.5, 4.0]), RNG.normal(size=8), both=True),
    "spline": TableCurve(np.linspace(-3.0, 4.0, 7), RNG.normal(size=7), rule="spline"),
    "spline, two approach directions": TableCurve(np.linspace(-3.0, 4.0, 7), RNG.normal(size=14), rule="spline", both=True),
    "periodic": TableCurve(np.linspace(0.0, 5.0, 6), RNG.normal(size=6), period=6.0),
    "periodic spline": TableCurve(np.linspace(0.0, 5.0, 6), RNG.normal(size=6), rule="spline", period=6.0),
    "one row": TableCurve(np.array([1.0]), np.array([0.4])),
    "fourier": Fourier(RNG.normal(size=7), period=5.0, origin=1.0),
    "polynomial": Polynomial(RNG.normal(size=5), (-3.0, 4.0), origin=0.5, scale=2.0)}
CURVES["turned"] = RotatedCurve((((0, 0), Component(parse("EXC"), CURVES["linear"])),
                                 ((0, 1), Component(parse("EYC"), CURVES["fourier"]))),
                                np.array([0.0, 0.6, 0.8]), back=True)


@pytest.mark.parametrize("kind", CURVES)
def test_sizes_and_slopes_of_curves_are_bounds_and_near(kind: str) -> None:
    curve, x = CURVES[kind], np.linspace(-6.0, 9.0, 150_001)
    for approach in (-1.0, 0.3, 1.0):
        values = curve.at(x, approach)
        slope = np.abs(np.diff(values) / np.diff(x)).max()
        assert np.abs(values).max() <= curve.most * (1.0 + 1e-12)
        assert slope <= curve.steepest * (1.0 + 1e-6)
    forward, backward = curve.at(x, 1.0), curve.at(x, -1.0)
    assert np.abs(forward - backward).max() <= curve.apart * (1.0 + 1e-12)
    assert (curve.apart > 0.0) == ("two approach directions" in kind)
    assert curve.steepest <= 3.0 * max(np.abs(np.diff(curve.at(x, approach)) / np.diff(x)).max()
                                       for approach in (-1.0, 1.0)) + 1e-12
    if kind == "turned":
        return
    with_more = curve.with_values(2.0 * curve.values)
    assert with_more.most == pytest.approx(2.0 * curve.most) and with_more.steepest == pytest.approx(2.0 * curve.steepest)


def with_two_directions(kin: Kinematics, letters: Sequence[str] = ()) -> SerialErrors:
    """Tables of two approach directions for two components of each axis, or of some."""
    found = []
    for j, letter in enumerate(kin.axis_names):
        if letters and letter not in letters:
            continue
        x = np.linspace(-7.0, 7.0, 9) if kin.rotary[j] else np.linspace(-600.0, 600.0, 9)
        for text in (f"E{letter}{letter}", f"E{'B' if letter != 'B' else 'C'}{letter}"):
            name = parse(text)
            assert name is not None
            size = 2e-5 if name.angular else 8e-3
            found.append(Component(name, TableCurve(x, size * RNG.normal(size=18), both=True)))
    return SerialErrors(tuple(found))


def worst_share(kin: Kinematics, model: ErrorModel, sizes: Sequence[float] = (1e-3, 1.0, 30.0)) -> float:
    """The largest difference by its bound, along straight steps of random length from random poses, with
    approach directions that change; infinite where there is no bound."""
    actual, q, worst = model.on(kin), joints(kin, STEPS, 7), 0.0
    rng, rotary = np.random.default_rng(9), np.array(kin.rotary)
    for size in sizes:
        step = rng.normal(size=q.shape) * np.where(rotary, 0.01, 1.0) * size
        step *= rng.random(q.shape) < 0.5  # also single axes
        approach, turned = rng.uniform(-1.0, 1.0, q.shape), rng.uniform(-1.0, 1.0, q.shape)
        rates = actual.error_rates(q, np.abs(step))
        if rates is None or (rates.tip >= 1e3).any():
            return float("inf")
        here, there = ([v - n for v, n in zip(actual.aim(actual.coordinates(x), w), kin.forward(x), strict=True)]
                       for x, w in ((q, approach), (q + step, turned)))
        for k, (rate, by_approach) in enumerate(((rates.tip, rates.tip_reversal), (rates.axis, rates.axis_reversal))):
            moved = np.linalg.norm(there[k] - here[k], axis=1)
            allowed = (rate * np.abs(step)).sum(axis=1) + (by_approach * np.abs(turned - approach)).sum(axis=1)
            worst = float(np.maximum(worst, (moved / (allowed + 1e-12)).max()))
    return worst


@pytest.mark.parametrize("name", NAMES)
def test_no_error_of_a_serial_machine_changes_faster(name: str) -> None:
    kin = kinematics(name)
    assert worst_share(kin, ErrorModel(serial_errors(kin, 3))) <= BOUND
    assert worst_share(kin, ErrorModel(with_two_directions(kin))) <= BOUND
    moving = dict.fromkeys("ABC", "moving")
    assert worst_share(kin, ErrorModel(replace(serial_errors(kin, 4), frame=moving))) <= BOUND


@pytest.mark.parametrize("name", ["uranesx", "h4a-c-table", "h4a-spindle-axis"])
def test_no_error_of_a_machine_on_rods_changes_faster(name: str) -> None:
    """Every dimension wrong, the rotary axis and the spindle too; two approach directions in the rotary axis's tables."""
    kin = machines.load(name).kinematics.with_tool(87.0)
    both = model(kin, 3)
    assert worst_share(kin, both, (1e-3, 0.1, 0.7)) <= BOUND
    assert worst_share(kin, replace(both, axes=SerialErrors()), (1e-3, 0.7)) <= BOUND
    if any(kin.rotary):
        assert worst_share(kin, replace(both, axes=with_two_directions(kin, kin.axis_names[4:])), (1e-3, 0.3)) <= BOUND
        moving = replace(both.axes, frame=dict.fromkeys("ABC", "moving"))
        assert worst_share(kin, replace(both, axes=moving), (0.3,)) <= BOUND


@pytest.mark.parametrize("name", ["uranesx", "h4a-c-table", "h4a-spindle-axis"])
def test_a_machine_on_rods_reaches_its_bound(name: str) -> None:
    """For short approach directions the bound is the rate itself."""
    kin = machines.load(name).kinematics
    actual, q = ErrorModel(rods=rod_errors(kin, 5)).on(kin), joints(kin, 60, 3)
    step = np.where(np.array(kin.rotary), 0.0, 1e-4) * np.random.default_rng(1).normal(size=q.shape)
    rates = actual.error_rates(q, np.abs(step))
    assert rates is not None
    near = kin.forward(q)[0]
    off = [actual.aim(actual.coordinates(x))[0] - kin.forward(x)[0] for x in (q, q + step)]
    assert np.abs(near).max() < 1e4
    reached = np.linalg.norm(off[1] - off[0], axis=1) / (rates.tip * np.abs(step)).sum(axis=1)
    assert 0.3 < reached.max() <= 1.0 + 1e-6


@pytest.mark.covering
@pytest.mark.parametrize("name", ["h4a-c-table", "h4a-spindle-axis"])
@pytest.mark.parametrize("constant", ["EB0S", "EA0S", "EX0S"])
def test_rates_hold_at_every_place_within_reach(name: str, constant: str) -> None:
    """Not only in the middle: far along a turn of the rotary axis a slide moves the tool's errors as the bound allows."""
    kin = machines.load(name).kinematics.with_tool(87.0)
    actual = ErrorModel(SerialErrors(constants={constant: 0.05 if constant != "EX0S" else 0.3})).on(kin)
    q = joints(kin, 20, 4)
    q[:, 4] = 1e-3
    reach = np.array([1e-6] * 4 + [0.5])
    rates = actual.error_rates(q, np.broadcast_to(reach, q.shape))
    assert rates is not None
    for turn in (-0.495, 0.495):
        there = q + np.array([0.0, 0.0, 0.0, 0.0, turn])
        for j in range(4):
            step = np.zeros(5)
            step[j] = 1e-3
            off = [[v - n for v, n in zip(actual.aim(actual.coordinates(x)), kin.forward(x), strict=True)]
                   for x in (there - step, there + step)]
            for k, rate in enumerate((rates.tip, rates.axis)):
                slope = np.linalg.norm(off[1][k] - off[0][k], axis=1) / 2e-3
                assert (slope <= rate[:, j] * (1.0 + 1e-6) + 2e-9).all(), (j, k, float((slope / rate[:, j]).max()))


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "nutating-head", "mill-3axis"])
def test_no_error_of_a_map_changes_faster(name: str) -> None:
    kin = kinematics(name)
    rng, slide = np.random.default_rng(2), np.linspace(-700.0, 700.0, 4)
    bed = tuple(joint.name for joint in kin.chain if joint.rotary)[:1]
    for letters, nodes, how in ((("X", "Y", "Z"), (slide,) * 3, {"bed": bed}), (("x", "z"), (slide,) * 2, {"length": 30.0}),
                                (("X", *bed), (slide, np.linspace(0.0, 5.0, 6))[: 1 + len(bed)],
                                 {"periods": (0.0, 2.0 * np.pi)[: 1 + len(bed)]})):
        table = rng.normal(size=(*map(len, nodes), 6)) * [0.03, 0.03, 0.03, 3e-5, 3e-5, 3e-5]
        assert worst_share(kin, ErrorModel(map=ErrorMap(letters, nodes, table, **how))) <= BOUND


@pytest.mark.parametrize(("text", "letter", "turning"),
                         [("EXX", "X", False), ("EBX", "X", True), ("EAC", "C", True)])
def test_a_single_error_reaches_its_bound(text: str, letter: str, turning: bool) -> None:
    """Nothing else moves the tip: the bound is the slope itself, times the arm where it turns."""
    kin = kinematics("mikron-ucp710")
    name, j = parse(text), kin.axis_names.index(letter)
    assert name is not None
    slope, turns = 1e-6 if turning else 4e-5, letter == "C"
    model = ErrorModel(SerialErrors((Component(name, Polynomial(np.array([0.0, slope]), REACH[turns])),)))
    actual, q = model.on(kin), joints(kin, 60, 3)
    rates = actual.error_rates(q, np.zeros(q.shape))
    assert rates is not None
    step = np.zeros(q.shape)
    step[:, j] = 1e-3
    off = [actual.aim(x)[0] - kin.forward(x)[0] for x in (q, q + step)]
    reached = np.linalg.norm(off[1] - off[0], axis=1) / 1e-3
    assert 0.3 < (reached / rates.tip[:, j]).max() <= 1.0 + 1e-6


def test_errors_that_are_too_large_have_no_bound() -> None:
    kin = kinematics("mikron-ucp710")
    large = ErrorModel(SerialErrors(constants={"EB0C": 0.2}))
    assert large.on(kin).error_rates(joints(kin, 3, 1), np.zeros((3, 5))) is None


@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "fork-head-ab", "head-table", "nutating-head"])
def test_other_pivots_of_the_control_change_the_tip_no_faster(name: str) -> None:
    kin, q = kinematics(name), joints(kinematics(name), 200, 6)
    rng, rotary = np.random.default_rng(3), np.array(kin.rotary)
    chain = tuple(replace(j, point=j.point + 0.01 * rng.normal(size=3)) if j.rotary else j for j in kin.chain)
    other = replace(kin, chain=chain, tool_length=kin.tool_length + 0.02)
    step = rng.normal(size=q.shape) * np.where(rotary, 0.05, 20.0)
    off = [kin.forward(x)[0] - other.forward(x)[0] for x in (q, q + step)]
    moved = np.linalg.norm(off[1] - off[0], axis=1)
    allowed = (pivot_rates(kin, other, q).tip * np.abs(step)).sum(axis=1)
    assert (moved <= allowed).all() and (moved / allowed).max() > 0.2


@pytest.mark.parametrize("name", NAMES)
def test_no_turning_axis_is_farther_from_a_standing_tip_than_the_arm(name: str) -> None:
    """The tip held on the part while rotary axes turn: their speed times the arm is what the slides go at most."""
    kin, q = kinematics(name), joints(kinematics(name), 60, 8)
    rotary = np.array(kin.rotary)
    tip, _ = kin.forward(q)
    arm, turn = standing_arm(kin, q), np.where(rotary, 1e-5, 0.0)
    for far in (0.0, 0.7):
        there = np.where(rotary, q + far, q)
        there[:, ~rotary] += slides_to(kin, there, tip)
        after = there + turn
        after[:, ~rotary] += slides_to(kin, after, tip)
        went = np.linalg.norm((after - there)[:, ~rotary], axis=1)
        assert (went <= arm * turn.sum() * (1.0 + 1e-3) + 1e-9).all()


def slides_to(kin: Serial, q: Floats, tip: Floats) -> Floats:
    """What the slides (N, 3) must add at q to bring the tip to where it was."""
    rates = kin.jacobian(q)[:, :3][:, :, ~np.array(kin.rotary)]
    return np.asarray(np.linalg.solve(rates, (tip - kin.forward(q)[0])[:, :, None])[:, :, 0])
