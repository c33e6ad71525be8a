"""Several parts in one program: LinuxCNC's interpreter, its offsets set as the header says, goes to each of them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.setup.places import PlaceOrder
from tests.linuxcnc import outputs
from tests.postproc.job.test_places import FACES, TOOLS, TWO
from toolpaths.arrays import Floats

EXACT = 1e-9
"""mm and degrees"""


def with_offsets(result: PostResult) -> str:
    """The text with comments of its header replaced: the register of every place set, the machine brought home."""
    assert result.job is not None
    lines, letters = result.text.split("\n"), result.machine.axis_names
    assert all(line.startswith("(") for line in lines[1:len(result.job.places) + 2])
    for k, place in enumerate(result.job.places):
        values = result.job.control_at(k).work_offset
        lines[1 + k] = f"G21 G90 G10 L2 P{int(place.code[1:]) - 53}" + words(letters, values)
    lines[1 + len(result.job.places)] = "G53 G0" + words(letters, outputs.start(result))
    return "\n".join(lines)


def words(letters: tuple[str, ...], values: Floats) -> str:
    return "".join(f" {letter}{value:.12f}" for letter, value in zip(letters, values, strict=True))


@pytest.mark.covering
@pytest.mark.parametrize("order", ["tool", "part"])
@pytest.mark.parametrize(("file", "machine", "places"), [
    ("pocket.cls", "mill-3axis", TWO), ("pocket.cls", "mill-4axis", FACES)])
def test_every_place_is_gone_to(interpret, file: str, machine: str, places: list[dict[str, object]],
                                order: PlaceOrder) -> None:
    path, found = toolpaths.read(Path("samples") / file)
    result = postproc.convert(path, machines.load(machine), "linuxcnc", SetupFile.model_validate(
        {"tools": TOOLS, "places": places, "order": order}), diagnostics=found)
    assert result.ok and result.comparison is not None
    with tempfile.TemporaryDirectory(prefix="postproc-places-") as folder:
        program = Path(folder) / "program.ngc"
        program.write_text(with_offsets(result))
        canonical = interpret(program, outputs.tools(result))
    assert canonical.error == ""
    motion = result.comparison.executed[1]
    ours = np.flatnonzero((motion.code > 0) & ~motion.hole)
    theirs = np.flatnonzero(np.isin(canonical.kind, (1, 2)) & np.isin(canonical.line, motion.line[ours]))
    np.testing.assert_array_equal(canonical.line[theirs], motion.line[ours])
    columns = [outputs.AXES.index(letter) for letter in result.machine.axis_names]
    assert np.abs(canonical.machine[theirs][:, columns] - motion.end[ours]).max() < EXACT
    assert len(set(np.round(motion.offset[ours], 1))) == len(places)
