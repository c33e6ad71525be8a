"""One wrong number in a CL file: a point far from all others, a tool axis far from those before and behind it."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind, Role, Toolpath
from toolpaths.units import DEG

_FAR = 5.0
"""times the extent of all other points from which a point is far from them"""
_FEW = 0.05
"""share of the points that a far number may stand in: it is kept where the records behind it state none"""
_TURNED, _STEADY = 60.0 * DEG, 15.0 * DEG
"""rad from which an axis stands apart from both its neighbours, and up to which these agree"""
_LEAST = 5
"""points that all others are at least"""
_PARKED_FOR = frozenset({"LOADTL", "STOP", "OPSTOP"})
"""records for which CAM systems park the tool"""
_HINT = "correct the record there, or have the CAM system write it again; all else is looked at when it is right"


def odd_record(toolpath: Toolpath, longest: float) -> Diagnostic | None:
    """The one record that a refusal by travel or reach comes from; None where there is none.

    Args:
        longest: travel of the longest linear axis, mm: a path that is longer fits nowhere
    """
    rows = np.flatnonzero(toolpath.role != Role.START)
    if len(rows) < _LEAST:
        return None
    return _far_point(toolpath, rows, longest) or _turned_axis(toolpath, rows)


def _far_point(toolpath: Toolpath, rows: Ints, longest: float) -> Diagnostic | None:
    for k, name in enumerate("XYZ"):
        values = toolpath.tip[rows, k]
        at = int(np.argmax(np.abs(values - np.median(values))))
        rest = values[values != values[at]]  # records behind it may keep the number
        if len(rest) < _LEAST - 1 or len(values) - len(rest) > max(1.0, _FEW * len(values)):
            continue
        low, high = float(rest.min()), float(rest.max())
        far = max(low - float(values[at]), float(values[at]) - high)
        if far > _FAR * max(high - low, 1.0) and far > longest and not _parked(toolpath, int(rows[at])):
            return _odd(toolpath, rows[at], f"{name} goes to {values[at]:g} mm, {far:g} mm beyond all other points of the "
                        f"file, which lie between {low:g} and {high:g} mm")
    return None


def _parked(toolpath: Toolpath, row: int) -> bool:
    """True where rapids alone lead from there to the end of the file, or from its start there, and where a rapid leads there
    and a tool change or a stop is next: a park point. It is stated on purpose, and where it is out of reach the error of
    travel names it."""
    behind = row + 1
    if toolpath.kind[row] == Kind.RAPID and behind < len(toolpath) and (
            toolpath.tool[behind] != toolpath.tool[row]
            or any(event.index == behind and event.word in _PARKED_FOR for event in toolpath.events)):
        return True
    cuts = (toolpath.role != Role.START) & ((toolpath.kind != Kind.RAPID) | (toolpath.role == Role.HOLE))
    return not cuts[row:].any() or not cuts[: row + 1].any()


def _turned_axis(toolpath: Toolpath, rows: Ints) -> Diagnostic | None:
    axis = toolpath.axis[rows]
    step = angle_between(axis[1:], axis[:-1])
    apart = (step[1:] > _TURNED) & (step[:-1] > _TURNED) & (angle_between(axis[2:], axis[:-2]) < _STEADY)
    at = np.flatnonzero(apart) + 1
    if len(at) != 1:
        return None
    turned = float(min(step[at[0]], step[at[0] - 1])) / DEG
    return _odd(toolpath, rows[at[0]], f"the tool axis stands {turned:.1f} degrees away from those of the points before and "
                "behind it")


def _odd(toolpath: Toolpath, row: np.int64, says: str) -> Diagnostic:
    return error("path.odd_record", says, file=toolpath.file, lines=[int(toolpath.line[row])], hint=_HINT)
