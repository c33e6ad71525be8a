"""Where a platform stands that moves along or about some directions only as others take it: parasitic motions.

Legs on hinges or a passive leg leave a platform 3 or 5 freedoms; its place C and turn R have six. The others are equations
(`holds.py`), solved together with what the tool asks for: its axis is square to two directions that are square to what is
asked, and a point of the platform lies at its target across the carriers.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.legs.loops import Loops, PlatformPose, turned
from machines.kinematics.sliders import solved
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths, unit
from toolpaths.shapes import arrays

STEPS, CLOSED = 24, 1e-11
"""of Newton; mm that the equations may miss 0 by before its last step"""
PARTS = 8
"""of the path from the middle of the workspace, where one Newton does not close"""


@dataclass(frozen=True, eq=False)
@arrays(target="N 3", arm="3", axis="N 3", across="E 3")
class PosesAsked:
    """What N poses are to be.

    Attributes:
        target: (N, 3) mm, of the point `arm`
        arm: (3,) mm from the reference point, in directions of the platform
        axis: (N, 3) unit vectors of z of the platform; None where its turn follows from its place
        across: (E, 3) unit vectors along which the point is to lie there; the others are the carriers'
    """

    target: Floats
    arm: Floats
    axis: Floats | None
    across: Floats

    def part(self, rows: Ints) -> PosesAsked:
        """Some of them."""
        return PosesAsked(self.target[rows], self.arm, None if self.axis is None else self.axis[rows], self.across)

    def between(self, share: float, start: PlatformPose) -> PosesAsked:
        """Those a `share` of the path from poses `start`."""
        place, turn = start
        at = place + turn @ self.arm
        axis = None if self.axis is None else unit(turn[:, :, 2] + share * (self.axis - turn[:, :, 2]))
        return PosesAsked(at + share * (self.target - at), self.arm, axis, self.across)


def standing(loops: Loops, asked: PosesAsked, start: PlatformPose, middle: PlatformPose) -> tuple[Floats, Floats, Bools]:
    """(C (N, 3), R (N, 3, 3), closed (N,)) by Newton from poses `start`, else by steps from the pose `middle` (1, ...)."""
    place, turn, closed = _newton(loops, asked, *start)
    far = np.flatnonzero(~closed & np.isfinite(asked.target).all(axis=1))
    if len(far):
        some = asked.part(far)
        from_there = np.tile(middle[0], (len(far), 1)), np.tile(middle[1], (len(far), 1, 1))
        p, r, good = *from_there, np.ones(len(far), dtype=np.bool_)
        for share in np.linspace(0.0, 1.0, PARTS + 1)[1:]:
            p, r, good = _newton(loops, some.between(float(share), from_there), p, r)
        place[far], turn[far], closed[far] = p, r, good
    return place, turn, closed


def _newton(loops: Loops, asked: PosesAsked, place: Floats, turn: Floats) -> tuple[Floats, Floats, Bools]:
    place, turn, closed = place.copy(), turn.copy(), np.zeros(len(place), dtype=np.bool_)
    live = np.flatnonzero(np.isfinite(np.hstack([place, turn.reshape(-1, 9), asked.target])).all(axis=1))
    for _ in range(STEPS):
        if not len(live):
            break
        gap, rows = _equations(loops, asked.part(live), place[live], turn[live])
        step = solved(rows, -gap)
        step[:, 3:] /= loops.lever
        place[live] += step[:, :3]
        turn[live] = turned(step[:, 3:]) @ turn[live]
        done = (np.abs(gap) < CLOSED * max(1.0, loops.weight / 1000.0)).all(axis=1)
        closed[live[done]] = True
        live = live[~done & np.isfinite(step).all(axis=1)]
    return place, turn, closed & np.isfinite(place).all(axis=1)


def _equations(loops: Loops, asked: PosesAsked, place: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """(mm that they miss 0 by (N, 6), their rows (N, 6, 6) with turns by the lever)."""
    assert loops.holds is not None
    n, (arm, lever) = len(place), (turn @ asked.arm, loops.lever)
    at = np.broadcast_to(asked.across, (n, *asked.across.shape))
    gaps = [loops.holds.gaps(place, turn), dot(at, (place + arm - asked.target)[:, None])]
    rows = [loops.holds.rows(place, turn, lever),
            np.concatenate([at, cross(np.broadcast_to(arm[:, None], at.shape), at) / lever], axis=2)]
    if asked.axis is not None:
        z = turn[:, :, 2]
        square = np.stack(_square_to(asked.axis), axis=1)
        gaps.append(lever * dot(square, z[:, None]))
        about = cross(np.broadcast_to(z[:, None], square.shape), square)
        rows.append(np.concatenate([0.0 * about, about], axis=2))
    return np.hstack(gaps), np.concatenate(rows, axis=1)


def _square_to(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (N, 3) square to unit `axis` (N, 3) and to each other."""
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    first = cross(axis, least)
    first = first / lengths(first)[:, None]
    return first, cross(axis, first)


def across_of(carriers: Floats) -> Floats:
    """(3 - M, 3): unit vectors square to the carriers (M, 3)."""
    if not len(carriers):
        return np.eye(3)
    return np.asarray(np.linalg.svd(carriers)[2][len(carriers):], dtype=np.float64)
