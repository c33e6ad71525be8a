"""Places of the same blocks at several fractions are made at once, and each of them once."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import postproc
from postproc.base.options import Options
from postproc.readback.execution.poses import BlockMotions, BlockPoses
from postproc.verification.executed import executed_poses
from tests.postproc.kit import few_sides

SETUP = str(Path(__file__).parents[3] / "samples" / "tools.setup.toml")


@pytest.mark.parametrize(("machine", "controller"), [("mikron-ucp710", "fanuc-30i"), ("head-table", "siemens-840d")])
def test_a_small_program_is_not_moved_fraction_by_fraction(machine: str, controller: str,
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    """Of places announced by `look_ahead` none is worked out again when it is asked for."""
    made, ahead = Counter[str](), BlockPoses.look_ahead
    at, looking = BlockMotions.at, list[bool]()

    def counted(self: BlockMotions, t: Any) -> Any:
        made["ahead" if looking else "alone"] += 1
        return at(self, t)

    def looked(self: BlockPoses, *asked: Any) -> None:
        looking.append(True)
        ahead(self, *asked)
        looking.pop()
    monkeypatch.setattr(BlockMotions, "at", counted)
    monkeypatch.setattr(BlockPoses, "look_ahead", looked)
    result = postproc.convert(few_sides("five_faces.cls"), machine, controller, options=Options(setup=SETUP))
    assert result.ok
    assert made["ahead"] >= 3
    assert made["alone"] <= 6


def test_what_is_made_ahead_is_what_is_made_alone() -> None:
    result = postproc.convert(few_sides("five_faces.cls"), "mikron-ucp710", "fanuc-30i", options=Options(setup=SETUP))
    assert result.comparison is not None and result.job is not None
    motion = result.comparison.executed[1]
    poses = executed_poses(result.job, motion, result.job.register_lengths())
    rows, times = np.arange(len(motion)), [0.0, 0.25, 0.5, 1.0]
    alone = [(*poses.poses(motion, rows, t), poses.joints(motion, rows, t)) for t in times]
    poses.look_ahead(motion, rows, times)
    for t, one in zip(times, alone, strict=True):
        for a, b in zip((*poses.poses(motion, rows, t), poses.joints(motion, rows, t)), one, strict=True):
            np.testing.assert_array_equal(a, b)
