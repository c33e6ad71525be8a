"""Travel of every axis, at and between points, in machine coordinates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.path.model import ARC, JointPath
from postproc.reference.moves import Moves
from postproc.setup.model import LOWER
from toolpaths.arrays import Floats, Ints, distinct
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

PART = 50_000
"""blocks that are looked at together"""
_ALONG = 0.5
"""of what a joint moves, which is along the tool where the tool's length counts in its travel"""


def _arc_extremes(path: JointPath, law: Control, k: Ints, at_start: Floats, low: Floats,
                  high: Floats) -> None:
    """Widen the joints `low`, `high` (K, J) of the arc blocks k (K,) to where they are extreme between the
    ends; they begin at joints `at_start` (K, J).

    Rotary joints stand still, so that the slides are a linear function of the words X, Y, Z. On the circle
    first cos a + across sin a of the plane each is extreme where its derivative vanishes; what runs along the
    axis of the arc is added whole.
    """
    kin, slides = law.machine.kinematics, law.slides
    q0 = at_start[:, slides]
    slides_of = np.linalg.inv(kin.slide_directions(at_start, slides)) @ np.linalg.inv(law.tip_to_words(kin, at_start))
    step = np.linalg.solve(slides_of, (path.q[k][:, slides] - q0)[..., None])[..., 0]
    for plane, (i, j) in PLANE_COLUMNS.items():
        rows = np.flatnonzero(path.plane[k] == plane)
        if not len(rows):
            continue
        first = -path.center[k[rows]][:, (i, j)]
        sense = np.where(path.ccw[k[rows]], 1.0, -1.0)
        across = sense[:, None] * np.stack([-first[:, 1], first[:, 0]], axis=1)
        last = first + step[rows][:, (i, j)]
        sweep = np.mod(sense * (np.arctan2(last[:, 1], last[:, 0]) - np.arctan2(first[:, 1], first[:, 0])),
                       2.0 * np.pi)
        sweep = np.where(sweep < 1e-9, 2.0 * np.pi, sweep)
        p, s = (np.einsum("kab,kb->ka", slides_of[rows][:, :, (i, j)], v) for v in (first, across))
        rise = slides_of[rows][:, :, 3 - i - j] * step[rows, 3 - i - j][:, None]
        for extra in (0.0, np.pi):
            angle = np.mod(np.arctan2(s, p) + extra, 2.0 * np.pi)
            value = q0[rows] + p * (np.cos(angle) - 1.0) + s * np.sin(angle)
            passed = (angle <= sweep[:, None]) & (np.hypot(p, s) > 0.0)
            at = np.ix_(rows, slides)
            low[at] = np.where(passed, np.minimum(low[at], value + np.minimum(rise, 0.0)), low[at])
            high[at] = np.where(passed, np.maximum(high[at], value + np.maximum(rise, 0.0)), high[at])


def check_travel(path: JointPath, moves: Moves, control: Control, kinematics: Callable[[int], Kinematics],
                 file: str = "", where: Callable[[Ints], str] = lambda moves: "", lower: str = LOWER[-1],
                 ) -> tuple[list[Diagnostic], dict[str, tuple[float, float]]]:
    """(excesses as errors, extents of each axis in mm or degrees); `where` says at which place moves (K,) are made,
    `lower` what brings linking moves down."""
    machine, limits = control.machine, control.machine.limits
    lowest, highest = np.full(len(limits.lower), np.inf), np.full(len(limits.lower), -np.inf)
    beyond: list[tuple[Ints, Floats, Floats]] = []
    for first in range(0, len(path), PART):
        rows = np.arange(first, min(first + PART, len(path)))
        low, high = extremes(path, moves, control, kinematics, rows)
        lowest, highest = np.minimum(lowest, low.min(axis=0)), np.maximum(highest, high.max(axis=0))
        bad = (np.maximum(limits.lower - low, high - limits.upper) > TRAVEL_SLACK).any(axis=1)
        beyond.append((rows[bad], low[bad], high[bad]))
    rows, low, high = (np.concatenate(column) for column in zip(*beyond, strict=True))
    diagnostics, extents = [], {}
    for j, name in enumerate(machine.axis_names):
        unit = 1.0 / DEG if machine.rotary[j] else 1.0
        extents[name] = (float(lowest[j] * unit), float(highest[j] * unit))
        over = np.maximum(limits.lower[j] - low[:, j], high[:, j] - limits.upper[j])
        bad = over > TRAVEL_SLACK
        if bad.any():
            diagnostics.append(_excess(path, moves, control, j, rows[bad], low[bad, j], high[bad, j], over[bad], file,
                                       where(path.move[rows[bad]]), kinematics, lower))
    return diagnostics, extents


