"""Words of machines that lose motion: chosen block by block, holes and rapids with them, in every output mode."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.correction import backlash_steps as walking
from postproc.correction.backlash_steps import BlockEnds
from postproc.path.model import TRAVERSE
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.checks import _turning_points
from postproc.setup.model import SetupFile, load_setup
from postproc.verification.residual_errors import after_formatting
from tests.postproc.correction import walk_by_numpy
from tests.postproc.correction.test_compensation_points import both_directions_of_all
from toolpaths.arrays import Floats
from toolpaths.compiled import compiled
from toolpaths.toolpath import Kind

SAMPLES = Path("samples")
GRAIN = 1e-4


# ---- the walk ----------------------------------------------------------------------------------------------

def no_motion(*shape: int) -> Floats:
    """Shift, low and high that leave the approach directions as they are."""
    result = np.zeros((3, *shape))
    result[1], result[2] = -np.inf, np.inf
    return result


def random_ends(rng: np.random.Generator, blocks: int, lossy: int, near: float,
                single: bool = False) -> BlockEnds:
    """Ends that are some micrometres off, joints that lose 1 to 6 um, steps around that."""
    i, size = np.arange(lossy), (blocks, lossy)
    gap = np.tile(rng.uniform(1e-3, 6e-3, lossy), (blocks, 1))
    back = rng.normal(size=(blocks, lossy, 3)) * 0.02 * GRAIN
    back[:, i, i] += GRAIN
    by_approach = rng.normal(size=(blocks, 3, lossy)) * 2e-4
    by_approach[:, i, i] += 0.5 * gap
    bend, later = no_motion(*size), no_motion(*size)
    if not single:
        bend[0], later[0] = rng.normal(size=size) * (rng.random(size) < 0.3), 0.5 * rng.normal(size=size)
        later[1], later[2] = -1.0, 1.0
    likes = np.where(rng.random(blocks) < 0.25, np.arange(blocks) - 1, -1)
    free = np.where(likes >= 0, 0.0, 1.0)[:, None] * (rng.random((blocks, 3)) < (1.0 if single else 0.95))
    nears = np.where(rng.random(blocks) < (0.0 if single else 0.2), 1.0, near)
    return BlockEnds(off=rng.normal(size=(blocks, 3)) * 1e-3, by_approach=by_approach,
                     tip_rates=np.eye(3) * GRAIN + rng.normal(size=(blocks, 3, 3)) * 0.05 * GRAIN, back=back, gap=gap,
                     bend=bend,
                     last=2.0 * rng.choice([0.0, 1e-4, -1e-4, 5e-4, -5e-4, 3e-3, -3e-3, 1.0, -1.0], size) / gap, later=later,
                     goes_on=rng.choice([-1.0, 0.0, 1.0], size), weight=np.where(rng.random(blocks) < 0.3, 1.0, 0.01),
                     plain=(rng.random(blocks) < 0.5) & (not single), near=nears,
                     enough=nears * (1.0 if single else 2.5), free=free,
                     like=np.full(blocks, -1) if single else likes)


def steps_of(ends: BlockEnds) -> Floats:
    """(K, 3) of the walk."""
    return walking.walk(ends)[0]


@pytest.mark.numeric
@pytest.mark.parametrize(("lossy", "made"), [
    *((lossy, False) for lossy in (1, 2, 3)), *(pytest.param(lossy, True, marks=pytest.mark.slow) for lossy in (1, 2, 3))])
def test_the_walk_interpreted_and_compiled_is_the_one_of_numpy(lossy: int, made: bool,
                                                               monkeypatch: pytest.MonkeyPatch) -> None:
    ends = random_ends(np.random.default_rng(lossy), 200, lossy, 8.7e-5)
    plain, approaches = walk_by_numpy.walk(ends)
    monkeypatch.setattr(walking, "chosen", lambda function, *_: function)
    fast = as_it_stands = walking.walk(ends)
    if made:
        monkeypatch.setattr(walking, "chosen", lambda function, *_: compiled(function))
        fast = walking.walk(ends)
    np.testing.assert_array_equal(fast[0], plain)
    np.testing.assert_array_equal(as_it_stands[0], plain)
    np.testing.assert_array_equal(as_it_stands[1], fast[1])
    np.testing.assert_allclose(fast[1], approaches, rtol=0.0, atol=1e-12)  # sums of other order
    assert np.abs(approaches).max() == 1.0 and (np.abs(approaches) < 1.0).any()
    assert np.abs(plain).max() > 3.0 and (plain == 0.0).all(axis=1).any()
    likes = np.flatnonzero(ends.like >= 0)
    np.testing.assert_array_equal(plain[likes], plain[ends.like[likes]])
    assert plain[likes].any()
    assert not plain[(ends.free == 0.0) & (ends.like < 0)[:, None]].any()


def costs(ends: BlockEnds, steps: Floats) -> tuple[Floats, Floats]:
    """(N,) mm that the tip is off by after steps (N, 3) in the block of `ends`, and with what the next begins off by.

    From the play operator: the approach direction 0 takes up a step by 2 / gap of it, held between -1 and 1;
        approach directions count by their share.
    """
    approach = np.clip(ends.last[0] + 2.0 * steps @ ends.back[0].T / ends.gap[0], -1.0, 1.0)
    off = np.linalg.norm(ends.off[0] + approach @ ends.by_approach[0].T + steps @ ends.tip_rates[0].T, axis=1)
    late = np.where(ends.goes_on[0] != 0.0, ends.goes_on[0] - approach, 0.0) @ ends.by_approach[0].T
    return off, off + ends.weight[0] * np.linalg.norm(late, axis=1)


def test_no_steps_around_bring_a_block_nearer() -> None:
    reach = np.arange(-18.0, 19.0)
    grid = np.stack(np.meshgrid(reach, reach, reach, indexing="ij"), axis=-1).reshape(-1, 3)
    rng, nearest, walk = np.random.default_rng(12), [], steps_of
    for k in range(18):
        ends = random_ends(rng, 1, 1 + k % 3, 1e-5, single=True)
        off, cost = costs(ends, walk(ends))
        assert cost[0] <= costs(ends, grid)[1].min() + 5e-5
        nearest.append(off[0])
        assert off[0] < costs(ends, np.zeros((1, 3)))[0][0] or not walk(ends).any()
    assert np.median(nearest) < 1.5e-4


def test_words_stay_where_rounding_leaves_as_much() -> None:
    walk = steps_of
    ends = random_ends(np.random.default_rng(3), 1, 2, 8.7e-5, single=True)
    still = replace(ends, off=-(ends.by_approach @ np.clip(ends.last, -1.0, 1.0)[..., None])[..., 0] + [[6e-5, 0.0, 6e-5]],
                    goes_on=np.zeros((1, 2)))
    assert costs(still, np.zeros((1, 3)))[0][0] == pytest.approx(6e-5 * np.sqrt(2.0))
    assert not walk(still).any()
    assert walk(replace(still, off=still.off + np.array([0.0, 4e-4, 0.0]))).any()


# ---- whole programs ----------------------------------------------------------------------------------------

def converted(sample: str | Path, machine: str, controller: str, model: str | Path, output: str = "auto",
              setup: SetupFile | None = None) -> PostResult:
    path, found = toolpaths.read(SAMPLES / sample)
    options = Options(setup="" if setup else str(SAMPLES / "tools.setup.toml"), error_model=str(model),
                      output=output)
    return postproc.convert(path, machine, controller, setup, options, found)


@pytest.mark.covering(of=("controller", "output", "law"))
@pytest.mark.parametrize(("sample", "machine", "controller", "output", "law", "seed"), [
    ("five_faces.cls", "mikron-ucp710", "linuxcnc", "axes", "axes", 3),
    ("five_faces.cls", "mikron-ucp710", "fanuc-30i", "auto", "tilted", 4),
    ("five_faces.cls", "mikron-ucp710", "haas-ngc", "auto", "tilted", 7),
    ("pocket.cls", "nutating-head", "siemens-840d", "auto", "tilted", 4),
    ("pocket.cls", "mikron-ucp710", "fanuc-30i", "tcp", "tcp", 8),
    ("pocket.cls", "mill-4axis", "linuxcnc", "axes", "axes", 3),
    ("tool_axis_tour.apt", "mikron-ucp710", "haas-ngc", "tcp", "tcp", 7),
    ("tool_axis_tour.apt", "head-table", "siemens-840d", "tcp", "tcp", 6)])
def test_points_are_inside_the_bound_where_every_slide_loses_motion(sample: str, machine: str, controller: str, output: str,
                                                                    law: str, seed: int, tmp_path: Path) -> None:
    result = converted(sample, machine, controller, both_directions_of_all(tmp_path, machine, seed), output)
    found = after_formatting(result)
    assert result.ok and found is not None and result.compensation is not None, [str(d) for d in result.diagnostics]
    assert result.path is not None and law in {frame.control.law for frame in result.path.frames}
    assert result.compensation.tip_before > 0.01
    assert found.tip.max() <= found.tip_bound and found.axis.max() <= found.axis_bound
    assert result.job is not None and found.tip.max() < 1.1 * result.job.rounding.tip
    assert "geometric_errors.bound" not in {d.code for d in result.diagnostics}


# ---- rapids ------------------------------------------------------------------------------------------------

def strong(folder: Path) -> Path:
    """Slides that are 600 um off at 400 mm, lose 60 um and lean by 80 arcsec."""
    text = ""
    for a in "XYZ":
        rows = [f"{p}, {1.5 * p}, {1.5 * p + 60.0}, {0.2 * p}" for p in (-400, 0, 400)]
        (folder / f"{a}.csv").write_text("\n".join([f"{a} [mm], E{a}{a}+ [um], E{a}{a}- [um], EB{a} [arcsec]", *rows]))
        text += f'[components.E{a}{a}]\ntable = "{a}.csv"\n[components.EB{a}]\ntable = "{a}.csv"\n'
    (folder / "e.toml").write_text(text)
    return folder / "e.toml"


def back_and_forth(slanting: bool) -> str:
    """Cuts with rapids between them that turn back in X, in Y and in Z, along one axis each or slanting."""
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/1000, CLW", "FEDRAT/300, MMPM", "RAPID", "GOTO/0, 0, 50"]
    for k in range(8):
        x, y = (-1) ** k * (20 + 3 * k), (-1) ** (k // 2) * (10 + 2 * k)
        lines += ["RAPID", f"GOTO/{x}, {y}, 5", f"GOTO/{x}, {y}, 0", f"GOTO/{x + 4}, {y + 3}, 0", "RAPID",
                  f"GOTO/{x + 4}, {y + 3}, 5", "RAPID", f"GOTO/{x - 2}, {y if slanting else y + 3}, 5"]
    return "\n".join([*lines, "FINI\n"])


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["fanuc-30i", "linuxcnc"])
@pytest.mark.parametrize("slanting", [True, False])
def test_rapids_that_begin_by_turning_back_get_one_point(controller: str, slanting: bool,
                                                         tmp_path: Path) -> None:
    """Whether every axis runs at its own speed (Fanuc) or not; slanting ones are then feeds, which get points as needed."""
    (tmp_path / "s.apt").write_text(back_and_forth(slanting))
    result = converted(tmp_path.resolve() / "s.apt", "mill-3axis", controller, strong(tmp_path),
                       setup=load_setup(None)[0])
    found = after_formatting(result)
    assert result.ok and found is not None and result.path is not None and result.job is not None
    assert found.tip.max() <= found.tip_bound
    path, moves = result.path, result.job.moves
    straight = (path.code == TRAVERSE) & np.isfinite(path.u) & ~path.home
    rapids = np.flatnonzero((moves.kind == Kind.RAPID) & ~moves.link)
    count = np.array([int(straight[path.move == m].sum()) for m in rapids])
    assert count.max() == 2 and (count == 2).sum() >= 8
    for m in rapids[count == 2].tolist():
        first = np.flatnonzero(straight & (path.move == m))[0]
        assert 0.05 < np.abs(path.q[first] - path.q[first - 1]).max() < 0.3  # taken up on the spot, 60 um per axis


# ---- holes -------------------------------------------------------------------------------------------------

def cycle_blocks(text: str) -> int:
    """Holes that a Fanuc program drills in canned cycles."""
    count, on = 0, False
    for line in text.splitlines():
        words = set(re.findall(r"G\d+", "" if line.startswith("(") else line))
        on = bool(words & {"G73", "G76", "G81", "G82", "G83", "G84", "G85"}) or (on and "G80" not in words)
        count += on and bool(re.search(r"[XYZR]-?[\d.]", line))
    return count


NEAR, LEANING, STEEP = "[location]\nEX0S = 30\n", "[location]\nEA0Z = 200\n", \
    "[components.EZZ]\npolynomial = [0, 2]\nscale = 1\nrange = [-10, 400]\n"


@pytest.mark.parametrize(("errors", "whole"), [(NEAR, True), (LEANING, False), (STEEP, False)],
                         ids=["near", "leaning", "steep"])
def test_holes_corrected_block_by_block_are_no_cycles(errors: str, whole: bool, tmp_path: Path) -> None:
    """Where Z leans by 1 um per mm no cycle can follow the hole; where Z is 2 um per mm too long one could be
    written, but its pecks would be of another length."""
    (tmp_path / "e.toml").write_text(errors)
    result, plain = (converted("five_faces.cls", "mikron-ucp710", "fanuc-30i", model, "axes")
                     for model in (tmp_path / "e.toml", ""))
    found, left = result.compensation, after_formatting(result)
    assert result.ok and found is not None and left is not None and left.tip.max() <= left.tip_bound
    assert result.program is not None and plain.program is not None and result.path is not None and result.job is not None
    drilled = (result.job.moves.hole[result.path.move] >= 0) & np.isfinite(result.path.u)
    assert len(plain.program.holes) == cycle_blocks(plain.text) == 15
    if whole:
        assert not found.apart[drilled].any() and len(result.program.holes) == 15
    else:
        single = np.unique(result.job.moves.hole[result.path.move[drilled & found.apart]])
        assert len(single) > 4 and len(result.program.holes) == 15 - len(single)
    assert cycle_blocks(result.text) == len(result.program.holes)


def test_tiny_steps_back_are_no_pecks() -> None:
    """What the tool rises by from one block to the next is a peck from a micrometre's thousandth on."""
    tiny = 5e-7
    one = np.array([-2.0, 1.0, 1.0 - tiny, 2.0, 3.0, 3.0 - tiny, -2.0])
    assert np.flatnonzero(_turning_points(one)).tolist() == [5]
    two = np.array([-2.0, 3.0, 2.9, 2.9 + tiny, 6.0, 6.0 + tiny, 6.0 - tiny, -2.0, 6.0])
    found = two[_turning_points(two)]
    assert len(found) == 3 and np.allclose(found, [3.0, 6.0, 6.0], atol=2.0 * tiny)
    assert not _turning_points(np.array([3.0, 2.0, 1.0]))[1:].any()
    assert _turning_points(np.array([1.0, 2.0])).tolist() == [False, True]
