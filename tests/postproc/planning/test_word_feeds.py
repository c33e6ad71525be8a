"""Words of `--feed planned` carry the plan: executed as written on a jerk-limited control, and by closed forms."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import toolpaths
from postproc.base.options import FeedSource, Options
from postproc.controllers.model import load_controller
from postproc.cycle_time import control
from postproc.cycle_time.conversion import program_clock
from postproc.cycle_time.estimate import timed
from postproc.cycle_time.lookahead import limits, rests
from postproc.cycle_time.model import load_model
from postproc.cycle_time.shape import shape
from postproc.cycle_time.source import from_conversion
from postproc.feedrate.feed import StepFeed
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.path.added_points import cut_at
from postproc.pipeline.convert import convert as convert_by_clock
from postproc.pipeline.feeds_by_clock import ProgramClock
from postproc.pipeline.result import PostResult
from postproc.planning.word_feeds import LEAST, SPREAD
from tests.postproc.kit import SAMPLES, convert, good, machine, toolpath
from tests.postproc.planning.test_planned_feed import wave

REFERENCE = "control"
JERKY = "fanuc-30i"
"""a control that limits jerk"""
PATHS = {"wave, fast": ("mikron-ucp710", 160, 9000), "wave, slow": ("mikron-ucp710", 160, 1500),
         "wave, few points": ("mikron-ucp710", 40, 6000), "fork head": ("fork-head-ab", 100, 4000),
         "nutating head": ("nutating-head", 100, 3000), "trunnion": ("trunnion-bc", 100, 5000)}


def waves(name: str, count: int, rate: int, feed: FeedSource = "planned", controller: str = JERKY,
          clock: ProgramClock | None = None) -> PostResult:
    """Without a clock the words carry the ideal plan."""
    lines = wave(count)
    return good(convert_by_clock(toolpath("RAPID", lines[0], f"FEDRAT/MMPM,{rate}", *lines[1:]), machine(name), controller,
                                 str(SAMPLES / "tools.setup.toml"), Options(feed=feed), clock=clock))


def lines_and_corner(feed: FeedSource = "planned", clock: ProgramClock | None = None) -> PostResult:
    return good(convert_by_clock(toolpath("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", "GOTO/80,0,50", "GOTO/80,60,50",
                                          "GOTO/20,60,40"), machine("mill-3axis"), JERKY, options=Options(feed=feed),
                                 clock=clock))


def on_the_control(result: PostResult, name: str = REFERENCE) -> tuple[float, list[float]]:
    """(s of the passes as the reference control runs the written words, largest share of velocity, acceleration and jerk
    that the axes use, jerk but for 2 % of the cycles)."""
    assert result.motion is not None and result.moves is not None
    model, _ = load_model(name)
    assert model is not None
    model, blocks = model.of_machine(result.machine), from_conversion(result)
    form = shape(blocks)
    moved, _ = control.motion(blocks, model, form, rests(blocks, form), limits(blocks, form, model)[0])
    found, used = moved.axes(), moved.settings
    jerk = np.abs(found.qddd / used.jerk).max(axis=1)
    shares = [float(np.abs(found.qd / used.velocity).max()), float(np.abs(found.qdd / used.acceleration).max()),
              float(np.quantile(jerk, 0.98))]
    own = np.isin(blocks.move, np.concatenate([one.move for one in result.motion.passes])) & ~blocks.rapid
    return float(timed(blocks, model).seconds[own].sum()), shares


def executed(result: PostResult, strict: bool = True) -> tuple[float, float, float]:
    """(s, worst ratio to a limit, s of the plan) of the passes under the words as steps of the largest speed, from rest to
    rest: a control that uses its limits to the full."""
    assert result.motion is not None and result.feeds is not None
    seconds, worst, planned = 0.0, 0.0, 0.0
    for one, made in zip(result.motion.passes, result.motion.plans, strict=True):
        rows = np.flatnonzero(one.ends > one.begin)
        speed = (one.ends - one.begin)[rows] / result.feeds.seconds[one.block[rows]]
        edges = np.append(one.begin[rows], one.ends[rows[-1]])
        for path in one.paths:
            run = plan(path, result.motion.source.bounds_of(one), StepFeed(edges, speed),
                       options=PlannerOptions(strict=strict))
            seconds, worst = seconds + run.seconds, max(worst, run.usage().worst)
        planned += made.seconds
    return seconds, worst, planned


@cache
def carried(name: str) -> PostResult:
    """Words that carry the plan of the reference control."""
    clock = program_clock(REFERENCE)
    return waves(*PATHS[name], clock=clock) if name in PATHS else lines_and_corner(clock=clock)


@pytest.mark.parametrize("name", ["trunnion", "lines and corner"])
def test_the_reference_control_runs_the_words_in_the_time_of_its_plan(name: str) -> None:
    """Within 3 %, its limits kept; on ten paths in `bench_planned_words.py`. The ideal plan is up to a third faster."""
    result = carried(name)
    times = result.feed_times
    assert times is not None and result.control_plan is not None and times.plan > times.ideal
    seconds, used = on_the_control(result)
    assert seconds == pytest.approx(times.plan, rel=0.03)
    assert max(used) <= 1.05, used
    assert times.planned.seconds <= 1.005 * times.programmed.seconds


def test_words_of_neighbours_differ_by_what_the_control_can_change_between_them() -> None:
    """Both are speeds of one motion, at most 5 % above it: they differ by no more than the axes can accelerate in both."""
    result = carried("trunnion")
    assert result.motion is not None and result.feeds is not None and result.path is not None
    block, seconds = result.motion.passes[0].block, result.feeds.seconds
    step = np.diff(result.path.q, axis=0, prepend=result.path.q[:1])[block]
    speed = step / seconds[block, None]
    allowed = result.machine.limits
    most = allowed.acceleration * (seconds[block][1:] + seconds[block][:-1])[:, None] + 0.1 * np.abs(speed[1:])
    assert (np.abs(np.diff(speed, axis=0)) <= 1.1 * most + 0.02 * allowed.velocity).all()


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("name", PATHS)
def test_a_jerk_limited_control_takes_the_plans_time(name: str) -> None:
    result = waves(*PATHS[name])
    seconds, worst, planned = executed(result)
    assert abs(seconds / planned - 1.0) < 0.03 and worst <= 1.0 + 1e-9


def test_mean_speeds_would_take_longer() -> None:
    """Why F is the highest speed of the plan in a block, not the mean."""
    result = waves(*PATHS["wave, fast"])
    assert result.motion is not None and result.feeds is not None
    one, made = result.motion.passes[0], result.motion.plans[0]
    mean = np.zeros_like(result.feeds.seconds)
    mean[one.block] = made.blocks(np.append(one.begin, one.ends[-1])).seconds
    slower = replace(result, feeds=replace(result.feeds, seconds=np.fmax(mean, result.feeds.seconds)))
    assert executed(slower, strict=False)[0] > 1.04 * made.seconds


def test_words_are_near_the_plans_means_and_never_above_its_speeds() -> None:
    result = waves(*PATHS["wave, fast"])
    assert result.motion is not None and result.feeds is not None
    one, made = result.motion.passes[0], result.motion.plans[0]
    speeds = made.blocks(np.append(one.begin, one.ends[-1]))
    word = (one.ends - one.begin) / result.feeds.seconds[one.block]
    assert (word <= speeds.highest * 1.005).all()
    moving = speeds.lowest > 0.8 * speeds.highest
    assert (word[moving] <= (1.0 + 3.0 * SPREAD) * speeds.mean[moving]).all() and moving.sum() > 120
    assert (speeds.seconds[moving] > 0.1 * LEAST).all()
    assert np.nansum(result.feeds.seconds[one.block]) > 0.85 * made.seconds


def test_points_are_added_where_a_block_spans_its_ramps() -> None:
    plain, result = lines_and_corner("programmed"), lines_and_corner()
    assert plain.path is not None and result.path is not None and result.motion is not None
    own = set(np.round(plain.path.q, 9)[:, 0].tolist())
    assert len(result.path) > len(plain.path) + 20 and own <= set(np.round(result.path.q, 9)[:, 0].tolist())
    assert np.nansum(result.path.seconds) == pytest.approx(np.nansum(plain.path.seconds), rel=1e-9)
    seconds, worst, planned = executed(result)
    assert abs(seconds / planned - 1.0) < 0.03 and worst <= 1.0 + 1e-9


def test_cut_parts_stay_on_their_block() -> None:
    result = waves("mikron-ucp710", 40, 6000, "programmed", "linuxcnc")
    assert result.path is not None and result.job is not None
    block, share = np.array([5, 5, 9]), np.array([0.25, 0.75, 0.5])
    cut = cut_at(result.path, result.job.moves, result.job.kinematics, machine("mikron-ucp710").home, block, share)
    q, s = result.path.q, result.path.seconds
    assert len(cut) == len(result.path) + 3 and cut.q[[7, 12]].tolist() == q[[5, 9]].tolist()
    assert cut.q[5] == pytest.approx(0.75 * q[4] + 0.25 * q[5], abs=1e-12)
    assert cut.seconds[5:8] == pytest.approx(s[5] * np.array([0.25, 0.5, 0.25]))
    assert cut.u[5] == pytest.approx(0.25) and cut.u[7] == 1.0
    assert cut.begin[-1] == result.path.begin[-1] + 3


@pytest.mark.parametrize("controller", ["linuxcnc", JERKY])
def test_both_times_are_reported_and_planned_is_not_slower(controller: str) -> None:
    lines = wave(60)
    path = toolpath("RAPID", lines[0], "FEDRAT/MMPM,6000", *lines[1:])
    made = good(convert_by_clock(path, machine("mikron-ucp710"), controller, options=Options(feed="planned"),
                                 clock=program_clock()))
    times = made.feed_times
    assert times is not None and times.plan > 0.5
    spec, _ = load_controller(controller)
    assert spec is not None
    if spec.feed.limited_jerk:
        assert times.planned.seconds <= 1.03 * times.programmed.seconds and not times.kept
        assert times.plan > times.words > times.words_programmed
    else:
        written = program_clock()(made).seconds
        assert written <= times.programmed.seconds
        assert times.kept == (times.planned.seconds > times.programmed.seconds)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bicubic.cls", "five_tilted.cls"])
def test_the_model_of_a_control_takes_no_longer(name: str) -> None:
    """The reference control on its own path: planned words cost nothing that counts."""
    model, _ = load_model("control")
    assert model is not None
    seconds = []
    for feed in ("programmed", "planned"):
        path, _ = toolpaths.read(SAMPLES / name)
        made = good(convert(path, "mikron-ucp710", JERKY, feed=feed))
        blocks = from_conversion(made)
        seconds.append(float(timed(blocks, model.of_machine(made.machine)).end.max()))
    assert seconds[1] <= 1.03 * seconds[0]


def test_blocks_that_a_radius_shifts_stay_whole() -> None:
    """A control takes the radius up, and off, over one block, and finds corners between two (Fanuc B-63944EN-2, cutter
    compensation: PS0041 where a corner's blocks are shorter than the shift)."""
    before = ["RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", "GOTO/0,0,40"]
    shifted = ["CUTCOM/LEFT", "GOTO/10,0,40", "GOTO/40,0,40", "GOTO/40,30,40", "CUTCOM/OFF", "GOTO/60,30,40"]
    after = ["RAPID", "GOTO/60,30,50", "GOTO/0,30,40"]
    made = good(convert(toolpath(*before, *shifted, *after), "mill-3axis", JERKY, feed="planned"))
    assert made.path is not None and made.job is not None
    row = made.job.moves.row[made.path.move]
    counts = np.bincount(row[made.path.code == 1], minlength=8)
    assert counts[1] > 2 and counts[7] > 2 and (counts[2:6] == 1).all(), counts
