"""Rests (DELAY) and stops (STOP, OPSTOP) of the CL file: each between the two positions that it stands between."""

from __future__ import annotations

import numpy as np

from postproc.witness.commanded import Commanded
from postproc.witness.evidence import Finding
from postproc.witness.motion import Walked
from postproc.witness.stretches import BOTTOM
from postproc.witness.text import Array

REST = 2e-3
"""s"""


def check_rests(w: Walked, c: Commanded, match: Array) -> tuple[list[Finding], int]:
    """Rests of another length and stops that the program lacks; how many were compared."""
    e, found, count = w.poses.executed, list[Finding](), len(c.stops)
    rests, asked, taken = dict[tuple[int, int], float](), dict[tuple[int, int], int](), set[int]()
    for row, seconds, line in c.rests:
        here = _between(w, match, row)
        rests[here] = rests.get(here, 0.0) + seconds
        asked.setdefault(here, line)
    for (first, last), seconds in rests.items():
        drilled = first >= 0 and w.targets.kind[np.searchsorted(match, first, side="right") - 1] == BOTTOM
        given = float(e.dwell[max(first + int(drilled), 0):last].sum())
        count += seconds == seconds
        if abs(given - seconds) > REST + 0.01 * seconds:
            found.append(Finding("rest", f"the tool rests for {given:g} s here, the CL file says {seconds:g} s",
                                 asked[first, last], int(e.line[max(first, 0)])))
    for row, kind, line in c.stops:
        first, last = _between(w, match, row)
        own = [k for k, (at, number) in enumerate(e.stops) if number == kind and first < at <= last and k not in taken]
        taken.update(own[:1])
        if not own:
            found.append(Finding("rest", f"the program has no M{kind:g} here, where the CL file stops", line,
                                 int(e.line[max(first, 0)])))
    return found, count


def _between(w: Walked, match: Array, row: int) -> tuple[int, int]:
    """(block that ends at the last position before a row, -1; block that ends at the first one behind it, or all)."""
    at = int(np.searchsorted(w.targets.row, row))
    first = int(match[at - 1]) if at else -1
    behind = int(np.searchsorted(match, first, side="right"))
    return first, int(match[behind]) if behind < len(match) else len(w.owner)
