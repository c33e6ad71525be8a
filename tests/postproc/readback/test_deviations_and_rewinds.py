"""Faults of a second reading: what the read-back takes for a deviation, a rewind, a point of its own."""

from __future__ import annotations

import numpy as np
import pytest

import machines
from postproc.readback.alignment.align import align
from postproc.readback.execution import assembly
from tests.postproc.kit import convert, good, goto, sample, toolpath
from toolpaths.shape import Curves
from toolpaths.units import DEG

UP = np.array([0.0, 0.0, 1.0])


def tilted(degrees: float) -> np.ndarray:
    return np.array([np.sin(degrees * DEG), 0.0, np.cos(degrees * DEG)])


def line(start: np.ndarray, end: np.ndarray, axis0: np.ndarray = UP, axis1: np.ndarray = UP) -> Curves:
    zero = np.zeros((1, 3))
    return Curves(start[None], end[None], axis0[None], axis1[None], np.zeros(1, dtype=bool), zero, zero,
                  np.zeros(1))


@pytest.mark.parametrize("name", ["h4a_dome.cls", "tool_axis_tour.apt"])
def test_rewinds_in_words_of_three_decimals_are_clear(name: str) -> None:
    result = sample(name, "nutating-head", "haas-ngc")
    assert len(result.path.rewinds) > 0 and result.controller.format.rotary_decimals == 3


def test_a_pose_is_measured_where_tip_and_axis_fit_together() -> None:
    """The axis turns by 80 degrees on 0.5 mm: 5 um of the tip are 0.8 degrees."""
    curve = line(np.zeros(3), np.array([0.5, 0.0, 0.0]), UP, tilted(80.0))
    tip, axis, guess = np.array([[0.255, 0.0, 0.0]]), tilted(40.0)[None], np.array([0.5])
    assert curve.deviation(tip, axis, guess)[1] == pytest.approx(0.8 * DEG)
    assert curve.deviation(tip, axis, guess, 0.01)[1] == pytest.approx(0.0, abs=1e-9)
    assert curve.deviation(tip, axis, guess, 0.003)[1] == pytest.approx(0.32 * DEG)
    aside = np.array([[0.255, 0.004, 0.0]])
    assert curve.deviation(aside, axis, guess, 0.005)[1] == pytest.approx(0.32 * DEG)


def test_a_short_move_whose_axis_lags_behind_its_tip_is_off() -> None:
    curve = line(np.zeros(3), np.array([0.08, 0.0, 0.0]), UP, tilted(40.0))
    _, off, _ = curve.deviation(np.array([[0.08, 0.0, 0.0]]), UP[None], np.array([0.5]), 0.01)
    assert off == pytest.approx(35.0 * DEG)


@pytest.mark.parametrize("name", [pytest.param("mikron-ucp710", marks=pytest.mark.slow), "fork-head-ab"])
def test_fast_turns_on_short_ways(name: str) -> None:
    """0.13 mm with 115 degrees of the axis: the rounding of the words stands for a tenth of a degree."""
    tip = np.array([[-5.0, 1.7, 7.0], [4.789, 56.358, -15.864], [4.807, 56.247, -15.804], [4.936, 55.477, -15.386]])
    axis = np.array([[0.0, 0.1, 1.0], [-0.60012, 0.7189, 0.35078], [0.56411, -0.44859, 0.69321], [0.5497, -0.451, 0.7031]])
    rows = goto(tip, axis / np.linalg.norm(axis, axis=1)[:, None])
    result = good(convert(toolpath("RAPID", rows[0], "FEDRAT/MMPM,1000", *rows[1:]), name))
    assert result.comparison.axis_bound <= result.job.axis_tolerance


