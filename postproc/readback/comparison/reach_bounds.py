"""Bounds of a parallel machine's workspace, joints and clearances at the ends of the blocks of a program."""

from __future__ import annotations

import numpy as np

from machines import reach
from postproc.readback.comparison.checks import CHUNK, ROUNDING_SLACK
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from postproc.reference.moves import Moves
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.units import DEG


def check_reach_bounds(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints,
                       faults: Faults) -> list[Diagnostic]:
    """Blocks that end where a rod, a joint or the platform cannot be; nothing for serial machines."""
    kinematics = executed.control.machine.kinematics
    if not reach.is_checked(kinematics):
        return []
    worst: dict[str, tuple[float, int, bool]] = {}
    for first in range(0, len(motion), CHUNK):
        rows = np.arange(first, min(first + CHUNK, len(motion)))
        margins = reach.reach(kinematics, executed.joints(motion, rows, 1.0))
        for name, angular, values in zip(margins.names, margins.angular, margins.values.T, strict=True):
            k = int(np.nanargmin(values)) if np.isfinite(values).any() else 0
            if values[k] < -ROUNDING_SLACK * (DEG if angular else 1.0) and values[k] < worst.get(name, (0.0, 0, False))[0]:
                worst[name] = float(values[k]), int(rows[k]), bool(angular)
    result = []
    for name, (value, row, angular) in worst.items():
        passed, unit = (-value / DEG, "degrees") if angular else (-value, "mm")
        line = int(moves.line[owner[row]]) if owner[row] < len(moves) else 0
        result.append(faults.error("verify.reach", f"{name}: passed by {passed:.4f} {unit}", line, int(motion.line[row]),
                                   hint="the machine cannot go there: put the block back, or move the part in the set-up "
                                   "(part.origin)"))
    return result
