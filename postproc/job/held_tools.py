"""Tools that are not round: where the machine could turn them about their own axis, they are asked not to be turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics.base import SPIN
from machines.machine import Machine
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from toolpaths.toolpath import Toolpath


def with_held_tools(moves: Moves, toolpath: Toolpath, machine: Machine, setup: SetupFile) -> Moves:
    """The moves in the table frame, those of tools that are not round at a spin of 0 where the file asks for none."""
    numbers = {int(number) for number, tool in setup.tools.items() if tool.keeps_spin}
    held = [k for k, tool in enumerate(toolpath.tools) if tool.number in numbers]
    if not held or SPIN not in machine.kinematics.with_free_spin().open_parameters:
        return moves
    ask = np.isin(moves.tool, held) & np.isnan(moves.spin)
    return replace(moves, spin=np.where(ask, 0.0, moves.spin))
