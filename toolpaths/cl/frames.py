"""Systems of the file and how points in them reach the part frame: MSYS, CSYS, CAMERA, CATIA axis rows, TRANS."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.build import Builder, Map
from toolpaths.cl.statements import Statement, words_of
from toolpaths.rotations import rotation
from toolpaths.toolpath import Frame
from toolpaths.units import DEG

_ORTHOGONAL = 2e-3


def set_system(b: Builder, name: str, matrix: Floats, origin: Floats) -> None:
    """Points from here on are in that system; the tool axis is its z until a point says otherwise."""
    frame = Frame("", tuple(origin.tolist()), tuple(tuple(row) for row in matrix.tolist()))
    index = b.frame_index.setdefault((frame.origin, frame.rotation), len(b.frames))
    if index == len(b.frames):
        b.frames.append(Frame(f"{name} {index + 1}", frame.origin, frame.rotation))
    b.system.set(b.row, index)
    b.here = (matrix, origin)
    b.turned = np.eye(3)
    _refresh(b)
    b.axis_marks.append((b.row, (0.0, 0.0, 1.0)))


def _refresh(b: Builder) -> None:
    """The map of points from the system and the shift (TRANS) that hold now."""
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


def system_of_rows(b: Builder, numbers: list[float], word: str) -> Map | None:
    """Rotation and origin (mm) of three rows of four; None and a diagnostic where they are no system."""
    if len(numbers) != 12:
        b.log.error("cl.frame", f"{word} has {len(numbers)} numbers, it takes 12", b.line)
        return None
    rows = np.array(numbers).reshape(3, 4)
    matrix = rotation_of(rows[:, 0], rows[:, 1])
    if matrix is None or float(matrix[:, 2] @ rows[:, 2]) < 1.0 - _ORTHOGONAL:
        b.log.error("cl.frame", f"the axes of {word} are not three right-handed unit vectors at right angles", b.line)
        return None
    return matrix, rows[:, 3] * b.scale


def msys(b: Builder, s: Statement) -> None:
    """MSYS/origin, X axis, Y axis (nine numbers)."""
    numbers = s.numbers
    if len(numbers) != 9:
        b.log.error("cl.frame", f"MSYS has {len(numbers)} numbers, it takes origin, X and Y axis (9)", b.line)
        return
    n = np.array(numbers)
    matrix = rotation_of(n[3:6], n[6:9])
    if matrix is None:
        b.log.error("cl.frame", "the axes of MSYS are not unit vectors at right angles", b.line)
        return
    set_system(b, "MSYS", matrix, n[:3] * b.scale)


def csys(b: Builder, s: Statement) -> None:
    """CSYS or CAMERA with three rows of four: rotation, and the origin in the fourth place."""
    found = system_of_rows(b, s.numbers, s.major)
    if found is not None:
        set_system(b, "CSYS", *found)


def trans(b: Builder, s: Statement) -> None:
    """TRANS/x, y, z: points from here on are shifted by it; the next TRANS replaces it."""
    if len(s.numbers) != 3 or len(s.words) != 3:
        b.log.error("cl.frame", f"TRANS/{s.body}: only three numbers are understood", b.line)
        return
    b.shift = np.array(s.numbers) * b.scale
    _refresh(b)


def origin(b: Builder, s: Statement) -> None:
    """CATIA: ORIGIN/origin, X axis, Z axis. Three numbers place the part on a machine and do not move its points."""
    numbers = s.numbers
    if len(numbers) == 9:
        n = np.array(numbers)
        matrix = rotation_of(n[3:6], np.cross(n[6:9], n[3:6]))
        if matrix is None:
            b.log.error("cl.frame", "the axes of ORIGIN are not unit vectors at right angles", b.line)
        else:
            set_system(b, "ORIGIN", matrix, n[:3] * b.scale)
    elif len(numbers) == 3:
        b.log.warning("cl.origin", "ORIGIN places the part on a machine; give that in the set-up file", b.line)
    else:
        b.log.error("cl.frame", f"ORIGIN has {len(numbers)} numbers, it takes 3 or 9", b.line)


def comment(b: Builder, s: Statement) -> None:
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


_AXES = {"AAXIS": 0, "BAXIS": 1, "CAXIS": 2, "A": 0, "B": 1, "C": 2, "XAXIS": 0, "YAXIS": 1, "ZAXIS": 2}
_TURNED = frozenset({"creo", "solidworks-clt"})
_NO_AXIS_WORDS = frozenset({"CLW", "CCLW", "INCR", "ATANGL", "TABLE", "HEAD", "NEXT", "ROTREF", "AXIS"})


def rotate(b: Builder, s: Statement) -> None:
    """ROTATE, ROTABL, ROTHED: an event. In Creo and `.clt`, points after it are in the turned frame, unless a system
    (CSYS) follows, which then says where they are: turning the table by a makes the frame turn by -a in the part."""
    b.event(s.major, tuple(w for w in s.words if w != ""))
    axis = next((_AXES[w] for w in s.words if isinstance(w, str) and w in _AXES), None)
    angle = s.after("ATANGL", "INCR")
    if angle is None:
        angle = next((w for w in s.words if isinstance(w, float)), None)
    if angle is None or b.dialect.name not in _TURNED:
        if angle is None or angle:
            b.log.warning("cl.table", f"{s.major}/{s.body}: the points after it are taken as if it were not there",
                          b.line, "points must be in the part's frame")
        return
    if axis is None:
        b.log.error("cl.table", f"{s.major}/{s.body}: no axis named", b.line, "AAXIS, BAXIS or CAXIS")
        return
    turn = angle if b.dialect.rotabl_radians and s.major != "ROTATE" else angle * DEG
    _turn(b, axis, -turn if s.has("CLW") else turn, not s.has("ATANGL"))


def _turn(b: Builder, axis: int, angle: float, incremental: bool) -> None:
    angles = b.table
    step = angle if incremental else angle - angles[axis]
    angles[axis] += step
    if step != 0.0:
        b.turned = b.turned @ rotation(np.eye(3)[axis], np.array([-step]))[0]
        _refresh(b)


HANDLERS = {"MSYS": msys, "CSYS": csys, "$$->CSYS": csys, "CAMERA": csys, "TRANS": trans, "ORIGIN": origin,
            "ROTATE": rotate, "ROTABL": rotate, "ROTHED": rotate}
