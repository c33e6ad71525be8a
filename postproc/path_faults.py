"""What stands against a path, as diagnostics."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.moves import Moves
from toolpaths.arrays import Array, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind
from toolpaths.units import DEG


def merged(diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics of the same code and message as one, with the lines of all."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in diagnostics:
        groups.setdefault((d.severity, d.code, d.message, d.file, d.hint), []).append(d)
    result = []
    for group in groups.values():
        head = group[0]
        lines = tuple(n for d in group for n in d.lines)[:6]
        result.append(Diagnostic(head.severity, head.code, head.message, head.file, lines,
                                 sum(d.count for d in group), head.hint))
    return result


def moved_axes(moves: Moves, rows: Ints, moved: Floats, file: str) -> list[Diagnostic]:
    if not bool((moved > 1e-6).any()):
        return []
    where = rows[moved > 1e-6]
    return [info("axis.moved", "tool axis moved onto the directions that the machine can take, within the axis "
                 "tolerance", file=file, lines=moves.line[where][:6].tolist(), count=len(where))]


def unreachable(control: Control, kin: Kinematics, moves: Moves, rows: Ints, axis: Floats, q: Floats,
                 file: str) -> list[Diagnostic]:
    bad = np.flatnonzero(~np.isfinite(q).all(axis=1))
    if not len(bad):
        return []
    name = control.machine.name
    nearest = kin.nearest_axis(axis[bad])
    off = angle_between(nearest, axis[bad])
    worst = int(off.argmax())
    lines = moves.line[rows[bad]]
    if off[worst] > 1e-9:
        i, j, k = axis[bad][worst]
        hint = "turn the part in the set-up (part.x_axis, part.y_axis)" + (
            "" if any(kin.rotary) else f"; {name} has no rotary axis, so every operation needs its own set-up")
        return [error("reach.axis", f"{name} cannot take the tool axis ({i:.6f}, {j:.6f}, {k:.6f}): its nearest "
                      f"direction is {off[worst] / DEG:.4f} degrees away", file=file,
                      lines=[int(lines[worst]), *lines[:5].tolist()], count=len(bad), hint=hint)]
    x, y, z = moves.tip[rows[bad[0]]]
    return [error("reach.position", f"{name} cannot reach the tip position ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table "
                  "frame with that tool axis", file=file, lines=lines[:6].tolist(), count=len(bad),
                  hint="move the part in the set-up (part.origin)")]


def no_way(moves: Moves, row: int, file: str) -> Diagnostic:
    return error("link.blocked", "no linking move stays above the safe planes", file=file, lines=[int(moves.line[row])],
                 hint="give clearance.centre and a larger clearance.distance in the set-up")


def broken(moves: Moves, rows: Ints, file: str) -> list[Diagnostic]:
    if not len(rows):
        return []
    return [error("path.jump", "the rotary axes jump here: no points between keep the tool on its path", file=file,
                  lines=moves.line[rows][:6].tolist(), count=len(rows),
                  hint="retract before this point, or change the tool axis")]


def rapid_as_feed(code: Array, move: Ints, seconds: Floats, moves: Moves, file: str) -> list[Diagnostic]:
    """Rapids that are written as feed moves (code 1, no time of their own), as the control would leave their line."""
    rows = np.flatnonzero((code == 1) & (seconds == 0.0) & (moves.kind[move] == Kind.RAPID))
    if not len(rows):
        return []
    lines = np.unique(moves.line[move[rows]])
    return [info("feed.rapid_as_feed", "rapids that move several axes are written as feed moves at the speed of the slowest "
                 "axis: the control's rapids would leave the straight line", file=file, lines=lines[:6].tolist(),
                 count=len(lines))]
