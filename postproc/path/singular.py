"""The stated distance that a machine keeps from its singular positions, at points and between them."""

from __future__ import annotations

import numpy as np

from postproc.control.control import Control
from postproc.path.model import JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import distinct
from toolpaths.diagnostics import Diagnostic, error, info


def check_singular(path: JointPath, moves: Moves, control: Control, least: float,
                   file: str = "") -> list[Diagnostic]:
    """How near the blocks come to singular positions: an error below `least`; nothing where the machine measures none."""
    kinematics = control.machine.kinematics
    names = kinematics.singular_names
    if not names or not len(path):
        return []
    found = kinematics.singular_distance_between(np.concatenate([control.machine.home[None, :], path.q]))
    result = []
    for name, values in zip(names, found.T, strict=True):
        worst = int(np.nanargmin(values))
        line = int(moves.line[path.move[worst]])
        bad = distinct(moves.line[path.move[np.flatnonzero(values < least)]])
        if len(bad):
            lines = [line, *(n for n in bad[:6].tolist() if n != line)]
            result.append(error("singular.distance", f"{name} comes to {values[worst]:.4f} of a singular position, allowed "
                                f"at least {least:g}", file=file, lines=lines, count=len(bad),
                                hint="move or turn the part in the set-up, or state another joints.singular_distance"))
    if not result:
        noted = ", ".join(f"{name} {np.nanmin(values):.3f}" for name, values in zip(names, found.T, strict=True))
        result.append(info("singular.distance", f"distance from singular positions: {noted} (stated: at least {least:g})",
                           file=file))
    return result
