"""Machines on rods with dimensional errors: sensitivity matrix, exact closure, second order, zero."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

import machines
from machines.geometric_error.actual import rods, rods_loop
from machines.geometric_error.actual.actual_rods import ActualDelta, ActualTilting
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, RodFrame, rod_frame
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load, load_checked
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from tests.machines.error_models import joints, model, rod_errors
from tests.machines.random_slides import random_slides
from toolpaths.arrays import Floats

NAMES = ("uranesx", "h4a-c-table", "h4a-spindle-axis")
TOOL = 70.0


def kinematics(name: str) -> OnLegs | LegsWithAxis:
    found = machines.load(name).kinematics.with_tool(TOOL)
    assert isinstance(found, OnLegs | LegsWithAxis)
    return found


def platform(kin: OnLegs | LegsWithAxis, n: int) -> tuple[Floats, Floats, Floats]:
    """(slides, place, turn) of random nominal platforms."""
    rng = np.random.default_rng(1)
    place, tilt = kin.workspace.random(rng, n)
    if isinstance(kin, OnLegs):
        return kin.legs.solve(place[:, None, :] + kin.loops.joints, kin.legs.roots), place, np.tile(np.eye(3), (n, 1, 1))
    return kin.platform.inverse(np.column_stack([place, tilt])), place, kin.platform.turn(tilt)


def closure(frame: RodFrame, slides: Floats, place: Floats, turned: Floats, errors: RodErrors) -> Floats:
    """(N, 6) half (|AB|^2 - (L + dl)^2), E-9, written out rod by rod."""
    rows = []
    for r, leg in enumerate(frame.leg):
        spun = Rotation.from_euler("XYZ", errors.guide[leg]).as_matrix()
        a = frame.rail[leg] + errors.rail[leg] + (slides[:, leg, None] * frame.direction[leg] + frame.arm[r]) @ spun.T \
            + frame.guide[leg] @ errors.carriage[r]
        rod = place + turned @ (frame.joint[r] + errors.platform[r]) - a
        rows.append(0.5 * (np.sum(rod**2, axis=1) - (frame.length[r] + errors.length[r]) ** 2))
    return np.stack(rows, axis=1)


@pytest.mark.parametrize("name", NAMES)
def test_sensitivity_matrix_is_the_derivative_of_the_closure(name: str) -> None:
    """Acceptance 12: S of E-15 (60 parameters of a Delta, 66 of an H4) against finite differences."""
    kin = kinematics(name)
    frame, zero, (slides, place, turned) = rod_frame(kin.on_rods), rod_errors(kin).with_values, platform(kin, 20)
    count = len(rod_errors(kin).names)
    assert count == (60 if isinstance(kin, OnLegs) else 66)
    s, step = frame.sensitivity(slides, place, turned), 1e-3
    for k in range(count):
        unit = np.eye(count)[k] * step
        up, down = (closure(frame, slides, place, turned, zero(sign * unit)) for sign in (1.0, -1.0))
        size = np.abs(s[:, :, k]).max()
        assert -(up - down) / (2.0 * step) == pytest.approx(s[:, :, k], abs=1e-6 * size)


@pytest.mark.parametrize("name", NAMES)
def test_platform_moves_as_the_sensitivity_says(name: str) -> None:
    """T^-1 S against finite differences of the solved loop, every parameter, 1e-7 of the largest effect."""
    kin = kinematics(name)
    frame, (slides, place, turned) = rod_frame(kin.on_rods), platform(kin, 10)
    errors = rod_errors(kin)
    rates = frame.platform_sensitivity(slides, place, turned)
    for k, label in enumerate(errors.names):
        step = 2e-5 if ".guide." in label else 2e-2
        unit = np.eye(len(errors.names))[k] * step
        up, down = (frame.solve(slides, place, turned, errors.with_values(sign * unit)) for sign in (1.0, -1.0))
        size = np.abs(rates[:, :3, k]).max()
        assert (up[0] - down[0]) / (2.0 * step) == pytest.approx(rates[:, :3, k], abs=1e-7 * size), label
        twist = Rotation.from_matrix(up[1] @ np.swapaxes(down[1], 1, 2)).as_rotvec() / (2.0 * step)
        assert twist == pytest.approx(rates[:, 3:, k], abs=1e-7 * np.abs(rates[:, 3:, k]).max() + 1e-10), label


def test_first_columns_are_those_of_annex_e() -> None:
    """E-18: a displaced rail acts as AB on both rods of its leg and on no other; E-31: +L."""
    kin = kinematics("uranesx")
    frame, (slides, place, turned) = rod_frame(kin.on_rods), platform(kin, 3)
    s, rods = frame.sensitivity(slides, place, turned), place[:, None] + frame.joint - frame.carriage_joints(slides)
    assert s[:, :2, :3] == pytest.approx(rods[:, :2], abs=1e-12)
    assert np.abs(s[:, 2:, :3]).max() == 0.0
    assert s[:, :, 54:] == pytest.approx(np.broadcast_to(1300.0 * np.eye(6), (3, 6, 6)))
    cos, sin = np.cos(2.0 * np.pi / 3.0), np.sin(2.0 * np.pi / 3.0)  # E-24, leg 2 at 120 degrees, x and y of dA
    assert s[:, 2, 24] == pytest.approx(-rods[:, 2, 0] * cos - rods[:, 2, 1] * sin, abs=1e-9)
    assert s[:, 2, 25] == pytest.approx(rods[:, 2, 0] * sin - rods[:, 2, 1] * cos, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_a_second_solution_of_the_loop_agrees(name: str) -> None:
    """scipy's root on place and rotation vector, from the nominal platform."""
    kin = kinematics(name)
    frame, errors, (slides, place, turned) = rod_frame(kin.on_rods), rod_errors(kin, 2, 0.05), platform(kin, 6)
    found, spun = frame.solve(slides, place, turned, errors)
    for k in range(6):
        one = slice(k, k + 1)

        def gaps(x: Floats, one: slice = one) -> Floats:
            turn = Rotation.from_rotvec(x[3:]).as_matrix() @ turned[one]
            return closure(frame, slides[one], x[None, :3], turn, errors)[0]

        solved = root(gaps, np.append(place[k], [0.0, 0.0, 0.0]), tol=1e-13).x
        assert found[k] == pytest.approx(solved[:3], abs=1e-8)
        assert spun[k] == pytest.approx(Rotation.from_rotvec(solved[3:]).as_matrix() @ turned[k], abs=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_zero_is_exact_and_first_order_is_to_second_order(name: str) -> None:
    kin = kinematics(name)
    full = model(kin, 4)
    nominal = full.zero().on(kin)
    assert isinstance(nominal, ActualDelta | ActualTilting)
    w = nominal.coordinates(joints(kin, 100))
    tip, axis, _ = nominal.place(w)
    expected = (w, np.tile([0.0, 0.0, 1.0], (100, 1))) if isinstance(kin, OnLegs) else kin.place(w[:, :4], w[:, 4])[:2]
    assert np.array_equal(tip, expected[0]) and np.array_equal(axis, expected[1])
    left = []
    for size in (8.0, 4.0):
        actual = full.with_values(size * full.values).on(kin)
        moved, (t, a, _) = actual.deviation(w, size * full.values), actual.place(w)
        left.append([np.abs(t - tip - moved[:, :3]).max(), np.abs(a - axis - np.cross(moved[:, 3:], axis)).max()])
    assert np.array(left[0]) / left[1] == pytest.approx([4.0, 4.0], rel=0.02)
    assert left[1][0] < 2e-3


@pytest.mark.parametrize("name", ["h4a-c-table", "h4a-spindle-axis"])
def test_errors_of_the_rotary_axis_alone(name: str) -> None:
    """With perfect rods the H4 is a chain: its axis errors do what those of a serial machine do, at every tilt."""
    kin = kinematics(name)
    assert isinstance(kin, LegsWithAxis)
    axes = model(kin, 4).axes
    actual = ErrorModel(axes).on(kin)
    w = actual.coordinates(joints(kin, 50))
    tip, _, _ = actual.place(w)
    moved = actual.deviation(w, np.concatenate([np.zeros(66), axes.values]))
    assert tip - kin.place(w[:, :4], w[:, 4])[0] == pytest.approx(moved[:, :3], abs=2e-5)
    assert np.abs(tip - kin.place(w[:, :4], w[:, 4])[0]).max() > 0.01


@pytest.mark.parametrize("name", ["h4a-c-table", "h4a-spindle-axis"])
def test_the_zero_of_a_rotary_axis_counts_about_its_machine_axis(name: str) -> None:
    kin, step = kinematics(name), 1e-4
    assert isinstance(kin, LegsWithAxis)
    zero = SerialErrors(constants={f"E{kin.axis_names[4]}0{kin.axis_names[4]}": step})
    none = rod_errors(kin).with_values(np.zeros(len(rod_errors(kin).names)))
    actual = ErrorModel(zero, none).on(kin)
    w = actual.coordinates(joints(kin, 20))
    tip, axis, _ = actual.place(w)
    wanted = kin.place(w[:, :4], w[:, 4] + step * kin.axis.sense)
    assert tip == pytest.approx(wanted[0], abs=1e-8) and axis == pytest.approx(wanted[1], abs=1e-12)
    moved = actual.deviation(w, np.append(none.values, step))
    assert moved[:, :3] == pytest.approx(tip - kin.place(w[:, :4], w[:, 4])[0], abs=1e-5)


@pytest.mark.parametrize("name", ["uranesx", "h4a-c-table", "h4a-spindle-axis"])
def test_rates_are_derivatives_of_the_nominal_place(name: str) -> None:
    kin = kinematics(name)
    actual = model(kin).zero().on(kin)
    w = actual.coordinates(joints(kin, 20))
    rates = actual.rates(w)
    for k in range(w.shape[1]):
        step = 1e-5 * np.eye(w.shape[1])[k]
        up, down = (np.concatenate(actual.place(w + sign * step)[:2], axis=1) for sign in (1.0, -1.0))
        assert (up - down) / 2e-5 == pytest.approx(rates[:, :, k], abs=1e-6)


@pytest.mark.slow
@pytest.mark.numeric
@pytest.mark.parametrize("name", NAMES)
def test_the_compiled_closure_is_the_one_of_numpy(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kin = kinematics(name)
    frame, errors, (slides, place, turned) = rod_frame(kin.on_rods), rod_errors(kin, length=0.5), platform(kin, 50)
    place[3], slides[7] = np.nan, np.nan
    slides[9] += 5000.0
    found = []
    for compiled in (False, True):
        monkeypatch.setattr(rods, "wanted", lambda *_, use=compiled: use)
        before = place.copy(), turned.copy()
        found.append(frame.solve(slides, place, turned, errors))
        np.testing.assert_array_equal(before[0], place)
        np.testing.assert_array_equal(before[1], turned)
    good = np.isfinite(found[0][0]).all(axis=1)
    assert good.sum() == 47 and not good[[3, 7, 9]].any()
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=0.0, atol=1e-12)


def test_the_loop_as_it_stands_closes_the_rods() -> None:
    kin = kinematics("uranesx")
    frame, errors, (slides, place, turned) = rod_frame(kin.on_rods), rod_errors(kin), platform(kin, 3)
    base, along = (frame.carriage_joints(q, errors)[0] for q in (np.zeros((1, 3)), np.ones((1, 3))))
    off = rods_loop.close_all(slides, frame.leg, base, along - base, frame.joint + errors.platform,
                              (frame.length + errors.length) ** 2, place, turned, 12, 1e-13, 0.5)
    assert off.max() < 1e-12 and np.abs(closure(frame, slides, place, turned, errors)).max() < 1e-6


DELTAS = [name for name in machines.names() if (on := machines.load(name).kinematics.on_rods) and not on.platform_turns
          and not rods.gives_rods(on)]


def test_there_are_deltas_without_rods() -> None:
    assert len(DELTAS) >= 9


@pytest.mark.parametrize("name", DELTAS)
def test_deltas_without_rods_take_the_distance_of_their_pairs(name: str, tmp_path: Path) -> None:
    """Exact closure against the first order, and two rods of a pair that differ by dl tilt the platform by dl / distance."""
    machine = machines.load(name)
    legs = "".join(f"[legs.{leg}]\npair = 40\nlength = [10, {-10 if leg == 'X' else 10}]\n" for leg in machine.axis_names)
    (tmp_path / "e.toml").write_text(f"{legs}[location]\nEA0S = 3.0\n")
    found = load(tmp_path / "e.toml", machine)
    kin = machine.kinematics.with_tool(TOOL)
    assert isinstance(kin, OnLegs) and found.rods is not None and found.rods.pairs == (40.0, 40.0, 40.0)
    q = random_slides(kin, np.random.default_rng(5), 40)
    tip, axis = kin.forward(q)
    actual = found.on(kin)
    w = actual.coordinates(q)
    first, exact = actual.deviation(w, found.values), actual.place(w)[0] - tip
    assert np.abs(first[:, :3] - exact).max() < 1e-4 and np.linalg.norm(exact, axis=1).max() > 0.005
    turned = np.linalg.norm(first[:, 3:], axis=1)
    assert turned.min() > 0.9 * 0.01 / 40.0
    assert correct(actual, q, tip, axis).tip_after.max() < 1e-6
    text = save(replace(found, name="again"), tmp_path)[0]
    assert load(text, machine).rods.pairs == found.rods.pairs


def test_pairs_are_asked_for_where_they_are_missing_and_nowhere_else(tmp_path: Path) -> None:
    for machine, text, line in (("delta-star", "[legs.X]\nlength = [1, 2]\n[legs.Y]\npair = 40\n", 1),
                                ("uranesx", "[legs.X]\npair = 40\n", 2)):
        (tmp_path / "e.toml").write_text(text)
        found, faults = load_checked(tmp_path / "e.toml", machines.load(machine))
        assert found is None and [(d.code, d.lines) for d in faults] == [("error-model.legs", (line,))]


def test_a_delta_without_rods_takes_errors_of_its_spindle_alone(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("[location]\nEX0S = 12\n")
    machine = machines.load("linuxcnc-lineardelta")
    actual = load(tmp_path / "e.toml", machine).on(machine.kinematics)
    q = np.array([[470.0, 475.0, 480.0]])
    np.testing.assert_allclose(actual.place(actual.coordinates(q))[0] - machine.kinematics.forward(q)[0], [[0.012, 0, 0]],
                               atol=1e-12)
