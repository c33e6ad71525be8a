"""The closed loops of a platform on legs: place and turn of the platform against the joints of its drives.

The platform's reference point is C, its turn R; the joint of leg k is B = C + R b, on a bar that is hinged to the platform
and keeps its direction C + R b + k. With r = B - A the loops are r.r = l^2, and a platform that moves by (v, omega) moves
them by r.v + (R b x r).omega: the rows of Jx (II-12 to II-18, V-18, V-23 of Company 2000). Only the freedoms that the
machine has are solved for, all others are held. Of a platform with `holds` all six are solved for, legs and holds together:
its drives set `free` of them, the others follow. A leg on a ring ends where the ring, about z of the platform, is nearest.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, cast

import numpy as np

from machines.kinematics.holds import Holds
from machines.kinematics.legs.drives import Drives
from machines.kinematics.sliders import determinant, solved, three_spheres, two_circles, unsolvable
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths, unit
from toolpaths.shapes import arrays

STEPS, CLOSED = 30, 1e-13
"""of Newton; closure relative to the square of a rod's length, before its last step"""
PlatformTurns = Literal["", "a", "b", "c", "abc"]
PlatformPose = tuple[Floats, Floats]
"""C (N, 3) mm and R (N, 3, 3)"""
FREEDOMS = ("x", "y", "z", "a", "b", "c")
"""translations along x, y, z and turns about them"""


