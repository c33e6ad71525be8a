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
from toolpaths.arrays import Floats

EXACT = 1e-9
"""mm and degrees"""
TOOLS = {str(n): {"gauge_length": 90.0 + 10.0 * n} for n in range(1, 6)}
ROW = [{"name": "left", "work_offset_code": "G54", "origin": (-30.0, 0.0, 20.0)},
       {"name": "right", "work_offset_code": "G56", "origin": (90.0, -10.0, 5.0), "x_axis": (0.0, 1.0, 0.0),
        "y_axis": (-1.0, 0.0, 0.0)}]
FACES = [{"name": f"face {k}", "work_offset_code": f"G5{4 + k}", "origin": (-20.0, 0.0, 60.0), "turn": {"A": 90.0 * k}}
         for k in range(3)]


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


@pytest.mark.parametrize("order", ["tool", "part"])
@pytest.mark.parametrize(("file", "machine", "places"), [
    ("pocket.cls", "mill-3axis", ROW), ("pocket.cls", "mill-4axis", FACES)])
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
