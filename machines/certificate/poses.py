"""Boxes of poses: place of the tip or of the platform's reference point, tilt and its direction, and what a leg ends at.

A pose is (x, y, z, tilt, heading): mm, rad. The turn is the least one that takes z to the tool axis (spin 0), as the
machine's inverse takes it; of a platform that turns about z alone `tilt` is that turn. With d from the point asked for to
the reference point, platform level, that stands at C = p + R d; of a platform that does not turn slides that carry it take
the part of p that it cannot move by itself, and where they are redundant poses are those seen from the carriers. Joints on
a bar, which keeps its direction, are at C + R b + k.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.certificate.spans import Span, joined, spanned, stacked, turned_by
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(from_point="3")
class PosesOfBoxes:
    """How platform joints depend on the five numbers of a pose.

    Attributes:
        from_point: d (3,) mm
    """

    legs: LegGeometry
    from_point: Floats

    @cached_property
    def moves(self) -> Floats:
        """(3, F): translations of the platform, then the carriers."""
        linear = np.eye(3)[:, [letter in self.legs.freedoms for letter in "xyz"]]
        return np.column_stack([linear, self.legs.carriers.T])

    @cached_property
    def split(self) -> tuple[Floats, Floats]:
        """(3, 3) from a place to that of the reference point, (M, 3) to the travel of the carriers."""
        if self.legs.carried_twice:
            return np.eye(3), np.zeros((len(self.legs.carriers), 3))
        free = self.moves.shape[1] - len(self.legs.carriers)
        parts: Floats = np.asarray(np.linalg.pinv(self.moves), dtype=np.float64)
        return np.asarray(self.moves[:, :free] @ parts[:free]), parts[free:]

    def turn(self, pose: Span) -> tuple[Span, Span]:
        """(R (N, 3, 3), its derivatives by tilt and heading (N, 2, 3, 3)) of poses (N, 5)."""
        n = len(pose.lo)
        c, s = turned_by(pose[:, 3])
        if self.legs.turns == "c":
            return _about_z(c, s)
        heading = {"a": spanned(np.full(n, -0.5 * np.pi)), "b": spanned(np.zeros(n))}.get(self.legs.turns, pose[:, 4])
        ch, sh = turned_by(heading)
        none, left = spanned(np.zeros(n)), spanned(1.0) - c

        def of(a: Span, b: Span, fixed: float) -> Span:
            """fixed I + a K + b K^2, K = (0, 0, ch; 0, 0, sh; -ch, -sh, 0), which turns z towards the heading."""
            across = ch * sh * b
            return stacked([spanned(fixed) - ch.square() * b, -across, ch * a, -across, spanned(fixed) - sh.square() * b,
                            sh * a, -(ch * a), -(sh * a), spanned(fixed) - b], -1).reshape(n, 3, 3)

        double, flat = ch * sh * left * 2.0, (ch.square() - sh.square()) * left
        by_heading = stacked([double, -flat, -(sh * s), -flat, -double, ch * s, sh * s, -(ch * s), none], -1)
        return of(s, left, 1.0), stacked([of(c, s, 0.0), by_heading.reshape(n, 3, 3)], 1)

    def ends(self, pose: Span) -> tuple[Span, Span, Span, Span]:
        """(B (N, K, 3), dB (N, 5, K, 3), arms R b (N, K, 3), their derivatives (N, 5, K, 3)), mm, of poses (N, 5)."""
        end, by, arms, arms_by = self.carried(pose, self.legs.joints)
        return (end if self.legs.kept is None else end + self.legs.kept), by, arms, arms_by

    def carried(self, pose: Span, points: Floats) -> tuple[Span, Span, Span, Span]:
        """The same of any points (K, 3) of the platform, from its reference point as it stands level."""
        n, count = len(pose.lo), len(points)
        place = pose[:, :3].by(self.split[0])
        linear = spanned(np.broadcast_to(self.split[0].T[None, :, None, :], (n, 3, count, 3)))
        if not self.legs.turns:
            arms = spanned(np.broadcast_to(points, (n, count, 3)))
            shift = self.split[0] @ self.from_point
            none = spanned(np.zeros((n, 5, count, 3)))
            return place[:, None, :] + (arms + shift), joined([linear, spanned(np.zeros((n, 2, count, 3)))], 1), arms, none
        turn, by = self.turn(pose)
        arms, changes = _applied(turn, points), _applied(by, points)
        whole = points + self.from_point
        far, far_changes = _applied(turn, whole), _applied(by, whole)
        still = spanned(np.zeros((n, 3, count, 3)))
        return place[:, None, :] + far, joined([linear, far_changes], 1), arms, joined([still, changes], 1)


def _about_z(c: Span, s: Span) -> tuple[Span, Span]:
    """(R (N, 3, 3), its derivatives by tilt and heading (N, 2, 3, 3)) of turns about z with that cosine and sine (N,)."""
    n = len(c.lo)
    none, one = spanned(np.zeros(n)), spanned(np.ones(n))
    turn = stacked([c, -s, none, s, c, none, none, none, one], -1).reshape(n, 3, 3)
    by_turn = stacked([-s, -c, none, c, -s, none, none, none, none], -1).reshape(n, 3, 3)
    return turn, stacked([by_turn, by_turn * 0.0], 1)


def _applied(turn: Span, vectors: Floats) -> Span:
    """(..., K, 3): turns (..., 3, 3) of vectors (K, 3)."""
    return (turn[..., None, :, :] * vectors[:, None, :]).sum(-1)
