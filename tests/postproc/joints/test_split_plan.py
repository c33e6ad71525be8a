"""A path split between a gantry and the hexaslide that it carries: inside both, faster than the gantry alone, proved."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.machine import Machine
from postproc.joints.road_clock import SHORTEST, clock_of
from postproc.joints.run_roads import RunRoad, rest
from postproc.joints.split_plan import ROOM, planned_split
from tests.postproc.kit import codes, convert, good, setup_of, toolpath
from toolpaths.arrays import Floats
from toolpaths.shape import Curves

LENGTH = 80.0


@cache
def gantry() -> Machine:
    return machines.load("macro-micro")


def road(tip: Floats, feed: float, lean: float = 0.0) -> RunRoad:
    """Straight moves through tips (N, 3) mm at a feed, mm/s."""
    n = len(tip) - 1
    axis = np.tile([np.sin(lean), 0.0, np.cos(lean)], (n, 1))
    curves = Curves(tip[:-1], tip[1:], axis, axis, np.zeros(n, dtype=bool), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n))
    return RunRoad(gantry().kinematics.with_tool(LENGTH), np.concatenate([tip[0], axis[0]]), curves, curves.length() / feed,
                   np.nan)


def wave(n: int = 400, far: float = 500.0) -> Floats:
    x = np.linspace(-far, far, n)
    return np.column_stack([x, 30.0 * np.sin(x / 15.0), np.full(n, -200.0)])


@pytest.mark.parametrize("lean", [0.0, 0.2])
def test_the_platform_stays_in_its_room_and_the_carriers_in_their_travel(lean: float) -> None:
    machine, roads = gantry(), [road(wave(), 250.0, lean), road(wave()[::-1] + np.array([0.0, 60.0, 0.0]), 250.0, lean)]
    for one, curve in zip(roads, planned_split(roads, machine), strict=True):
        at = np.linspace(curve.measure[0], curve.measure[-1], 3000)
        tip, axis = one.at(curve.measure, at)
        off = np.abs(curve.at(at) - rest(one.kin, tip, axis))
        assert (off <= ROOM * one.kin.parameters_apart + 250.0 * SHORTEST).all() and off.max() > 10.0  # between its times
        q = one.kin.inverse_with(tip, axis, curve.at(at))[0]
        assert ((q >= machine.limits.lower) & (q <= machine.limits.upper)).all()


def test_the_split_takes_less_time_than_the_carriers_alone_and_moves_them_gently() -> None:
    machine, roads = gantry(), [road(wave(), 250.0)]
    clock, columns = clock_of(roads, 1000.0), [machine.axis_names.index(a) for a in "XYZ"]
    split, alone = (planned_split(roads, machine, divided)[0] for divided in (True, False))
    seconds = [clock.seconds(machine, one.at(clock.times)) for one in (split, alone)]
    assert seconds[0] < 0.8 * seconds[1]
    bend = [np.abs(np.diff(one.at(clock.times), 2, axis=0)).max() / clock.step**2 for one in (split, alone)]
    assert bend[0] < machine.limits.acceleration[columns].max() < bend[1]


def test_a_path_beyond_the_gantry_is_reached_by_the_platform() -> None:
    """The gantry ends at x = 3000 mm, the platform leans out by what its workspace allows."""
    tip = np.array([[2950.0, 0.0, -200.0], [3000.0, 0.0, -200.0], [3120.0, 0.0, -200.0]])
    roads = [road(tip, 100.0)]
    curve, = planned_split(roads, gantry())
    q = roads[0].kin.inverse_with(*roads[0].at(curve.measure, curve.measure), curve.at(curve.measure))[0]
    assert (q <= gantry().limits.upper).all() and np.isfinite(q).all()


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i"])
def test_nine_linear_axes_are_words_of_every_control(controller: str) -> None:
    """X, Y, Z carry, A, B, C, U, V, W are slides, in mm; the gantry lifts the tool where the platform alone would not."""
    path = toolpath("RAPID", "GOTO/-60,0,30", "FEDRAT/MMPM,6000", "GOTO/-60,0,0", "GOTO/60,10,4", "RAPID", "GOTO/60,10,30")
    result = good(convert(path, "macro-micro", controller, setup=setup_of(
        "[part]\norigin = [0, 150, -270]\n[clearance]\nmargin = 300\n[tools.1]\ngauge_length = 80\n")))
    assert result.witness is not None and not result.witness.findings and result.path is not None
    z = result.path.q[:, result.machine.axis_names.index("Z")]
    assert np.ptp(z[np.isfinite(result.path.u)]) < 20.0 < np.ptp(z) and "beyond" not in result.text
    reach = result.machine.kinematics.with_tool(80.0).rig(result.path.q).place[:, 2]
    assert (reach <= 550.0 + 1e-6).all()


def test_lengths_of_letters_for_angles_are_not_scaled_in_inches() -> None:
    setup = setup_of('[output]\nunits = "inch"\n[part]\norigin = [0, 150, -270]\n[tools.1]\ngauge_length = 80\n')
    result = convert(toolpath("RAPID", "GOTO/0,0,0"), "macro-micro", setup=setup)
    assert not result.ok and any("words of A, B, C are lengths" in d.message for d in result.diagnostics)


@pytest.mark.parametrize("mode", ["planned", "rest"])
def test_programs_hold_all_joints_and_are_proved(mode: str) -> None:
    x = np.linspace(-300.0, 300.0, 60)
    path = toolpath("RAPID", "GOTO/-300,0,30", "FEDRAT/MMPM,12000",
                    *(f"GOTO/{a:.4f},{25 * np.sin(a / 12):.4f},0" for a in x), "RAPID", "GOTO/300,0,30")
    result = good(convert(path, "macro-micro", "siemens-840d", setup=setup_of(
        f'[part]\norigin = [0, 150, -270]\n[joints]\ncarriers = "{mode}"\n[tools.1]\ngauge_length = 80\n')))
    assert result.path is not None and result.comparison is not None and result.witness is not None
    assert result.comparison.tip_bound < 0.01 and result.comparison.bounded_cuts == result.comparison.cuts
    assert not result.witness.findings
    carried = result.path.q[np.isfinite(result.path.u)][:, [result.machine.axis_names.index(a) for a in "XY"]]
    leaves = np.ptp(carried[:, 1])
    assert leaves > 49.0 if mode == "rest" else leaves < 15.0
    assert [name for name, _, _ in result.path.opened] == ["X", "Y", "Z"]
    split, alone = result.path.split_seconds
    assert (split < 0.9 * alone) == (mode == "planned") and f"alone {alone:.2f} s" in result.text


def test_a_control_without_words_for_an_axis_says_so(tmp_path: Path) -> None:
    text = Path("machines/data/macro-micro.toml").read_text("utf-8").replace('"A", "B"', '"Q", "B"')
    (tmp_path / "own.toml").write_text(text.replace("axes.A]", "axes.Q]"), "utf-8")
    setup = setup_of("[tools.1]\ngauge_length = 80\n")
    result = convert(toolpath("RAPID", "GOTO/0,0,0"), tmp_path / "own.toml", setup=setup)
    assert not result.ok and "write.axis_letters" in codes(result.diagnostics)
