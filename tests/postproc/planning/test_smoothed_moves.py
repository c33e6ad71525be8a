"""`--smooth` on dense and uneven points: order is kept, what converts without converts with, passes are taken back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from postproc.pipeline import stages
from postproc.pipeline.result import PostResult
from tests.postproc.kit import codes, convert, good, toolpath
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity, error
from toolpaths.toolpath import Toolpath

RETRACT = 50.0


def ncl(tip: Floats, axis: Floats) -> list[str]:
    """Fixed columns, four decimals of the tip and seven of the axis."""
    rows = np.hstack([tip, axis])
    return ["GOTO  /" + ",".join(f"{v:10.{4 if k < 3 else 7}f}" for k, v in enumerate(row)) for row in rows]


def dense(seed: int) -> tuple[Floats, Floats]:
    """Points from 0.3 um to 3 mm apart, some twice, none quite on the curve; the axis goes through 90 degrees of tilt."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(20, 120))
    travel = np.cumsum(10.0 ** rng.uniform(-3.5, -0.5, count) * rng.choice([1, 1, 1, 0, 10], count))
    tilt = np.radians(rng.uniform(60, 95) + rng.uniform(-20, 20) * travel / travel[-1])
    turn = rng.uniform(0, 6) + rng.uniform(-1, 1) * travel / travel[-1]
    axis = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    tip = np.stack([travel, 2.0 * np.sin(travel / 8.0), np.cos(travel / 5.0)], axis=1)
    tip += rng.normal(size=tip.shape) * 10.0 ** rng.uniform(-4.5, -2.6)
    twice = np.flatnonzero(rng.random(count) < 0.1)
    tip[twice] = tip[np.maximum(twice - 1, 0)]
    return tip, axis


def passes(*each: tuple[Floats, Floats]) -> Toolpath:
    lines = []
    for tip, axis in each:
        cut = ncl(tip, axis)
        above = [ncl((tip[k] + RETRACT * axis[k])[None], axis[k][None])[0] for k in (0, -1)]
        lines += ["RAPID", above[0], "FEDRAT/1000.0,MMPM", *cut, "RAPID", above[1]]
    return toolpath("MULTAX/ON", *lines)


def moved(result: PostResult) -> Floats:
    """(M,) mm by which points are off those of the CL file."""
    assert result.moves is not None and result.job is not None
    return np.asarray(np.linalg.norm(result.moves.tip - result.job.moves.tip, axis=1))


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", [1, 6, 7, 70, 71])
def test_what_converts_without_converts_with(seed: int) -> None:
    """Points nearer to each other than smoothing moves them passed for their neighbours: the rapid behind the
    pass then stood for its last cut."""
    path = passes(dense(seed))
    for name in ("head-table", "linuxcnc-xyzac-trt"):
        good(convert(path, name))
        smooth = good(convert(path, name, smooth=True))
        assert "smooth.taken_back" not in codes(smooth.diagnostics) and moved(smooth).max() <= 0.005


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", range(6))
def test_each_point_stays_nearest_to_its_own(seed: int) -> None:
    smooth = good(convert(passes(dense(seed)), "head-table", smooth=True))
    assert smooth.moves is not None and smooth.job is not None
    now, given = smooth.moves, smooth.job.moves
    off, turn = moved(smooth), np.linalg.norm(now.axis - given.axis, axis=1)
    for k in np.flatnonzero((off > 0.0) | (turn > 0.0)).tolist():
        for other in (k - 1, k + 1):
            same = (given.tip[k] == given.tip[other]).all() and (given.axis[k] == given.axis[other]).all()
            assert same or np.linalg.norm(now.tip[other] - given.tip[k]) > off[k] or (
                np.linalg.norm(now.axis[other] - given.axis[k]) > turn[k]), k


def test_points_that_stay_are_reported_and_no_move_is_faster() -> None:
    smooth = good(convert(passes(dense(6)), "head-table", smooth=True))
    note = next(d for d in smooth.diagnostics if d.code == "smooth.points")
    assert note.severity is Severity.INFO and "pass" in note.message and "lines" in note.message and note.lines
    assert smooth.moves is not None and smooth.job is not None
    before, now = smooth.job.moves, smooth.moves
    with np.errstate(invalid="ignore"):
        late = now.lengths() / now.feed - before.lengths() / before.feed
    assert np.nanmin(late) > -0.0015 / (1000.0 / 60.0)


def failing(monkeypatch: pytest.MonkeyPatch, fails: Any) -> None:
    """The proof of a program finds an error on the lines that `fails` (text, call) names."""
    read_back, calls = stages.read_back, [0]

    def proof(text: str, job: Any, *rest: Any, **options: Any) -> Any:
        comparison, found = read_back(text, job, *rest, **options)
        calls[0] += 1
        lines = fails(text, calls[0])
        return comparison, found + ([error("verify.tip", "the tip is off by 1 mm", file=job.toolpath.file,
                                           lines=lines)] if lines is not None else [])

    monkeypatch.setattr(stages, "read_back", proof)


def wavy(z: float) -> tuple[Floats, Floats]:
    s = np.linspace(0.0, 1.0, 80)
    tip = np.round(np.stack([40.0 * s, 4.0 * np.sin(5.0 * s), 2.0 * np.cos(7.0 * s) + z], axis=1), 2)
    return tip, np.tile([0.0, 0.0, 1.0], (80, 1))


def test_a_pass_whose_proof_fails_is_taken_back_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    path = passes(wavy(0.0), wavy(-5.0))
    line = int(path.line[20])
    failing(monkeypatch, lambda text, call: [line] if call == 1 else None)
    result = good(convert(path, "mikron-ucp710", smooth=True))
    note = next(d for d in result.diagnostics if d.code == "smooth.taken_back")
    assert note.severity is Severity.WARNING and "the tip is off by 1 mm" in note.message and "lines" in note.message
    off = moved(result)
    assert off[:82].max() == 0.0 and off[83:].max() > 1e-4 and "points smoothed" in result.text


@pytest.mark.parametrize("lines", [[], [3]])
def test_all_passes_are_taken_back_where_the_proof_names_none(lines: list[int],
                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, lambda text, call: lines if "points smoothed" in text else None)
    result = good(convert(passes(wavy(0.0)), "mikron-ucp710", smooth=True))
    assert "smooth.taken_back" in codes(result.diagnostics)
    assert moved(result).max() == 0.0 and "points smoothed" not in result.text


def test_what_fails_without_smoothing_too_is_refused_as_that_is(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, lambda text, call: [])
    result = convert(passes(wavy(0.0)), "mikron-ucp710", smooth=True)
    assert not result.ok and "smooth.taken_back" not in codes(result.diagnostics) and result.text == ""