def extremes(path: JointPath, moves: Moves, control: Control, kinematics: Callable[[int], Kinematics],
             rows: Ints | None = None) -> tuple[Floats, Floats]:
    """(lowest, highest) joints (K, J) of each block, or of each of `rows` (K,).

    Straight joints are extreme at their ends and in arcs. Where the control runs the kinematics joints bend between the
    ends: there the blocks are sampled.
    """
    rows = np.arange(len(path)) if rows is None else rows
    end = path.q[rows]
    before = np.where((rows == 0)[:, None], control.machine.home, path.q[np.maximum(rows - 1, 0)])
    low, high = np.minimum(before, end), np.maximum(before, end)
    frame, tool = path.frame[rows], moves.tool[path.move[rows]]
    for k in groups(frame):
        law = path.frames[int(frame[k[0]])].control
        arcs = k[path.code[rows[k]] == ARC]
        if len(arcs) and law.machine.kinematics.straight_slides:
            low_arc, high_arc = low[arcs], high[arcs]
            _arc_extremes(path, law, rows[arcs], before[arcs], low_arc, high_arc)
            low[arcs], high[arcs] = low_arc, high_arc
        for index in distinct(tool[k]) if law.tip_law else ():
            part = k[tool[k] == index]
            for q in law.bent(before[part], end[part], np.linspace(0.1, 0.9, 9), kinematics(int(index))):
                low[part], high[part] = np.fmin(low[part], q), np.fmax(high[part], q)
    return low, high


def _shorter_helps(kinematics: Kinematics, q: Floats, j: int, over: float) -> bool:
    """True where the joints (J,) have a tool longer than joint `j` lacks, and that joint moves along it: `over` is positive
    above its travel, negative below."""
    if kinematics.tool_length <= abs(over):
        return False
    tip, axis = kinematics.forward(np.stack([q, q + np.eye(len(q))[j]]))
    return bool((tip[1] - tip[0]) @ axis[0] * np.sign(over) > _ALONG)


def _excess(path: JointPath, moves: Moves, control: Control, j: int, bad: Ints, low: Floats, high: Floats, over: Floats,
            file: str, where: str, kinematics: Callable[[int], Kinematics], lowering: str) -> Diagnostic:
    """Axis j goes beyond its travel in the blocks `bad` (K,), to `low`, `high`, by `over` (K,), at a place."""
    machine = control.machine
    rotary = machine.rotary[j]
    unit, name = (1.0 / DEG, "degrees") if rotary else (1.0, "mm")
    cuts = ~np.isnan(path.u[bad]) & (moves.kind[path.move[bad]] != Kind.RAPID)
    at = int(np.where(cuts | ~cuts.any(), over, 0.0).argmax())  # a link follows from the cuts at its ends
    worst = bad[at]
    above = high[at] > machine.limits.upper[j] + TRAVEL_SLACK
    value = high[at] if above else low[at]
    lower, upper = machine.limits.lower[j] * unit, machine.limits.upper[j] * unit
    lines = np.unique(moves.line[path.move[bad]])
    first = int(moves.line[path.move[worst]])
    linking = " in a linking move" if np.isnan(path.u[worst]) else ""
    hint = "move the part in the set-up (part.origin)"
    if rotary:
        hint = "turn the part in the set-up, or split the operation"
    else:
        others = [lowering] if linking else []
        tool = kinematics(int(moves.tool[path.move[worst]]))
        if _shorter_helps(tool, path.q[worst], j, float(over[at] if above else -over[at])):
            others.append("use a shorter tool (gauge_length)")
        hint += "".join(f", {'or ' * (k + 1 == len(others))}{one}" for k, one in enumerate(others))
    return error("travel.exceeded", f"axis {machine.axis_names[j]} goes to {value * unit:.4f} {name}{linking}{where}, "
                 f"allowed {lower:.4f} to {upper:.4f} {name}", file=file,
                 lines=[first, *(n for n in lines[:6].tolist() if n != first)], count=len(lines), hint=hint)
