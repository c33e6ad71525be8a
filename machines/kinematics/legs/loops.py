"""The closed loops of a platform on legs: place and turn of the platform against the joints of its drives.

The platform's reference point is C, its turn R; the joint of leg k is B = C + R b, on a bar that is hinged to the platform
and keeps its direction C + R b + k. With r = B - A the loops are r.r = l^2, and a platform that moves by (v, omega) moves
them by r.v + (R b x r).omega: the rows of Jx (II-12 to II-18, V-18, V-23 of Company 2000). Only the freedoms that the
machine has are solved for, all others are held.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np

from machines.kinematics.legs.drives import Drives
from machines.kinematics.sliders import determinant, solved, three_spheres, two_circles, unsolvable
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import cross, dot, lengths
from toolpaths.shapes import arrays

STEPS, CLOSED = 30, 1e-13
"""of Newton; closure relative to the square of a rod's length, before its last step"""
PlatformTurns = Literal["", "a", "b", "c", "abc"]
FREEDOMS = ("x", "y", "z", "a", "b", "c")
"""translations along x, y, z and turns about them"""


@dataclass(frozen=True, eq=False)
@arrays(joints="K 3", kept="K 3")
class Loops:
    """K legs under a platform of K freedoms.

    Attributes:
        joints: (K, 3) mm, b: joints of the legs, or hinges of bars that hold them, which turn with the platform
        freedoms: of FREEDOMS, in that order; one turn, or all three
        kept: (K, 3) mm from the hinge of a bar, which keeps its direction, to the joint of its leg (V-10: the sides of the
            symmetric H4's platform), 0 of joints on the platform itself; None without bars
        bars: the number of the bar that each leg holds, -1 of none; () without bars
    """

    drives: Drives
    joints: Floats
    freedoms: tuple[str, ...]
    kept: Floats | None = None
    bars: tuple[int, ...] = ()

    @cached_property
    def basis(self) -> Floats:
        """(6, K): the freedoms as columns."""
        return np.eye(6)[:, [FREEDOMS.index(name) for name in self.freedoms]]

    @property
    def turns(self) -> PlatformTurns:
        """The turns among the freedoms."""
        return cast(PlatformTurns, "".join(name for name in self.freedoms if name in "abc"))

    @cached_property
    def lever(self) -> float:
        """mm per rad that makes turns lengths: the longest b."""
        return max(float(lengths(self.joints).max(initial=0.0)), 1.0)

    def arms(self, turn: Floats) -> Floats:
        """R b (N, K, 3) mm of turns (N, 3, 3)."""
        if not self.turns:
            return np.broadcast_to(self.joints, (len(turn), *self.joints.shape))
        return np.asarray(self.joints @ np.swapaxes(turn, 1, 2), dtype=np.float64)

    def ends(self, place: Floats, turn: Floats) -> Floats:
        """B (N, K, 3) mm."""
        return self._ends(place, self.arms(turn))

    def _ends(self, place: Floats, arms: Floats) -> Floats:
        ends = place[:, None, :] + arms
        return np.asarray(ends if self.kept is None else ends + self.kept, dtype=np.float64)

    def matrix(self, rods: Floats, arms: Floats) -> Floats:
        """Jx (N, K, K) mm: rows (r, R b x r / lever) of the freedoms."""
        rows = np.concatenate([rods, cross(arms, rods) / self.lever], axis=2) if self.turns else rods
        return np.asarray(rows[:, :, self._columns], dtype=np.float64)

    @cached_property
    def _columns(self) -> list[int]:
        return [FREEDOMS.index(name) for name in self.freedoms]

    def matrix_at(self, place: Floats, turn: Floats, q: Floats) -> tuple[Floats, Floats]:
        """(Jx (N, K, K), rods (N, K, 3)) mm, of joints q (N, K) of the drives."""
        arms = self.arms(turn)
        rods = self._ends(place, arms) - self.drives.feet(q)
        return self.matrix(rods, arms), np.asarray(rods, dtype=np.float64)

    def twists(self, x: Floats) -> Floats:
        """(v, omega) (N, 6, ...) of solutions (N, K, ...) of Jx."""
        result = np.zeros((len(x), 6, *x.shape[2:]))
        result[:, self._columns] = x
        result[:, 3:] /= self.lever
        return result

    def rates(self, place: Floats, turn: Floats, q: Floats) -> Floats:
        """(v, omega) of the platform per joint rate (N, 6, K), II-17; NaN where Jx is exactly singular."""
        jx, rods = self.matrix_at(place, turn, q)
        bad = unsolvable(jx)
        inverse = np.linalg.inv(np.where(bad[:, None, None], np.eye(jx.shape[1]), jx))
        x = np.where(bad[:, None, None], np.nan, inverse * self.drives.gains(rods, q)[:, None, :])
        return self.twists(np.asarray(x))

    def newton(self, q: Floats, place: Floats, turn: Floats) -> tuple[Floats, Floats, Bools]:
        """(place (N, 3), turn (N, 3, 3), closed (N,)) of joints q (N, K) from a pose near it."""
        place, turn, closed = place.copy(), turn.copy(), np.zeros(len(q), dtype=np.bool_)
        live = np.flatnonzero(np.isfinite(np.hstack([q, place, turn.reshape(-1, 9)])).all(axis=1))
        for _ in range(STEPS):
            if not len(live):
                break
            jx, rods = self.matrix_at(place[live], turn[live], q[live])
            square = self.drives.spans(q[live]) ** 2
            gap = 0.5 * (dot(rods, rods) - square)
            step = self.twists(solved(jx, -gap))
            place[live] += step[:, :3]
            if self.turns:
                turn[live] = turned(step[:, 3:]) @ turn[live]
            done = (np.abs(gap) < CLOSED * square).all(axis=1)
            closed[live[done]] = True
            live = live[~done & np.isfinite(step).all(axis=1)]
        return place, turn, closed & np.isfinite(place).all(axis=1)

    @property
    def closed_form(self) -> bool:
        """True of a platform that does not turn: its joints lie on spheres about the feet, moved by -b."""
        return not self.turns

    def places(self, q: Floats) -> tuple[Floats, Floats]:
        """(foot, out), each (N, 3) mm, of joints q (N, K) of a platform that does not turn: it stands at foot + out, where
        det Jx > 0, or at foot - out; of three slides along z III-11 of Company 2000 as corrected. NaN where the legs do not
        meet."""
        centres, radii = self.drives.feet(q) - self.joints, self.drives.spans(q)
        centres = centres if self.kept is None else centres - self.kept
        return three_spheres(centres, radii) if len(self.freedoms) == 3 else two_circles(centres, radii)

    def side(self, place: Floats, turn: Floats, q: Floats) -> Floats:
        """(N,) det Jx, whose sign cannot change inside an assembly mode."""
        return determinant(self.matrix_at(place, turn, q)[0])


def turned(by: Floats) -> Floats:
    """(N, 3, 3) turns by rotation vectors (N, 3) (Rodrigues)."""
    angle = lengths(by)
    safe = np.where(angle > 0.0, angle, 1.0)
    x, y, z = (by / safe[:, None]).T
    zero = np.zeros(len(by))
    over = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    s, c = np.sin(angle)[:, None, None], 2.0 * np.sin(0.5 * angle)[:, None, None] ** 2
    return np.asarray(np.eye(3) + s * over + c * (over @ over), dtype=np.float64)
