"""Holes corrected as a whole: all at once as one by one, at several heights, in planes, tapped, and what
stays a cycle; approach directions of joints in blocks that are nearly straight."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import postproc
import toolpaths
from machines.geometric_error.actual.lost_motion import PlaySteps
from postproc.base.options import Options
from postproc.correction import backlash_words
from postproc.correction.backlash_steps import BlockEnds, walk
from postproc.correction.backlash_words import _composed
from postproc.correction.runs import RowRuns
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.compare import _taken_up
from postproc.setup.model import load_setup
from postproc.verification.residual_errors import after_formatting
from tests.postproc.correction.test_compensation_points import both_directions_of_all
from toolpaths.arrays import Floats

CONTROLLERS = ["linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc"]
HEIGHTS = (0, -4, 0, 0, -4, 0, 5, 0)
PLACES = ((-28, -29), (-25, 18), (2, 21), (50, 28), (-37, -52), (56, -58), (49, -28), (-9, 47))


# ---- runs --------------------------------------------------------------------------------------------------

def test_runs_are_those_of_a_loop() -> None:
    rng = np.random.default_rng(5)
    number = np.repeat(rng.permutation(40), rng.integers(1, 6, 40))
    runs = RowRuns.of(number).some(np.arange(40) % 3 != 1)
    parts = [np.arange(a, a + n) for a, n in zip(runs.begin.tolist(), runs.size.tolist(), strict=True)]
    assert len(parts) == 27 and all(len(set(number[part].tolist())) == 1 for part in parts)
    np.testing.assert_array_equal(runs.rows, np.concatenate(parts))
    np.testing.assert_array_equal(runs.last, [part[-1] for part in parts])
    value, true = rng.integers(0, 3, len(runs.rows)).astype(float), rng.random(len(runs.rows)) < 0.7
    ends = np.cumsum(runs.size)
    for k, (one, other) in enumerate(zip(ends - runs.size, ends, strict=True)):
        assert runs.least(value)[k] == one + np.argmin(value[one:other])
        assert runs.throughout(true)[k] == true[one:other].all()
        assert runs.first(true)[k] == (one + np.argmax(true[one:other]) if true[one:other].any() else -1)


def test_blocks_compose_as_one_after_the_other() -> None:
    rng = np.random.default_rng(6)
    bend, last = np.sort(rng.normal(size=(3, 30, 2)), axis=0)[[1, 0, 2]], rng.normal(size=(30, 2))
    first, count = np.array([1, 9, 10, 22]), np.array([7, 0, 11, 1])
    found, approach = _composed(bend, last, first, count), rng.uniform(-1.0, 1.0, 2)
    for k in range(4):
        there = approach
        for block in range(first[k], first[k] + count[k]):
            there = np.clip(np.clip(there + bend[0, block], bend[1, block], bend[2, block]) + last[block], -1.0, 1.0)
        np.testing.assert_allclose(PlaySteps(*found[:, k]).at(approach), there, rtol=0.0, atol=1e-12)
    assert not np.isfinite(found[1:, 1]).any() and np.isfinite(found[1:, 2]).all()


# ---- programs ----------------------------------------------------------------------------------------------

def drilled(folder: Path, machine: str, controller: str, cycle: str, tilted: bool = False, seed: int = 2,
            model: str = "") -> PostResult:
    """Holes at HEIGHTS in one sequence, along z or along an axis that leans by 30 degrees."""
    y, z = (np.array([0.0, 0.5 * np.sqrt(3.0), 0.5]), np.array([0.0, -0.5, 0.5 * np.sqrt(3.0)])) if tilted else np.eye(3)[1:]
    at = [f"GOTO/{','.join(f'{v:.6f}' for v in (x * np.eye(3)[0] + v * y + h * z, z) for v in v)}"
          for (x, v), h in (((0, 0), 60), *zip(PLACES, HEIGHTS, strict=True), ((0, 0), 60))]
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/1000,CLW", "MULTAX/ON", "RAPID", at[0], f"CYCLE/{cycle}", *at[1:-1],
             "CYCLE/OFF", "RAPID", at[-1], "FINI", ""]
    path, found = toolpaths.read_bytes("\n".join(lines))
    options = Options(error_model=model or (str(both_directions_of_all(folder, machine, seed)) if seed else ""))
    setup = load_setup(None)[0]
    setup = setup.model_copy(update={"output": setup.output.model_copy(update={"rapids_as_feed": True})})
    return postproc.convert(path, machine, controller, setup, options, found)


def checked(result: PostResult) -> PostResult:
    """The same, that it is written and proved."""
    assert result.ok, [str(d) for d in result.diagnostics]
    found = after_formatting(result)
    assert found is not None and found.tip.max() <= found.tip_bound
    return result


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("tilted", [False, True])
def test_taps_at_several_heights_stay_cycles(controller: str, tilted: bool, tmp_path: Path) -> None:
    """A lift to the next hole's plane goes straight up, as the control that drills the hole does not."""
    machine = "mikron-ucp710" if tilted else "mill-3axis"
    result = checked(drilled(tmp_path, machine, controller, "TAP,DEPTH,8,CLEAR,4,MMPR,1", tilted))
    assert result.program is not None and len(result.program.holes) == len(HEIGHTS)


