"""Creo's indexed parts: where points stand while ROTATE or TRANS are in force, and what a file may not contradict.

The evidence is in docs/reference/cl-records.md, "Creo indexing".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import rotation

if TYPE_CHECKING:
    from toolpaths.cl.build import Map, ToolpathBuilder
from toolpaths.cl.text.subprograms import Called, called

SAME_AXIS = 2e-3
"""rad: angles of three decimals that add up over a turn, and rows of CSYS remarks"""
SAME_PLACE = 0.02
"""mm between a TRANS and the translation of a CSYS remark that say the same"""
_NO_PLACE = 1e-6
_STEP = 1e-12
TURN_HINT = "state the angle with INCR, as one that adds to the table's, or a CSYS remark behind it"
TRANS_HINT = ("have Creo write the sequence with MULTAX/ON (six numbers) and without subroutines, or correct ROTATE, "
              "TRANS or the CSYS remark")


def in_force(b: ToolpathBuilder) -> bool:
    """True where points stand about the rotation axis: the table is turned, or a subroutine runs that is
    called under a turned table elsewhere."""
    return b.dialect.table_frames and (any(b.table) or b.about_axis)


def indexed_subprograms(b: ToolpathBuilder) -> frozenset[Called]:
    """Numbers and names of the subroutines that some CALSUB calls after a ROTATE, found once."""
    if b.indexed_subs is None:
        turned, found = False, set()
        for s in b.program.statements:
            if s.major == "ROTATE":
                turned = True
            elif s.major == "CALSUB" and turned and s.words:
                found.add(called(s))
        b.indexed_subs = frozenset(found) if b.dialect.table_frames else frozenset()
    return b.indexed_subs


def turn_table(b: ToolpathBuilder, axis: int, step: float) -> None:
    """ROTATE by `step` rad about a machine axis: the frame of the points turns by less that angle in the part.

    A CSYS remark right before ROTATE may hold the new position already: then its z is where ROTATE takes the tool axis.
    """
    if abs(step) <= _STEP:
        return
    old, b.table_turn = b.table_turn, b.table_turn @ rotation(np.eye(3)[axis], np.array([-step]))[0]
    z = b.turned @ b.here[0][:, 2]
    if _apart(z, old[:, 2]) > SAME_AXIS >= _apart(z, b.table_turn[:, 2]):
        b.table_here, b.turn_doubt = b.table_turn, ""
    b.turned = b.table_turn @ b.table_here.T
    b.turns_at.append(b.row)


def map_of(b: ToolpathBuilder) -> tuple[Map, str]:
    """(rotation and origin of the points from here on, "" or what the file contradicts)."""
    matrix, place = b.turned @ b.here[0], b.turned @ b.here[1]
    shift = matrix @ b.shift
    fault = _axis_fault(b, matrix)
    if not b.shift.any():
        if in_force(b) and place.any():
            b.dropped_at.set(b.row, True)
            place = np.zeros(3)
        return (matrix, place), fault
    if _apart(place, shift) <= SAME_PLACE or float(np.abs(place).max()) <= _NO_PLACE:
        return (matrix, shift), fault
    if _apart(place, b.shift) <= SAME_PLACE:
        return (matrix, b.shift.copy()), fault
    return (matrix, shift), fault or (
        f"TRANS shifts the points by ({_text(b.shift)}) mm, the CSYS remark by ({_text(place)}): unknown whether they "
        "are one translation")


def _axis_fault(b: ToolpathBuilder, matrix: Floats) -> str:
    """ROTATE turns the tool axis to where z of the CSYS remark must stand."""
    if any(b.table) and _apart(matrix[:, 2], b.table_turn[:, 2]) > SAME_AXIS:
        return (f"by ROTATE the tool axis is ({_text(b.table_turn[:, 2])}) in the part, by the CSYS remark it is "
                f"({_text(matrix[:, 2])})")
    return b.turn_doubt


def cancels(b: ToolpathBuilder, shift: Floats) -> bool:
    """True where TRANS/-h after TRANS/+h ends that shift, as Creo writes it around a CALSUB; under a turned
    table alone, and not where the next CALSUB runs at -h."""
    if not in_force(b) or not b.shift.any() or _apart(shift, -b.shift) > _STEP * float(np.abs(shift).max()):
        return False
    for s in b.program.statements[b.index + 1:b.stop]:
        if s.major == "TRANS":
            return True
        if s.major == "CALSUB":
            return bool(b.here[1].any())
    return True


def note_call(b: ToolpathBuilder, begun: int) -> None:
    """A subroutine runs from here on; the caller's own points since the last one begin at row `begun`."""
    if b.dialect.table_frames and b.row > begun and (b.turns_at or b.shift.any()):
        b.entries.append((begun, b.row))


