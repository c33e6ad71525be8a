"""Where the meaning of the words changes: sections of the program, and the commands that enter and leave them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from postproc.compile.program import Command, Commands, Section
from postproc.path.model import JointPath
from toolpaths.arrays import Ints

_BELONG_BEFORE = frozenset({"CUTTER_COMPENSATION_OFF", "DWELL"})
"""commands that stand before a mode is left"""


def sections_of(path: JointPath, new: Ints) -> tuple[Section, ...]:
    """The sections of a path, `new` (K + 1,) giving the number of each block among those that are written."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(path.frame)) + 1])
    at = new[first]
    kept = np.flatnonzero(np.append(at[1:], new[-1]) > at)
    result: list[Section] = []
    for k in kept.tolist():
        frame = path.frames[int(path.frame[first[k]])]
        control, last = frame.control, result[-1] if result else None
        if last is None or (last.plane, last.law, last.place) != (control.plane, control.law, control.place):
            result.append(Section(int(at[k]), control.law, control.plane, frame.angles, frame.rotary, control.place))
    return tuple(result)


def with_sections(commands: Commands, sections: tuple[Section, ...]) -> Commands:
    """The commands with those that leave one section and enter the next.

    Cutter compensation ends inside its section; all else at the same block comes after the change.
    """
    result = dict(commands)
    for k, (old, section) in enumerate(pairwise(sections), 1):
        here = result.get(section.first, ())
        before = tuple(c for c in here if c.name in _BELONG_BEFORE and old.law != "axes")
        change = (*((Command("LEAVE_SECTION", (float(k - 1),)),) if old.law != "axes" else ()),
                  *((Command("SET_ORIGIN_OFFSETS", (float(section.place),)),) if section.place != old.place else ()),
                  *((Command("ENTER_SECTION", (float(k),)),) if section.law != "axes" else ()))
        result[section.first] = (*before, *change, *(c for c in here if c not in before))
    return result