def test_a_move_of_a_few_grains_needs_no_block_of_its_own() -> None:
    """Repeated points a micrometre apart: one block may stand for several of them, the next one is far."""
    x = np.array([0.0, 1.0, 1.0, 1.001 + 1e-10, 1.05, 2.0])
    point = np.stack([x, 0 * x, 0 * x], axis=1)
    up = np.tile(UP, (5, 1))
    zero = np.zeros((5, 3))
    curves = Curves(point[:-1], point[1:], up, up, np.zeros(5, dtype=bool), zero, zero, np.zeros(5))
    tip = point[[1, 3, 4, 5]] - [2e-10, 0.0, 0.0]
    match, _ = align(tip, up[:4], np.full(4, np.nan), curves, np.zeros(5, dtype=bool), 0.01, 1e-3)
    assert match.tolist() == [0, 1, 1, 2, 3]


@pytest.mark.parametrize("rows", [["GOTO/0,0,0"], ["GOTO/0,0,0", "FEDRAT/MMPM,100", "GOTO/10,0,0"]])
def test_positions_of_another_assembly_are_out_of_reach(rows: list[str]) -> None:
    """Above the slides the rods have lengths that fit, but the platform hangs below them."""
    (fault,) = [d for d in convert(toolpath("RAPID", *rows), "h4a-c-table").diagnostics if d.severity.name == "ERROR"]
    assert fault.code == "reach.position" and "(0.0000, 0.0000, 0.0000)" in fault.message


def test_where_travel_is_short_a_jump_is_reported_as_that() -> None:
    heading = np.radians(np.linspace(0.0, 330.0, 34))
    axis = np.stack([0.0 * heading, np.sin(heading), np.cos(heading)], axis=1)
    rows = goto(np.zeros((len(axis), 3)) + np.linspace(0.0, 60.0, len(axis))[:, None] * [1.0, 0.0, 0.0], axis)
    result = convert(toolpath("RAPID", rows[0], "FEDRAT/MMPM,1000", *rows[1:]), "fork-head-ab")
    errors = [d for d in result.diagnostics if d.severity.name == "ERROR"]
    assert {d.code for d in errors} == {"travel.exceeded"} and any("axis A" in d.message for d in errors)


@pytest.mark.parametrize("far", [1e5, 1e12])
def test_a_walk_ends_where_the_machine_cannot_follow(far: float) -> None:
    """A coordinate that slipped by digits is NaN at once, not after a step every 20 mm."""
    kin = machines.load("delta-star").kinematics
    home = kin.inverse(np.array([[0.0, 0.0, 300.0]]), np.array([[0.0, 0.0, 1.0]]))[0]
    pose = np.hstack(kin.forward(home))
    count = 0
    given = kin.forward

    class Counted:
        rotary, in_loops, carried = kin.rotary, kin.in_loops, staticmethod(kin.carried)

        def forward(self, q: np.ndarray, near: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
            nonlocal count
            count += 1
            return given(q, near)
    found = assembly.walk(Counted(), home, home + np.array([[far, 0.0, 0.0]]), pose)
    assert np.isnan(found).all() and count < 200


def test_a_full_circle_is_no_part_of_the_move_before_it() -> None:
    """Its tips are one, within the tolerance of the line's end; nor is a pose that is no number taken for one as near."""
    up, none = np.tile([0.0, 0, 1], (4, 1)), np.zeros((3, 3))
    tip = np.array([[-0.005, 0, 0], [-0.005, 0, 0], [-0.001, 0, 0], [0, 0, -5.0]])
    start, end = none - [[20.0, 0, 0], [0, 0, 0], [0, 0, 0]], none - [[0, 0, 0], [0, 0, 0], [0, 0, 5.0]]
    curves = Curves(start, end, up[:3], up[:3], np.array([False, True, False]), np.tile([10.0, 0, 0], (3, 1)), up[:3],
                    np.array([0.0, 2 * np.pi, 0.0]))
    turns = np.array([np.nan, 2 * np.pi, np.nan, np.nan])
    assert align(tip, up, turns, curves, np.zeros(3, dtype=bool), 0.01, 1e-3)[0].tolist() == [0, 2, 3]
    tip[1] = np.nan
    assert align(tip, up, turns * np.nan, curves, np.zeros(3, dtype=bool), 0.01, 1e-3)[0][0] == 0
