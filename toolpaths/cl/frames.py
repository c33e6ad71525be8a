"""Systems of the file and how points in them reach the part frame: MSYS, CSYS, MCS, CATIA axis rows, TRANS, ROTABL."""

from __future__ import annotations

import math

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl import indexing
from toolpaths.cl.build import Map, ToolpathBuilder
from toolpaths.cl.text.statements import Statement, words_of
from toolpaths.rotations import rotation
from toolpaths.toolpath import Frame
from toolpaths.units import DEG

_ORTHOGONAL = 2e-3
_WORK_OFFSET = "work offset"


def set_system(b: ToolpathBuilder, name: str, matrix: Floats, origin: Floats) -> None:
    """Points from here on are in that system; the tool axis is its z until a point says otherwise."""
    b.here = (matrix, origin)
    b.turned = np.eye(3)
    b.table_here = b.table_turn
    b.unknown_turn = ""
    if not indexing.in_force(b):
        _name_system(b, name, matrix, origin)
    refresh(b)
    b.axis_marks.append((b.row, (0.0, 0.0, 1.0)))


def _name_system(b: ToolpathBuilder, name: str, matrix: Floats, origin: Floats) -> None:
    """Operations from here on are in that system; a position of an indexed table is none."""
    frame = Frame("", tuple(origin.tolist()), tuple(tuple(row) for row in matrix.tolist()))
    index = b.frame_index.setdefault((frame.origin, frame.rotation), len(b.frames))
    if index == len(b.frames):
        b.frames.append(Frame(f"{name} {index + 1}", frame.origin, frame.rotation))
    b.system.set(b.row, index)


def refresh(b: ToolpathBuilder) -> None:
    """The map of points from the system, the table and the shift (TRANS) that hold now."""
    if b.dialect.table_frames:
        b.dropped_at.set(b.row, False)
        found, fault = indexing.map_of(b)
        b.frame_faults.set(b.row, fault)
        b.use_map(found)
        return
    matrix, origin = b.here
    if b.shift.any():
        origin = matrix @ b.shift + origin
    b.use_map((b.turned @ matrix, b.turned @ origin))


def rotation_of(x: Floats, y: Floats) -> Floats | None:
    """Matrix with columns x, y, x cross y made orthonormal; None where they are not so within 2e-3."""
    nx, ny = float(np.linalg.norm(x)), float(np.linalg.norm(y))
    if abs(nx - 1.0) > _ORTHOGONAL or abs(ny - 1.0) > _ORTHOGONAL or abs(float(x @ y)) > _ORTHOGONAL:
        return None
    x = x / nx
    z = np.cross(x, y)
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]) + 0.0


def system_of_rows(b: ToolpathBuilder, numbers: list[float], word: str) -> Map | None:
    """Rotation and origin (mm) of three rows of four; None and a diagnostic where they are no system."""
    if len(numbers) != 12:
        b.log.error("cl.frame", f"{word} has {len(numbers)} numbers, it takes 12", b.line,
                    "write three rows of X, Y, Z and origin: 12 numbers")
        return None
    rows = np.array(numbers).reshape(3, 4)
    matrix = rotation_of(rows[:, 0], rows[:, 1])
    if matrix is None or float(matrix[:, 2] @ rows[:, 2]) < 1.0 - _ORTHOGONAL:
        b.log.error("cl.frame", f"the axes of {word} are not three right-handed unit vectors at right angles", b.line,
                    "correct the axes: X, Y, Z of length 1, Z = X x Y")
        return None
    return matrix, rows[:, 3] * b.scale


def msys(b: ToolpathBuilder, s: Statement) -> None:
    """MSYS/origin, X axis, Y axis (nine numbers)."""
    numbers = s.numbers
    if len(numbers) != 9:
        b.log.error("cl.frame", f"MSYS has {len(numbers)} numbers, it takes origin, X and Y axis (9)", b.line,
                    "write MSYS/x,y,z, X axis, Y axis: 9 numbers")
        return
    n = np.array(numbers)
    matrix = rotation_of(n[3:6], n[6:9])
    if matrix is None:
        b.log.error("cl.frame", "the axes of MSYS are not unit vectors at right angles", b.line,
                    "correct the axes: X and Y of length 1, at right angles")
        return
    set_system(b, "MSYS", matrix, n[:3] * b.scale)


def csys(b: ToolpathBuilder, s: Statement) -> None:
    """CSYS or CAMERA with three rows of four: rotation, and the origin in the fourth place."""
    found = system_of_rows(b, s.numbers, s.major)
    if found is not None:
        set_system(b, "CSYS", *found)


