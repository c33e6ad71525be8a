"""How the legs of any platform transmit, over its workspace: the loops' matrices, whatever the drives and freedoms.

Turns count by a lever (half the largest distance of two platform joints), an arm by the path of its end: all of it is mm per
mm, so that a condition number has a meaning (Company 2000, II-24).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from machines.kinematics.frames import tool_x
from machines.kinematics.legs.attitudes import attitude
from machines.kinematics.legs.loops import Loops
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross

Posed = Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]
"""(C (N, 3), R (N, 3, 3)) of a place (N, 3), tool axis (N, 3) and spin (N,)"""
HEADINGS = 12
"""directions into which a platform that turns in all of them is tilted"""


@dataclass(frozen=True, eq=False)
class OverWorkspace:
    """A `Transmission`."""

    loops: Loops
    workspace: Workspace
    posed: Posed | None = None
    """place and turn of a platform of which something follows from the rest"""

    @cached_property
    def lever(self) -> float:
        """See `Transmission`."""
        joints = self.loops.joints
        return 0.5 * float(np.linalg.norm(joints[:, None] - joints[None], axis=2).max()) if self.loops.turns else 0.0

    @property
    def headings(self) -> Floats:
        """See `Transmission`."""
        return np.linspace(0.0, 2.0 * np.pi, HEADINGS, endpoint=False) if self.loops.turns == "abc" else np.zeros(1)

    def loops_at(self, place: Floats, tilt: Floats, heading: float) -> tuple[Floats, Floats]:
        """See `Transmission`: own roots, spin 0; NaN where a leg does not reach."""
        loops, drives = self.loops, self.loops.drives
        axis, spin = attitude(loops.turns, tilt, np.full(len(tilt), heading))
        if loops.holds is not None and self.posed is not None:
            place, turn = self.posed(place, axis, spin)
        else:
            x = tool_x(axis, spin)
            turn = np.stack([x, cross(axis, x), axis], axis=2)
            place = place * loops.basis[:3].any(axis=1)
        q = drives.solve(loops.ends(place, turn), drives.roots)
        jx, rods = loops.matrix_at(place, turn, q)
        translations = loops.translations.shape[1]
        jx = np.array(loops.of_drives(jx))
        jx[:, :, translations:] *= loops.lever / self.lever if self.lever else 1.0
        return jx, drives.gains(rods, q) / drives.size
