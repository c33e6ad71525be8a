"""Levels of a control's smoothing: what each takes of the axes' limits, stretches of several in one program."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.cycle_time.estimate import timed, total
from tests.postproc.time_kit import blocks, machine, model

CUTS = "G0 X0. Y0.\nG1 F3000.\n" + "\n".join(
    f"X{8.0 * (k // 2 % 2):.1f} Y{4.0 * ((k + 1) // 2):.1f}" for k in range(40)) + "\nG0 Z50.\nM5\n"


def seconds(head: str, controller: str, name: str) -> float:
    b = blocks(f"G21 G90 G17 G94\n{head}\n{CUTS}", machine(), controller)
    return total(b, timed(b, model(name)))


def test_levels_of_g05_1_take_longer_the_more_accurate_they_are_and_lie_between_two_that_are_stated() -> None:
    one, five, ten = (seconds(f"G05.1 Q1 R{r}", "fanuc-30i", "fanuc") for r in (1, 5, 10))
    assert one < five < ten < 1.6 * one
    assert five - one == pytest.approx((ten - one) * 4.0 / 9.0, rel=0.4)


def test_without_g05_1_corners_are_rounded_by_filters_and_blocks_take_longer() -> None:
    off, on = (seconds(head, "fanuc-30i", "fanuc") for head in ("G05.1 Q0", "G05.1 Q1"))
    assert off == seconds("", "fanuc-30i", "fanuc") and abs(off - on) > 0.02 * on


@pytest.mark.parametrize(("heads", "controller", "name"), [
    (("G187 P1", "G187 P2", "G187 P3"), "haas-ngc", "haas"), (("CYCLE832(0.1,_ROUGH,1)", "CYCLE832(0.01,_FINISH,1)"),
                                                              "siemens-840d", "siemens")])
def test_finishing_takes_longer_than_roughing(heads: tuple[str, ...], controller: str, name: str) -> None:
    times = [seconds(head, controller, name) for head in heads]
    assert times == sorted(times) and times[0] < times[-1]


def test_a_program_of_two_levels_takes_what_both_parts_take_and_a_rest_between() -> None:
    """Blocks follow each other, and every pause is there once."""
    b = blocks(f"G21 G90 G17 G94\nG05.1 Q1 R1\n{CUTS}G05.1 Q0\nG05.1 Q1 R10\n{CUTS}", machine(), "fanuc-30i")
    times = timed(b, model("fanuc"))
    assert (times.begin[1:] >= times.end[:-1] - 1e-9).all() and len(times.pause) == len(b.pauses)
    parts = [seconds(f"G05.1 Q1 R{r}", "fanuc-30i", "fanuc") for r in (1, 10)]
    assert total(b, times) == pytest.approx(sum(parts), rel=0.05)
    assert np.isclose(times.seconds.sum() + times.pause.sum(), total(b, times), rtol=0.02)
