"""Our estimate of LinuxCNC's time compared with the machine time of its simulator."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from machines.machine import Machine
from postproc.controllers.model import load_controller
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate
from postproc.cycle_time.model import load_model
from postproc.cycle_time.source import from_gcode
from postproc.setup.model import SetupFile
from postproc.time_fit.log import RunLog
from tests.linuxcnc.simulator import Run
from tests.linuxcnc.time_programs import END, HEAD, PROGRAMS, machine, random_lines
from tests.postproc.time_kit import calibrated

EACH, MEAN = 0.01, 0.003
"""shares of the time that an estimate may be off, each and on average"""
seen: dict[str, float] = {}
SIMULATED = ("5 axes, G93, G64 P0.01", "5 axes, control's kinematics")
"""run in the simulator by every `make test`, the others with -m slow: all are compared with its recorded
times by tests/postproc/cycle_time/test_cycle_time_models.py"""


def blocks(text: str, on: Machine) -> MotionBlocks:
    spec, _ = load_controller("linuxcnc")
    assert spec is not None
    made, found = from_gcode(text.encode(), on, spec, SetupFile())
    assert made is not None, [str(d) for d in found]
    return made


def estimated(text: str, on: Machine) -> Estimate:
    model, _ = load_model("linuxcnc")
    assert model is not None
    return estimate(blocks(text, on), on, model)


def in_motion(e: Estimate) -> float:
    """s from the first to the last motion, as `Run.seconds` counts: commands before and behind left out."""
    return float(e.timed.end.max() - e.timed.begin.min())


def run(recorded: Callable[..., Run], text: str, on: Machine, folder: Path, fast: int = 20) -> Run:
    """Commands between motions wait for processes of the host, whose delays the fast clock multiplies."""
    (folder / "program.ngc").write_text(text)
    warp = 3 if any(word in text for word in ("M6", "M8", "F30000", "F24000")) else fast
    result: Run = recorded(on, folder / "program.ngc", {1: (0.0, 6.0), 2: (0.0, 6.0)}, warp=warp)
    assert result.errors == ()
    return result


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in SIMULATED else pytest.mark.slow)
                                  for name in PROGRAMS])
def test_estimate_is_the_simulators_time(recorded, tmp_path: Path, name: str) -> None:
    letters, program = PROGRAMS[name]
    on, text = machine(letters), program + END
    e = estimated(text, on)
    measured = run(recorded, text, on, tmp_path).seconds
    for _ in range(2):  # what a busy host costs only adds to a recording, so that the shortest counts
        if abs(in_motion(e) / measured - 1.0) >= EACH:
            measured = min(measured, run(recorded, text, on, tmp_path).seconds)
    seen[name] = in_motion(e) / measured - 1.0
    assert abs(seen[name]) < EACH
    assert e.lower_bound <= measured
    assert e.band[0] <= measured <= e.band[1]


def test_mean_of_all_programs() -> None:
    if len(seen) < len(SIMULATED):
        pytest.skip("needs the whole table in one process")
    assert np.mean(np.abs(list(seen.values()))) < MEAN


def test_lines_are_taken_up_when_the_simulator_takes_them_up(recorded, tmp_path: Path) -> None:
    """Not only the sum is right: every line begins within a few per mille of the run."""
    on, text = machine("mill-3axis"), f"{HEAD} G64 P0.05 Q0\nG0 Z300\nF3000\n{random_lines(60)}{END}"
    result = run(recorded, text, on, tmp_path, fast=6)
    b = blocks(text, on)
    begin = estimated(text, on).timed.begin
    moving = np.flatnonzero(np.any(np.diff(result.joints, axis=0) != 0.0, axis=1))[0]
    for row in range(5, len(b), 7):
        measured = result.t[np.flatnonzero(result.line == b.line[row])[0]] - result.t[moving]
        assert begin[row] == pytest.approx(measured, abs=0.025)


@pytest.mark.slow
def test_a_generic_model_learns_linuxcnc_from_its_log(recorded, tmp_path: Path) -> None:
    """A look-ahead model fitted to one run foretells another within its band."""
    on = machine("mill-3axis")
    texts = [f"{HEAD} G64 P0.01\nG0 Z300\nF{feed}\n{random_lines(count)}G0 X0 Y0 Z300\nG0 X200\n{END}"
             for feed, count in ((4000, 120), (2500, 80))]
    runs = [run(recorded, text, on, tmp_path) for text in texts]
    taught = runs[0]
    rows = np.concatenate([[0], np.flatnonzero(np.diff(taught.line) != 0) + 1])
    rows = rows[taught.line[rows] > 0]
    log = RunLog(taught.line[rows], taught.t[rows], np.full((len(rows), 3), np.nan), rows)
    model, _ = load_model("lookahead")
    assert model is not None
    fit, found = calibrated(blocks(texts[0], on), log, model, "log.csv", on)
    assert fit is not None, found
    e = estimate(blocks(texts[1], on), on, fit.model)
    wide = estimate(blocks(texts[1], on), on, model)
    assert e.band[0] <= runs[1].seconds <= e.band[1]
    assert e.band[1] - e.band[0] < 0.5 * (wide.band[1] - wide.band[0])
    assert abs(in_motion(e) / runs[1].seconds - 1.0) < 0.02
