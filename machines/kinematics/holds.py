"""What holds a platform besides its legs: hinges at their feet, and a passive leg that slides through a joint of the bed.

With C and R the platform's place and turn, two equations, bilinear in both, say all of it (mm):

    plane of the bed        n.(m (C - P) + R b) = 0     a leg on a hinge along n stays in the plane through its foot P
                                                        square to it, and so does its joint b (m = 1); m = 0: a direction
                                                        b of the platform stays square to n, as the two axes of a
                                                        universal joint do
    plane of the platform   (C - O).R u + k = 0         a point O of the bed stays in a plane of the platform square to u:
                                                        two of them hold a line of the platform in O

Differentiated with the twist (v, w) each is a row (e, a x e) as that of a rod along e at the arm a from C: e = n, a = R b
and e = R u, a = O - C (of m = 0 without its first part). Such a platform has as many freedoms less, and what it moves
besides, its parasitic motions, follows. Source: the same closure as that of rods; for the Tricept's leg Siciliano, The
Tricept robot: inverse kinematics, manipulability analysis and closed-loop direct kinematics algorithm, Robotica 17 (1999).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(normals="A 3", points="A 3", joints="A 3", moves="A", across="S 3", through="S 3", apart="S", lean="A", foot="A")
class Holds:
    """A planes of the bed and S planes of the platform.

    Attributes:
        normals: (A, 3) unit vectors n
        points: (A, 3) mm, P
        joints: (A, 3) mm, b in directions of the platform
        moves: (A,) m, 1 or 0
        across: (S, 3) unit vectors u in directions of the platform
        through: (S, 3) mm, O
        apart: (S,) mm, k
        lean: (A,) mm that the planes of the bed lie off, as errors leave them
        foot: (A,) the rod whose foot a plane of the bed goes through instead of P, -1 of none: with errors the foot may
            leave its nominal plane as it moves
    """

    normals: Floats
    points: Floats
    joints: Floats
    moves: Floats
    across: Floats
    through: Floats
    apart: Floats
    lean: Floats
    foot: Ints

    @property
    def count(self) -> int:
        """H = A + S"""
        return len(self.normals) + len(self.across)

    def gaps(self, place: Floats, turn: Floats) -> Floats:
        """(N, H) mm: what each equation misses 0 by."""
        e, arms = self.directions(place, turn)
        a = len(self.normals)
        first = self.moves * ((place[:, None] - self.points) * self.normals).sum(axis=2) + dot(arms[:, :a], e[:, :a])
        return np.hstack([first - self.lean, self.apart - dot(arms[:, a:], e[:, a:])])

    def at_feet(self, feet: Floats) -> Floats:
        """(N, H) mm that `gaps` are less by where planes go through the feet (N, R, 3) of rods."""
        result = np.zeros((len(feet), self.count))
        for k in np.flatnonzero(self.foot >= 0):
            result[:, k] = (feet[:, self.foot[k]] - self.points[k]) @ self.normals[k]
        return result

    def gains(self, moved: Floats) -> Floats:
        """(N, H, R) mm of each equation per mm or rad of a rod's drive, whose foot is `moved` (N, R, 3) by it."""
        result = np.zeros((len(moved), self.count, moved.shape[1]))
        for k in np.flatnonzero(self.foot >= 0):
            result[:, k, self.foot[k]] = moved[:, self.foot[k]] @ self.normals[k]
        return result

    def rows(self, place: Floats, turn: Floats, lever: float) -> Floats:
        """(N, H, 6): (e, a x e / lever)."""
        e, arms = self.directions(place, turn)
        return np.concatenate([self._moves[:, None] * e, cross(arms, e) / lever], axis=2)

    def bent(self, place: Floats, turn: Floats, twist: Floats) -> Floats:
        """(N, H) what the second derivative of each equation is at the twist (N, 6), mm and rad, without its own
        acceleration."""
        e, arms = self.directions(place, turn)
        a, v, w = len(self.normals), twist[:, None, :3], twist[:, None, 3:]
        inward = cross(w, cross(w, arms[:, :a]))
        swung = cross(w, e[:, a:])
        return np.hstack([dot(e[:, :a], inward), 2.0 * dot(np.broadcast_to(v, swung.shape), swung)
                          - dot(arms[:, a:], cross(w, swung))])

    def reach(self, place: Floats) -> Floats:
        """(N, H) mm: |a|."""
        n = len(place)
        return np.hstack([np.broadcast_to(lengths(self.joints), (n, len(self.joints))),
                          lengths(self.through - place[:, None])])

    def turn_rates(self, place: Floats, turn: Floats) -> Floats:
        """(N, 3, 3) rad about x, y, z per mm of C along them, of a platform whose three turns follow from its place."""
        rows = self.rows(place, turn, 1.0)
        return np.asarray(-np.linalg.solve(rows[:, :, 3:], rows[:, :, :3]), dtype=np.float64)

    @cached_property
    def travels(self) -> Floats:
        """(H,) 1 of planes of the platform, whose e turns with it and whose a changes as C moves; 0 of those of the bed."""
        return np.repeat([0.0, 1.0], [len(self.normals), len(self.across)])

    @cached_property
    def _moves(self) -> Floats:
        return np.concatenate([self.moves, np.ones(len(self.across))])

    def directions(self, place: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """(e, a), each (N, H, 3): unit vectors, mm."""
        n, back = len(place), np.swapaxes(turn, 1, 2)
        e = np.concatenate([np.broadcast_to(self.normals, (n, *self.normals.shape)), self.across @ back], axis=1)
        arms = np.concatenate([self.joints @ back, self.through - place[:, None]], axis=1)
        return e, arms


def hinges(normals: Floats, points: Floats, joints: Floats) -> Holds:
    """Legs (A, 3) that swing about hinges along unit `normals` through `points`, their platform joints at `joints`."""
    none = np.zeros((0, 3))
    return Holds(normals, points, joints, np.ones(len(normals)), none, none, np.zeros(0), *_exact(len(normals)))


def telescope(point: Floats, joint: Floats, line: Floats, hinge: Floats, arm: float) -> Holds:
    """A leg fixed to the platform along the unit `line` through `joint`, which slides through a universal joint at `point`
    of the bed whose outer axis is `hinge`, all (3,) with the platform level.

    Args:
        arm: mm by which turns about the line count as lengths
    """
    inner = np.cross(line, hinge)
    inner = inner / np.linalg.norm(inner)
    other = np.cross(line, inner)
    across = np.array([inner, other])
    return Holds(hinge[None], np.zeros((1, 3)), arm * inner[None], np.zeros(1), across, np.tile(point, (2, 1)),
                 across @ joint, *_exact(1))


def together(parts: list[Holds]) -> Holds:
    """All of them."""
    return Holds(*(np.concatenate([getattr(part, name) for part in parts]) for name in Holds.__dataclass_fields__))


def untwisted(arm: float) -> Holds:
    """What no leg on rings holds: x of the platform stays square to y, so that its turn is one about x, then one about y.

    It is the convention of pentakins (c = 0); a round tool does not notice it.
    """
    none = np.zeros((0, 3))
    return Holds(np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 3)), np.array([[arm, 0.0, 0.0]]), np.zeros(1), none, none,
                 np.zeros(0), *_exact(1))


def _exact(count: int) -> tuple[Floats, Ints]:
    """(lean, foot) of planes of the bed as the machine file has them."""
    return np.zeros(count), np.full(count, -1, dtype=np.int64)
