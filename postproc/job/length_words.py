"""Whether the words of a program hold the length of the tool."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from toolpaths.arrays import Floats


def words_depend_on_length(control: Control, kin: Kinematics, axis: Floats) -> bool:
    """True where a length offset on Z does not make program words free of the tool length (heads, parallel machines)."""
    if control.tip_law:
        return False
    some = axis[np.linspace(0, len(axis) - 1, min(len(axis), 200)).astype(int)]
    some = kin.nearest_axis(np.array(sorted(set(map(tuple, some.tolist())))))
    tip = np.tile(kin.forward(control.machine.home[None, :])[0], (len(some), 1))
    short, long = (control.words(tool.inverse(tip, some)[0], tool, length)
                   for tool, length in ((kin, 0.0), (kin.with_tool(1.0), 1.0)))
    return bool(np.nanmax(np.abs(long - short), initial=0.0) > 1e-9)
