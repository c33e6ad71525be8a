"""Why a cycle that single moves do not replace is not written as a canned cycle."""

from __future__ import annotations

import numpy as np

from postproc.compile.canned import LAST_PECK, cycle_key, cycle_spec, ends_short, falls, may_cycle
from postproc.controllers.model import ControllerFile
from postproc.path.model import JointPath
from postproc.reference.events import spindle_states
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.choices import CycleKind
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Cycle, Toolpath

SINGLE_MOVES = frozenset({"DRILL", "THRU", "CSINK", "FACE", "DEEP", "BRKCHP", "BORE", "REAM"})
"""kinds of cycles that rapids, feeds and dwells replace"""
_SPINDLE = ("its spindle stands", "state SPINDL/RPM,n,CLW before it")
_OTHER = ("the tool does not stand along Z of the words, or the retract ends at none of the levels of the cycle",
          "an output mode in which it does (--output-mode tilted), or RTRCTO at the start plane or where the tool came from")


def not_native(toolpath: Toolpath, moves: Moves, path: JointPath, native: Bools, controller: ControllerFile,
               skip: Bools) -> list[Diagnostic]:
    """Cycles that single moves do not replace and that could not be written as canned cycles, each with its
    reason; `native` and `skip` (K,) as in `holes_of`."""
    rows = _rows(toolpath, moves, path, native, controller)
    turning = spindle_states(toolpath)[0][moves.row[rows]]
    found: dict[tuple[str, str, str], list[int]] = {}
    for row, side in zip(rows.tolist(), turning.tolist(), strict=True):
        block = min(int(path.begin[row]), len(native) - 1)
        cycle = toolpath.cycles[int(moves.cycle[row])]
        key = cycle_key(cycle.kind, side)
        reason = _lacking(cycle, key, controller) or _at_its_place(path, block, controller, bool(skip[block]))
        found.setdefault((key or cycle.kind, *reason), []).append(int(moves.line[row]))
    return [error("cycle.not_native", f"a cycle {key} cannot be written as single moves, and this one not as a canned "
                  f"cycle: {why}", file=toolpath.file, lines=lines[:6], count=len(lines), hint=hint)
            for (key, why, hint), lines in sorted(found.items())]


def as_moves(toolpath: Toolpath, moves: Moves, path: JointPath, native: Bools, controller: ControllerFile,
             skip: Bools) -> list[Diagnostic]:
    """Cycles that the control has and that are written as single moves all the same, once for each kind and reason."""
    if not controller.cycles.enabled:
        return []
    only = only_canned(toolpath, controller)
    rows = np.flatnonzero((moves.phase == Phase.DRILL) & (moves.cycle >= 0))
    rows = rows[~only[moves.cycle[rows]] & ~native[np.minimum(path.begin[rows], len(native) - 1)]]
    found: dict[tuple[CycleKind, str], list[int]] = {}
    for row in rows.tolist():
        block = min(int(path.begin[row]), len(native) - 1)
        cycle = toolpath.cycles[int(moves.cycle[row])]
        if cycle.kind in controller.cycles.table or cycle.kind in controller.cycles.with_dwell:
            why = _unequal(cycle, controller) or _at_its_place(path, block, controller, bool(skip[block]))[0]
            found.setdefault((cycle.kind, why), []).append(int(moves.line[row]))
    return [info("cycle.as_moves", f"{len(lines)} {'hole' if len(lines) == 1 else 'holes'} of CYCLE/{kind} written as "
                 f"single moves: {why}", file=toolpath.file, lines=lines[:6], count=len(lines))
            for (kind, why), lines in sorted(found.items())]


def _unequal(cycle: Cycle, controller: ControllerFile) -> str:
    """Why no cycle of the controller is equal, "" where one is."""
    if cycle_spec(controller, cycle, cycle.kind) is not None:
        return ""
    if len(set(cycle.steps)) > 1:
        if falls(cycle) and ends_short(cycle):
            return f"its pecks would leave less than {LAST_PECK:g} mm for the last one"
        return "its pecks are not all alike" + (", and the controller's cycles.falling has none" if falls(cycle) else "")
    waits = "with" if cycle.dwell > 0.0 else "without"
    return f"the controller has none {waits} a dwell"


def only_canned(toolpath: Toolpath, controller: ControllerFile) -> Bools:
    """(C,) cycles that single moves do not replace."""
    return np.array([c.kind not in SINGLE_MOVES or c.kind in controller.cycles.rigid_only for c in toolpath.cycles],
                    dtype=bool)


def _rows(toolpath: Toolpath, moves: Moves, path: JointPath, native: Bools,
          controller: ControllerFile) -> Ints:
    """The moves down such holes."""
    only = only_canned(toolpath, controller)
    rows = np.flatnonzero((moves.phase == Phase.DRILL) & (moves.cycle >= 0))
    rows = rows[only[moves.cycle[rows]]] if len(only) else rows[:0]
    return rows[~native[np.minimum(path.begin[rows], len(native) - 1)]]


def _lacking(cycle: Cycle, key: str, controller: ControllerFile) -> tuple[str, str] | None:
    """(reason, what to do) where the controller file has no cycle of that key, spindle and dwell."""
    cycles, dwells = controller.cycles, cycle.dwell > 0.0
    plain, waiting = key in cycles.table, key in cycles.with_dwell
    if not key:
        return _SPINDLE
    if not cycles.enabled or 17 not in cycles.planes:
        return "the controller file allows none", "cycles.enabled and cycles.planes of the controller file"
    if not plain and not waiting:
        return f"the controller's cycles.table has no {key}", "take another cycle in the CAM system, or state the " \
            "control's in the controller file"
    if dwells and not waiting:
        return f"it dwells for {cycle.dwell:g} s, and the controller's cycles.with_dwell has no {key}", \
            "take DWELL out of the CYCLE record"
    if not dwells and not plain:
        return f"the controller has {key} with a dwell only", "state DWELL in the CYCLE record"
    return None


def _at_its_place(path: JointPath, block: int, controller: ControllerFile, skipped: bool) -> tuple[str, str]:
    """(reason, what to do) where the controller has the cycle, but not there."""
    law = path.frames[int(path.frame[block])].control
    if not may_cycle(law, controller):
        return f"this controller has none in output mode {law.law}", "another --output-mode, or one of its own for the " \
            "operation ([output.operations] of the set-up)"
    if skipped:
        return "it stands between OPSKIP/ON and OPSKIP/OFF", "end OPSKIP before it"
    return _OTHER
