"""Long work is done in stretches: short ones give bit for bit what one long one gives."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.base.options import Options
from postproc.cycle_time import linuxcnc, shape
from postproc.cycle_time.conversion import estimate_of
from postproc.path import travel
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.readback.comparison import checks, compare, slow_moves, states
from postproc.readback.execution import sections
from postproc.readback.text import modal, words
from postproc.reference import moves
from postproc.witness import block_times, place, second_reading
from postproc.witness import motion as witness_motion
from postproc.witness import states as witness_states
from tests.postproc.kit import few_sides, good
from toolpaths import aside
from toolpaths.arrays import slices
from toolpaths.rotations import cross, lengths

SAMPLES = Path(__file__).parents[3] / "samples"
SIZES = ((aside, "LARGE", 1), (place, "CHUNK", 9), (witness_motion, "CHUNK", 9), (witness_states, "CHUNK", 9),
         (second_reading, "CHUNK", 9), (block_times, "_CHUNK", 9), (linuxcnc, "_TOGETHER", 7), (words, "_STRETCH", 64),
         (words, "_NEAR", 7), (modal, "_PART", 11), (sections, "_PART", 5), (checks, "CHUNK", 9), (compare, "CHUNK", 9),
         (slow_moves, "CHUNK", 9), (states, "CHUNK", 9), (travel, "PART", 6), (moves, "_PART", 11))
CASES = (("five_faces.cls", "linuxcnc"), ("five_faces.cls", "fanuc-30i"), ("five_faces.cls", "heidenhain-tnc640"),
         ("tool_axis_tour.apt", "siemens-840d"), ("tool_axis_tour.apt", "haas-ngc"), ("pocket.cls", "generic-iso"))


def made(name: str, controller: str) -> PostResult:
    return convert(few_sides(name), "mikron-ucp710", controller, options=Options())


def all_of(result: PostResult) -> dict[str, object]:
    """The text, what is reported, what the second witness says, and the bytes of every array of the comparison, its motion
    and its times."""
    assert result.comparison is not None and result.comparison.executed is not None and result.witness is not None
    time = estimate_of(result)
    assert time is not None
    parts: dict[str, object] = {"text": result.text, "told": [str(d) for d in result.diagnostics], "extents": result.extents,
                               "witness": replace(result.witness, seconds=0.0), "bound": time.lower_bound}
    for owner in (result.comparison, result.comparison.executed[1], time.timed):
        parts |= {f"{type(owner).__name__}.{name}": np.ascontiguousarray(value).tobytes()
                  for name, value in vars(owner).items() if isinstance(value, np.ndarray)}
    return parts


@pytest.mark.covering(count=3)
@pytest.mark.parametrize(("name", "controller"), CASES, ids=str)
def test_short_stretches_change_nothing(name: str, controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = all_of(good(made(name, controller)))
    for module, size, value in SIZES:
        assert getattr(module, size) > value
        monkeypatch.setattr(module, size, value)
    monkeypatch.setattr(shape, "slices", lambda count: slices(count, 7))
    assert all_of(made(name, controller)) == whole


@pytest.mark.parametrize("near", [3, 10_000])
def test_comments_are_cut_out_wherever_they_stand(near: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(words, "_NEAR", near)
    pieces = [b"(a b)", b"; c (d)", b"(", b")", b"G1 X1", b"\n", b"((x)y)", b"(\n)", b" ", b";"]
    rng = np.random.default_rng(5)
    for _ in range(200):
        text = b"".join(pieces[k] for k in rng.integers(0, len(pieces), 30))
        wanted = re.sub(rb"\([^()\n]*\)|;[^\n]*", b"", words.lines_of(text))
        assert words.plain(text) == wanted


def test_faults_in_far_lines_keep_their_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(words, "_STRETCH", 20)
    text = b"G1 X1 Y2.5\n" * 30
    read, found = words.read_words(text)
    assert not found and read.lines == 30 and read.line.tolist() == np.repeat(np.arange(1, 31), 3).tolist()
    assert read.value.tolist() == [1.0, 1.0, 2.5] * 30
    assert read.point is not None and read.point.tolist() == [False, False, True] * 30
    _, found = words.read_words(text + b"G1 X\n")
    assert [d.lines for d in found] == [(31,)]


def test_lengths_and_cross_products_have_the_bits_of_numpy() -> None:
    rng = np.random.default_rng(3)
    a, b = (rng.normal(size=(1001, 3)) * 10.0 ** rng.integers(-6, 6, size=(1001, 1)) for _ in range(2))
    assert (lengths(a) == np.linalg.norm(a, axis=1)).all() and (cross(a, b) == np.cross(a, b)).all()
    assert (cross(a, b[0]) == np.cross(a, b[0])).all()