def mcs(b: ToolpathBuilder, s: Statement) -> None:
    """MCS/X axis, Y axis, Z axis, origin (12 numbers): the work plane of Autodesk's posts for CAMplete and MANUSnc;
    SURFCAM's view."""
    if len(s.numbers) != 12:
        b.log.error("cl.frame", f"MCS has {len(s.numbers)} numbers, it takes X, Y and Z axis and origin (12)", b.line,
                    "write X axis, Y axis, Z axis, origin: 12 numbers")
        return
    axes = np.array(s.numbers).reshape(4, 3)
    matrix = rotation_of(axes[0], axes[1])
    if matrix is None or float(matrix[:, 2] @ axes[2]) < 1.0 - _ORTHOGONAL:
        b.log.error("cl.frame", "the axes of MCS are not three right-handed unit vectors at right angles", b.line,
                    "correct the axes: X, Y, Z of length 1, Z = X x Y")
        return
    if b.dialect.views_absolute and (axes[3].any() or not np.allclose(matrix, np.eye(3), atol=_ORTHOGONAL)):
        b.log.error("cl.frame", f"MCS/{s.body[:60]}: a view of SURFCAM that is not upright in the absolute origin, and no "
                    "source says which system its points count in", b.line, "post all paths of the file in one view, "
                    "with the switch for 5 axes")
        return
    set_system(b, "MCS", matrix, axes[3] * b.scale)


def mcsys(b: ToolpathBuilder, s: Statement) -> None:
    """MCSYS/NUM, offset, POINT, origin, VECTOR, X axis, VECTOR, Y axis: the work plane of Autodesk's post for MfgSuite."""
    n = [w for w in s.words if isinstance(w, float)]
    shape = tuple(w for w in s.words if isinstance(w, str))
    if shape != ("NUM", "POINT", "VECTOR", "VECTOR") or len(n) != 10:
        b.log.error("cl.frame", f"MCSYS/{s.body[:60]}: it takes NUM, a number, POINT, origin, VECTOR, X axis, VECTOR, "
                    "Y axis", b.line, "write MCSYS/NUM,1,POINT,x,y,z,VECTOR,i,j,k,VECTOR,i,j,k")
        return
    work_offset(b, n[0])
    matrix = rotation_of(np.array(n[4:7]), np.array(n[7:10]))
    if matrix is None:
        b.log.error("cl.frame", "the axes of MCSYS are not unit vectors at right angles", b.line,
                    "correct the axes: X and Y of length 1, at right angles")
    else:
        set_system(b, "MCSYS", matrix, np.array(n[1:4]) * b.scale)


def zero(b: ToolpathBuilder, s: Statement) -> None:
    """ZERO/n: the work offset of the control that the points after it are in."""
    if len(s.numbers) != 1:
        b.log.error("cl.frame", f"ZERO/{s.body}: it takes the number of a work offset", b.line,
                    "write for example ZERO/1")
    else:
        work_offset(b, s.numbers[0])


def work_offset(b: ToolpathBuilder, number: float) -> None:
    """The file says nothing of where work offsets lie, so all its points must be in one."""
    first = b.memory.setdefault(_WORK_OFFSET, number)
    if first != number:
        b.log.error("cl.work-offset", f"points in work offset {number:g} after points in {first:g}: nothing in the file "
                    "says how one lies to the other", b.line, "write one file for each work offset", key=_WORK_OFFSET)


def trans(b: ToolpathBuilder, s: Statement) -> None:
    """TRANS/x, y, z: points from here on are shifted by it; the next TRANS replaces it."""
    if len(s.numbers) != 3 or len(s.words) != 3:
        b.log.error("cl.frame", f"TRANS/{s.body}: only three numbers are understood", b.line,
                    "write TRANS/x,y,z")
        return
    shift = np.array(s.numbers) * b.scale
    b.shift = np.zeros(3) if indexing.cancels(b, shift) else shift
    refresh(b)


def origin(b: ToolpathBuilder, s: Statement) -> None:
    """CATIA: ORIGIN/origin, X axis, Z axis. Three numbers place the part on a machine and do not move its points."""
    numbers = s.numbers
    if len(numbers) == 9:
        n = np.array(numbers)
        matrix = rotation_of(n[3:6], np.cross(n[6:9], n[3:6]))
        if matrix is None:
            b.log.error("cl.frame", "the axes of ORIGIN are not unit vectors at right angles", b.line,
                        "correct the axes: X and Y of length 1, at right angles")
        else:
            set_system(b, "ORIGIN", matrix, n[:3] * b.scale)
    elif len(numbers) == 3:
        b.log.warning("cl.origin", "ORIGIN places the part on a machine; give that in the set-up file", b.line)
    else:
        b.log.error("cl.frame", f"ORIGIN has {len(numbers)} numbers, it takes 3 or 9", b.line,
                    "write ORIGIN/x,y,z, or with X axis and Y axis behind it")


def comment(b: ToolpathBuilder, s: Statement) -> None:
    """CATIA's axis system: the comment *CATIA0, a name, and three rows of four numbers."""
    if s.body.startswith("*CATIA0"):
        b.axis_system = []
    elif b.axis_system is not None:
        row = [w for w in words_of(s.body) if isinstance(w, float)]
        if len(row) == 4:
            b.axis_system.append(row)
        elif b.axis_system:
            b.axis_system = None
        if b.axis_system is not None and len(b.axis_system) == 3:
            found = system_of_rows(b, [v for r in b.axis_system for v in r], "$$*CATIA0")
            b.axis_system = None
            if found is not None:
                set_system(b, "CATIA0", *found)