def approaches(b: ToolpathBuilder, tip: Floats, rapid: Bools, index: Ints) -> tuple[Ints, Bools]:
    """(`index` (N,) of maps with that of a subroutine for the points that lead to it, those points (N,)): the
    last one before CALSUB, and rapids before that straight above it; not one that stands over the
    subroutine's start as is."""
    index, found = index.copy(), np.zeros(len(index), dtype=np.bool_)
    for begun, first in b.entries:
        row = first - 1
        if first >= len(index) or not (rapid[row] or b.turns_at):
            continue
        old, new = int(index[row]), int(index[first])
        if old != new and _over(b, tip, first, old, new) + SAME_PLACE < _over(b, tip, first, new, new):
            continue
        index[row], found[row] = new, True
        while row > begun and rapid[row - 1] and index[row - 1] == old and (tip[row - 1, :2] == tip[row, :2]).all():
            row -= 1
            index[row], found[row] = new, True
    return index, found


def _over(b: ToolpathBuilder, tip: Floats, first: int, map_index: int, there: int) -> float:
    """mm between the point before row `first`, in a frame, and the line along the tool axis through that row, in `there`."""
    away = _placed(b, map_index, tip[first - 1] * b.scale) - _placed(b, there, tip[first] * b.scale)
    found = b.maps[there]
    z = np.array([0.0, 0.0, 1.0]) if found is None else found[0][:, 2]
    return float(np.linalg.norm(away - (away @ z) * z))


def _placed(b: ToolpathBuilder, map_index: int, point: Floats) -> Floats:
    found = b.maps[map_index]
    return point if found is None else found[0] @ point + found[1]


def local_rows(b: ToolpathBuilder, given: Bools, inside: Bools, approach: Bools, axis: Floats,
               index: Ints) -> Bools:
    """True (N,) for points of six numbers that are in the local frame: those of subroutines, and those under
    a turned table whose tool axis is the local z and not that of the frame in the part."""
    local: Bools = inside.copy()
    if not b.turns_at:
        return local
    up = np.array([0.0, 0.0, 1.0])
    rows = np.flatnonzero(given & ~inside)
    for i in np.unique(index[rows]).tolist():
        found = b.maps[i]
        if found is not None:
            here = rows[index[rows] == i]
            turned = _apart(found[0][:, 2], up) > SAME_AXIS
            local[here] = (np.linalg.norm(axis[here] - up, axis=1) <= SAME_AXIS) & (turned | approach[here])
    return local


def check_frames(b: ToolpathBuilder, index: Ints, local: Bools, lines: Ints) -> None:
    """Errors for points in frames that the file contradicts; a note where a translation was not added."""
    n = len(index)
    for start, end, fault in _spans(b.frame_faults.starts, b.frame_faults.values, n):
        here = lines[start:end][local[start:end]]
        if fault and len(here):
            hint = TURN_HINT if "unknown which" in str(fault) else TRANS_HINT
            b.log.error("cl.index-frame", str(fault), int(here[0]), hint, key=str(fault)[:20])
    dropped = [start for start, end, value in _spans(b.dropped_at.starts, b.dropped_at.values, n)
               if value and local[start:end].any()]
    if dropped:
        b.log.info("cl.index-translation", "under a turned table points stand about the rotation axis: the translation of "
                   "the CSYS remark is not added", int(lines[dropped[0]]))


def check_axes(b: ToolpathBuilder, inside: Bools, given: Bools, axis: Floats, index: Ints,
               lines: Ints) -> None:
    """Points of six numbers of a subroutine are local: an axis that is radial as it stands would be turned twice."""
    if not b.turns_at:
        return
    rows = np.flatnonzero(inside & given)
    for i in np.unique(index[rows]).tolist():
        found = b.maps[i]
        here = rows[index[rows] == i]
        if found is None or not len(here):
            continue
        z = found[0][:, 2]
        if _apart(z, np.array([0.0, 0.0, 1.0])) <= SAME_AXIS:
            continue
        bad = here[np.linalg.norm(axis[here] - z, axis=1) <= SAME_AXIS]
        if len(bad):
            b.log.error("cl.index-axis", f"the tool axis ({_text(z)}) in a subroutine is that of the part already: by the "
                        "frame of its CALSUB it would be turned twice", int(lines[bad[0]]), TRANS_HINT)


def check_cuts(b: ToolpathBuilder, cutting: Bools, index: Ints, lines: Ints) -> None:
    """No cut begins in one position of the table and ends in another."""
    if not b.turns_at:
        return
    for row in np.flatnonzero(cutting[1:] & (index[1:] != index[:-1])) + 1:
        now, before = (np.eye(3) if m is None else m[0] for m in (b.maps[index[row]], b.maps[index[row - 1]]))
        if np.abs(now - before).max() > SAME_AXIS:
            b.log.error("cl.index-cut", "a cutting move begins before ROTATE and ends after it", int(lines[row]),
                        "put RAPID and an approach point after ROTATE")


def _spans(starts: list[int], values: list[object], n: int) -> list[tuple[int, int, object]]:
    ends = [*starts[1:], n]
    return [(s, min(e, n), v) for s, e, v in zip(starts, ends, values, strict=True) if s < min(e, n)]


def _apart(a: Floats, b: Floats) -> float:
    return float(np.linalg.norm(a - b))


def _text(v: Floats) -> str:
    return ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in v)
