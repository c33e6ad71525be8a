"""Limits of a tool in the set-up (tip_acceleration, tip_jerk, axis_rate): kept by planned feeds and by the
planned motion, measured on the CL curve with the feeds of the words; named where feeds are not planned."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
from machines.dynamics_models import AxisMassModel, DynamicsModel
from postproc.cli.app import app
from postproc.cycle_time.planned import planned_times
from postproc.cycle_time.source import from_conversion
from postproc.feedrate.limits import ToolLimits
from postproc.pipeline.result import PostResult
from postproc.planning.pass_geometry import PassGeometry, pass_geometry, stops_of
from postproc.planning.planned import PlannedMotion, Source
from postproc.planning.planned_source import source_of
from postproc.planning.steady_feed import CORNER
from postproc.setup.fingerprint import fingerprint
from postproc.setup.model import SetupFile, ToolSetup
from tests.postproc.kit import execute, good, machine, toolpath
from tests.postproc.planning.test_planned_feed import STENCIL, cuts, seconds, wave
from tests.postproc.time_kit import model
from toolpaths.arrays import Floats
from toolpaths.smoothing.smooth import Smooth, Tolerance

STATED = {"tip_acceleration": 150.0, "tip_jerk": 1000.0, "axis_rate": 6.0}
"""Each is exceeded by the programmed feed of 3000 mm/min, and by what the axes alone allow."""


def converted(limits: dict[str, float], feed: str = "planned", number: str = "1") -> PostResult:
    lines = wave(160)
    setup = SetupFile(tools={"1": ToolSetup(gauge_length=120.0), number: ToolSetup(gauge_length=120.0, **limits)})
    path = toolpath("RAPID", lines[0], "FEDRAT/MMPM,3000", *lines[1:])
    return good(postproc.convert(path, machine("mikron-ucp710"), "linuxcnc", setup, postproc.Options(feed=feed)))


def at_the_tool(path: Smooth, s: Floats) -> tuple[Floats, Floats, Floats]:
    """|axis'|, degrees per mm, |tip''| and |tip'''| at s (N,), by differences."""
    tip, axis = (part.reshape(len(s), 4, 3) for part in
                 path.at((s[:, None] + STENCIL * np.array([-1.5, -0.5, 0.5, 1.5])).ravel()))
    bend = (tip[:, 3] - tip[:, 2] - tip[:, 1] + tip[:, 0]) / (2.0 * STENCIL**2)
    third = (tip[:, 3] - 3.0 * tip[:, 2] + 3.0 * tip[:, 1] - tip[:, 0]) / STENCIL**3
    turn = np.degrees(np.linalg.norm(axis[:, 2] - axis[:, 1], axis=1) / STENCIL)
    return turn, np.linalg.norm(bend, axis=1), np.linalg.norm(third, axis=1)


def geometry(result: PostResult) -> PassGeometry:
    job, path = result.job, result.path
    assert job is not None and path is not None
    stops = stops_of(job.toolpath, job.moves)
    one, = pass_geometry(path, job.moves, job.kinematics, Tolerance(0.01, np.radians(0.05)), stops, CORNER)[0]
    return one


def largest(result: PostResult) -> dict[str, float]:
    """What the words do at the tool: each block at its feed, at nine places."""
    one, steps, first = geometry(result), cuts(result), execute(result)
    before = first[first.index(next(step for step in first if step.kind == "feed")) - 1].end
    speed = (one.ends - one.begin) / seconds(steps, before)
    found: dict[str, float] = dict.fromkeys(STATED, 0.0)
    for part in np.linspace(0.0, 1.0, 9):
        s = np.clip(one.begin + part * (one.ends - one.begin), 2.0 * STENCIL,
                    one.smooth.s[-1] - 2.0 * STENCIL)
        turn, bend, third = at_the_tool(one.smooth, s)
        here = {"axis_rate": turn * speed, "tip_acceleration": bend * speed**2, "tip_jerk": third * speed**3}
        for name, values in here.items():
            found[name] = max(found[name], float(values.max()))
    return found


@pytest.mark.parametrize("name", sorted(STATED))
def test_planned_feeds_keep_a_limit_of_the_tool(name: str) -> None:
    free, kept = largest(converted({})), largest(converted({name: STATED[name]}))
    assert free[name] > 1.2 * STATED[name]
    assert 0.7 * STATED[name] < kept[name] < 1.01 * STATED[name]


def test_the_limit_of_another_tool_changes_nothing() -> None:
    assert [s.feed for s in cuts(converted(STATED, number="7"))] == [s.feed for s in cuts(converted({}))]


def test_the_time_that_the_limits_of_the_tool_cost_is_reported() -> None:
    motion = converted({"tip_acceleration": 20.0}).motion
    assert motion is not None and motion.limiting()["tool"]["acceleration_s"] > 0.5 * motion.seconds


def test_the_report_names_the_tool() -> None:
    reduced, = (d for d in converted({"tip_acceleration": 100.0}).diagnostics if d.code == "feed.reduced")
    assert "or the tool a limit of the set-up" in reduced.message


def ideal(limits: dict[str, float], **without: Any) -> float:
    """s of a line of 200 mm at 1200 mm/min, from rest to rest, as the ideal model plans it."""
    path = toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,1200", "GOTO/200,0,5", "RAPID",
                    "GOTO/200,0,50")
    mill = machine("mill-3axis")
    mill = replace(mill, limits=replace(mill.limits, **without))
    result = good(postproc.convert(path, mill, "linuxcnc", SetupFile(tools={"1": ToolSetup(**limits)})))
    blocks = from_conversion(result)
    times, found = planned_times(result, blocks, model("ideal"))
    assert not found
    return float(times.seconds[~blocks.rapid].sum())


def test_the_planned_motion_accelerates_no_faster_than_the_tool_may() -> None:
    """v/A more than the path takes at full speed; on machines that state no jerk as well."""
    assert ideal({"tip_acceleration": 5.0}) == pytest.approx(200.0 / 20.0 + 20.0 / 5.0, rel=5e-3)
    none = np.full(3, np.inf)
    assert ideal({"tip_acceleration": 5.0}, jerk=none) == pytest.approx(200.0 / 20.0 + 20.0 / 5.0, rel=3e-3)
    assert ideal({}, jerk=none) < 10.2


@cache
def corners() -> Source:
    """Nine blended corners, at 3000 mm/min."""
    corner = [f"GOTO/{x},{y},5" for k in range(3) for x, y in ((10, k), (10, 10), (0, 10), (0, 1 + k))]
    path = toolpath("RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,3000", *corner)
    result = good(postproc.convert(path, machine("mill-3axis"), "linuxcnc", SetupFile()))
    assert result.job is not None and result.path is not None
    return source_of(result.job, result.job.moves, result.path)


@pytest.mark.parametrize(("name", "values"), [("acceleration", (2.0, 290.0, 310.0)), ("jerk", (100.0, 1e4, 1e6)),
                                              ("tilt_rate", (0.01, 1.0))])
def test_a_looser_limit_never_slows_the_strict_plan(name: str, values: tuple[float, ...]) -> None:
    """Nor is it 3 % slower than the fast plan, whose samples exceed the limits a little."""
    source = corners()
    strict, fast = ([PlannedMotion(replace(source, tools={0: ToolLimits(**{name: value})}), strict=keep).seconds
                     for value in values] for keep in (True, False))
    assert all(behind <= 1.002 * before for before, behind in pairwise(strict))
    assert all(one <= 1.03 * other for one, other in zip(strict, fast, strict=True))


def test_limits_that_nobody_keeps_are_named(tmp_path: Path) -> None:
    """The hint followed: with --feed planned the warning is gone."""
    (tmp_path / "part.cls").write_text("TOOL PATH/A,TOOL,T\nTLDATA/MILL,10,0,50,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\n"
                                       "SPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/MMPM,800\nGOTO/0,0,0\n"
                                       "GOTO/30,0,0\nGOTO/30,20,0\nEND-OF-PATH\n")
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 100\ntip_acceleration = 300\n")
    words = ["convert", str(tmp_path / "part.cls"), "-m", "mill-3axis", "-c", "linuxcnc", "-o", str(tmp_path / "o.ngc"),
             "--setup", str(tmp_path / "s.toml")]
    plain, planned = CliRunner().invoke(app, words), CliRunner().invoke(app, [*words, "--feed", "planned"])
    assert plain.exit_code == 0 == planned.exit_code, plain.output + planned.output
    assert "setup.tool_limits" in plain.output and "--feed planned" in plain.output
    assert "setup.tool_limits" not in planned.output


def test_the_cutting_force_of_a_tool_is_taken_off_the_motors() -> None:
    """On an arc of 20 mm at 3000 mm/s2 of X, of which the cut takes four fifths, planned feeds are no more than
    (600 20) ** 0.5 mm/s, and those of the CL file, 500 mm/s, do not take their place for that."""
    mill, at = machine("mill-3axis"), np.linspace(0.0, 0.2, 16)
    axes = {name: AxisMassModel(mass=50.0, force=force) for name, force in zip("XYZ", (150.0, 300.0, 3000.0), strict=True)}
    round_ = [f"GOTO/{20 * np.cos(a):.5f},{20 * np.sin(a):.5f},5" for a in at]
    result = good(postproc.convert(
        toolpath("RAPID", round_[0], "FEDRAT/MMPM,30000", *round_[1:]), replace(mill, dynamics=DynamicsModel(axes=axes)),
        "linuxcnc", SetupFile(tools={"1": ToolSetup(gauge_length=90.0, cutting_force=120.0)}),
        postproc.Options(feed="planned")))
    assert np.nansum(result.feeds.seconds) > 20.0 * at[-1] / 120.0


def test_the_fingerprint_counts_limits_that_are_stated() -> None:
    """Set-ups without them keep the fingerprint of programs that were written before the keys were there."""
    def setup(**limits: float) -> SetupFile:
        return SetupFile(tools={"1": ToolSetup(gauge_length=120.0, **limits)})

    marks = [fingerprint(one, "") for one in (setup(), *(setup(**{name: 5.0}) for name in STATED))]
    assert marks[0] == "05a7ef6c" and len(set(marks)) == 4
