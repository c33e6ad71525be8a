"""How far the tip of the tool travels against the part, whatever the words of a program are."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths

STILL = 1e-9
"""mm or degrees below which an axis does not move"""
CHORD, CHORDS = 3.0, (1, 8, 64, 512)
"""degrees of a rotary axis for one chord of the tip's path, which is 1e-4 short then; chords of a block"""


@dataclass(frozen=True)
class TipPath:
    """The tip along the rows of an executed motion."""

    motion: Motion
    poses: BlockPoses
    rotary: tuple[bool, ...]

    def travel(self, rows: Ints) -> Floats:
        """(K,) mm that the tip travels in the part's frame in the rows (K,) of the motion; arcs by chords."""
        result = np.zeros(len(rows))
        wanted = self._chords(rows)
        for count in CHORDS:
            which = wanted == count
            here = rows[which]
            if len(here):
                tips = (self.poses.poses(self.motion, here, t)[0] for t in np.linspace(0.0, 1.0, count + 1).tolist())
                result[which] = np.sum([lengths(behind - before) for before, behind in pairwise(tips)], axis=0)
        return result

    def _chords(self, rows: Ints) -> Ints:
        """(K,) chords of each row, one where no rotary axis turns."""
        step = np.diff(self.motion.end, axis=0, prepend=self.motion.start[None])
        turned = np.abs(step[rows][:, np.array(self.rotary)]).max(axis=1, initial=0.0)
        most = np.where((turned > STILL) | (self.motion.code[rows] == 2), np.maximum(turned / CHORD, 2.0), 1.0)
        return np.asarray(np.array(CHORDS)[np.searchsorted(CHORDS[:-1], most)])
