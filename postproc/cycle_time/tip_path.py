"""How far the tip of the tool travels against the part, whatever the words of a program are."""

from __future__ import annotations

import numpy as np

from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

STILL = 1e-9
"""mm or degrees below which an axis does not move"""
CHORD, CHORDS = 3.0, (1, 8, 64, 512)
"""degrees of a rotary axis for one chord of the tip's path, which is 1e-4 short then; chords of a block"""
PLACES = 20_000
"""looked at together"""


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
            here, together = rows[which], max(1, PLACES // (count + 1))
            parts = [here[first:first + together] for first in range(0, len(here), together)]
            result[which] = np.concatenate([self._along(part, count) for part in parts]) if parts else ()
        return result

    def _along(self, rows: Ints, chords: int) -> Floats:
        """(K,) mm by so many chords of each row; all places at once, for a platform is followed to each of them."""
        shares = np.linspace(0.0, 1.0, chords + 1)
        tips, _ = self.poses.poses(self.motion, np.repeat(rows, len(shares)), np.tile(shares, len(rows)))
        steps = np.diff(tips.reshape(len(rows), len(shares), 3), axis=1)
        return np.asarray(np.linalg.norm(steps, axis=2).sum(axis=1))

    def _chords(self, rows: Ints) -> Ints:
        """(K,) chords of each row, one where no rotary axis turns."""
        step = np.diff(self.motion.end, axis=0, prepend=self.motion.start[None])
        turned = np.abs(step[rows][:, np.array(self.rotary)]).max(axis=1, initial=0.0)
        most = np.where((turned > STILL) | (self.motion.code[rows] == 2), np.maximum(turned / CHORD, 2.0), 1.0)
        return np.asarray(np.array(CHORDS)[np.searchsorted(CHORDS[:-1], most)])
