"""Tapped holes: pitch, hand and kind of tapping, which the path of the tool does not show."""

from __future__ import annotations

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.reference.events import spindle_states
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic

PITCH_SLACK = 0.005
"""share of a pitch that the rounding of feed, speed and pitch words explains"""
_FLOATING = ("CYCLE840", "CYCL DEF 206")
"""cycles of the controllers that leave feed and spindle uncoupled"""


def check_taps(motion: Motion, job: Job, moves: Moves, owner: Ints, faults: Faults) -> list[Diagnostic]:
    """Feed by speed is the pitch of the CL file, right- or left-hand as its spindle turns, coupled as the post has it."""
    taps = np.array([c.kind == "TAP" for c in job.toolpath.cycles] + [False])
    move = np.minimum(owner, len(moves) - 1)
    drilled = (owner < len(moves)) & (moves.phase[move] == Phase.DRILL)
    rows, others = (np.flatnonzero(drilled & which) for which in (taps[moves.cycle[move]], ~taps[moves.cycle[move]]))
    others = others[np.isfinite(motion.pitch[others])]
    result: list[Diagnostic] = []
    if len(others):
        result.append(faults.error("verify.tap", "the hole is tapped, the CL file does not tap it",
                                   int(moves.line[move[others[0]]]), int(motion.line[others[0]]), len(others),
                                   "the cycle of the hole"))
    if not len(rows):
        return result
    m = move[rows]
    sense, rpm = (a[moves.row[m]] for a in spindle_states(job.toolpath))
    stated = np.array([np.nan if c.pitch is None else c.pitch for c in job.toolpath.cycles])[moves.cycle[m]]
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = sense * np.where(np.isfinite(stated), stated, 60.0 * moves.feed[m] / rpm)
    found = motion.pitch[rows]
    right = np.abs(found - wanted) <= PITCH_SLACK * np.abs(wanted)
    bad = np.flatnonzero(~right)
    if len(bad):
        k = int(bad[0])
        what = "the hole is not tapped" if np.isnan(found[k]) else f"the tap runs at {_thread(found[k])}"
        result.append(faults.error("verify.tap", f"{what}, it should be {_thread(wanted[k])}", int(moves.line[m[k]]),
                                   int(motion.line[rows[k]]), len(bad), "feed = pitch times speed; the cycle for the hand "
                                   "of the tap"))
    loose: Bools = motion.floating[rows] & (not _floats(job))
    if loose.any():
        k = int(loose.argmax())
        result.append(faults.error("verify.tap", "tapping with a floating chuck, the post taps rigidly",
                                   int(moves.line[m[k]]), int(motion.line[rows[k]]), int(loose.sum()),
                                   "the cycle as the post writes it"))
    return result


def _thread(pitch: float) -> str:
    return f"{abs(pitch):.4f} mm per turn, {'left' if pitch < 0.0 else 'right'}-hand"


def _floats(job: Job) -> bool:
    """True where the controller's own cycle of a tap needs a floating chuck."""
    cycles = job.controller.cycles
    return any(name in spec.code for table in (cycles.table, cycles.with_dwell) for key, spec in table.items()
               if key.startswith("TAP") for name in _FLOATING)
