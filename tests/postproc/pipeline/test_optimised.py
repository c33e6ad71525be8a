"""`--optimise`: never slower on the control's clock, proved and verified like any other, what was gained by what."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from postproc.base.header_words import read_header
from postproc.base.options import Options
from postproc.base.program_time import ProgramTime
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline import optimised as search
from postproc.pipeline.convert import convert, verify
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from tests.postproc.kit import goto, machine, toolpath
from tests.postproc.planning.test_planned_feed import wave
from toolpaths.toolpath import Toolpath


def swing(count: int = 6) -> Toolpath:
    """Few points, the axis turning by 6 degrees from each to the next: many points between."""
    s = np.linspace(0.0, 1.0, count)
    tip = np.round(np.stack((60.0 * s, 10.0 * s, 5.0 * np.sin(6.0 * s)), axis=1), 4)
    axis = np.stack((0.3 + 0.5 * s, 0.4 * np.cos(5.0 * s), np.ones(count)), axis=1)
    lines = goto(tip, axis / np.linalg.norm(axis, axis=1, keepdims=True))
    return toolpath("RAPID", lines[0], "FEDRAT/MMPM,6000", *lines[1:])


@pytest.fixture
def few_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it does not matter how near the best share of the tolerance comes."""
    monkeypatch.setattr(search, "SHARES", (0.45, 0.75))
    monkeypatch.setattr(search, "NEARER", 1)


@cache
def made(controller: str, **options: Any) -> PostResult:
    return convert(swing(), machine("mikron-ucp710"), controller, options=Options(**options), clock=program_clock())


@pytest.mark.parametrize("controller", ["linuxcnc", *(
    pytest.param(name, marks=pytest.mark.slow) for name in ("siemens-840d", "heidenhain-tnc640", "haas-ngc"))])
def test_nothing_is_slower_and_what_is_gained_adds_up(controller: str) -> None:
    plain, best = made(controller), made(controller, optimise=True)
    assert plain.ok and best.ok and best.optimised is not None, [str(d) for d in best.diagnostics]
    before, after = (program_clock().executed(one).seconds for one in (plain, best))
    assert after <= before and best.optimised.after.seconds == after and best.optimised.before.seconds == before
    assert before - after == pytest.approx(sum(one.before - one.after for one in best.optimised.steps), abs=1e-9)
    assert best.optimised.tried > 3 and best.optimised.before.bound <= after
    assert best.comparison is not None and best.comparison.worst_tip <= 0.01


def test_a_share_of_the_tolerance_that_gains_is_stated_and_verified(tmp_path: Path) -> None:
    best = made("linuxcnc", optimise=True)
    assert best.ok and best.optimised is not None
    assert best.optimised.steps and any("smoothing" in one.what for one in best.optimised.steps)
    assert best.optimised.before.bound < best.optimised.least <= best.optimised.after.seconds
    assert best.optimised.closed is not None and best.optimised.closed > 100.0 / 3.0
    stated = read_header(best.text.encode()).smoothing
    assert stated == best.options.smoothing > 0.0
    program = tmp_path / "p.ngc"
    program.write_text(best.text)
    assert verify(program, swing(), machine("mikron-ucp710"), "linuxcnc").ok
    program.write_text(best.text.replace("smoothing", "rounding"))
    found = verify(program, swing(), machine("mikron-ucp710"), "linuxcnc")
    assert (stated > 0.003) == ("verify.smoothing" in {d.code for d in found.diagnostics})


def test_a_header_that_gives_the_control_what_the_path_has_used_is_refused(tmp_path: Path) -> None:
    """0.005 mm are linearised, 0.003 the control's: with 0.007 in header and blocks both leave the tolerance of 0.01."""
    plain = made("linuxcnc")
    assert plain.ok and plain.comparison is not None and plain.comparison.tip_bound > 0.0025
    text = plain.text.replace("G64 P0.002 Q0.001", "G64 P0.006 Q0.001").replace("(feed mode auto)", (
        "(feed mode auto)\n(control's smoothing 0.007 mm)"))
    assert "P0.006 " in text and "smoothing 0.007 mm" in text
    program = tmp_path / "p.ngc"
    program.write_text(text)
    found = verify(program, swing(), machine("mikron-ucp710"), "linuxcnc")
    assert "verify.smoothing" in {d.code for d in found.diagnostics} and not found.ok


