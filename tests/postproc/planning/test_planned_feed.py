"""`--feed planned`, `--merge-feeds` and `--smooth`, from the words of the programs that come out."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from typer.testing import CliRunner

from machines.kinematics.base import Kinematics
from postproc.cli.app import app
from postproc.compile.merged_feeds import merged
from postproc.feedrate.limits import JointLimits
from postproc.pipeline.result import PostResult
from postproc.planning.pass_geometry import pass_geometry, stops_of
from postproc.planning.planned import joint_limits
from postproc.planning.steady_feed import CORNER
from tests.postproc.kit import SAMPLES, Step, convert, execute, few_lines, good, goto, machine, toolpath
from toolpaths.arrays import Floats
from toolpaths.smoothing.smooth import Smooth, Tolerance

STENCIL = 0.02
"""mm between the places from which derivatives are taken"""


def wave(count: int, places: int = 4) -> list[str]:
    s = np.linspace(0.0, 1.0, count)
    tip = np.stack((40.0 * s, 4.0 * np.sin(5.0 * s), 2.0 * np.cos(7.0 * s)), axis=1)
    axis = np.stack((0.3 + 0.1 * np.sin(4.0 * s), 0.2 * np.cos(3.0 * s), np.ones(count)), axis=1)
    axis = np.round(axis / np.linalg.norm(axis, axis=1, keepdims=True), 6)
    return goto(np.round(tip, places), axis / np.linalg.norm(axis, axis=1, keepdims=True))


@cache
def written(rate: int, count: int = 160, places: int = 4, **options: Any) -> PostResult:
    lines = wave(count, places)
    return good(convert(toolpath("RAPID", lines[0], f"FEDRAT/MMPM,{rate}", *lines[1:]), "mikron-ucp710", **options))


def cuts(result: PostResult) -> list[Step]:
    return [step for step in execute(result) if step.kind == "feed"]


def seconds(steps: list[Step], before: Floats) -> Floats:
    """What LinuxCNC takes for each step: 1/F min, or the length of X, Y, Z, where they move, by F."""
    ends = np.array([before, *(step.end for step in steps)])
    travel = np.diff(ends, axis=0)
    xyz, abc = np.linalg.norm(travel[:, :3], axis=1), np.linalg.norm(travel[:, 3:], axis=1)
    length = np.where(xyz > 0.0, xyz, abc)
    return np.array([60.0 / step.feed if step.inverse else 60.0 * part / step.feed
                     for step, part in zip(steps, length, strict=True)])


def worst_ratios(path: Smooth, kin: Kinematics, near: Floats, s: Floats, speed: Floats,
                 limits: JointLimits) -> Floats:
    """(N,) worst ratio to any limit at places s (N,) run over at constant ds/dt, by differences of the inverse."""
    places = s[:, None] + STENCIL * np.array([-1.5, -0.5, 0.5, 1.5])
    tip, axis = path.at(places.ravel())
    near = np.repeat(near, 4, axis=0)
    branches = kin.inverse(tip, axis, near=near)
    branches[..., 3:] = near[:, 3:] + np.mod(branches[..., 3:] - near[:, 3:] + np.pi, 2.0 * np.pi) - np.pi
    q = branches[np.abs(branches - near).sum(axis=2).argmin(axis=0), np.arange(len(near))].reshape(len(s), 4, -1)
    orders = [(q[:, 2] - q[:, 1]) / STENCIL, (q[:, 3] - q[:, 2] - q[:, 1] + q[:, 0]) / (2.0 * STENCIL**2),
              (q[:, 3] - 3.0 * q[:, 2] + 3.0 * q[:, 1] - q[:, 0]) / STENCIL**3]
    ratios = [np.abs(d) * speed[:, None] ** k / limit for k, (d, limit) in
              enumerate(zip(orders, (limits.velocity, limits.acceleration, limits.jerk), strict=True), start=1)]
    return np.asarray(np.max(ratios, axis=(0, 2)))


@pytest.mark.parametrize("mode", ["inverse-time", "per-minute"])
def test_words_keep_every_limit_anywhere_in_their_block(mode: str) -> None:
    result = written(9000, feed="planned", feed_mode=mode)
    assert result.job is not None and result.path is not None
    job = result.job
    one, = pass_geometry(result.path, job.moves, job.kinematics, Tolerance(0.01, np.radians(0.05)),
                         stops_of(job.toolpath, job.moves), CORNER)[0]
    steps = cuts(result)
    assert len(steps) == len(one.block) and all(step.inverse == (mode == "inverse-time") for step in steps)
    first = execute(result)
    before = first[first.index(next(s for s in first if s.kind == "feed")) - 1].end
    speed = (one.ends - one.begin) / seconds(steps, before)
    kin = job.kinematics(int(job.moves.tool[one.move[0]]))
    worst = np.zeros(len(steps))
    for part in np.linspace(0.0, 1.0, 9):
        s = np.clip(one.begin + part * (one.ends - one.begin), 2.0 * STENCIL,
                    one.smooth.s[-1] - 2.0 * STENCIL)
        worst = np.maximum(worst, worst_ratios(one.smooth, kin, result.path.q[one.block], s, speed,
                                               joint_limits(machine("mikron-ucp710").limits)))
    assert worst.max() < 1.01 and np.median(worst) > 0.6


def test_words_of_programmed_feed_do_not_keep_them() -> None:
    planned, programmed = written(9000, feed="planned"), written(9000)
    slow, fast = (np.array([step.feed for step in cuts(r)]) for r in (planned, programmed))
    assert (slow < 0.8 * fast).any() and (slow <= fast + 1e-9).all()
    assert "feed planned" in planned.text and "feed planned" not in programmed.text
    assert any(d.code == "feed.reduced" and "jerk" in d.message for d in planned.diagnostics)


def test_slow_feeds_stay_as_they_are() -> None:
    assert [s.feed for s in cuts(written(60, feed="planned"))] == [s.feed for s in cuts(written(60))]


def test_merged_feeds_are_few_and_never_higher() -> None:
    plain = written(9000, feed="planned", feed_mode="per-minute")
    few = written(9000, feed="planned", feed_mode="per-minute", merge_feeds=0.2)
    own, joined = (np.array([step.feed for step in cuts(r)]) for r in (plain, few))
    assert (joined <= own + 1e-9).all() and (joined >= 0.8 * own - 1e-3).all()
    assert (np.diff(joined) != 0.0).sum() < 0.3 * (np.diff(own) != 0.0).sum()
    assert few.feeds is not None and plain.feeds is not None
    assert np.nansum(few.feeds.seconds) > np.nansum(plain.feeds.seconds)


def test_merging_by_hand() -> None:
    feed = np.array([100.0, 95.0, 91.0, 89.0, 50.0, 52.0, 500.0, 100.0])
    free = np.array([True] * 6 + [False, True])
    group = np.zeros(8, dtype=np.int64)
    assert merged(feed, free, group, 0.1).tolist() == [91.0, 91.0, 91.0, 89.0, 50.0, 50.0, 500.0, 100.0]
    assert merged(feed, free, np.arange(8), 0.1).tolist() == feed.tolist()
    assert merged(feed, free, group, 0.0).tolist() == feed.tolist()


def test_smooth_moves_points_inside_the_tolerance_and_calms_the_words() -> None:
    rough, calm = written(1500, 400, 3), written(1500, 400, 3, smooth=True)
    assert rough.job is not None and calm.comparison is not None
    assert 1e-4 < calm.comparison.worst_tip <= 0.01
    for result in (rough, calm):
        assert result.comparison is not None and result.comparison.worst_axis <= np.radians(0.05)
    assert calm.shares is not None and rough.shares is not None
    assert calm.shares["points"] + calm.shares["linearising"] == pytest.approx(rough.shares["linearising"])
    assert "points smoothed" in calm.text and "points smoothed" not in rough.text
    noise = []
    for result in (rough, calm):
        ends = np.array([step.end for step in cuts(result)])
        travel = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(ends, axis=0), axis=1))))
        bend = make_interp_spline(travel, ends, k=3).derivative(2)(travel[10:-10])
        noise.append(np.abs(np.diff(bend, axis=0)).max())
    assert noise[1] < 0.3 * noise[0]


def test_smooth_leaves_corners_arcs_and_lone_lines() -> None:
    for name in ("pocket.cls", "five_tilted.cls"):
        from toolpaths import read

        path, _ = read(SAMPLES / name)
        kind = "mill-3axis" if name.startswith("pocket") else "mikron-ucp710"
        plain, smooth = (good(convert(path, kind, smooth=s)) for s in (False, True))
        assert [s.end.tolist() for s in execute(plain)] == [s.end.tolist() for s in execute(smooth)]


def test_command_line(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    (tmp_path / "bicubic.cls").write_text(few_lines("bicubic.cls"))
    arguments = ["convert", str(tmp_path / "bicubic.cls"), "-m", "mill-3axis", "-c", "linuxcnc", "-o", str(out)]
    got = CliRunner().invoke(app, [*arguments, "--feed", "planned", "--merge-feeds", "10", "--smooth", "--json", "-"])
    assert got.exit_code == 0, got.stderr
    assert json.loads(got.stdout)["tolerance_shares"]["points"] > 0.0
    text = out.read_text()
    assert "feed planned, merged within 10 %" in text and "points smoothed" in text
    wrong = CliRunner().invoke(app, [*arguments, "--feed", "fast"])
    assert wrong.exit_code == 2 and "planned" in wrong.stderr
    assert CliRunner().invoke(app, [*arguments, "--merge-feeds", "80"]).exit_code == 2
