"""What `convert` prints: formulas held against the control, executed over stretches."""

from collections.abc import Callable

import numpy as np
import pytest

from postproc.cycle_time import conversion as room
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.conversion import sampled
from postproc.cycle_time.estimate import estimate, timed, total
from tests.postproc.time_kit import blocks, machine, model

ON = machine("mikron-ucp710")


def turning(count: int) -> MotionBlocks:
    """Points of which every other one turns, as points between CL points stand, with a dwell."""
    k = np.arange(count)
    bent = np.cumsum(np.repeat(0.1 * np.sin(np.arange(count // 2 + 1) / 4.0), 2)[:count])
    rows = [f"G1 X{0.5 * i:.3f} A{20 + a:.3f} C{b:.3f}" for i, a, b in zip(k, bent, 3.0 * bent, strict=True)]
    rows.insert(count // 2, "G4 P1.5")
    return blocks("\n".join(["G21 G90 G94 G17 G64", "G0 X0 Y0 Z100 A20 C0", "F3000", *rows]), ON, "generic-iso")


def waves(count: int) -> MotionBlocks:
    """Rows of short lines that rise and fall on three axes, with rapids between them, and a dwell."""
    z = 100.0 + 2.0 * np.sin(np.arange(count) / 5.0)
    rows = [(f"G0 Z120\nX0 Y{i // 60}\nZ{z[i]:.3f}\n" if i % 60 == 0 else "") + f"G1 X{0.6 * (i % 60):.3f} Z{z[i]:.3f}"
            for i in range(count)]
    rows.insert(count // 2, "G4 P1.5")
    return blocks("\n".join(["G21 G90 G94 G17 G64", "G0 X0 Y0 Z120 A0 C0", "F3000", *rows]), ON, "generic-iso")


@pytest.mark.parametrize(("program", "step"), [(turning, None), (turning, 8.333), (waves, 8.333)])
def test_stretches_that_are_executed_mend_the_formulas(program: Callable[[int], MotionBlocks], step: float | None) -> None:
    """Both kinds of corners; the executed time is in the band, which is narrower than that of formulas alone. A program
    of three axes was announced 9 % longer than `time` executed it: stretches were executed where axes turn alone."""
    b, m = program(800), model("control").model_copy(update={"corner_step": step, "corner_tolerance": 0.002})
    true, alone = total(b, timed(b, m)), estimate(b, ON, m.quick())
    found = sampled(b, m)
    held = estimate(b, ON, m.quick(), times=found.times, off=found.off)
    assert abs(held.seconds - true) < min(0.04 * true, abs(alone.seconds - true) / 4.0)
    assert held.band[0] <= true <= held.band[1] and np.diff(held.band)[0] < np.diff(alone.band)[0]
    assert held.seconds - found.times.seconds.sum() == pytest.approx(alone.seconds - alone.timed.seconds.sum())


def test_small_programs_and_those_that_cannot_be_executed_keep_their_formulas(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the clock loads takes longer than a small file is converted in."""
    m = model("control")
    for b, of in ((turning(room.FEWEST // 2), m), (turning(500), m.quick()), (turning(500), model("linuxcnc"))):
        assert sampled(b, of).off is None
    monkeypatch.setattr("postproc.cycle_time.control.MOST_BLOCKS", 10)
    assert sampled(turning(500), m).off is None


def test_formulas_in_the_place_of_the_control_have_their_band(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the blocks up to which it is executed; the band was that of the executed control."""
    b, m = turning(200), model("control")
    monkeypatch.setattr("postproc.cycle_time.control.MOST_BLOCKS", 10)
    assert estimate(b, ON, m).band == pytest.approx(estimate(b, ON, m.quick()).band)


def test_times_by_formulas_are_never_below_the_bound() -> None:
    """300,000 points that wind C: stretches held against the control scaled the formulas below what no control can beat."""
    b, m = turning(200), model("control").quick()
    whole = estimate(b, ON, m)
    short = room.slowed(whole.timed, b, np.full(len(b), 0.5 * whole.lower_bound / whole.seconds))
    lifted = estimate(b, ON, m, times=short)
    assert lifted.seconds == lifted.lower_bound == pytest.approx(total(b, lifted.timed))
    assert lifted.band[0] <= lifted.seconds < whole.seconds
