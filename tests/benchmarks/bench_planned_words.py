"""Words of `--feed planned` executed: under the planner as a control, and on the reference control, next to programmed ones.

    python tests/benchmarks/bench_planned_words.py

Ten paths: plan, sums of the words, least time under the words as largest speeds (and under the plan's mean speeds), and
the model `control` with programmed and planned words.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import toolpaths
from postproc.cycle_time.estimate import timed
from postproc.cycle_time.model import load_model
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.result import PostResult
from tests.postproc.kit import SAMPLES, convert, good
from tests.postproc.planning.test_word_feeds import JERKY, PATHS, executed, lines_and_corner, waves
from toolpaths.diagnostics import read_value

SAMPLE_PATHS = (("bicubic.cls", "mikron-ucp710"), ("five_tilted.cls", "mikron-ucp710"), ("pocket.cls", "mill-3axis"))


def sample(name: str, machine: str) -> Callable[[str], PostResult]:
    return lambda feed: good(convert(toolpaths.read(SAMPLES / name)[0], machine, JERKY, feed=feed))


def of_wave(name: str) -> Callable[[str], PostResult]:
    return lambda feed: waves(*PATHS[name], feed=feed)


def on_the_control(result: PostResult) -> float:
    """s of the cuts under the model `control`."""
    blocks, model = from_conversion(result), read_value(load_model("control"))
    return float(timed(blocks, model.of_machine(result.machine)).seconds[~blocks.rapid].sum())


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


def main() -> None:
    paths = {**{name: of_wave(name) for name in PATHS}, "lines and corner": lines_and_corner,
             **{name: sample(name, machine) for name, machine in SAMPLE_PATHS}}
    print(f"{'path':18}{'plan s':>9}{'words':>9}{'executed':>10}{'of means':>10}{'worst':>7} | control: programmed, planned")
    for name, make in paths.items():
        plain, planned = make("programmed"), make("planned")
        if planned.feeds is None:
            raise ValueError("no feeds")
        seconds, worst, plan = executed(planned)
        print(f"{name:18}{plan:9.3f}{np.nansum(planned.feeds.seconds):9.3f}{seconds:10.3f}"
              f"{executed(means(planned), strict=False)[0]:10.3f}{worst:7.3f} | {on_the_control(plain):9.3f} "
              f"{on_the_control(planned):9.3f}", flush=True)


if __name__ == "__main__":
    main()
