"""The planned test program: safe, within its time; what it promises of the band holds on controls of other parameters."""

from __future__ import annotations

import tomllib
from functools import cache

import numpy as np
import pytest

from postproc.controllers.model import load_controller
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate, timed, total
from postproc.cycle_time.kinds import KINDS
from postproc.cycle_time.source import from_gcode
from postproc.setup.model import SetupFile
from postproc.time_fit.calibrate import calibrate
from postproc.time_fit.plan_calibration import (
    LENGTH,
    CalibrationPlan,
    Knowledge,
    chosen_moves,
    plan_calibration,
    simulated_log,
)
from postproc.time_fit.plan_text import as_text
from postproc.time_fit.runs import run_of_log
from tests.postproc.time_kit import blocks, machine, model
from toolpaths.diagnostics import read_value

BUDGET = 32.0
TRUTHS = (pytest.param({"corner_tolerance": 0.004, "stated_share": 0.4, "rapid": 0.8, "acceleration_share": 0.9,
                        "stop_time": 0.03}, marks=pytest.mark.slow),
          {"corner_tolerance": 0.025, "stated_share": 2.5, "override": 0.97, "jerk_share": 0.6, "block_time": 0.004})


@cache
def program() -> MotionBlocks:
    """A zigzag with rapids and arcs, as a shop has it."""
    text = ["G21 G90 G94 G17", "G0 X0 Y0 Z300", "S1000 M3", "F2500"]
    for k in range(42):
        text.append(f"G1 X{(k % 2) * 35 + k % 3} Y{k * 0.8:.3f}")
        text += ["G0 Z310", f"G0 X{-20 + k}", "G0 Z300"] if k % 6 == 5 else []
    return blocks("\n".join(text), machine(timing=True), controller="generic-iso")


@cache
def plan() -> CalibrationPlan:
    return plan_calibration(program(), machine(timing=True), "generic-iso", model("lookahead"), SetupFile(), BUDGET, "t.nc")


@cache
def run_program() -> MotionBlocks:
    """The test program as its files say."""
    spec, _ = load_controller("generic-iso")
    assert spec is not None
    setup = SetupFile.model_validate(tomllib.loads(plan().setup), strict=False)
    return read_value(from_gcode(plan().text.encode(), machine(timing=True), spec, setup))


def width(e: Estimate) -> float:
    return e.band[1] - e.band[0]


@pytest.mark.parametrize("truth", TRUTHS)
def test_a_run_on_a_control_of_other_parameters_narrows_the_band_as_promised(truth: dict[str, float]) -> None:
    control = model("lookahead").model_copy(update=truth)
    run = read_value(run_of_log(run_program(), simulated_log(run_program(), control)))
    fit = read_value(calibrate([run], model("lookahead"), "log.csv", machine(timing=True)))
    e = estimate(program(), machine(timing=True), fit.model)
    real = total(program(), timed(program(), control))
    assert e.band[0] <= real <= e.band[1]
    assert abs(e.seconds / real - 1.0) < 0.01 < abs(plan().now.seconds / real - 1.0)
    assert width(plan().after) < 0.4 * width(plan().now)
    assert 0.6 < width(e) / width(plan().after) < 1.5


def test_the_test_stays_in_its_box_within_its_time() -> None:
    b, limits = run_program(), machine(timing=True).limits
    assert total(b, timed(b, model("lookahead"))) == pytest.approx(plan().seconds) and plan().seconds <= BUDGET
    assert (b.end >= limits.lower - 1e-9).all() and (b.end <= limits.upper + 1e-9).all()
    origin = np.add(tomllib.loads(plan().setup)["part"]["origin"], [0.0, 0.0, LENGTH])
    fed = b.end[~b.rapid] - origin
    assert (fed >= plan().low - 1e-6).all() and (fed <= plan().high + 1e-6).all()


def test_operator_is_told_what_to_log_and_how_it_is_used() -> None:
    text = plan().text.lower()
    for said in ("nothing is cut", "box of air", "nc_line and time_s", "--calibrate log.csv", "--setup t.setup.toml"):
        assert said in text
    assert "instead of" in as_text(plan(), "t.nc")


def test_moves_that_show_what_the_program_asks_are_taken_first() -> None:
    """Two parameters, the program depends on the second alone; moves that cost more than they tell stay out."""
    information = np.array([np.diag([1e4, 0.0]), np.diag([0.0, 50.0]), np.diag([0.0, 60.0]), np.diag([0.0, 1e5])])
    known = Knowledge(information, np.array([1.0, 2.0, 30.0, 1e3]), np.zeros((4, len(KINDS))), np.array([0.0, 5.0]),
                      np.zeros(len(KINDS)))
    assert chosen_moves(known, 100.0)[0] == 1 and 0 not in chosen_moves(known, 100.0)
    assert 3 not in chosen_moves(known, 100.0) and chosen_moves(known, 0.5) == []
    assert known.variance([1]) == pytest.approx(25.0 / 51.0)


@pytest.mark.slow
def test_without_a_program_the_test_shows_what_every_kind_of_move_depends_on() -> None:
    made = plan_calibration(None, machine(timing=True), "generic-iso", model("lookahead"), SetupFile(), BUDGET, "t.nc")
    assert made.seconds <= BUDGET and len(made.moves) > 3
    assert all(after < before for name, (before, after) in made.shown.items() if name != "block_time")
