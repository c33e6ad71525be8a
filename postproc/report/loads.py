"""How far the tool yields along a program under the cutting force that the set-up gives it, what its motors have to give at
the program's feeds, and where both are worst."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.job.job import Job
from postproc.path.model import FEED, JointPath
from postproc.pipeline.result import PostResult
from postproc.planning.planned_source import cutting_forces
from postproc.reference.moves import Moves
from toolpaths.arrays import Ints, distinct

AT_ONCE, LOOKS = 65536, 2000
"""poses at a time; blocks at which the forces of the motors are looked at, spread over each tool's cuts"""


def deflection(result: PostResult) -> dict[str, Any] | None:
    """Worst move of the tip at the ends of cuts, under the force in its worst direction; how far drives that yield let it
    hang differently in one tool's cuts, and move as axes reverse. None where the machine file has no stiffness, or neither a
    tool a force nor the machine masses."""
    job, path, moves = result.job, result.path, result.moves
    if job is None or path is None or moves is None or result.machine.stiffness is None:
        return None
    forces = cutting_forces(job)
    found = _under_cutting(result, job, path, moves, forces) | _by_drives(result, job, path, moves)
    return found or None


def _cuts(path: JointPath, moves: Moves, tool: int) -> Ints:
    return np.flatnonzero((path.code == FEED) & (moves.tool[path.move] == tool))


def _by_drives(result: PostResult, job: Job, path: JointPath, moves: Moves) -> dict[str, Any]:
    """`weight_um`, `reversal_um`: largest over the tools."""
    from machines.dynamics.yielding import drive_moves

    worst = dict[str, Any]()
    for tool in np.unique(moves.tool).tolist():
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        rows = _cuts(path, moves, tool)
        for first in range(0, len(rows), AT_ONCE):
            found = drive_moves(result.machine, job.kinematics(tool), path.q[rows[first:first + AT_ONCE]])
            if found is None:
                return {}
            low, high = np.minimum(low, found[0].min(axis=0)), np.maximum(high, found[0].max(axis=0))
            worst["reversal_um"] = max(worst.get("reversal_um", 0.0), 1e3 * float(found[1].max()))
        if len(rows):
            worst["weight_um"] = max(worst.get("weight_um", 0.0), 1e3 * float(np.linalg.norm(high - low)))
    return worst


def _under_cutting(result: PostResult, job: Job, path: JointPath, moves: Moves, forces: dict[int, float]) -> dict[str, Any]:
    from machines.stiffness.along import tip_compliance

    worst = dict[str, Any]()
    for tool, force in forces.items():
        rows, kinematics = _cuts(path, moves, tool), job.kinematics(tool)
        for first in range(0, len(rows), AT_ONCE):
            here = rows[first:first + AT_ONCE]
            found = tip_compliance(result.machine, kinematics, path.q[here])
            if found is None:
                return {}
            bend = force * 1e3 * np.linalg.norm(found, ord=2, axis=(1, 2))
            k = int(bend.argmax())
            if bend[k] > worst.get("worst_um", -1.0):
                worst = {"worst_um": float(bend[k]), "force_n": force, "tool": job.number_of(tool),
                         "line": int(moves.line[path.move[here[k]]]), "tip_mm": moves.tip[path.move[here[k]]].tolist()}
    return worst


def deflection_lines(found: dict[str, Any] | None) -> list[str]:
    """The same for people."""
    if found is None:
        return []
    lines = []
    if "weight_um" in found:
        lines = [f"drives that yield: the tip hangs up to {found['weight_um']:.1f} um differently from place to place of "
                 f"one tool's cuts, by weights, and moves up to {found['reversal_um']:.1f} um where all axes reverse, by "
                 "friction"]
    if "worst_um" not in found:
        return lines
    place = ", ".join(f"{v:.3f}" for v in found["tip_mm"])
    return [*lines, f"deflection of the tip: at most {found['worst_um']:.1f} um under {found['force_n']:g} N in the worst "
            f"direction, T{found['tool']} at ({place}), line {found['line']}; rods, joints and drives alone, ends of cuts"]


def motor_load(result: PostResult) -> dict[str, Any] | None:
    """Largest share of its limit that a motor gives in the cuts at the words' feeds: in steady motion (rates, gravity, the
    tool's cutting force in its worst direction), and on top of that while the control starts and stops all axes with their
    full accelerations, in the signs that are worst. None where the machine file limits no motor."""
    job, path, moves = result.job, result.path, result.moves
    if job is None or path is None or moves is None:
        return None
    from machines.dynamics.limits import force_limits

    forces, worst = cutting_forces(job), dict[str, Any]()
    for tool in distinct(moves.tool).tolist():
        limits = force_limits(result.machine, job.kinematics(tool), forces.get(tool, 0.0))
        if limits is None:
            return None
        rows = np.flatnonzero((path.code == FEED) & (moves.tool[path.move] == tool) & (path.seconds > 0.0))
        rows = rows[rows > 0]
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(LOOKS, len(rows))).astype(np.int64))] if len(rows) else rows
        if not len(rows):
            continue
        before, after = path.q[rows - 1], path.q[rows]
        rate = (after - before) / path.seconds[rows][:, None]
        steady, ramp = limits.loads(0.5 * (before + after), rate, result.machine.limits.acceleration)
        for key, share in (("steady", steady), ("starting_and_stopping", ramp)):
            k, j = np.unravel_index(int(share.argmax()), share.shape)
            if share[k, j] > worst.get(key, {"share": -1.0})["share"]:
                worst[key] = {"share": float(share[k, j]), "motor": limits.names(result.machine)[int(j)],
                              "tool": job.number_of(tool), "line": int(moves.line[path.move[rows[k]]])}
    return worst or None


def motor_load_lines(found: dict[str, Any] | None) -> list[str]:
    """The same for people."""
    if found is None:
        return []
    steady, ramp = found["steady"], found["starting_and_stopping"]
    return [f"motors: {steady['motor']} gives at most {steady['share']:.0%} of its limit in steady cuts (T{steady['tool']}, "
            f"line {steady['line']}); {ramp['motor']} {ramp['share']:.0%} if all axes start or stop at their full "
            f"acceleration there (line {ramp['line']})"]
