"""Boxes of poses: place of the tip or of the platform's reference point, tilt and its direction, and what a leg ends at.

A pose is (x, y, z, tilt, heading): mm, rad. The turn is the least one that takes z to the tool axis (spin 0), as the
machine's inverse takes it; of a platform that turns about z alone `tilt` is that turn. With d from the point asked for to
the reference point, platform level, that stands at C = p + R d; of a platform that does not turn slides that carry it take
the part of p that it cannot move by itself, and where they are redundant poses are those seen from the carriers. Joints on
a bar, which keeps its direction, are at C + R b + k. Of a platform of which something follows C and R are those of
`following.py`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.certificate.following import FollowingMotion, following
from machines.certificate.spans import Span, dotted, joined, spanned
from machines.certificate.turns import applied, least_turns
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
        """(R (N, 3, 3), its derivatives by tilt and heading (N, 2, 3, 3)) of poses (N, 5), nothing following."""
        return least_turns(self.legs.turns, pose)

    @cached_property
    def follows(self) -> FollowingMotion | None:
        """What follows from the pose, of a platform that something holds besides its legs."""
        return None if self.legs.holds is None else FollowingMotion(self.legs, self.from_point)

    def carriers(self, pose: Span) -> Span | None:
        """(N, M) travel of the carriers, of a platform of which something follows; of others it is linear (`split`)."""
        return None if self.follows is None else following(self.follows, pose).carried

    def ends(self, pose: Span) -> tuple[Span, Span, Span, Span]:
        """(B (N, K, 3), dB (N, 5, K, 3), arms R b (N, K, 3), their derivatives (N, 5, K, 3)), mm, of poses (N, 5)."""
        end, by, arms, arms_by = self.carried(pose, self.legs.joints)
        if self.legs.rings is not None:
            return self._on_rings(pose, end, by, (arms, arms_by))
        return (end if self.legs.kept is None else end + self.legs.kept), by, arms, arms_by

    def carried(self, pose: Span, points: Floats) -> tuple[Span, Span, Span, Span]:
        """The same of any points (K, 3) of the platform, from its reference point as it stands level."""
        n, count = len(pose.lo), len(points)
        if self.follows is not None:
            there = following(self.follows, pose)
            arms, arms_by = applied(there.turn, points), applied(there.turn_by, points)
            return there.place[:, None] + arms, there.place_by[:, :, None] + arms_by, arms, arms_by
        place = pose[:, :3].by(self.split[0])
        linear = spanned(np.broadcast_to(self.split[0].T[None, :, None, :], (n, 3, count, 3)))
        if not self.legs.turns:
            arms = spanned(np.broadcast_to(points, (n, count, 3)))
            shift = self.split[0] @ self.from_point
            none = spanned(np.zeros((n, 5, count, 3)))
            return place[:, None, :] + (arms + shift), joined([linear, spanned(np.zeros((n, 2, count, 3)))], 1), arms, none
        turn, by = self.turn(pose)
        arms, changes = applied(turn, points), applied(by, points)
        whole = points + self.from_point
        far, far_changes = applied(turn, whole), applied(by, whole)
        still = spanned(np.zeros((n, 3, count, 3)))
        return place[:, None, :] + far, joined([linear, far_changes], 1), arms, joined([still, changes], 1)

    def _on_rings(self, pose: Span, end: Span, by: Span, arms: tuple[Span, Span]) -> tuple[Span, Span, Span, Span]:
        """What `ends` gives of legs that end on rings about z of the platform, round ends (N, K, 3), where these are nearest
        to the feet: by d, from the end to the foot, the part a of it across z, and a / |a|."""
        _, _, z, z_by = self.carried(pose, np.tile([0.0, 0.0, 1.0], (len(self.legs.names), 1)))
        rings = self.legs.rings
        assert rings is not None
        apart = -(end - self.legs.points)
        high, high_by = dotted(apart, z), dotted(apart[:, None], z_by) - dotted(by, z[:, None])
        aside = apart - high[..., None] * z
        aside_by = -by - high_by[..., None] * z[:, None] - high[:, None, :, None] * z_by
        far = aside.square().sum(-1).root()
        out = aside.over(far[..., None])
        out_by = (aside_by - dotted(out[:, None], aside_by)[..., None] * out[:, None]).over(far[:, None, :, None])
        shift, shift_by = out * rings[:, None], out_by * rings[:, None]
        return end + shift, by + shift_by, arms[0] + shift, arms[1] + shift_by