def test_a_tolerance_that_is_used_up_takes_fewer_blocks_and_is_kept() -> None:
    plain, filled = made("generic-iso"), made("generic-iso", filled=True)
    assert filled.ok and plain.path is not None and filled.path is not None and len(filled.path) < len(plain.path)
    assert plain.comparison is not None and filled.comparison is not None
    assert plain.comparison.tip_bound < filled.comparison.tip_bound <= 0.01
    assert "tolerance used up" in filled.text and "tolerance used up" not in plain.text
    assert program_clock().ranked(filled).seconds == program_clock().executed(filled).seconds


def test_what_is_slower_is_not_taken(few_shares: None) -> None:
    """A clock that finds every change slower: the program is the one without --optimise."""
    plain = made("linuxcnc")
    seen: list[float] = []

    def clock(result: PostResult, band: bool = False) -> ProgramTime:
        seen.append(100.0 + len(seen))
        moves = np.zeros(len(result.comparison.moves) if result.comparison else 0)
        return ProgramTime(seen[-1], (seen[-1], seen[-1]), 90.0, "clock of the test", moves)

    best = convert(swing(), machine("mikron-ucp710"), "linuxcnc", options=Options(optimise=True), clock=clock)
    assert best.ok and best.optimised is not None and not best.optimised.steps and len(seen) > 5
    assert [d.code for d in best.diagnostics] == [d.code for d in plain.diagnostics]
    body = [text.split("\n%")[0].splitlines()[-40:-5] for text in (best.text, plain.text)]
    assert body[0] == body[1]


def test_modes_that_the_shop_asks_for_stay(few_shares: None) -> None:
    best = made("siemens-840d", optimise=True, output="tcp")
    assert best.ok and best.optimised is not None
    assert not any("output mode" in one.what for one in best.optimised.steps) and best.setup.output.default == "auto"


def test_planned_feeds_are_optimised_too(few_shares: None) -> None:
    lines = wave(40)
    path = toolpath("RAPID", lines[0], "FEDRAT/MMPM,6000", *lines[1:])
    best = convert(path, machine("mikron-ucp710"), "fanuc-30i", options=Options(optimise=True, feed="planned"),
                   clock=program_clock())
    assert best.ok and best.optimised is not None and best.feed_times is not None
    assert best.optimised.after.seconds <= best.optimised.before.seconds


def faster_as_programmed(result: PostResult, band: bool = False) -> ProgramTime:
    """The clock of a control that makes its ramps itself, and runs programmed feeds faster."""
    seconds = 10.0 if result.options.feed == "planned" else 8.0
    moves = np.zeros(len(result.comparison.moves) if result.comparison else 0)
    return ProgramTime(seconds, (seconds, seconds), 5.0, "clock of the test", moves)


CORNER = ("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", "GOTO/20,0,50", "GOTO/21,1,50")


def test_programmed_feeds_that_are_kept_are_what_is_timed(few_shares: None) -> None:
    """Times are those of the program written."""
    best = convert(toolpath(*CORNER), machine("mill-3axis"), "linuxcnc", options=Options(optimise=True, feed="planned"),
                   clock=faster_as_programmed)
    assert best.ok and best.optimised is not None and best.feed_times is not None and best.feed_times.kept
    assert (best.optimised.before.seconds, best.optimised.after.seconds) == (8.0, 8.0)
    assert faster_as_programmed(best).seconds == 8.0


@pytest.mark.parametrize("limits", [{}, {"tip_acceleration": 300.0}])
def test_limits_of_a_tool_are_kept_by_planned_feeds_alone(limits: dict[str, float]) -> None:
    """Programmed feeds that are faster are none that keep what the set-up asks for."""
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 120.0, **limits}}})
    made = convert(toolpath(*CORNER), machine("mill-3axis"), "linuxcnc", setup, Options(feed="planned"),
                   clock=faster_as_programmed)
    assert made.ok and made.feed_times is not None and made.feed_times.kept == (not limits)
