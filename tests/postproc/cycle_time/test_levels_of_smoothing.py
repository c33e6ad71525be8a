"""Levels of a control's smoothing: what each takes of the axes' limits, stretches of several in one program."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.cycle_time.estimate import estimate, timed, total
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


TURNS = "G21 G90 G94 G17 {words}\nG0 X0 Y0 Z0\nG1 X1 F1000\nX2 Y1\n"


def test_a_stated_tolerance_holds_behind_g64_and_says_what_a_turn_counts() -> None:
    on = machine("mikron-ucp710")
    stated = blocks(TURNS.format(words="G64\nCYCLE832(0.003,_ORI_FINISH,0.015)").replace("G21", "G710"), on, "siemens-840d")
    assert stated.tolerance[-1] == pytest.approx(0.003)
    assert stated.arms.tolist() == pytest.approx([1.0, 1.0, 1.0, *[0.003 / np.radians(0.015)] * 2])
    silent = blocks(TURNS.format(words="G64").replace("G21", "G710"), on, "siemens-840d")
    assert not np.isfinite(silent.tolerance[-1]) and silent.arms.tolist() == [1.0, 1.0, 1.0, 50.0, 50.0]


def test_a_tolerance_that_the_program_states_is_not_assumed() -> None:
    on = machine("mikron-ucp710")
    zigzag = "\n".join(f"X{k % 2 * 3} Y{k * 0.2:.1f}" for k in range(20))
    stated, silent = (estimate(blocks(TURNS.format(words=f"G64{words}").replace("G21", "G710") + zigzag, on, "siemens-840d"),
                               on, model("siemens")).assumed for words in ("\nCYCLE832(0.01,_FINISH,1)", ""))
    assert stated["corner_tolerance"] == 0.0 < stated["stated_share"] < 0.5 * silent["corner_tolerance"]
    assert silent["stated_share"] == 0.0
