"""Arcs under cutter compensation that controls refuse: where it begins or ends, and out of the plane that it acts in."""

from __future__ import annotations

import numpy as np

from postproc.compile.program import Command, Program
from postproc.controllers.model import ControllerFile
from postproc.path.model import ARC
from postproc.reference.events import state_at
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, error

CODE = "CUTTER_COMPENSATION"
LEADS = {False: ("begins", "CUTCOM before a straight move that leads to the contour"),
         True: ("ends", "CUTCOM/OFF before a straight move that leads away from the contour")}
"""by True for its end: what it does, what to write"""


def compensated_arcs(controller: ControllerFile, program: Program, file: str) -> list[Diagnostic]:
    """Arcs that the controller cannot run where the program has them.

    The first move in the plane behind G41 or G40 builds the offset up or takes it down. It has to be straight
    on Fanuc (16/18-C operator's manual, cutter compensation C, start-up and cancel: G00 or G01), on Siemens
    (S1, G41 and G40 with G0 or G1), on Heidenhain (TNC 620 DIN/ISO 34056x-02, 6.2) and on Haas (alarms 340,
    341); LinuxCNC 2.9 begins on an arc, and ends on none (measured with rs274). None of them changes the
    plane while it is on (Siemens alarm 10757; rs274 says so).
    """
    rules, leads = controller.cutter_compensation, _leading(program)
    allowed = {False: rules.begins_on_arc, True: rules.ends_on_arc}
    result = []
    for off, (does, write) in LEADS.items():
        lines = [] if allowed[off] else [c.line or int(program.line[k]) for k, c in leads.items()
                                         if program.code[k] == ARC and c.name.endswith("OFF") == off]
        if lines:
            result.append(error("cutcom.arc", f"cutter compensation {does} on an arc, which this controller cannot",
                                file=file, lines=lines[:6], count=len(lines), hint=f"write {write}"))
    across = _on(program) & (program.code == ARC) & (program.plane != 17)
    if across.any():
        result.append(error("cutcom.arc_plane", "an arc out of the XY plane while cutter compensation is on, which acts in "
                            "that plane", file=file, lines=np.unique(program.line[across])[:6].tolist(),
                            count=int(across.sum()), hint="write CUTCOM/OFF before it, or let the CAM system write points"))
    return result


def _leading(program: Program) -> dict[int, Command]:
    """The last command of compensation before the first move in the plane behind it, by the block of that move."""
    moving, result = _planar(program), dict[int, Command]()
    for block, command in program.ordered():
        if command.name.startswith(CODE) and (at := int(moving.searchsorted(block))) < len(moving):
            result[int(moving[at])] = command
    return result


def _planar(program: Program) -> Ints:
    """Blocks that move X or Y, or go round an arc."""
    columns = [program.letters.index(letter) for letter in "XY" if letter in program.letters]
    moved = np.diff(program.words[:, columns], axis=0, prepend=np.nan) != 0.0
    return np.flatnonzero(moved.any(axis=1) | (program.code == ARC))


def _on(program: Program) -> Bools:
    """(K,) blocks under compensation."""
    begun = [(block, not c.name.endswith("OFF")) for block, c in program.ordered() if c.name.startswith(CODE)]
    starts, on = zip((0, False), *begun, strict=True)
    return np.array(on)[state_at(list(starts), len(program))]
