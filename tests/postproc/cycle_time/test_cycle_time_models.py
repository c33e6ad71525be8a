"""Models of controls against closed forms, a second planner, and the laws that hold for all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, Trajectory

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.bound import lower_bound
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.linuxcnc import SETTLED
from postproc.cycle_time.linuxcnc_kernels import chain_ends, next_begins, speeds, timeline
from postproc.cycle_time.linuxcnc_segments import merge
from postproc.cycle_time.lookahead import rest_to_rest
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.report import as_dict, as_text
from postproc.cycle_time.shape import shape
from postproc.cycle_time.shares import most_expensive, operations, shares
from tests.linuxcnc import time_programs
from tests.postproc.time_kit import HEAD, blocks, machine, model, random_program
from toolpaths.compiled import compiled

KINDS = ("linuxcnc", "lookahead", "ideal")
CASES = [("mill-3axis", "", 300.0), ("mikron-ucp710", "AC", 150.0), ("mill-4axis", "A", 400.0)]


def programs(count: int) -> list[tuple[str, MotionBlocks]]:
    return [(name, blocks(random_program(seed, rotary, top), machine(name)))
            for seed in range(count) for name, rotary, top in CASES]


def test_one_line_under_linuxcnc_is_length_over_feed_and_a_ramp() -> None:
    b = blocks(f"{HEAD} G61.1\nF1000\nG1 X100")
    speed, rate = 1000 / 60, machine().limits.acceleration[0]
    assert total(b, timed(b, model("linuxcnc"))) == pytest.approx(100 / speed + speed / rate + SETTLED + 0.0005, abs=1e-9)


def test_stop_in_every_corner_adds_up() -> None:
    """G61.1: each of the lines by itself, half a servo cycle more for each stop."""
    text = "\n".join(f"G1 X{20 * (i % 2)} Y{2 * i}" for i in range(1, 31))
    b = blocks(f"{HEAD} G61.1\nF3000\n{text}")
    length = np.linalg.norm(np.diff(b.xyz, axis=0), axis=1)
    rate = (3000.0 / (np.abs(np.diff(b.xyz, axis=0)) / length[:, None]).max(axis=1))
    alone = length / 50.0 + 50.0 / rate + 0.0005
    assert timed(b, model("linuxcnc")).end[-1] == pytest.approx(alone.sum() + SETTLED, abs=1e-9)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", range(5))
def test_rest_to_rest_is_ruckigs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length, target, rate, jerk = (10.0 ** rng.uniform(a, b, 40) for a, b in ((-3, 3), (0, 3), (1, 4), (2, 6)))
    ours = rest_to_rest(length, target, rate, jerk)
    for k in range(40):
        asked, travel = InputParameter(1), Trajectory(1)
        asked.current_position, asked.target_position = [0.0], [float(length[k])]
        asked.max_velocity, asked.max_acceleration, asked.max_jerk = [target[k]], [rate[k]], [jerk[k]]
        Ruckig(1).calculate(asked, travel)
        assert ours[k] == pytest.approx(travel.duration, rel=1e-9)


def test_one_line_of_the_ideal_model_is_rest_to_rest() -> None:
    b = blocks(f"{HEAD}\nF3000\nG1 X40")
    limits = machine().limits
    alone = rest_to_rest(np.array([40.0]), np.array([50.0]), limits.acceleration[:1], limits.jerk[:1])[0]
    assert total(b, timed(b, model("ideal"))) == pytest.approx(alone, rel=1e-9)


def test_no_model_is_faster_than_the_bound() -> None:
    for name, b in programs(14):
        for kind in KINDS:
            m = model(kind)
            assert lower_bound(b, m) <= total(b, timed(b, m)) * (1.0 + 1e-9), (name, kind)


@pytest.mark.parametrize("kind", ["control", "fanuc"])
def test_no_executed_control_is_faster_than_its_bound(kind: str) -> None:
    """With jerk, and its rests; formulas of it take no less either."""
    m = model(kind)
    for name, b in programs(4):
        assert lower_bound(b, m) <= total(b, timed(b, m.quick())), name
    for name, b in programs(1):
        assert lower_bound(b, m) <= total(b, timed(b, m)), name


def test_bound_is_the_ramp_from_rest_to_rest_between_forced_stops() -> None:
    """Two collinear lines with a dwell between: rest at both ends and in the middle, corners free."""
    b = blocks(f"{HEAD}\nF6000\nG1 X30\nG1 X60\nG4 P0.5\nG1 X90 Y30")
    leg = 30.0 * np.sqrt(2.0)
    rate = 3000.0 * np.sqrt(2.0)
    expected = 60.0 / 100.0 + 100.0 / 3000.0 + 0.5 + leg / 100.0 + 100.0 / rate
    assert lower_bound(b, model("ideal")) == pytest.approx(expected, rel=1e-12)


def test_shares_add_up_to_the_time() -> None:
    for name, b in programs(6):
        for kind in KINDS:
            e = estimate(b, machine(name), model(kind), with_band=False)
            s = shares(e)
            assert sum(v.sum() for v in s.by_cause.values()) == pytest.approx(e.seconds, rel=1e-6, abs=2e-6)
            assert min(v.min() for v in s.by_cause.values()) > -1e-9
            held = s.feed + sum(sum(v) for v in s.limiting.values())
            assert held <= e.seconds * (1 + 1e-9)
            assert sum(float(op["time_s"]) for op in operations(e, s)) == pytest.approx(e.seconds, rel=1e-6, abs=2e-6)


def test_the_most_expensive_place_is_the_long_stop() -> None:
    b = blocks(f"{HEAD} G64 P0.01\nF3000\nG1 X30\nG1 X60\nG4 P2\nG1 X90\nG1 X0 Y1")
    e = estimate(b, machine(), model("lookahead"), with_band=False)
    places = most_expensive(e, shares(e))
    assert places[0]["nc_line"] == 4 and places[0]["cause"] == "dwell"
    assert places[0]["lost_s"] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("kind", ["lookahead", "ideal"])
def test_time_scales_with_the_limits(kind: str) -> None:
    """Velocity and feed k times, acceleration k^2, jerk k^3, stops and blocks 1/k: 1/k of the time."""
    k = 1.7
    m = model(kind)
    for _, b in programs(3):
        axes = replace(b.axes, velocity=b.axes.velocity * k, acceleration=b.axes.acceleration * k**2,
                       jerk=b.axes.jerk * k**3)
        fast = replace(b, axes=axes, speed=b.speed * k)
        quick = m.model_copy(update={"block_time": m.block_time / k, "stop_time": m.stop_time / k})
        assert total(fast, timed(fast, quick)) == pytest.approx(total(b, timed(b, m)) / k, rel=1e-9)
        assert lower_bound(fast, quick) == pytest.approx(lower_bound(b, m) / k, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_place_does_not_matter(kind: str) -> None:
    for _, b in programs(3):
        move = np.linspace(3.0, 7.0, b.start.shape[1])
        shift = np.where(b.axes.rotary, 0.0, move)
        moved = replace(b, start=b.start + shift, end=b.end + shift,
                        center=np.where(b.arc[:, None], b.center + shift[b.axes.xyz], 0.0))
        assert total(moved, timed(moved, model(kind))) == pytest.approx(total(b, timed(b, model(kind))), rel=1e-5)


def test_wider_corners_and_quicker_blocks_are_faster() -> None:
    text = "\n".join(f"G1 X{5 * (i % 2)} Y{0.5 * i}" for i in range(1, 60))
    b = blocks(f"{HEAD}\nF6000\n{text}", controller="generic-iso")
    base = model("lookahead")
    times = [total(b, timed(b, base.model_copy(update={"corner_tolerance": e}))) for e in (0.003, 0.01, 0.03, 0.1)]
    assert all(np.diff(times) < 0)
    slow = base.model_copy(update={"block_time": 0.2})
    assert total(b, timed(b, slow)) >= 0.2 * len(b)


def test_the_machine_file_says_what_its_control_sees_ahead() -> None:
    """Few blocks and slow ones take longer; neither is assumed then. Planners that have no such rule stay as they are."""
    b = blocks(f"{HEAD}\nF30000\n" + "\n".join(f"G1 X{0.2 * i:.1f}" for i in range(1, 200)), controller="generic-iso")
    plain = estimate(b, machine(), model("lookahead"), with_band=False)
    few, slow = (replace(machine(), **stated) for stated in ({"look_ahead": 5}, {"block_time": 0.05}))
    assert estimate(b, few, model("lookahead"), with_band=False).seconds > 1.3 * plain.seconds
    made = estimate(b, slow, model("lookahead"), with_band=False)
    assert made.seconds >= 0.05 * len(b) > plain.seconds and "block_time" not in made.model.assumed
    assert "block_time" in plain.model.assumed
    for kind in ("linuxcnc", "ideal"):
        assert estimate(b, few, model(kind), with_band=False).seconds == estimate(b, machine(), model(kind), False).seconds


def test_window_of_few_blocks_is_slower() -> None:
    b = blocks(f"{HEAD}\nF30000\n" + "\n".join(f"G1 X{0.2 * i:.1f}" for i in range(1, 500)),
               controller="generic-iso")
    near, far = (total(b, timed(b, model("lookahead").model_copy(update={"lookahead": n, "block_time": 0.0})))
                 for n in (5, 5000))
    peak = timed(b, model("lookahead").model_copy(update={"lookahead": 5, "block_time": 0.0})).peak.max()
    assert near > 1.5 * far
    assert peak == pytest.approx(np.sqrt(2 * 3000 * 0.2 * 5 + 3000 * 0.2), rel=1e-9)


@pytest.mark.slow  # make numeric runs it; the plain loops have tests of their own
@pytest.mark.numeric
@pytest.mark.parametrize("seed", range(3))
def test_compiled_loops_are_the_plain_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 300
    xyz = np.cumsum(rng.normal(0, 0.01, (n + 1, 3)) + np.array([0.2, 0, 0]), axis=0)
    args = xyz, rng.random(n) < 0.95, np.full(n, 0.02)
    np.testing.assert_array_equal(compiled(chain_ends)(*args), chain_ends(*args))
    length, target, rate = rng.uniform(0.1, 5, n), rng.uniform(1, 100, n), rng.uniform(100, 3000, n)
    args = length, target, target * 1.1, rate, rng.random(n) < 0.9, rng.uniform(1, 90, n), rng.uniform(10, 90, n)
    np.testing.assert_array_equal(compiled(speeds)(*args), speeds(*args))
    args = length, target, rate, target * rng.random(n), 0.001
    np.testing.assert_array_equal(compiled(next_begins)(*args), next_begins(*args))
    args = length, length * 0.4 * rng.random(n), rng.random(n) * 0.1, rng.random(n) < 0.1
    np.testing.assert_array_equal(compiled(timeline)(*args), timeline(*args))


def test_merged_lines_stay_within_the_chain_tolerance() -> None:
    rng = np.random.default_rng(1)
    points = np.cumsum(rng.normal(0, 0.004, (400, 2)) + np.array([0.15, 0.0]), axis=0)
    b = blocks(f"{HEAD} G64 P0.01 Q0.02\nF3000\n" + "\n".join("G1 X{:.4f} Y{:.4f}".format(*p) for p in points))
    merged, rows = merge(b)
    assert len(merged) < len(b) / 3 and rows[-1] == len(b) - 1
    assert np.diff(np.concatenate([[-1], rows])).max() <= 101
    for start, end, first, last in zip(merged.start, merged.end, np.concatenate([[0], rows[:-1] + 1]), rows,
                                       strict=True):
        chord = (end - start)[:2]
        off = b.end[first:last, :2] - start[:2]
        across = np.abs(off[:, 0] * chord[1] - off[:, 1] * chord[0]) / np.linalg.norm(chord)
        assert across.max(initial=0.0) <= 0.02 + 1e-9


def test_band_holds_the_time_and_grows_with_what_is_assumed() -> None:
    b = blocks(random_program(4))
    m = machine()
    known = replace(m, limits=replace(m.limits, assumed=frozenset()))
    assumed = estimate(b, m, model("lookahead"))
    sure = estimate(b, known, model("lookahead").model_copy(update={"assumed": ()}))
    assert assumed.band[0] < assumed.seconds < assumed.band[1]
    assert sure.band[0] < sure.seconds < sure.band[1]
    assert assumed.band[1] - assumed.band[0] > 1.5 * (sure.band[1] - sure.band[0])
    assert set(sure.uncertainties) == {"the model itself"}


def test_lengths_of_arcs_and_helices() -> None:
    b = blocks(f"{HEAD} G64\nF1000\nG0 X0 Y0 Z300\nG2 X0 Y0 I10 J0\nG3 X20 Y0 Z290 I10 J0")
    form = shape(b)
    assert form.length[-2:] == pytest.approx([20 * np.pi, np.hypot(10 * np.pi, 10.0)], rel=1e-9)
    assert form.first[-2] == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)


def test_override_makes_cutting_shorter() -> None:
    b = blocks(f"{HEAD} G64 P0.01\nF600\nG1 X100\nG1 Y100")
    times = [total(b, timed(b, CycleTimeModel(kind=kind, override=o))) for kind in ("linuxcnc", "lookahead")
             for o in (1.0, 1.25)]
    assert times[1] == pytest.approx(times[0] / 1.25, rel=0.01)
    assert times[3] == pytest.approx(times[2] / 1.25, rel=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_the_spindle_runs_up_at_each_start(kind: str) -> None:
    b = blocks(f"{HEAD} G64 P0.01\nF600\nM3 S500\nG1 X10\nM5\nG1 X20\nM3 S900\nG1 X30")
    slow, quick = (model(kind).model_copy(update={"spindle_time": s}) for s in (2.0, 0.0))
    assert total(b, timed(b, slow)) == pytest.approx(total(b, timed(b, quick)) + 4.0, rel=1e-9)
    s = shares(estimate(b, machine(), slow, with_band=False))
    assert s.by_cause["spindle"].sum() == pytest.approx(4.0, abs=0.02)


def test_the_first_start_of_a_sinumerik_takes_longer_and_a_fitted_time_scales_both() -> None:
    """117 and 67 ms in logs; the axes wait for no speed."""
    b = blocks("G17 G90 G71 G94 G64\nF600\nS500 M3\nG1 X10\nM5\nG1 X20\nS9000 M3\nG1 X30", controller="siemens-840d")
    m = model("siemens").quick()
    free = total(b, timed(b, m.model_copy(update={"spindle_time": 0.0})))
    assert total(b, timed(b, m)) - free == pytest.approx(0.117 + 0.067, abs=1e-3)
    assert total(b, timed(b, m.model_copy(update={"spindle_time": 0.134}))) - free == pytest.approx(0.368, abs=2e-3)


@pytest.mark.parametrize(("controller", "words", "rests"), [
    ("siemens-840d", ("G60", ""), 3), ("siemens-840d", ("G64", "G9"), 1), ("fanuc-30i", ("G61", ""), 3),
    ("fanuc-30i", ("G64", "G09"), 1), ("haas-ngc", ("G61", ""), 3), ("haas-ngc", ("G64", "G9"), 1)])
def test_exact_stops_take_time_and_are_reported(controller: str, words: tuple[str, str], rests: int) -> None:
    """Along one line, where nothing else slows the axes down."""
    text = "G17 G90 G21 G94 {}\nG1 X10. F3000.\n{} G1 X20.\nG1 X30.\nG1 X40."
    by_dialect = text.replace("G21", "G71") if controller == "siemens-840d" else text
    made, free = (blocks(by_dialect.format(*two), controller=controller) for two in (words, ("G64", "")))
    m = model({"siemens-840d": "siemens", "fanuc-30i": "fanuc", "haas-ngc": "haas"}.get(controller, "lookahead"))
    e, plain = (estimate(b, machine(), m, with_band=False) for b in (made, free))
    assert e.seconds - plain.seconds > 0.02 * rests
    found = as_dict(e)["exact_stops"]
    assert found["blocks"] == rests and 0.01 * rests < found["lost_s"] and not as_dict(plain)["exact_stops"]["blocks"]
    assert f"exact stops (G60, G9, G61): at {rests} blocks" in as_text(e, "a.nc")
    assert "exact stops" not in as_text(plain, "a.nc")


def test_a_corner_is_passed_as_its_parabola_allows() -> None:
    """Square corner, tolerance e: v^2 = 8 e A/sqrt(2); both lines long enough."""
    b = blocks("G21 G90 G94 G17\nF3000\nG1 X50\nG1 Y50", controller="generic-iso")
    m = model("ideal").model_copy(update={"jerk": False})
    corner = np.sqrt(8.0 * 0.01 * 3000.0 / np.sqrt(2.0))
    expected = 2.0 * 50.0 / 50.0 + 50.0 / 3000.0 + (50.0 - corner) ** 2 / 3000.0 / 50.0
    assert total(b, timed(b, m)) == pytest.approx(expected, rel=1e-12)


def test_jerk_of_a_run_over_several_blocks_is_that_of_one() -> None:
    one, several = (blocks(f"{HEAD}\nF3000\n{text}", controller="generic-iso") for text in (
        "G1 X90", "\n".join(f"G1 X{x}" for x in (0.05, 0.2, 0.5, 40, 89.6, 89.9, 90))))
    times = [total(b, timed(b, model("ideal"))) for b in (one, several)]
    assert times[1] == pytest.approx(times[0], rel=1e-9)


def test_uncertainties_reach_to_both_sides() -> None:
    b, m = blocks(random_program(4)), machine()
    e = estimate(b, m, model("lookahead"))
    own = 1.96 * e.uncertainties["the model itself"]
    assert e.seconds - e.band[0] > 1.2 * own and e.band[1] - e.seconds > 1.2 * own


def test_what_each_axis_does_on_an_arc() -> None:
    b = blocks("G21 G90 G94\nF600\nG0 Z300\nG17 G2 X20 I10 J0\nG18 G2 X40 Z290 I10 K0\nG19 G2 Y20 J10 K0")
    share = shape(b).share[-3:]
    pitch = 1.0
    np.testing.assert_allclose(share[0], [1.0, 1.0, 0.0], atol=1e-12)
    assert share[1, 1] == pytest.approx(0.0, abs=1e-9) and share[1, 0] == pytest.approx(pitch)
    np.testing.assert_allclose(share[2], [0.0, 1.0, 1.0], atol=1e-12)


def test_at_most_a_hundred_points_are_merged() -> None:
    b = blocks(f"{HEAD} G64 P0.01\nF3000\n" + "\n".join(f"G1 X{0.2 * i:.1f}" for i in range(1, 500)))
    assert np.diff(np.concatenate([[-1], merge(b)[1]])).max() == 101


@pytest.mark.parametrize("name", time_programs.PROGRAMS)
def test_linuxcnc_takes_as_long_as_its_simulator_once_did(name: str) -> None:
    on, program = time_programs.PROGRAMS[name]
    b = blocks(program, time_programs.machine(on))
    within = 0.0008 if "whole cycles" in name else 0.005
    assert timed(b, model("linuxcnc")).end.max() == pytest.approx(time_programs.MEASURED[name], rel=within)
    assert lower_bound(b, model("linuxcnc")) <= time_programs.MEASURED[name]
