"""Seconds of what is drilled in a pass: from stop to stop down to each depth and out at feed, and the dwells."""

from __future__ import annotations

import numpy as np

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.rest_to_rest import PointToPointMode, rest_seconds
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind, Toolpath


@dataclass(frozen=True)
@arrays(rows="K", fed="K")
class Drilled:
    """Moves at feed in the holes of a pass.

    Attributes:
        rows (K,): rows of the pass that they end, none of them its first
        fed (K,): seconds that each takes at its feed
        dwell: seconds at the bottoms
    """

    rows: Ints
    fed: Floats
    dwell: float

    def seconds(self, q: Floats, limits: JointLimits) -> float:
        """All together, joints (n, J) of the pass straight from rest to rest; the feed is a joint that needs
        `fed` seconds at its greatest velocity."""
        if not len(self.rows):
            return self.dwell
        with_feed = JointLimits(np.append(limits.velocity, 1.0), np.append(limits.acceleration, np.inf),
                                np.append(limits.jerk, np.inf))
        begin = np.hstack((q[self.rows - 1], np.zeros((len(self.rows), 1))))
        end = np.hstack((q[self.rows], self.fed[:, None]))
        return self.dwell + float(rest_seconds(begin, end, with_feed, PointToPointMode.STRAIGHT).sum())


def drilled_of(toolpath: Toolpath, moves: Moves, rows: tuple[int, int]) -> Drilled:
    """What is drilled in [first, last) of the moves; a dwell in revolutions does not count."""
    here = slice(*rows)
    inside = moves.hole[here] >= 0
    fed = np.flatnonzero(inside & (moves.kind[here] != Kind.RAPID))
    fed = fed[fed > 0]
    at = rows[0] + fed
    travel = np.linalg.norm(moves.tip[at] - moves.tip[at - 1], axis=1)
    seconds = np.where(np.isnan(moves.feed[at]), moves.seconds[at], travel / moves.feed[at])
    bottoms = moves.cycle[here][inside & (moves.phase[here] == Phase.DRILL)]
    return Drilled(fed, seconds, float(sum(toolpath.cycles[k].dwell for k in bottoms.tolist())))
