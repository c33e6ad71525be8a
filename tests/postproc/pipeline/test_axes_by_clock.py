"""Tool axes by the control's clock: `auto` is never slower than `keep` on the control that it is written for."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.base.options import Options, Orientation
from postproc.base.program_time import ProgramTime
from postproc.cycle_time.conversion import program_clock
from postproc.orientation.report.figures_of_choice import control_line
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from tests.postproc.kit import SAMPLES, machine
from tests.postproc.orientation.test_orientation_program import strips

SETUP = load_setup(SAMPLES / "tools.setup.toml")[0]


def oriented(controller: str, orient: Orientation) -> PostResult:
    made = convert(strips(), machine("mikron-ucp710"), controller, SETUP, Options(orient=orient), clock=program_clock())
    assert made.ok, [str(d) for d in made.diagnostics]
    return made


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i"])
def test_auto_is_never_slower_than_keep(controller: str) -> None:
    auto, keep = oriented(controller, "auto"), oriented(controller, "keep")
    assert auto.choice is not None
    times = auto.choice.programs
    assert program_clock().executed(auto).seconds <= program_clock().executed(keep).seconds
    assert times["auto"].seconds == pytest.approx(program_clock().executed(auto).seconds, rel=1e-9)
    assert times["keep"].seconds == pytest.approx(program_clock().executed(keep).seconds, rel=1e-9)
    assert times["auto"].band[0] < times["auto"].seconds < times["auto"].band[1]


@pytest.mark.parametrize("own", [True, False])
def test_the_choice_obeys_the_clock(own: bool) -> None:
    """A clock by which the axes of the CL file are slow, and one by which all others are."""
    def clock(result: PostResult, band: bool = False) -> ProgramTime:
        plans = result.choice.plans if result.choice is not None else {}
        seconds = 50.0 if (plans["auto"].states == plans["keep"].states) is own else 100.0
        moves = np.ones(len(result.job.moves) if result.job else 0)
        return ProgramTime(seconds, (seconds, seconds), 10.0, "clock of the test", moves)

    made = convert(strips(), machine("mikron-ucp710"), "linuxcnc", SETUP, Options(orient="auto"), clock=clock)
    assert made.ok and made.choice is not None
    assert (made.choice.plans["auto"].states == made.choice.plans["keep"].states) is own
    assert made.choice.gain == (0.0 if own else 50.0)
    assert ("nothing gained" if own else "50.0 % gained") in control_line(made.choice)
