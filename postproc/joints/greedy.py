"""What a post that always takes the nearest joints would do, to compare with: it looks one pose ahead."""

from __future__ import annotations

import numpy as np

from postproc.joints.lattice import Lattice
from postproc.joints.states import BAD, SECONDS, Segment, leading, rough_segments
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import wrap


@dataclass(frozen=True)
class Greedy:
    """Rewinds, poses outside travel, time with every axis at its velocity."""

    rewinds: int
    outside: int
    seconds: float


def greedy(lattice: Lattice, start: Floats) -> Greedy:
    """A run from joints `start` (J,): the nearest state inside travel, kept until travel ends it, then the nearest other."""
    segments = rough_segments(lattice, True)
    state, time = _nearest(lattice, segments[0], segments[0].first, start)
    rewinds, outside = 0, 0
    for k, segment in enumerate(segments):
        branch, _ = segment.states[state]
        outside += int(segment.bad[state])
        time += float(lattice.clock[branch, segment.last] - lattice.clock[branch, segment.first])
        if k + 1 == len(segments):
            return Greedy(rewinds, outside, time)
        after = segments[k + 1]
        to, cost = min(leading(lattice, segment, after)[state], key=lambda travel: (travel[1][BAD], travel[1][SECONDS]))
        time += float(cost[SECONDS])
        if (after.bad[to] or cost[BAD]) and not after.bad.all():
            at = lattice.joints(after.states[to][0], after.first, after.states[to][1])
            to, travel = _nearest(lattice, after, after.first, at)
            rewinds, time = rewinds + 1, time + travel + float(lattice.away[segment.last])
        state = to
    raise AssertionError("a run has at least one segment")


def _nearest(lattice: Lattice, segment: Segment, pose: int, q: Floats) -> tuple[int, float]:
    """(state inside travel that is nearest to q (J,), time to go there); of those outside where no other is."""
    to = np.stack([lattice.joints(b, pose, turns) for b, turns in segment.states])
    step = np.where(lattice.endless, wrap(to - q), to - q)
    travel = np.nan_to_num(np.abs(np.where(lattice.rotary, step, 0.0)).sum(axis=1), nan=np.inf)
    best = int(np.lexsort((travel, segment.bad > 0))[0])
    return best, float(lattice.seconds(step[best]))
