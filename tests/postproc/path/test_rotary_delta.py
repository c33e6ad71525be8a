"""A rotary Delta, all of whose drives are arms, on the road: short moves, spoilt words, a part that stands nowhere."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import machines
import postproc
from machines.machine import Machine
from postproc.pipeline.result import PostResult
from postproc.setup.model import PartPlacement, SetupFile
from postproc.setup_sheet.place import found_place
from postproc.verification.read_back import read_back
from tests.machines.kinematics.test_legs import ARMS
from tests.postproc.kit import codes, good, goto, toolpath
from toolpaths.toolpath import Toolpath

TOLERANCE = 0.05
SHORT = np.array([[x, 0.0, 0.0] for x in np.arange(30) * 0.004] + [[60.0, 40.0, 0.0]])
"""steps of 0.004 mm, less than an angle of 0.001 degrees moves the tip"""


@cache
def rotary_delta() -> Machine:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "rotary.toml"
        fast = re.sub(r"(velocity|acceleration|jerk) = 1\n", r"\1 = 3000\n", ARMS)
        file.write_text(fast + '[control]\nrapids = "straight"\n')
        return machines.load(file)


def path_of(points: np.ndarray) -> Toolpath:
    return toolpath("RAPID", *goto(points[:1] + np.array([0.0, 0.0, 20.0])), "FEDRAT/600,MMPM", *goto(points))


def converted(points: np.ndarray) -> PostResult:
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 60.0}}}).model_copy(
        update={"part": PartPlacement(origin=(0.0, 0.0, -750.0))})
    return postproc.convert(path_of(points), rotary_delta(), "haas-ngc", setup, postproc.Options(tolerance=TOLERANCE))


@cache
def short() -> PostResult:
    return good(converted(SHORT))


def test_moves_shorter_than_an_angle_shows_may_vanish() -> None:
    """0.001 degrees of an arm of 350 mm is 0.006 mm of tip."""
    result = short()
    assert result.comparison is not None and result.comparison.worst_tip < TOLERANCE and "verify.not_reached" not in codes(
        result.diagnostics)


@pytest.mark.parametrize("by", [0.05, -0.05])
def test_a_spoilt_angle_among_them_is_seen(by: float) -> None:
    result = short()
    assert result.job is not None
    lines = result.text.splitlines()
    at = next(k for k, line in enumerate(lines) if re.search(r"G1 .*A", line)) + 3
    spoilt = re.sub(r"([ABC])(-?[\d.]+)", lambda word: f"{word[1]}{float(word[2]) + by:.3f}", lines[at], count=1)
    assert spoilt != lines[at]
    text = "\n".join([*lines[:at], spoilt, *lines[at + 1:], ""])
    assert "verify.tip" in codes(read_back(text.encode(), result.job, "test")[1])


def test_a_number_beyond_the_workspace_is_named() -> None:
    """No slide has a travel to measure the file by: the workspace has, 619 mm from corner to corner."""
    points = np.array([[x, 0.0, 0.0] for x in range(0, 36, 6)])
    points[3, 1] = 5000.0
    (odd,) = found_place(converted(points), path_of(points))
    assert odd.lines and "Y goes to 5000 mm" in odd.message
