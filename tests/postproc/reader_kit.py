"""Hand-written programs of every dialect through the reader, on a machine with a known work offset and known tools."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from machines.choices import Rapids
from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.controllers.model import ControllerFile, load_controller
from postproc.readback.dialects.iso import IsoReader
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.poses import BlockPoses
from postproc.readback.text.canonical import ProgramText
from postproc.readback.text.words import Words
from tests.postproc.kit import machine
from toolpaths.diagnostics import Diagnostic, has_errors

ORIGIN = (10.0, 20.0, 30.0)
LENGTHS = {1: 100.0, 2: 55.5}
FANUC, HAAS, SIEMENS, TNC = "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"


@cache
def controller(name: str) -> ControllerFile:
    spec, found = load_controller(name)
    assert spec is not None and not found
    return spec


def control(name: str = "mill-3axis", rapids: Rapids = "straight", own: Kinematics | None = None) -> Control:
    return Control(machine(name), "axes", np.array(ORIGIN), rapids=rapids, own_kinematics=own)


def executed(dialect: str, text: str, on: str = "mill-3axis", others: Mapping[str, bytes] | None = None,
             of: Control | None = None) -> tuple[Motion | None, list[Diagnostic]]:
    """Motion of a program, and what the reader finds."""
    held = of or control(on)
    home = held.machine.home * held.unit
    reader = reader_for(controller(dialect), held.machine.axis_names, home)
    code, found = reader.read(text.encode(), "MAIN", others)
    if code is None:
        return None, found
    offsets = Offsets(held.work_offset, held.xyz, LENGTHS, home, held.length_on_z, 0.5, held, reader.rises_first,
                      reader.arc_slack)
    motion, more = run(code, held.machine.axis_names, offsets, "MAIN")
    return motion, [*found, *more]


def good(dialect: str, text: str, on: str = "mill-3axis", **more: object) -> Motion:
    """The motion of a program without faults."""
    motion, found = executed(dialect, text, on, **more)
    assert not has_errors(found), [str(d) for d in found]
    assert motion is not None
    return motion


def words(motion: Motion) -> list[list[float]]:
    """Ends less the work offset, rounded."""
    return (motion.end[:, :3] - np.array(ORIGIN)).round(4).tolist()


def look(motion: Motion, held: Control) -> BlockPoses:
    """Poses of the motion on the machine itself."""
    kin = held.machine.kinematics
    return BlockPoses(held, lambda number: kin.with_tool(LENGTHS.get(number, 0.0)), LENGTHS)


def faults(dialect: str, text: str, on: str = "mill-3axis") -> dict[str, list[int]]:
    """Codes of the errors with their lines."""
    result: dict[str, list[int]] = {}
    for d in executed(dialect, text, on)[1]:
        if d.severity.name == "ERROR":
            result.setdefault(d.code, list(d.lines))
    return result


def execute(words: Words, letters: tuple[str, ...], offsets: Offsets,
            file: str = "") -> tuple[Motion, list[Diagnostic]]:
    """The motion of a program in RS274/NGC words, without subprograms, that starts with the machine at home."""
    reader = IsoReader(letters)
    found = reader.check(words, file)
    canonical, more = reader.translated(ProgramText(words), np.arange(words.lines + 1), file)
    motion, last = run(canonical, letters, offsets, file)
    return motion, [*found, *more, *last]
