"""Drilling cycles whose numbers make no hole, refused before anything is planned with them."""

from __future__ import annotations

import numpy as np

from postproc.controllers.model import ControllerFile
from toolpaths.arrays import Bools, distinct
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Cycle, Toolpath

_SAME = 1e-9
"""mm between planes that are one"""


def unfit_holes(toolpath: Toolpath, controller: ControllerFile) -> list[Diagnostic]:
    """Cycles with holes that have no depth in the words of the controller, whose planes are in the wrong
    order, or whose pecks are nothing; all by the line of the CYCLE record."""
    used = [toolpath.cycles[int(k)] for k in distinct(toolpath.cycle[toolpath.cycle >= 0])]
    if not used:
        return []
    least = controller.grain
    depth, clearance, retract, peck = np.array([_numbers(c) for c in used]).T
    shallow = ~(depth >= least)
    under = ~shallow & ~(clearance + depth >= least)
    below = ~shallow & ~under & ~(retract > -depth)
    lifted = ~shallow & ~under & ~below & (retract < clearance - _SAME)
    last = f"{_plain(least)} mm, the last decimal of the controller's words"
    faults = (
        ("cycle.depth", shallow, depth, f"the depth of the hole is {{}} mm, at least {last}", "state the depth in the CAM "
         "system (FEDTO or DEPTH of the CYCLE record), or take the hole out of the operation"),
        ("cycle.start_plane", under, clearance, "the start plane lies {} mm above the hole's top, which is at or below its "
         "bottom", "state CLEAR or RAPTO above the top of the hole"),
        ("cycle.retract", below, retract, "the retract plane lies {} mm above the hole's top, which is at or below its "
         "bottom", "state RTRCTO above the top of the hole, or RTRCTO,AUTO"),
        ("cycle.peck", ~(peck >= least), peck, f"a peck of {{}} mm, at least {last}", "state a larger STEP, or drill in one "
         "go (CYCLE/DRILL)"))
    return [error(code, text.format(_plain(values[rows[0]])), file=toolpath.file, lines=[used[k].line for k in rows[:6]],
                  count=len(rows), hint=hint)
            for code, wrong, values, text, hint in faults if len(rows := np.flatnonzero(wrong))
            ] + _lifted(used, lifted, toolpath.file)


def _numbers(cycle: Cycle) -> tuple[float, float, float, float]:
    """(depth, clearance, retract, smallest peck), mm; inf where the cycle has none."""
    retract = np.inf if cycle.retract is None else cycle.retract
    return cycle.depth, cycle.clearance, retract, min(cycle.steps, default=np.inf)


def _plain(value: float) -> str:
    """A number without an exponent."""
    return np.format_float_positional(value, precision=9, trim="-")


def _lifted(used: list[Cycle], which: Bools, file: str) -> list[Diagnostic]:
    """Retract planes below the start plane: the tool goes up to that one."""
    rows = np.flatnonzero(which)
    if not len(rows):
        return []
    return [info("cycle.retract", "the retract plane lies below the start plane: the tool retracts to the start plane",
                 file=file, lines=[used[k].line for k in rows[:6]], count=len(rows))]