_RADIAN_ROUNDING = 5.1e-7
_SAME_FRAME = 1e-9
_NO_ANGLE = 1e-9
"""rad"""
_AXES = {"AAXIS": 0, "BAXIS": 1, "CAXIS": 2, "A": 0, "B": 1, "C": 2, "XAXIS": 0, "YAXIS": 1, "ZAXIS": 2}


def rotate(b: ToolpathBuilder, s: Statement) -> None:
    """ROTATE, ROTABL, ROTHED: an event. In Creo and `.clt`, points after it are in the turned frame, unless a
    system (CSYS) follows, which then says where they are. In Creo the table turns by the angle, so the frame
    turns by less that angle in the part; in `.clt` the frame itself does, as the TLAXIS of the same operation shows.
    INCR adds the angle, ABS and ATANGL (without it) state it; Creo's other readings are unknown until a system follows."""
    b.event(s.major, tuple(w for w in s.words if w != ""))
    axis = next((_AXES[w] for w in s.words if isinstance(w, str) and w in _AXES), None)
    angle = s.after("ATANGL", "INCR")
    if angle is None:
        angle = next((w for w in s.words if isinstance(w, float)), None)
    if angle is None or not (b.dialect.table_frames or b.dialect.frame_turns):
        if angle is None or angle:
            b.log.warning("cl.table", f"{s.major}/{s.body}: the points after it are taken as if it were not there",
                          b.line, "points must be in the part's frame")
        return
    if axis is None:
        b.log.error("cl.table", f"{s.major}/{s.body}: no axis named", b.line, "AAXIS, BAXIS or CAXIS")
        return
    turn = _radians(angle) if b.dialect.rotabl_radians and s.major != "ROTATE" else angle * DEG
    turn, added = -turn if s.has("CLW") else turn, s.has("INCR") or not s.has("ATANGL", "ABS")
    if b.dialect.table_frames and (unknown := _unknown_turn(s, b.table[axis], turn, added)):
        b.unknown_turn = unknown
    _turn(b, axis, turn, added)


def _unknown_turn(s: Statement, old: float, turn: float, added: bool) -> str:
    """What is not known of an angle that adds to the table's or states it, or of the direction CLW to a stated one; ""
    where all readings turn the table alike."""
    other = turn if added else -turn if s.has("CLW") else turn
    position = old + turn if added else turn
    if (added and s.has("INCR")) or abs(math.remainder(position - other, 2.0 * math.pi)) < _NO_ANGLE:
        return ""
    return f"{s.major}/{s.body} turns the table to {position / DEG:.6g} or to {other / DEG:.6g} degrees: unknown which"


def _radians(angle: float) -> float:
    """An angle written with six decimals of a radian: the thousandth of a degree that rounds to it, where there is one."""
    near = round(angle / DEG, 3) * DEG
    return near if abs(near - angle) <= _RADIAN_ROUNDING else angle


def _turn(b: ToolpathBuilder, axis: int, angle: float, incremental: bool) -> None:
    angles = b.table
    step = angle if incremental else angle - angles[axis]
    angles[axis] += step
    if abs(angles[axis]) < _NO_ANGLE:
        angles[axis] = 0.0
    if b.dialect.table_frames:
        indexing.turn_table(b, axis, step)
        refresh(b)
    elif step != 0.0:
        b.turned, b.turned_at = b.turned @ rotation(np.eye(3)[axis], np.array([step]))[0], b.row
        refresh(b)
        if b.dialect.tlaxis_upright:
            b.turned_lines[b.row] = b.line
    if b.dialect.frame_turns:
        use_world_axis(b)


def turn_back(b: ToolpathBuilder) -> None:
    """A frame in which points stand is still turned where the next operation begins: the ROTABL that turn it back are
    missing, which is an error, or made up for (`tlaxis_upright`)."""
    if b.row == b.turned_at or np.abs(b.turned - np.eye(3)).max() <= _SAME_FRAME:
        return
    if not b.dialect.tlaxis_upright:
        b.log.error("cl.rotabl-open", "the frame of the points is still turned where the next operation begins: the ROTABL "
                    "that turn it back are missing", b.line, "--axis-from tlaxis begins each TLAXIS with the frame upright; "
                    "else write the file again in the CAM system")
    b.table, b.turned = [0.0, 0.0, 0.0], np.eye(3)  # else what follows would be at fault too
    refresh(b)


def use_world_axis(b: ToolpathBuilder) -> None:
    """`.clt`: points of three numbers are along the z of the turned frame, along TLAXIS where the frame is not turned."""
    stated = b.world_axes[-1][1] if b.world_axes else (0.0, 0.0, 1.0)
    turned = bool(np.abs(b.turned - np.eye(3)).max() > _SAME_FRAME)
    b.axis_marks.append((b.row, (0.0, 0.0, 1.0) if turned else stated))


HANDLERS = {"MSYS": msys, "CSYS": csys, "$$->CSYS": csys, "CAMERA": csys, "MCS": mcs, "MCSYS": mcsys, "ZERO": zero,
            "TRANS": trans, "ORIGIN": origin,
            "ROTATE": rotate, "ROTABL": rotate, "ROTHED": rotate}
