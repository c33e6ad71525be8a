"""`--feed planned` on LinuxCNC's simulator: limits kept, the time foretold, not slower than the programmed feeds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from postproc.base.options import FeedSource, Options
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from tests.linuxcnc.simulator import Run
from tests.linuxcnc.time_programs import machine
from tests.postproc.kit import toolpath
from tests.postproc.planning.test_planned_feed import wave
from toolpaths.units import DEG


def made(feed: FeedSource, count: int, rate: int) -> PostResult:
    lines = wave(count)
    path = toolpath("RAPID", lines[0], f"FEDRAT/MMPM,{rate}", *lines[1:])
    result = convert(path, machine("mikron-ucp710"), "linuxcnc", options=Options(feed=feed),
                     clock=program_clock())
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


@pytest.mark.parametrize(("count", "rate"), [(60, 3000), pytest.param(160, 9000, marks=pytest.mark.slow)])
def test_planned_words_keep_the_limits_and_the_time(recorded: Callable[..., Run], tmp_path: Path, count: int,
                                                    rate: int) -> None:
    seconds = {}
    for feed in get_args(FeedSource):
        result = made(feed, count, rate)
        (tmp_path / "p.ngc").write_text(result.text)
        run = recorded(result.machine, tmp_path / "p.ngc", {1: (0.0, 6.0)})
        assert run.errors == ()
        rates = np.diff(run.joints * np.where(np.array(result.machine.rotary), DEG, 1.0), axis=0) / 1e-3
        limits = result.machine.limits
        assert np.abs(rates / limits.velocity).max() <= 1.05
        assert np.abs(np.diff(rates, axis=0) / 1e-3 / limits.acceleration).max() <= 1.05
        assert program_clock()(result).seconds == pytest.approx(run.seconds, rel=0.03)
        seconds[feed] = run.seconds
    assert seconds["planned"] <= seconds["programmed"] * 1.002
