"""Travel of every axis, at and between points, in machine coordinates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.joint_path import TRAVEL_SLACK
from postproc.moves import Moves
from postproc.path import ARC, Path
from postproc.word_arcs import PLANE_COLUMNS
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG


def arc_extremes(path: Path, control: Control) -> tuple[Floats, Floats]:
    """(lowest, highest) joints (K, J) inside each block: its ends, and on arcs the quadrant points between."""
    before = np.concatenate([control.machine.home[None, :], path.q[:-1]])
    low, high = np.minimum(before, path.q), np.maximum(before, path.q)
    rows = np.flatnonzero(path.code == ARC)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = rows[path.plane[rows] == plane]
        if len(k):
            _widen(path, control, before, k, int(control.xyz[i]), int(control.xyz[j]), (i, j), low, high)
    return low, high


def _widen(path: Path, control: Control, before: Floats, k: Ints, a: int, b: int, plane: tuple[int, int],
           low: Floats, high: Floats) -> None:
    """Quadrant points of arcs in the plane of joints a, b (slides run as the words do, so centres add)."""
    offset = path.center[k][:, plane]
    radius = np.hypot(offset[:, 0], offset[:, 1])
    center = before[k][:, [a, b]] + offset
    first = np.arctan2(-offset[:, 1], -offset[:, 0])
    last = np.arctan2(path.q[k, b] - center[:, 1], path.q[k, a] - center[:, 0])
    sense = np.where(path.ccw[k], 1.0, -1.0)
    sweep = np.mod(sense * (last - first), 2.0 * np.pi)
    sweep = np.where(sweep < 1e-9, 2.0 * np.pi, sweep)
    for quadrant, (axis, sign) in enumerate(((a, 1.0), (b, 1.0), (a, -1.0), (b, -1.0))):
        passed = np.mod(sense * (quadrant * np.pi / 2.0 - first), 2.0 * np.pi) <= sweep
        value = center[:, 0 if axis == a else 1] + sign * radius
        rows = k[passed]
        low[rows, axis] = np.minimum(low[rows, axis], value[passed])
        high[rows, axis] = np.maximum(high[rows, axis], value[passed])


def check_travel(path: Path, moves: Moves, control: Control, kinematics: Callable[[int], Kinematics],
                 file: str = "") -> tuple[list[Diagnostic], dict[str, tuple[float, float]]]:
    """(excesses as errors, extents of each axis in mm or degrees)."""
    low, high = extremes(path, moves, control, kinematics)
    machine, limits = control.machine, control.machine.limits
    diagnostics, extents = [], {}
    for j, name in enumerate(machine.axis_names):
        unit = 1.0 / DEG if machine.rotary[j] else 1.0
        extents[name] = (float(low[:, j].min() * unit), float(high[:, j].max() * unit))
        over = np.maximum(limits.lower[j] - low[:, j], high[:, j] - limits.upper[j])
        bad = np.flatnonzero(over > TRAVEL_SLACK)
        if len(bad):
            diagnostics.append(_excess(path, moves, control, j, low, high, over, bad, file))
    return diagnostics, extents


def extremes(path: Path, moves: Moves, control: Control,
             kinematics: Callable[[int], Kinematics]) -> tuple[Floats, Floats]:
    """(lowest, highest) joints (K, J) of each block.

    Straight joints are extreme at their ends and at the quadrants of arcs. Where the control runs the kinematics
    joints bend between the ends: there the blocks are sampled.
    """
    if not control.tip_law:
        return arc_extremes(path, control)
    before = np.concatenate([control.machine.home[None, :], path.q[:-1]])
    low, high = np.minimum(before, path.q), np.maximum(before, path.q)
    tool = moves.tool[path.move]
    for index in np.unique(tool):
        kin, k = kinematics(int(index)), np.flatnonzero(tool == index)
        for t in np.linspace(0.1, 0.9, 9):
            _, _, q = control.between(before[k], path.q[k], np.full(len(k), t), kin)
            low[k], high[k] = np.fmin(low[k], q), np.fmax(high[k], q)
    return low, high


def _excess(path: Path, moves: Moves, control: Control, j: int, low: Floats, high: Floats, over: Floats, bad: Ints,
            file: str) -> Diagnostic:
    machine = control.machine
    rotary = machine.rotary[j]
    unit, name = (1.0 / DEG, "degrees") if rotary else (1.0, "mm")
    worst = bad[over[bad].argmax()]
    value = high[worst, j] if high[worst, j] > machine.limits.upper[j] + TRAVEL_SLACK else low[worst, j]
    lower, upper = machine.limits.lower[j] * unit, machine.limits.upper[j] * unit
    lines = np.unique(moves.line[path.move[bad]])
    first = int(moves.line[path.move[worst]])
    linking = " in a linking move" if np.isnan(path.u[worst]) else ""
    hint = "move the part in the set-up (part.origin)"
    if rotary:
        hint = "turn the part in the set-up, or split the operation"
    elif linking:
        hint += ", lower clearance.margin, or use a shorter tool (gauge_length)"
    return error("travel.exceeded", f"axis {machine.axis_names[j]} goes to {value * unit:.4f} {name}{linking}, allowed "
                 f"{lower:.4f} to {upper:.4f} {name}", file=file,
                 lines=[first, *(n for n in lines[:6].tolist() if n != first)], count=len(lines), hint=hint)
