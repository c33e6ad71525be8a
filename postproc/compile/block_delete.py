"""OPSKIP: blocks that a switch at the control leaves out ("/").

What follows them must not depend on the switch, so that it states every axis and every modal code again;
modes, tools and compensation must not change inside.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.compile.program import Command, Commands
from postproc.path.model import JointPath
from postproc.reference.events import words
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.toolpath import Toolpath

_KEPT = frozenset({"ENTER_SECTION", "LEAVE_SECTION", "CHANGE_TOOL", "USE_TOOL_LENGTH_OFFSET", "CUTTER_COMPENSATION_LEFT",
                   "CUTTER_COMPENSATION_RIGHT", "CUTTER_COMPENSATION_OFF", "OPERATION_START"})
"""commands that must not depend on a switch"""


def skipped(toolpath: Toolpath, moves: Moves, path: JointPath) -> Bools:
    """(K,) blocks between OPSKIP/ON and OPSKIP/OFF, or the end."""
    change = np.zeros(len(path) + 1, dtype=np.int8)
    on = False
    for event in toolpath.events:
        if event.word == "OPSKIP" and ("OFF" not in words(event)) != on:
            on = not on
            change[path.begin[int(np.searchsorted(moves.row, event.index))]] += 1 if on else -1
    return np.asarray(np.cumsum(change)[:-1] > 0)


def after(skip: Bools) -> Ints:
    """The blocks that follow blocks which may be left out."""
    return np.flatnonzero(np.diff(skip.astype(np.int8), prepend=0) == -1)


def with_skips(commands: Commands, skip: Bools, lines: Ints, file: str) -> tuple[Commands, list[Diagnostic]]:
    """The commands of blocks `skip` (K,) marked, modal codes restated behind them; `lines` (K,) are the CL lines."""
    if not skip.any():
        return commands, []
    result, wrong = dict(commands), []
    first = np.flatnonzero(np.diff(skip.astype(np.int8), prepend=0) == 1).tolist()
    for k, group in commands.items():
        if k < len(skip) and skip[k] and k not in first:
            result[k] = tuple(replace(c, skip=True) for c in group)
            wrong += [int(lines[k]) for c in group if c.name in _KEPT]
    for k in after(skip).tolist():
        wrong += [int(lines[k]) for c in commands.get(k, ()) if c.name in _KEPT]
        result[k] = (Command("RESTATE"), *result.get(k, ()))
    found = [warning("opskip.proof", "blocks that the block switch leaves out are written with /; they are proved as being "
                     "carried out, without them nothing is proved", file=file,
                     lines=np.unique(lines[skip])[:6].tolist(), count=int(skip.sum()))]
    if wrong:
        found.append(error("opskip.mode", "the tool, its length, the output mode or cutter compensation changes among "
                           "blocks that a switch may leave out", file=file, lines=sorted(set(wrong))[:6], count=len(wrong),
                           hint="put OPSKIP around moves of one tool and one tool axis only"))
    return result, found
