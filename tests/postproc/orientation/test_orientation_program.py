"""Seconds of whole plans compared with those of the programs that are written for them, under the ideal control."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import toolpaths
from postproc.base.options import Options
from postproc.orientation.plans.orient import orient
from postproc.pipeline.convert import convert
from postproc.report.unwinding import unwinding
from postproc.setup.model import load_setup
from tests.postproc.kit import SAMPLES, machine
from tests.postproc.time_kit import program_seconds
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

HEAD = ["UNITS/MM", "CUTTER/10,5", "LOADTL/1", "SPINDL/RPM,1000,CLW", "MULTAX"]


def strips() -> Toolpath:
    """Three faces at 35 degrees, each a third of half a turn further round, then the top: strips with rapids off and on."""
    lines = list(HEAD)
    for turn, lean in [(0.0, 35.0), (120.0, 35.0), (240.0, 35.0), (0.0, 0.0)]:
        c, s = np.cos(turn * DEG), np.sin(turn * DEG)
        axis = np.array([np.sin(lean * DEG) * c, np.sin(lean * DEG) * s, np.cos(lean * DEG)])
        level = np.array([-s, c, 0.0])
        for k in range(1):
            ends = [20.0 * np.array([c, s, 0.0]) + side * 25.0 * level + 4.0 * k * np.cross(level, axis)
                    for side in (-1.0, 1.0)]
            begin, end = ends
            for word, at in (("RAPID", begin + 20.0 * axis), ("RAPID", begin + 3.0 * axis), ("FEDRAT/MMPM,9000", begin),
                             ("FEDRAT/MMPM,9000", end), ("RAPID", end + 20.0 * axis)):
                lines += [word, "GOTO/" + ",".join(f"{x:.6f}" for x in (*at, *axis))]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]).encode(), file="strips.apt")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


@pytest.mark.parametrize(("name", "counts"), [
    ("mikron-ucp710", {"park": "turn"}), ("mikron-ucp710", {"park": "home"}),
    ("mikron-ucp710", {"park": "home", "modulo": True}),
    pytest.param("head-table", {"park": "home"}, marks=pytest.mark.slow)],
    ids=["whole-turn", "home", "modulo", "head-table"])
def test_a_plan_takes_as_long_as_its_program(name: str, counts: dict[str, Any]) -> None:
    """From home to home with the tool change: `keep` winds C up, which the travel home undoes only where C
    parks at home and counts its turns. The program rounds corners between rapids, the count stops there, so
    that it is above by some percent at most."""
    m, (setup, _) = machine(name), load_setup(SAMPLES / "tools.setup.toml")
    m = replace(m, turns=tuple(replace(turns, **counts) if m.endless[j] else turns for j, turns in enumerate(m.turns)))
    assert setup is not None
    choice, found = orient(strips(), m, setup, Options(max_tilt=5.0))
    assert choice is not None, found
    counted, written, wound = {}, {}, {}
    for plan in ("keep", "auto"):
        program = convert(choice.toolpath(plan), m, setup=setup, options=Options(feed="planned"))
        counted[plan], written[plan] = choice.plans[plan].seconds, program_seconds(program)
        wound[plan] = sum(one["in_program_s"] for one in unwinding(program).values())
        assert counted[plan] == pytest.approx(written[plan], rel=0.025), plan
    assert counted["keep"] - counted["auto"] == pytest.approx(written["keep"] - written["auto"], abs=0.3)
    assert (wound["keep"] > 0.5) == (counts == {"park": "home"})


def test_a_plan_counts_the_way_by_home_where_the_tool_waits_there_to_index() -> None:
    """A Haas retracts to home before rotary axes turn; `orient` without a controller goes by the set-up alone."""
    options = Options(setup=str(SAMPLES / "tools.setup.toml"), orient="auto", feed="planned", max_tilt=5.0)
    setup, m = load_setup(SAMPLES / "tools.setup.toml")[0], machine("mikron-ucp710")
    assert setup is not None
    program = convert(strips(), m, "haas-ngc", setup, options)
    assert program.ok and program.choice is not None, [str(d) for d in program.diagnostics]
    counted, written = program.choice.plans["auto"].seconds, program_seconds(program)
    stops = 0.4 * program.text.count("G53 G0 G49")  # s: the way home begins from rest where its block takes the length off
    assert written - stops < counted < 1.025 * written
    low, _ = orient(strips(), m, setup, options)
    assert low is not None and counted > low.plans["auto"].seconds + 1.0


def drilled(*cycles: str) -> Toolpath:
    """Two holes by each cycle from above, two on a face at 30 degrees."""
    lines = list(HEAD)
    for cycle in cycles:
        for side, lean in ((-1.0, 0.0), (1.0, 30.0)):
            axis = f"{np.sin(lean * DEG):.9f},0,{np.cos(lean * DEG):.9f}"
            lines += ["RAPID", f"GOTO/{side * 40.0},0,20,{axis}", f"CYCLE/{cycle}", f"GOTO/{side * 20.0},0,0,{axis}",
                      f"GOTO/{side * 20.0},30,0,{axis}", "CYCLE/OFF", "RAPID", f"GOTO/{side * 40.0},0,20,{axis}"]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]).encode(), file="holes.apt")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table"])
def test_holes_take_as_long_as_in_the_program(name: str) -> None:
    path = drilled("DRILL,DEPTH,12,MMPM,600,CLEAR,3,DWELL,0.5", "DEEP,DEPTH,12,STEP,5,MMPM,900,CLEAR,2", "BORE,DEPTH,6,MMPM,"
                   "600,CLEAR,3")
    m, (setup, _) = machine(name), load_setup(SAMPLES / "tools.setup.toml")
    assert setup is not None
    choice, found = orient(path, m, setup, Options())
    assert choice is not None, found
    drilling = sum(tried.own.drilling for tried in choice.tried)
    fed = 4 * (15.0 / 10.0 + 0.5) + 4 * 14.0 / 15.0 + 4 * 2 * 9.0 / 10.0
    assert fed < drilling < 1.15 * fed and choice.plans["keep"].cuts.sum() == pytest.approx(drilling)
    written = program_seconds(convert(path, m, setup=setup, options=Options(feed="planned")))
    assert choice.plans["keep"].seconds == pytest.approx(written, rel=0.03)


def test_a_hole_is_timed_from_rest_to_rest() -> None:
    """15 mm down at 600 mm/min: what the feed takes, and a little for the start and the stop."""
    choice, _ = orient(drilled("DRILL,DEPTH,12,MMPM,600,CLEAR,3"), machine("mikron-ucp710"), load_setup(
        SAMPLES / "tools.setup.toml")[0] or pytest.fail(), Options())
    assert choice is not None
    one = choice.tried[0].own
    assert 1.5 * 2 < one.drilling < 1.6 * 2 and one.bound == pytest.approx(one.seconds) and not one.one.stretches
