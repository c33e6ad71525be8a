"""Cutter compensation of every cut against CUTCOM of the CL file and the set-up."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.witness.commanded import ARC, LINE, OFF, UNKNOWN, Commanded
from postproc.witness.evidence import Case, Finding
from postproc.witness.motion import Walked
from postproc.witness.states import tools_of
from postproc.witness.text import Array

_NAMES = {OFF: "off", 41: "left of the path", 42: "right of the path"}


def check_sides(w: Walked, c: Commanded, case: Case) -> tuple[list[Finding], int]:
    """Cuts on another side than CUTCOM says; how many blocks were compared, where either has compensation.

    A block that ends where two positions of the file are within the tolerance may belong to either.
    """
    e = w.poses.executed
    rows = np.flatnonzero(w.inside & (w.code > 0) & ~w.gap & ~w.returns & ((w.kind == LINE) | (w.kind == ARC)) & w.on_path())
    row = w.targets.row[w.owner[rows]]
    wanted, known = _wanted(c, case.setup)
    given = e.side[rows]
    if not ((given != OFF).any() or (c.side != OFF).any()):
        return [], 0
    near = (np.maximum(row - 1, 0), row, np.minimum(row + 1, len(c) - 1))
    good = np.any([wanted[k] == given for k in near], axis=0) | ~known[row]
    bad = np.flatnonzero(~good)
    compared = int(known[row].sum())
    named, used = c.radius[row], e.radius[rows]
    other = np.flatnonzero(case.radius_named & good & (given != OFF) & np.isfinite(named) & (used != named)
                           & (named != tools_of(c, case.setup)[row]))
    if len(other) and not len(bad):
        k = int(other[0])
        return [Finding("compensation", f"the register of cutter compensation is {used[k]:g}, CUTCOM names {named[k]:g}",
                        int(c.line[row[k]]), int(e.line[rows[k]]), len(other))], compared
    if not len(bad):
        return [], compared
    k = int(bad[0])
    return [Finding("compensation", f"cutter compensation is {_NAMES[int(given[k])]}, by CL file and set-up it is "
                    f"{_NAMES[int(wanted[row[k]])]}", int(c.line[row[k]]), int(e.line[rows[k]]), len(bad))], compared


def _wanted(c: Commanded, setup: dict[str, Any]) -> tuple[Array, Array]:
    """(side (N,), True (N,) where it is sure): off in holes and for tools whose path is not compensated."""
    bare = [int(n) for n, t in (setup.get("tools") or {}).items() if (t or {}).get("compensation") == "none"]
    side = np.where(c.cycle >= 0, OFF, c.side)
    if not bare:
        return side, np.ones(len(c), bool)
    tool = tools_of(c, setup)
    unsure = (tool == UNKNOWN) & (side != OFF)
    return np.where(np.isin(tool, bare), OFF, side), ~unsure
