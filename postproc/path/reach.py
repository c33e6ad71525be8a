"""What a parallel machine's rods, joints and platform allow, at the ends of the blocks and between them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from machines import reach as clearances
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.control.control import Control
    from postproc.path.model import JointPath
    from postproc.reference.moves import Moves

_SAMPLES = (0.25, 0.5, 0.75)
_SLACK = 1e-5
"""mm or rad: round-off that passes no bound"""
is_checked = clearances.is_checked


def inside(kinematics: Kinematics, q: Floats) -> bool:
    """True where joints (N, J) of a parallel machine keep every bound."""
    return bool((clearances.reach(kinematics, q).values >= -_SLACK).all())


def check_reach(path: JointPath, moves: Moves, control: Control, file: str, lower: str) -> list[Diagnostic]:
    """Workspace, joint and clearance bounds that the blocks pass, as errors; nothing for serial machines. `lower`: what
    brings linking moves down."""
    kinematics = control.machine.kinematics
    if not is_checked(kinematics):
        return []
    start = np.concatenate([control.machine.home[None, :], path.q])
    margins = _at_samples(path, control, start) if control.tip_law else clearances.reach_between(kinematics, start)
    result = []
    for name, angular, count, worst, value in replace(margins, values=margins.values + _SLACK).passed():
        unit, what = (1.0 / DEG, "degrees") if angular else (1.0, "mm")
        linking = " in a linking move" if np.isnan(path.u[worst]) else ""
        message = f"{name}: passed by {-(value - _SLACK) * unit:.4f} {what}{linking}, allowed at least 0"
        result.append(error("reach.clearance", message, file=file, lines=[int(moves.line[path.move[worst]])], count=count,
                            hint=f"move the part in the set-up (part.origin), turn it, or {lower}"))
    return result


def _at_samples(path: JointPath, control: Control, start: Floats) -> clearances.Margins:
    """Least margins of each block over samples of the motion that the control's own kinematics makes."""
    kinematics = control.machine.kinematics
    margins = clearances.reach(kinematics, path.q)
    values = margins.values.copy()
    for t in _SAMPLES:
        _, _, q = control.between(start[:-1], path.q, np.full(len(path), t), kinematics)
        values = np.fmin(values, clearances.reach(kinematics, q).values)
    return replace(margins, values=values)
