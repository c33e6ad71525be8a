"""How far the tool yields along a program under the cutting force that the set-up gives it, and where that is worst."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.path.model import FEED
from postproc.pipeline.result import PostResult
from postproc.planning.planned_source import cutting_forces

AT_ONCE = 65536
"""poses at a time"""


def deflection(result: PostResult) -> dict[str, Any] | None:
    """Worst move of the tip at the ends of cuts, under the force in its worst direction; None where the machine file has no
    stiffness or no tool a force."""
    job, path, moves = result.job, result.path, result.moves
    if job is None or path is None or moves is None or result.machine.stiffness is None:
        return None
    from machines.stiffness.along import tip_compliance

    forces, worst = cutting_forces(job), dict[str, Any]()
    for tool, force in forces.items():
        rows = np.flatnonzero((path.code == FEED) & (moves.tool[path.move] == tool))
        kinematics = job.kinematics(tool)
        for first in range(0, len(rows), AT_ONCE):
            here = rows[first:first + AT_ONCE]
            found = tip_compliance(result.machine, kinematics, path.q[here])
            if found is None:
                return None
            bend = force * 1e3 * np.linalg.norm(found, ord=2, axis=(1, 2))
            k = int(bend.argmax())
            if bend[k] > worst.get("worst_um", -1.0):
                worst = {"worst_um": float(bend[k]), "force_n": force, "tool": job.number_of(tool),
                         "line": int(moves.line[path.move[here[k]]]), "tip_mm": moves.tip[path.move[here[k]]].tolist()}
    return worst or None


def deflection_lines(found: dict[str, Any] | None) -> list[str]:
    """The same for people."""
    if found is None:
        return []
    place = ", ".join(f"{v:.3f}" for v in found["tip_mm"])
    return [f"deflection of the tip: at most {found['worst_um']:.1f} um under {found['force_n']:g} N in the worst direction,"
            f" T{found['tool']} at ({place}), line {found['line']}; rods, joints and drives alone, ends of cuts"]