def rises(text: str) -> list[bool]:
    """Of every G8x block whose R is above that of the one before: that a Z alone goes there."""
    found, level, before = [], np.inf, ""
    for line in text.splitlines():
        words = dict(re.findall(r"([RZ])(-?[\d.]+)", line if "G84" in line else ""))
        if words:
            if float(words["R"]) > level + 1.0:
                found.append(bool(re.fullmatch(r"(G0 )?Z-?[\d.]+", before)))
            level = float(words["R"])
        before = line
    return found


def test_the_tool_is_lifted_before_it_crosses(tmp_path: Path) -> None:
    assert rises(checked(drilled(tmp_path, "mill-3axis", "linuxcnc", "TAP,DEPTH,8,CLEAR,4,MMPR,1")).text) == [True] * 3


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "siemens-840d"])
@pytest.mark.parametrize("cycle", ["DRILL,DEPTH,3,CLEAR,2,RETURN,2,MMPM,250",
                                   "DEEP,DEPTH,15,CLEAR,2,RETURN,2,STEP,5,MMPM,180",
                                   "BRKCHP,DEPTH,12,CLEAR,2,RETURN,20,STEP,4,MMPM,180",
                                   "BORE,DEPTH,8,CLEAR,3,RETURN,3,MMPM,100"])
@pytest.mark.parametrize("tilted", [False, True])
def test_holes_at_several_heights_are_proved(cycle: str, controller: str, tilted: bool,
                                             tmp_path: Path) -> None:
    """Some stay cycles, some are written out; a cycle behind one that is written out begins at its own level."""
    result = checked(drilled(tmp_path, "mikron-ucp710" if tilted else "mill-3axis", controller, cycle, tilted))
    assert result.program is not None and result.compensation is not None
    plain = drilled(tmp_path, result.machine.name, controller, cycle, tilted, seed=0)
    assert plain.program is not None and len(result.program.holes) <= len(plain.program.holes)


