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


def _arc_extremes(path: Path, law: Control, before: Floats, k: Ints, low: Floats, high: Floats) -> None:
    """Widen the joints `low`, `high` (K, J) of the arc blocks k to where they are extreme between the ends.

    Rotary joints stand still, so that the slides are a linear function of the words X, Y, Z. On the circle first cos a +
    across sin a of the plane each is extreme where its derivative vanishes; what runs along the axis of the arc is added
    whole.
    """
    kin, slides = law.machine.kinematics, law.slides
    q0 = before[k][:, slides]
    slides_of = np.linalg.inv(kin.jacobian(before[k])[:, :3][:, :, slides]) @ np.linalg.inv(law.tip_to_words(kin, before[k]))
    step = np.linalg.solve(slides_of, (path.q[k][:, slides] - q0)[..., None])[..., 0]
    for plane, (i, j) in PLANE_COLUMNS.items():
        rows = np.flatnonzero(path.plane[k] == plane)
        if not len(rows):
            continue
        first = -path.center[k[rows]][:, (i, j)]
        sense = np.where(path.ccw[k[rows]], 1.0, -1.0)
        across = sense[:, None] * np.stack([-first[:, 1], first[:, 0]], axis=1)
        last = first + step[rows][:, (i, j)]
        sweep = np.mod(sense * (np.arctan2(last[:, 1], last[:, 0]) - np.arctan2(first[:, 1], first[:, 0])), 2.0 * np.pi)
        sweep = np.where(sweep < 1e-9, 2.0 * np.pi, sweep)
        p, s = (np.einsum("kab,kb->ka", slides_of[rows][:, :, (i, j)], v) for v in (first, across))
        rise = slides_of[rows][:, :, 3 - i - j] * step[rows, 3 - i - j][:, None]
        for extra in (0.0, np.pi):
            angle = np.mod(np.arctan2(s, p) + extra, 2.0 * np.pi)
            value = q0[rows] + p * (np.cos(angle) - 1.0) + s * np.sin(angle)
            passed = (angle <= sweep[:, None]) & (np.hypot(p, s) > 0.0)
            at = np.ix_(k[rows], slides)
            low[at] = np.where(passed, np.minimum(low[at], value + np.minimum(rise, 0.0)), low[at])
            high[at] = np.where(passed, np.maximum(high[at], value + np.maximum(rise, 0.0)), high[at])


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

    Straight joints are extreme at their ends and in arcs. Where the control runs the kinematics joints bend between the
    ends: there the blocks are sampled.
    """
    before = np.concatenate([control.machine.home[None, :], path.q[:-1]])
    low, high = np.minimum(before, path.q), np.maximum(before, path.q)
    tool = moves.tool[path.move]
    for law, k in path.by_control():
        arcs = k[path.code[k] == ARC]
        if len(arcs) and law.machine.kinematics.slides_affine:
            _arc_extremes(path, law, before, arcs, low, high)
        for index in np.unique(tool[k]) if law.tip_law else ():
            kin, part = kinematics(int(index)), k[tool[k] == index]
            for t in np.linspace(0.1, 0.9, 9):
                _, _, q = law.between(before[part], path.q[part], np.full(len(part), t), kin)
                low[part], high[part] = np.fmin(low[part], q), np.fmax(high[part], q)
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