@dataclass(frozen=True, eq=False)
@arrays(joints="K 3", kept="K 3", rings="K")
class Loops:
    """K legs under a platform of K freedoms, or of 6 with 6 - K holds.

    Attributes:
        joints: (K, 3) mm, b: joints of the legs, or hinges of bars that hold them, which turn with the platform
        freedoms: of FREEDOMS, in that order; one turn, or all three
        kept: (K, 3) mm from the hinge of a bar, which keeps its direction, to the joint of its leg (V-10: the sides of the
            symmetric H4's platform), 0 of joints on the platform itself; None without bars
        holds: what holds the platform besides its legs
        free: freedoms that the drives set by themselves where others follow; () all
        rings: (K,) mm, radii about z of the platform, round its joints, on which legs of changing length end; 0 of others;
            None without any
        bars: the number of the bar that each leg holds, -1 of none; () without bars
        bar_names, passive: names of bars and of passive legs
        hinged: legs that swing about hinges; in `holds` they stand behind the passive legs
    """

    drives: Drives
    joints: Floats
    freedoms: tuple[str, ...]
    kept: Floats | None = None
    holds: Holds | None = None
    free: tuple[str, ...] = ()
    rings: Floats | None = None
    bars: tuple[int, ...] = ()
    bar_names: tuple[str, ...] = ()
    passive: tuple[str, ...] = ()
    hinged: tuple[int, ...] = ()

    @cached_property
    def basis(self) -> Floats:
        """(6, K): the freedoms as columns."""
        return np.eye(6)[:, [FREEDOMS.index(name) for name in self.freedoms]]

    @cached_property
    def translations(self) -> Floats:
        """(3, F): the directions x, y, z in which the drives move the platform by themselves."""
        return np.eye(3)[:, ["xyz".index(name) for name in self.free or self.freedoms if name in "xyz"]]

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
        return self._ends(place, self.arms_at(place, turn))

    def _ends(self, place: Floats, arms: Floats) -> Floats:
        ends = place[:, None, :] + arms
        return np.asarray(ends if self.kept is None else ends + self.kept, dtype=np.float64)

    def arms_at(self, place: Floats, turn: Floats) -> Floats:
        """`arms`, of legs on rings to the point of the ring that is nearest to the foot."""
        arms = self.arms(turn)
        if self.rings is None:
            return arms
        axis = np.broadcast_to(turn[:, None, :, 2], arms.shape)
        apart = self.drives.points - place[:, None] - arms
        aside = apart - dot(apart, axis)[:, :, None] * axis
        return np.asarray(arms + self.rings[:, None] * unit(aside, 0.0), dtype=np.float64)

    def matrix(self, rods: Floats, arms: Floats, pose: PlatformPose) -> Floats:
        """Jx (N, K, K) mm: rows (r, R b x r / lever) of the freedoms; (N, 6, 6) with those of the holds times `weight`."""
        rows = np.concatenate([rods, cross(arms, rods) / self.lever], axis=2) if self.turns else rods
        if self.holds is not None:
            rows = np.concatenate([rows, self.weight * self.holds.rows(*pose, self.lever)], axis=1)
        return np.asarray(rows[:, :, self._columns], dtype=np.float64)

    @cached_property
    def weight(self) -> float:
        """mm, about the length of a rod: rows of holds times it are as large as those of rods."""
        return max(float(self.drives.lengths.mean()), self.lever)

    def sizes(self, q: Floats) -> Floats:
        """(N, K or 6) mm: lengths of the rows of Jx, which free it of units."""
        spans = self.drives.spans(q)
        return spans if self.holds is None else np.hstack([spans, np.full((len(q), self.holds.count), self.weight)])

    def driven(self, right: Floats, held: Floats | None = None) -> Floats:
        """(N, K or 6): the right side (N, K) of the legs with that of the holds (N, H) mm, default 0, times `weight`."""
        if self.holds is None:
            return right
        return np.hstack([right, np.zeros((len(right), self.holds.count)) if held is None else self.weight * held])

    def held_gaps(self, place: Floats, turn: Floats, q: Floats) -> Floats:
        """(N, H) mm that what holds the platform misses, of joints q (N, K) of the drives."""
        assert self.holds is not None
        gaps = self.holds.gaps(place, turn)
        return gaps if (self.holds.foot < 0).all() else gaps - self.holds.at_feet(self.drives.feet(q))

    def of_drives(self, jx: Floats) -> Floats:
        """(N, K, K): Jx (N, 6, 6) of the freedoms that the drives set, with what follows as it follows; of others itself."""
        if self.holds is None:
            return jx
        own = [name in self.free for name in self.freedoms]
        rest = [not name for name in own]
        k = len(self.joints)
        follow = np.linalg.solve(jx[:, k:][:, :, rest], jx[:, k:][:, :, own])
        return np.asarray(jx[:, :k][:, :, own] - jx[:, :k][:, :, rest] @ follow, dtype=np.float64)

    @cached_property
    def _columns(self) -> list[int]:
        return [FREEDOMS.index(name) for name in self.freedoms]

    def matrix_at(self, place: Floats, turn: Floats, q: Floats) -> tuple[Floats, Floats]:
        """(Jx (N, K, K), rods (N, K, 3)) mm, of joints q (N, K) of the drives; see `matrix`."""
        arms = self.arms_at(place, turn)
        rods = self._ends(place, arms) - self.drives.feet(q)
        return self.matrix(rods, arms, (place, turn)), np.asarray(rods, dtype=np.float64)

    def twists(self, x: Floats) -> Floats:
        """(v, omega) (N, 6, ...) of solutions (N, K or 6, ...) of Jx."""
        result = np.zeros((len(x), 6, *x.shape[2:]))
        result[:, self._columns] = x
        result[:, 3:] /= self.lever
        return result

    def rates(self, place: Floats, turn: Floats, q: Floats) -> Floats:
        """(v, omega) of the platform per joint rate (N, 6, K), II-17; NaN where Jx is exactly singular."""
        jx, rods = self.matrix_at(place, turn, q)
        bad = unsolvable(jx)
        inverse = np.linalg.inv(np.where(bad[:, None, None], np.eye(jx.shape[1]), jx))[:, :, :len(self.joints)]
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
            if self.holds is not None:
                gap = self.driven(gap, self.held_gaps(place[live], turn[live], q[live]))
                square = self.sizes(q[live]) ** 2
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
