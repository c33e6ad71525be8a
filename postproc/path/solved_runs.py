"""The runs of a program with their joints as the control will take them, each in the frame that its words are in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import postproc.path.faults as faults
from machines.kinematics.base import Kinematics
from postproc.control.modes import CONSTANT, OutputModes, WordFrame, turning_run
from postproc.joints.run_plan import RunPlan
from toolpaths.arrays import Bools, Floats, Ints, distinct, slices
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.rotations import angle_between
from toolpaths.shapes import arrays


@dataclass(frozen=True)
class SolvedRun:
    """Rows `first` to before `last` of Moves, with the frame of their words and the tool's kinematics."""

    first: int
    last: int
    frame: WordFrame
    kin: Kinematics
    left: float
    """rad of the axis tolerance that linearising may use"""
    modes: OutputModes
    """those of its place"""


@dataclass(frozen=True)
@arrays(axis="R 3", q="R J")
class SolvedRuns:
    """All runs, and the axes (R, 3) and joints (R, J) of their rows."""

    each: tuple[SolvedRun, ...]
    axis: Floats
    q: Floats


def solved_runs(plan: RunPlan, modes: OutputModes, kinematics: Callable[[int], Kinematics], operation: Ints,
                axis_tolerance: float, file: str) -> tuple[SolvedRuns, list[Diagnostic]]:
    """The runs of a plan in the output modes that are theirs; those that cannot be solved are left out, with errors.

    Args:
        operation: (R,) of each row
        axis_tolerance: rad
    """
    moves, machine = plan.refined.moves, modes.control.machine
    starts = np.flatnonzero(moves.link)
    lasts, firsts = [*starts[1:].tolist(), len(moves)], starts.tolist()
    still = _still(moves.axis, starts, axis_tolerance)
    owner, left, tool = operation[np.array(lasts) - 1].tolist(), plan.left[starts].tolist(), moves.tool[starts]
    good = machine.kinematics.straight_slides and bool(np.isfinite(plan.q).all()) and not bool((plan.moved > 1e-6).any()) \
        and not bool(np.isfinite(moves.spin).any())
    laws = {(op, s): modes.law(op, s) for op, s in set(zip(owner, still.tolist(), strict=True))}
    tools = {k: kinematics(k) for k in distinct(tool).tolist()}
    q, axis, found, each = plan.q, moves.axis, list[Diagnostic](), list[SolvedRun]()
    for k, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
        kin, law = tools[int(tool[k])], laws[owner[k], bool(still[k])]
        if not good:
            more = _faults(plan, modes, kin, np.arange(first, last), axis_tolerance, file)
            found += more
            if has_errors(more):
                continue
        if law == "tilted" and not still[k]:
            found.append(turning_run(distinct(moves.line[first:last]).tolist(), file))
            continue
        own = modes.of(owner[k])
        frame = own.tcp if law == "tcp" else own.base
        if law == "tilted":
            if axis is moves.axis:
                axis, q = np.array(axis), q.copy()
            frame, at = own.plane(kin, q[first])
            q[first:last] = kin.at_tip(moves.tip[first:last], np.tile(at, (last - first, 1)),
                                       frame.control.slides)
            axis[first:last] = kin.forward(q[first:first + 1])[1]
        each.append(SolvedRun(first, last, frame, kin, left[k], own))
    return SolvedRuns(tuple(each), axis, q), found


def _still(axis: Floats, starts: Ints, axis_tolerance: float) -> Bools:
    """(runs,) True where the tool axes of a run are one within a share of the tolerance (rad)."""
    if axis.strides[0] == 0 or not len(starts):
        return np.ones(len(starts), dtype=np.bool_)
    first, own = np.repeat(starts, np.diff(np.append(starts, len(axis)))), axis[starts[0]:]
    near = np.concatenate([angle_between(own[part], axis[first[part]]) for part in slices(len(own))]) <= (
        CONSTANT * axis_tolerance)
    return np.asarray(np.logical_and.reduceat(near, starts - starts[0]))


def _faults(plan: RunPlan, modes: OutputModes, kin: Kinematics, rows: Ints, axis_tolerance: float,
            file: str) -> list[Diagnostic]:
    """What stands against the joints of a run."""
    moves, q, axis = plan.refined.moves, plan.q[rows], plan.refined.moves.axis[rows]
    found = faults.moved_axes(moves, rows, plan.moved[rows], file)
    found += faults.unreachable(modes.control, kin, moves, rows, axis, q, file)
    if has_errors(found):
        return found
    return found + faults.spun(kin, moves, rows, axis, q, axis_tolerance, file)
