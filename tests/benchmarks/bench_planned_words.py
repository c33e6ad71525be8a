"""Words of `--feed planned` executed on the reference control, in the passes, next to the plan that they carry.

    python tests/benchmarks/bench_planned_words.py [MODEL]

Ten paths: the ideal plan, the plan by the control's rules, the words as the control executes them and over that plan, the
largest shares of velocity, acceleration and jerk (all cycles but 2 %) that its axes use, the same with programmed
words; then, of the ideal plan on an ideal control, least time under the words as largest speeds, and under mean speeds.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import toolpaths
from postproc.base.options import FeedSource, Options
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline.convert import convert as convert_by_clock
from postproc.pipeline.feeds_by_clock import ProgramClock
from postproc.pipeline.result import PostResult
from tests.postproc.kit import SAMPLES, good, machine, tool_setup
from tests.postproc.planning.test_word_feeds import JERKY, PATHS, executed, lines_and_corner, on_the_control, waves

SAMPLE_PATHS = (("bicubic.cls", "mikron-ucp710"), ("five_tilted.cls", "mikron-ucp710"), ("pocket.cls", "mill-3axis"))


def sample(name: str, machine_name: str, feed: FeedSource = "planned", clock: ProgramClock | None = None) -> PostResult:
    return good(convert_by_clock(toolpaths.read(SAMPLES / name)[0], machine(machine_name), JERKY, tool_setup(),
                                 Options(feed=feed), clock=clock))


def means(result: PostResult) -> PostResult:
    """The same with the plan's mean speeds as words."""
    if result.motion is None or result.feeds is None:
        raise ValueError("no plan")
    seconds = result.feeds.seconds.copy()
    for one, made in zip(result.motion.passes, result.motion.plans, strict=True):
        rows = np.flatnonzero(one.ends > one.begin)
        cuts = np.append(one.begin[rows], one.ends[rows[-1]])
        seconds[one.block[rows]] = np.fmax(np.diff(made.time(cuts)), seconds[one.block[rows]])
    return replace(result, feeds=replace(result.feeds, seconds=seconds))


def main(model: str) -> None:
    paths = {**{name: partial(waves, *PATHS[name]) for name in PATHS}, "lines and corner": lines_and_corner,
             **{name: partial(sample, name, kind) for name, kind in SAMPLE_PATHS}}
    print(f"{'path':18}{'ideal s':>9}{'plan':>9}{'executed':>10}{'ratio':>8}  v, a, j used {'programmed':>15}"
          f"{'| ideal words':>15}{'means':>9}")
    for name, make in paths.items():
        made, plain, ideal = make(clock=program_clock(model)), make(feed="programmed"), make()
        if made.feed_times is None or made.motion is None:
            raise ValueError("no plan")
        plan = made.feed_times.plan
        seconds, used = on_the_control(made, model)
        before = on_the_control(replace(plain, motion=made.motion), model)[0]
        print(f"{name:18}{made.feed_times.ideal:9.3f}{plan:9.3f}{seconds:10.3f}{seconds / plan:8.3f}  "
              f"{used[0]:.2f} {used[1]:.2f} {used[2]:.2f} {before:15.3f}{executed(ideal)[0]:15.3f}"
              f"{executed(means(ideal), strict=False)[0]:9.3f}", flush=True)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["control"]))
