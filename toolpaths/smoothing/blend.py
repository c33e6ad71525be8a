"""Where two segments meet: one turns into the other within a short distance, or the motion stops.

With A before the joint and B behind it, D = B - A (zero at the joint) and x the path from the joint, the path
is A(s) + D(R(x)): R is the ramp max(x, 0) rounded over |x| < a by a polynomial of degree 6 whose third
derivative is continuous. Outside it the path is A and B themselves; between two lines its direction turns one
direction only, and its speed never exceeds theirs. What it leaves is D where the ramp's rounding is highest,
at x = 0: R(0) = 5/32 a.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.smoothing.members import Members

HIGHEST = 5.0 / 32.0
ROOM = 0.45
"""Part of a segment that the blend at one of its ends may take."""
SHARPEST = 2.4
"""rad: a blend that turns by more would nearly stand still"""
FILL = 0.98
"""Part of the tolerance that blends use."""
_ROUNDS = 60


def ramp(u: Floats) -> Floats:
    """R/a at u = x/a (N,): 0 for u <= -1, u for u >= 1, between them the integral of the quintic smooth step."""
    inner = np.clip(u, -1.0, 1.0)
    square = inner**2
    rounded = 0.5 * (inner + 1.0) + 15.0 / 16.0 * (
        (square - 1.0) / 2.0 - (square**2 - 1.0) / 6.0 + (square**3 - 1.0) / 30.0)
    return np.asarray(np.where(u > 1.0, u, rounded))


@dataclass(frozen=True)
@arrays(s="G", half="G", stop="G", turn="G")
class SegmentBlends:
    """The G - 1 joints between segments: parameter, half length a (0 at stops), which are stops, and the turn in rad."""

    s: Floats
    half: Floats
    stop: Bools
    turn: Floats

    def zones(self) -> Floats:
        """(n, 2) from where to where the path is neither of its segments."""
        return np.stack((self.s - self.half, self.s + self.half), axis=1)[~self.stop]

    def at(self, members: Members, s: Floats) -> Floats:
        """(N, 6) tip and scaled axis of the path at s (N,)."""
        segment = np.clip(np.searchsorted(self.s, s, side="right"), 0, len(self.s))
        values = members.at(segment, s)
        if not len(self.s):
            return values
        joint = np.clip(np.where(segment == 0, 0, segment - 1), 0, len(self.s) - 1)
        behind = np.minimum(segment, len(self.s) - 1)
        joint = np.where(np.abs(s - self.s[behind]) < np.abs(s - self.s[joint]), behind, joint)
        where = np.flatnonzero(np.abs(s - self.s[joint]) < self.half[joint])
        if len(where):
            values[where] = self._blended(members, joint[where], s[where])
        return values

    def _blended(self, members: Members, joint: Ints, s: Floats) -> Floats:
        half, middle = self.half[joint], self.s[joint]
        there = middle + half * ramp((s - middle) / half)
        return np.asarray(members.at(joint, s) + members.at(joint + 1, there) - members.at(joint, there))


def chosen(members: Members, turn: Floats, tolerance: float, adjacent_splines: float,
           sharpest: float) -> SegmentBlends:
    """Blends as long as room and tolerance allow.

    Args:
        turn (G - 1,): rad by which the direction changes at the joints
        tolerance: mm (tip, and scaled axis) for joints of lines and arcs
        adjacent_splines: the same where one of the two is a spline
        sharpest: rad; the motion stops where it turns by more
    """
    s, size, reach = members.s[1:-1], np.diff(members.s), members.reach()
    stop = turn > sharpest
    half = np.minimum(np.minimum(ROOM * size[:-1], ROOM * size[1:]), reach[:-1])
    allowed = FILL * np.where(members.spline[:-1] | members.spline[1:], adjacent_splines, tolerance)
    half[stop] = 0.0
    joint = np.flatnonzero(~stop)
    for _ in range(_ROUNDS):
        if not len(joint):
            break
        off = _off(members, joint, s[joint], half[joint])
        wide = off > allowed[joint]
        joint, off = joint[wide], off[wide]
        half[joint] *= np.maximum(0.999 * allowed[joint] / off, 0.5)
    return SegmentBlends(s, half, stop, turn)


def _off(members: Members, joint: Ints, s: Floats, half: Floats) -> Floats:
    """(n,) deviation of tip or scaled axis from the two segments, mm, at some places of the rounding."""
    worst = np.zeros(len(s))
    for part in (0.25, 0.5, 0.75, 1.0):
        there = s + part * HIGHEST * half
        gap = members.at(joint + 1, there) - members.at(joint, there)
        worst = np.maximum(worst, np.maximum(np.linalg.norm(gap[:, :3], axis=1), np.linalg.norm(gap[:, 3:], axis=1)))
    return worst
