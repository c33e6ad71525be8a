"""Words of modulo axes that could not say which path they turn, or that would turn an axis which stands."""

from __future__ import annotations

import numpy as np

from postproc.compile.program import Program
from postproc.control.rollover import LEAST, TURN, Rollover
from toolpaths.arrays import Bools, Floats
from toolpaths.diagnostics import Diagnostic, error


def without_standing(write: Bools, positions: Floats, rolls: dict[int, Rollover]) -> Bools:
    """(K, J) the words that blocks state, without those of axes that stand, where the sign of a word is the direction.

    LinuxCNC takes a word that is less than its own position by the last bit of a number for one that lies a
    whole turn ahead (`unwrap_rotary` of its interpreter). The first word of an axis stays: nobody knows where
    it stands before.
    """
    for axis, roll in rolls.items():
        rows = np.flatnonzero(write[:, axis])
        stands = rows[1:][np.abs(np.diff(positions[rows, axis])) < LEAST]
        if roll.rule == "sign" and len(stands):
            write = write.copy()
            write[stands, axis] = False
    return write


def standing_unsaid(rolls: dict[int, Rollover], letters: tuple[str, ...], restart: bool, skipped: bool,
                    file: str) -> list[Diagnostic]:
    """An error where a block must not depend on what ran before it, but an axis that stands cannot be stated."""
    axes = ", ".join(letters[axis] for axis, roll in rolls.items() if roll.rule == "sign")
    why = "a restart at an operation" if restart else "a block behind OPSKIP" if skipped else ""
    if not axes or not why:
        return []
    return [error("rollover.standing", f"{why} must state {axes}, and where the sign of a word is the direction a word that "
                  "states where the axis stands may turn it by a whole turn", file=file,
                  hint='leave restart = true out of the set-up and OPSKIP out of the CL file, or take rollover = "shortest" '
                  'or "none" for the axis where the control can')]


def long_turns(program: Program, file: str) -> list[Diagnostic]:
    """Blocks that turn a modulo axis by half a turn or more where the control takes the shorter path, else by
    a whole one."""
    found = []
    for axis, roll in program.rolls.items():
        most = TURN / 2.0 if roll.undirected else TURN
        step = np.abs(program.words[:, axis] - program.before(axis))
        bad = np.flatnonzero(program.write[:, axis] & (step > most - LEAST))
        if len(bad):
            k = int(bad[0])
            found.append(error("rollover.turn", f"axis {program.letters[axis]} turns by {step[k]:.4f} degrees in one block, "
                               f"and its words say the direction of less than {most:g} only", file=file,
                               lines=program.line[bad[:6]].tolist(), count=len(bad),
                               hint='rollover = "none" for this axis in the machine file, where the control counts turns'))
    return found
