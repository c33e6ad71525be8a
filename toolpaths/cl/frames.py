"""Systems of the file and how points in them reach the part frame: MSYS, CSYS, CAMERA, CATIA axis rows, TRANS."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.build import Builder, Map
from toolpaths.cl.statements import Statement
from toolpaths.toolpath import Frame

_ORTHOGONAL = 2e-3
_SHIFT = "trans"
_SYSTEM = "system"


def set_system(b: Builder, name: str, rotation: Floats, origin: Floats) -> None:
    """Points from here on are in that system; the tool axis is its z until a point says otherwise."""
    frame = Frame("", tuple(origin.tolist()), tuple(tuple(row) for row in rotation.tolist()))
    for i, known in enumerate(b.frames):
        if (known.origin, known.rotation) == (frame.origin, frame.rotation):
            index = i
            break
    else:
        index = len(b.frames)
        b.frames.append(Frame(f"{name} {index + 1}", frame.origin, frame.rotation))
    b.system.set(b.row, index)
    b.memory[_SYSTEM] = (rotation, origin)
    _refresh(b)
    b.axis_marks.append((b.row, (0.0, 0.0, 1.0)))


def _refresh(b: Builder) -> None:
    """The map of points from the system and the shift (TRANS) that hold now."""
    system, shift = b.memory.get(_SYSTEM), b.memory.get(_SHIFT)
    if system is None and shift is None:
        b.use_map(None)
        return
    rotation, origin = system if isinstance(system, tuple) else (np.eye(3), np.zeros(3))
    b.use_map((rotation, rotation @ shift + origin if isinstance(shift, np.ndarray) else origin))


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
    rotation = rotation_of(rows[:, 0], rows[:, 1])
    if rotation is None or float(rotation[:, 2] @ rows[:, 2]) < 1.0 - _ORTHOGONAL:
        b.log.error("cl.frame", f"the axes of {word} are not three right-handed unit vectors at right angles", b.line)
        return None
    return rotation, rows[:, 3] * b.scale


def msys(b: Builder, s: Statement) -> None:
    """MSYS/origin, X axis, Y axis (nine numbers)."""
    numbers = s.numbers
    if len(numbers) != 9:
        b.log.error("cl.frame", f"MSYS has {len(numbers)} numbers, it takes origin, X and Y axis (9)", b.line)
        return
    n = np.array(numbers)
    rotation = rotation_of(n[3:6], n[6:9])
    if rotation is None:
        b.log.error("cl.frame", "the axes of MSYS are not unit vectors at right angles", b.line)
        return
    set_system(b, "MSYS", rotation, n[:3] * b.scale)


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
    shift = np.array(s.numbers) * b.scale
    b.memory[_SHIFT] = shift if shift.any() else None
    _refresh(b)


HANDLERS = {"MSYS": msys, "CSYS": csys, "$$->CSYS": csys, "CAMERA": csys, "TRANS": trans}