@pytest.mark.parametrize("controller", ["fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_holes_in_planes_of_printed_angles_stay_cycles(controller: str, tmp_path: Path) -> None:
    """The tool is as far from Z of the plane as the angles are rounded: a hundredth of a last decimal in the depth."""
    result = checked(drilled(tmp_path, "mikron-ucp710", controller, "DRILL,DEPTH,3,CLEAR,2,RETURN,2,MMPM,250", True))
    assert result.program is not None and len(result.program.holes) >= 3


def test_what_a_level_is_off_by_is_taken_up_before_a_feed_and_at_its_beginning() -> None:
    """The last part of the approach direction to a plane, and the first of a cut behind a hole; not in the
    middle of cuts."""
    approach = [100.0, 10.0, 0.005, 20.0, 0.005, 20.0, 0.005, 0.005, 20.0, 0.02, 20.0, 0.005]
    motion = SimpleNamespace(code=np.array([0, 0, 0, 1, 1, 1, 1, 0, 1, 1, 1, 1]))
    job = SimpleNamespace(errors=True, options=Options(), rounding=SimpleNamespace(tip=1e-4))
    tip = np.cumsum(approach)[:, None] * np.eye(3)[:1]
    assert np.flatnonzero(_taken_up(job, motion, tip)).tolist() == [2, 4]


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("two_directions", [False, True])
def test_taps_have_planes_of_their_own_and_are_come_to_from_afar(controller: str, two_directions: bool,
                                                                 tmp_path: Path) -> None:
    """A table that sinks by 0.06 um per mm and a Z that leans by 40 arcsec: 11 um across at the level that
    the tool comes from, up to 6 um between the planes; neither is the bottom's to settle."""
    (tmp_path / "z.csv").write_text("Z [mm], EZZ+ [um], EZZ- [um]\n-500, 0, 3\n500, 1, 4\n")
    text = '[location]\nEA0Z = 40\n[components.EZX]\npolynomial = [0, 0.06]\nrange = [-300, 300]\n'
    (tmp_path / "e.toml").write_text(text + ('[components.EZZ]\ntable = "z.csv"\n' if two_directions else ""))
    cycle, model = "TAP,DEPTH,8,CLEAR,4,MMPR,1", str(tmp_path / "e.toml")
    result = checked(drilled(tmp_path, "mill-3axis", controller, cycle, model=model))
    assert result.program is not None and len(result.program.holes) == len(HEIGHTS)
    planes = np.array([hole.plane_level for hole in result.program.holes])
    off = planes - 4.0 - np.array(HEIGHTS)
    assert 0.004 < np.ptp(off) < 0.012 and np.ptp(off - [-6e-5 * x for x, _ in PLACES]) < 2e-3


def test_no_points_fix_what_a_hole_leaves_a_rapid_off_by(tmp_path: Path) -> None:
    """Behind a hole with a level of the common plane; the rapid away is halved for its own errors alone."""
    result = checked(drilled(tmp_path, "mill-3axis", "linuxcnc", "DRILL,DEPTH,3,CLEAR,2,RETURN,2,MMPM,250", seed=1))
    path, moves = result.path, result.job.moves if result.job is not None else None
    assert path is not None and moves is not None
    count = np.bincount(path.move[(path.code == 0) & np.isfinite(path.u)], minlength=len(moves))
    assert count.max() <= 3


def test_slides_of_other_letters_lose_motion_too(tmp_path: Path) -> None:
    text = Path("machines/data/mill-3axis.toml").read_text()
    for one, other in zip("XYZ", "UVW", strict=True):
        text = re.sub(rf"(\[axes\.|retract_axis = \"|[wb' ]){one}(?=[\]'\" ])", rf"\g<1>{other}", text)
    (tmp_path / "uvw.toml").write_text(text)
    (tmp_path / "u.csv").write_text("U [mm], EXU+ [um], EXU- [um]\n-400, 0, 4\n400, 5, 9\n")
    (tmp_path / "e.toml").write_text('[components.EXU]\ntable = "u.csv"\n')
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/1000,CLW", "FEDRAT/300,MMPM", "RAPID", "GOTO/0,0,20", "GOTO/30,0,0",
             "GOTO/10,5,0", "GOTO/20,9,-1", "FINI", ""]
    path, found = toolpaths.read_bytes("\n".join(lines))
    options = Options(error_model=str(tmp_path / "e.toml"), setup="samples/tools.setup.toml")
    checked(postproc.convert(path, str(tmp_path / "uvw.toml"), "linuxcnc", options=options, diagnostics=found))


def test_blocks_that_are_nearly_straight_need_no_pieces(tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    """The words are those that pieces of all blocks lead to; some blocks are not straight enough to go without."""
    model, texts, counts = both_directions_of_all(tmp_path, "mikron-ucp710", 3), [], []
    runs = backlash_words._runs
    monkeypatch.setattr(backlash_words, "_runs", lambda pieces: (lambda found: counts.append(len(found[1]))
                                                                 or found)(runs(pieces)))
    for near in (backlash_words.NEAR, np.inf):
        monkeypatch.setattr(backlash_words, "NEAR", near)
        path, found = toolpaths.read("samples/tool_axis_tour.apt")
        options = Options(error_model=str(model), setup="samples/tools.setup.toml", output="tcp")
        texts.append(checked(postproc.convert(path, "mikron-ucp710", "haas-ngc", options=options, diagnostics=found)).text)
    assert texts[0] == texts[1] and 0 < min(counts[:len(counts) // 2]) < 0.9 * min(counts[len(counts) // 2:])


def test_blocks_of_a_hole_are_moved_as_far_as_its_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """So are their joints: else the approach directions behind the first block would be those of a hole that
    was moved back."""
    seen: list[BlockEnds] = []

    def kept(ends: BlockEnds) -> tuple[Floats, Floats]:
        seen.append(ends)
        return walk(ends)

    monkeypatch.setattr("postproc.correction.backlash_words.walk", kept)
    path, found = toolpaths.read("samples/five_faces.cls")
    result = postproc.convert(path, "mikron-ucp710", "fanuc-30i", diagnostics=found, options=Options(
        setup="samples/tools.setup.toml", error_model="samples/errors/mikron-ucp710.toml"))
    assert result.ok and seen
    rows = np.flatnonzero(seen[-1].like >= 0)
    assert len(rows) > 20 and np.abs(seen[-1].back[rows]).max(axis=(1, 2)).min() > 1e-5
    np.testing.assert_allclose(seen[-1].back[rows], seen[-1].back[seen[-1].like[rows]], atol=1e-9)
