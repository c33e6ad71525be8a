"""The ideal model of a CL file is the feed planner's motion."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import postproc
from postproc.cycle_time.bound import lower_bound
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.planned import planned_times, with_seconds
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.result import PostResult
from tests.postproc.kit import TOOLS, few_sides, toolpath
from tests.postproc.time_kit import model


@cache
def converted(name: str, machine: str, **options: object) -> PostResult:
    path = few_sides(name, (1, 2) if name == "pocket.cls" else None)
    result = postproc.convert(path, machine, "linuxcnc", TOOLS, postproc.Options(**options))
    assert result.ok, result.diagnostics
    return result


@pytest.mark.parametrize(("name", "machine"),
                         [("pocket.cls", "mill-3axis"), ("tool_axis_tour.apt", "mikron-ucp710")])
def test_passes_take_what_the_plan_takes(name: str, machine: str) -> None:
    result = converted(name, machine, feed="planned")
    blocks, ideal = from_conversion(result), model("ideal")
    times, found = planned_times(result, blocks, ideal)
    assert not found and result.motion is not None and blocks.move is not None
    passes = np.zeros(len(blocks), dtype=bool)
    for one in result.motion.passes:
        passes |= ~blocks.rapid & (blocks.move >= one.move.min()) & (blocks.move <= one.move.max())
    kept = replace(result.motion, strict=True)
    assert times.seconds[passes].sum() == pytest.approx(kept.seconds, rel=1e-9)
    limits, worst = kept.source.bounds, 0.0
    for made in kept.trajectories():
        q = np.concatenate([made.q[:1]] * 3 + [made.q] + [made.q[-1:]] * 3)
        worst = max(worst, float((np.abs(np.diff(q, 3, axis=0)) / 1e-9 / limits.jerk).max()))
    assert worst <= 1.002
    own = timed(blocks, ideal)
    np.testing.assert_allclose(times.seconds[~passes], own.seconds[~passes], rtol=1e-9, atol=1e-9)
    assert lower_bound(blocks, ideal) <= total(blocks, times)
    e = estimate(blocks, result.machine, ideal, times=times)
    assert e.seconds == pytest.approx(total(blocks, times)) and e.band[0] < e.seconds < e.band[1]


def test_one_straight_pass_is_rest_to_rest() -> None:
    """A line of 200 mm at 1200 mm/min: plan, model and closed form agree."""
    path = toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,1200", "GOTO/200,0,5", "RAPID",
                    "GOTO/200,0,50")
    result = postproc.convert(path, "mill-3axis", "linuxcnc", TOOLS)
    blocks, ideal = from_conversion(result), model("ideal")
    times, found = planned_times(result, blocks, ideal)
    assert not found
    cut = np.flatnonzero(~blocks.rapid)
    expected = 200.0 / 20.0 + 2.0 * np.sqrt(20.0 / 30000.0)
    assert times.seconds[cut].sum() == pytest.approx(expected, rel=2e-3)
    assert timed(blocks, ideal).seconds[cut].sum() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("override", [0.5, 2.0])
def test_the_operators_override_in_the_planned_motion(override: float) -> None:
    """The same line at 50 % and 200 % of 1200 mm/min; a model whose control runs feeds faster multiplies it."""
    path = toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,1200", "GOTO/200,0,5", "RAPID",
                    "GOTO/200,0,50")
    result = postproc.convert(path, "mill-3axis", "linuxcnc", TOOLS)
    blocks, ideal = from_conversion(result, override), model("ideal")
    cut, speed = np.flatnonzero(~blocks.rapid), 20.0 * override
    expected = 200.0 / speed + 2.0 * np.sqrt(speed / 30000.0)
    assert planned_times(result, blocks, ideal, override)[0].seconds[cut].sum() == pytest.approx(expected, rel=4e-3)
    assert timed(blocks, ideal).seconds[cut].sum() == pytest.approx(expected, rel=4e-3)
    faster = ideal.model_copy(update={"override": 1.0 / override})
    expected = 200.0 / 20.0 + 2.0 * np.sqrt(20.0 / 30000.0)
    assert planned_times(result, blocks, faster, override)[0].seconds[cut].sum() == pytest.approx(expected, rel=4e-3)


def test_other_times_keep_rests_between_blocks() -> None:
    blocks = from_conversion(converted("pocket.cls", "mill-3axis"))
    own = timed(blocks, model("lookahead"))
    slow = with_seconds(own, 2.0 * own.seconds)
    np.testing.assert_allclose(slow.begin[1:] - slow.end[:-1], own.begin[1:] - own.end[:-1], atol=1e-9)
    np.testing.assert_allclose(slow.end - slow.begin, 2.0 * own.seconds, atol=1e-9)
