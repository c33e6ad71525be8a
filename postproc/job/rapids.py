"""Rapids that the control would not keep on their line, split where that is safe: along the tool axis, then across.

Where each axis runs at its own rapid speed (dog-leg), a rapid of several axes leaves the straight line of the CL file. It
stays G0: the tool rises along its axis first, goes across above all that is cut (and the stock of the set-up), and comes
down along its axis last; across only the height is kept and compared, as from hole to hole. Fanuc B-63944EN, 4.1,
positioning (G00): nonlinear interpolation, unless parameter 1401#1 LRP = 1; Haas setting 335.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.modes import CONSTANT, OutputModes
from postproc.joints.joint_path import nearest_solution
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.path.blocks import rapid_codes
from postproc.path.links import MARGINS, SafeSpace
from postproc.reference.moves import Moves
from postproc.reference.split_rapids import CORNER, along, splittable, with_corners
from toolpaths.arrays import Bools, Floats, Ints, box_corners
from toolpaths.rotations import angle_between

STILL = 1e-6
"""mm below a safe plane that are none"""


def safe_rapids(moves: Moves, modes: OutputModes, kinematics: Callable[[int], Kinematics], operation: Ints, space: SafeSpace,
                stock: Floats | None, tolerances: tuple[float, float]) -> Moves:
    """The moves with their rapids split where the control would take them off their line and a safe path is known.

    Args:
        kinematics: the kinematics with the tool of that index of the Toolpath
        operation (M,): of each move
        stock (8, 3): corners of the stock in the table frame
        tolerances: mm and rad of the program
    """
    control = modes.control
    if control.rapids != "dog-leg" or control.law == "tcp":
        return moves
    if stock is not None:
        every = np.concatenate([space.corners, stock])
        space = replace(space, corners=box_corners(every.min(axis=0), every.max(axis=0)))
    parts = [_split(moves, rows, control, kinematics(tool), space, tolerances)
             for tool, rows in _by_tool(moves, _bendable(moves, modes, operation, tolerances[1]))]
    parts = [part for part in parts if len(part[0])]
    if not parts:
        return moves
    rows, level = (np.concatenate(some) for some in zip(*parts, strict=True))
    order = np.argsort(rows)
    rows, level = rows[order], level[order]
    rise, fall = (level - along(moves.tip[k], moves.axis[rows]) for k in (rows - 1, rows))
    return with_corners(moves, rows, level, rise > CORNER, fall > CORNER)


def _bendable(moves: Moves, modes: OutputModes, operation: Ints, axis_tolerance: float) -> Ints:
    """The splittable rapids in words under which axes run each for itself."""
    rows = splittable(moves)
    if not len(rows):
        return rows
    starts = np.flatnonzero(moves.link)
    run = np.maximum(np.searchsorted(starts, rows, side="right") - 1, 0)
    off = angle_between(moves.axis, moves.axis[starts[np.maximum(np.cumsum(moves.link) - 1, 0)]])
    still = np.maximum.reduceat(off, starts) <= CONSTANT * axis_tolerance
    last = np.append(starts[1:], len(moves)) - 1
    law = {(op, s): modes.law(op, s) for op, s in set(zip(operation[last].tolist(), still.tolist(), strict=True))}
    bends = np.array([law[op, s] != "tcp" for op, s in zip(operation[last].tolist(), still.tolist(), strict=True)])
    return np.asarray(rows[bends[run]])


def _by_tool(moves: Moves, rows: Ints) -> list[tuple[int, Ints]]:
    return [(int(moves.tool[rows[k[0]]]), rows[k]) for k in groups(moves.tool[rows])] if len(rows) else []


def _split(moves: Moves, rows: Ints, control: Control, kin: Kinematics, space: SafeSpace,
           tolerances: tuple[float, float]) -> tuple[Ints, Floats]:
    """(rows that leave their line and have a safe path, height (K,) along their axis at which it goes across)."""
    home = np.tile(control.machine.home, (len(rows), 1))
    axis, begin, end = moves.axis[rows], moves.tip[rows - 1], moves.tip[rows]
    q0 = nearest_solution(kin, begin, axis, _rested(kin, begin, axis, home))
    q1 = nearest_solution(kin, end, axis, _rested(kin, end, axis, q0))
    known = np.asarray(np.isfinite(np.concatenate([q0, q1], axis=1)).all(axis=1))
    leaves = np.asarray(known & kin.singular(np.where(known[:, None], q0, control.machine.home)))
    sure = np.flatnonzero(known & ~leaves)
    leaves[sure] = rapid_codes(control, kin, q0[sure], q1[sure], 0.1 * tolerances[0], 0.1 * tolerances[1]) != 0
    k = np.flatnonzero(leaves)
    level = _levels(kin, control.machine, space, (begin[k], end[k], axis[k], q0[k]))
    return rows[k[np.isfinite(level)]], level[np.isfinite(level)]


def _rested(kin: Kinematics, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """Joints (K, J) with what a redundant machine leaves open as its inverse takes it, for no plan is known; else `near`."""
    return kin.inverse(tip, axis, near=near)[0] if kin.open_parameters else near


def _levels(kin: Kinematics, machine: Machine, space: SafeSpace, rapids: tuple[Floats, Floats, Floats, Floats]) -> Floats:
    """(K,) height along the axis at which rapids (begin, end, axis (K, 3), joints (K, J)) may go across: their own higher
    end where that is above all that is cut, else the safe plane, as far above as travel allows; NaN where it allows none."""
    begin, end, axis, q = rapids
    low, high = (along(p, axis) for p in (begin, end))
    top, result = np.maximum(low, high), np.full(len(axis), np.nan)
    planes = [_plane(space, axis, share) for share in MARGINS]
    own = top >= planes[-1] - STILL
    result[own] = top[own]
    for plane in planes:
        k = np.flatnonzero(np.isnan(result))
        if not len(k):
            break
        ends = [p[k] + (plane[k] - h[k])[:, None] * axis[k] for p, h in ((begin, low), (end, high))]
        inside = np.all([_inside(kin.inverse(p, axis[k], near=q[k]), machine) for p in ends], axis=0).any(axis=0)
        result[k[inside]] = plane[k[inside]]
    return result


def _plane(space: SafeSpace, axis: Floats, share: float) -> Floats:
    """(K,) height of the safe plane along axes (K, 3), with a share of its margin; never below what is cut."""
    top = (axis @ space.corners.T).max(axis=1)
    if space.distance is not None:
        return np.asarray(np.maximum(axis @ space.centre + space.distance, top))
    return np.asarray(top + share * space.margin)


def _inside(q: Floats, machine: Machine) -> Bools:
    """(B, K) True where joints (B, K, J) are inside travel, rotary ones by whole turns; not where they are none."""
    limits, result = machine.limits, np.zeros(q.shape, dtype=bool)
    for turn in (-2.0 * np.pi, 0.0, 2.0 * np.pi):
        turned = q + turn * np.array(machine.rotary)
        result |= (turned >= limits.lower - TRAVEL_SLACK) & (turned <= limits.upper + TRAVEL_SLACK)
    return np.asarray(result.all(axis=-1))
