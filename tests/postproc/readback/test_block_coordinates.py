"""Coordinates of blocks in their frames: those of each end by itself, and each place computed once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from machines.kinematics import chain_loop
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.frames import ExecutionFrame, FrameTable
from postproc.readback.execution.frames_loop import in_frames, on_table
from postproc.readback.execution.poses import SAMPLES, BlockMotions, BlockPoses, begins, coordinates
from tests.postproc.reader_kit import FANUC, control, good
from toolpaths.arrays import Floats, Ints

ON, COUNT = "mikron-ucp710", 12
HELD = control(ON)
ROWS = {"all": np.arange(COUNT), "apart": np.array([0, 2, 3, 7, 8, 9, 11]), "back": np.array([5, 4, 4, 5, 0]),
        "one": np.array([3]), "none": np.zeros(0, dtype=np.int64)}


@pytest.fixture(scope="module")
def motion() -> Motion:
    """Blocks of five axes, some of them in words of the tip, of two frames."""
    moved = good(FANUC, "%\nO1\nG21 G90 G94 G17\n" + "".join(f"G1 X{k}. Y{3 * k}. Z-{k}. F100.\n" for k in range(COUNT))
                 + "M30\n%\n", ON)
    rng = np.random.default_rng(3)
    kin = HELD.machine.kinematics.with_tool(80.0)
    frames = tuple(ExecutionFrame("tcp", HELD, kin, np.eye(3), np.array([x, 2.0, 3.0])) for x in (1.0, 40.0))
    end = moved.end + rng.uniform(-1.0, 1.0, moved.end.shape)
    return replace(moved, end=end, frames=(*moved.frames, *frames), frame=np.array([0, 0, 1, 1, 1, 2, 2, 1, 1, 1, 2, 0]))


@pytest.mark.parametrize("name", ROWS)
def test_coordinates_are_those_of_each_end_by_itself(motion: Motion, name: str) -> None:
    rows = ROWS[name]
    first, last = coordinates(motion, rows)
    assert np.array_equal(first, motion.table.coordinates(motion.frame[rows], begins(motion, rows)))
    assert np.array_equal(last, motion.table.coordinates(motion.frame[rows], motion.end[rows]))
    assert not np.array_equal(last, motion.end[rows]) or name == "none"


@pytest.mark.parametrize("name", ROWS)
def test_positions_made_ahead_are_those_asked_for_one_by_one(motion: Motion, name: str) -> None:
    rows, poses = ROWS[name], BlockPoses(HELD, lambda _: HELD.machine.kinematics, {})
    poses.look_ahead(motion, rows, SAMPLES)
    for t in SAMPLES[:-1]:
        assert np.array_equal(poses._position(motion, rows, t), BlockMotions.of(motion, HELD, rows).at(t))


def test_a_place_between_two_blocks_is_computed_once(motion: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    """13 ends and beginnings of 12 blocks, and one more where the frame changes."""
    asked: list[int] = []
    found = FrameTable.coordinates

    def counted(table: FrameTable, number: Ints, position: Floats) -> Floats:
        asked.append(len(position))
        return found(table, number, position)
    monkeypatch.setattr(FrameTable, "coordinates", counted)
    changes = int(np.count_nonzero(np.diff(motion.frame)))
    BlockPoses(HELD, lambda _: HELD.machine.kinematics, {}).look_ahead(motion, ROWS["all"], SAMPLES)
    assert asked == [COUNT + 1 + changes]


@pytest.mark.numeric
def test_points_in_frames_have_the_bits_of_the_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    rotation = np.linalg.qr(rng.normal(size=(4, 3, 3)))[0]
    origin, number, point = rng.normal(size=(4, 3)) * 100.0, rng.integers(0, 4, 300), rng.normal(size=(300, 3)) * 50.0
    found = []
    for chosen in (False, True):
        monkeypatch.setattr(chain_loop, "wanted", lambda *_, chosen=chosen: chosen)
        found.append([change(number, rotation, origin, point) for change in (on_table, in_frames)])
    np.testing.assert_array_equal(*found)
    np.testing.assert_allclose(in_frames(number, rotation, origin, found[1][0]), point, rtol=0, atol=1e-11)
    f = number[0]
    np.testing.assert_allclose(found[1][0][0], rotation[f] @ point[0] + origin[f], rtol=0, atol=1e-11)
