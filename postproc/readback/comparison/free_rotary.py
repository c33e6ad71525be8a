"""Tools that are held about their own axes: where the rotary axis that their direction leaves free stands."""

from __future__ import annotations

import numpy as np

from postproc.joints.spin import spins_off
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.units import DEG


def check_spins(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints, tip: Floats, axis: Floats, tolerance: float,
                faults: Faults) -> list[Diagnostic]:
    """Blocks that do not end with the tool held about its axis as the moves (`owner` (K,)) ask; `tolerance` in rad."""
    asked = np.append(moves.spin, [np.nan, np.nan])[owner]
    linking = np.append(moves.link, [True, True])[owner]
    rows = np.flatnonzero(np.isfinite(asked) & ~linking)
    if not len(rows):
        return []
    off = np.zeros(len(rows))
    for number in np.unique(motion.tool[rows]).tolist():
        k = np.flatnonzero(motion.tool[rows] == number)
        at = rows[k]
        off[k] = spins_off(executed.kinematics(number), executed.joints(motion, at, 1.0), tip[at],
                           axis[at], asked[at])
    bad = np.flatnonzero(off > tolerance)
    if not len(bad):
        return []
    worst = int(off.argmax())
    return [faults.error("verify.spin", f"the tool is {off[worst] / DEG:.4f} degrees turned about its axis from where this "
                         f"pass holds it, allowed {tolerance / DEG:.4f}", int(moves.line[owner[rows[worst]]]),
                         int(motion.line[rows[worst]]), len(bad))]
