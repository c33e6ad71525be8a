"""Inverse dynamics of a platform on legs, by virtual work: every force times what its point moves per joint rate.

A slender even rod between A and B moves as two half masses at the two Gauss points of its line: their acceleration and what
they move are linear along it, so the work is exact (A'' and B'' with m/3 and m/6). Halves at the ends (m/2 and 0) are the
lumped masses of III-15 and III-16. Forces on B and on the platform reach the joints by the platform's rates (J^T of II-28),
forces on A by the drive's own A'. So F = M q'' + h(q, q') + g(q) of any drives and freedoms. Source: Company 2000, II-25 to
II-33 (II-31 and II-33 as its errata have them), III-13 to III-17.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np

from machines.dynamics.bodies import GRAVITY, AxisDrives, Dynamics, RigidBody
from machines.dynamics.chain import AxisBody, MovingFrame, loads_of, side_forces
from machines.kinematics.base import Kinematics
from machines.kinematics.leg_motion import LegMotion, LegParts
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, rotation
from toolpaths.shapes import arrays

GAUSS = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))
"""of a line's length: where two halves of a slender even rod have its mass, centre and moment of inertia"""


@dataclass(frozen=True, eq=False)
@arrays(mass="K", centres="K 3", inertia="K", rods="K", ends="K", length="K", carried="M", under_part="M")
class LegMasses:
    """Of K legs and M carriers, kg and mm.

    Attributes:
        mass: (K,) of carriages, arms, outer parts of legs of changing length
        centres: (K, 3) centres of mass of arms at q = 0
        inertia: (K,) kg mm2 of arms about their axes through their centres of mass
        rods: (K,) of all rods of a leg
        ends: (K,) at the platform's end of a leg
        length: (K,) mm of the parts of a leg of changing length
        carried: (M,) of the carriers' own bodies
        under_part: (M,) carriers that move the part
        lumped: halves of the rods at their ends (III-15, III-16) instead of their exact inertia
    """

    mass: Floats
    centres: Floats
    inertia: Floats
    rods: Floats
    ends: Floats
    length: Floats
    carried: Floats
    under_part: Bools
    lumped: bool = False


@dataclass(frozen=True, eq=False)
@arrays(down="3")
class LegDynamics(Dynamics):
    """A platform on legs, with carriers or with rotary axes; `drives` and `down` as of chains.

    Attributes:
        platform: bodies that move with the platform
        table: axes under the part, from the bed to it
        head: axes from the platform to the spindle
    """

    kinematics: Kinematics
    parts: LegParts
    masses: LegMasses
    platform: tuple[RigidBody, ...]
    drives: AxisDrives
    down: Floats
    table: tuple[AxisBody, ...] = field(default=())
    head: tuple[AxisBody, ...] = field(default=())

    def forces(self, q: Floats, rate: Floats, acceleration: Floats, gravity: float = GRAVITY) -> Floats:
        """See the base class."""
        load = self.loads(q, rate, acceleration, gravity)
        drives = self.drives
        result = np.asarray(drives.rotor * acceleration - (drives.balance if gravity else 0.0), dtype=np.float64)
        result[:, self.parts.legs_at] += load.drives + np.einsum("nik,ni->nk", load.motion.rates, load.wrench)
        if len(self.parts.carriers_at):
            own = self._carriers(acceleration, gravity, load.total)
            result[:, self.parts.carriers_at] += own
        bed = MovingFrame.bed(len(q), gravity * self.down)
        table = side_forces(self.table, q, rate, acceleration, bed)[0] if self.table else []
        for axis, force in zip((*self.table, *self.head), (*table, *load.head), strict=True):
            result[:, axis.at] += force
        return result

    def loads(self, q: Floats, rate: Floats, acceleration: Floats, gravity: float = GRAVITY) -> PlatformLoads:
        """What drives and platform have to carry in that motion."""
        motion = self.kinematics.leg_motion(q, rate, acceleration)
        base = np.tile(-gravity * self.down, (len(q), 1))
        legs = ~self.masses.under_part
        base = base + acceleration[:, self.parts.carriers_at[legs]] @ self.parts.carriers[legs]
        at_feet, at_ends = self._rods(motion, base[:, None])
        about_c = MovingFrame(motion.turn, np.zeros_like(base), motion.twist[:, 3:], np.zeros_like(base),
                              motion.acceleration[:, 3:], base + motion.acceleration[:, :3])
        m, f = loads_of(self.platform, about_c)
        head, beyond_m, beyond_f = side_forces(self.head, q, rate, acceleration, about_c)
        force = at_ends.sum(axis=1) + f + beyond_f
        moment = cross(motion.arms, at_ends).sum(axis=1) + m + beyond_m
        at_drives, drives = self._drives(motion, (q, rate, acceleration), base[:, None])
        return PlatformLoads(motion, dot(motion.moved, at_feet) + drives, np.concatenate([force, moment], axis=1),
                             force + at_feet.sum(axis=1) + at_drives, tuple(head))

    def _rods(self, motion: LegMotion, base: Floats) -> tuple[Floats, Floats]:
        """Forces of rods and joints on A and on B of each leg (N, K, 3)."""
        foot, end = motion.foot_accelerations + base, motion.end_accelerations + base
        masses, fixed = self.masses, ~self.parts.stretches
        at_feet, at_ends = np.zeros_like(foot), masses.ends[:, None] * end
        rods = np.where(fixed, masses.rods, 0.0)[:, None]
        if masses.lumped:
            at_feet, at_ends = 0.5 * rods * foot, at_ends + 0.5 * rods * end
        else:
            for share in GAUSS:
                f = 0.5 * rods * ((1.0 - share) * foot + share * end)
                at_feet, at_ends = at_feet + (1.0 - share) * f, at_ends + share * f
        if not fixed.all():
            tubes, pistons = (np.where(fixed, 0.0, m) for m in (masses.mass, masses.rods))
            for share in GAUSS:
                for mass, origin, offset in ((tubes, foot, share * masses.length), (pistons, end, -share * masses.length)):
                    on_foot, on_end = _along(motion, 0.5 * mass, origin, offset, origin is end)
                    at_feet, at_ends = at_feet + on_foot, at_ends + on_end
        return at_feet, at_ends

    def _drives(self, motion: LegMotion, joints: tuple[Floats, Floats, Floats], base: Floats) -> tuple[Floats, Floats]:
        """(force (N, 3) on what carries the legs, forces of the drives (N, K)) of carriages and arms themselves."""
        parts, own = self.parts, self.parts.legs_at
        q, rate, acceleration = (one[:, own] for one in joints)
        slide = ~(parts.arm | parts.stretches)
        f = np.where(slide, self.masses.mass, 0.0)[:, None] * (motion.foot_accelerations + base)
        drives = dot(motion.moved, f)
        for k in np.flatnonzero(parts.arm):
            w = rotation(parts.directions[k], q[:, k]) @ (self.masses.centres[k] - parts.points[k])
            w = w - (w @ parts.directions[k])[:, None] * parts.directions[k]
            moved = cross(np.broadcast_to(parts.directions[k], w.shape), w)
            f[:, k] = self.masses.mass[k] * (moved * acceleration[:, k, None] - w * rate[:, k, None] ** 2 + base[:, 0])
            drives[:, k] = dot(moved, f[:, k]) + self.masses.inertia[k] * acceleration[:, k]
        return f.sum(axis=1), drives

    def _carriers(self, acceleration: Floats, gravity: float, total: Floats) -> Floats:
        """(N, M): their own bodies, and of those under the legs all that they carry, carriers beyond them included."""
        parts, masses = self.parts, self.masses
        count = len(parts.carriers)
        found = np.zeros((len(acceleration), count))
        rates = acceleration[:, parts.carriers_at]
        for i in range(count):
            beyond = [j for j in range(i, count) if masses.under_part[j] == masses.under_part[i]]
            for j in beyond:  # a carrier moves with all before it
                moving = [k for k in range(j + 1) if masses.under_part[k] == masses.under_part[i]]
                sense = -1.0 if masses.under_part[i] else 1.0
                a = sense * rates[:, moving] @ parts.carriers[moving] - gravity * self.down
                found[:, i] += sense * masses.carried[j] * (a @ parts.carriers[i])
            found[:, i] += 0.0 if masses.under_part[i] else total @ parts.carriers[i]
        return found


@dataclass(frozen=True, eq=False)
@arrays(drives="N K", wrench="N 6", total="N 3", head="*N")
class PlatformLoads:
    """What a motion asks for.

    Attributes:
        motion: of legs and platform
        drives: (N, K) of the drives' own bodies and of the feet of the rods
        wrench: (N, 6) force and moment about C on the platform, ends of the rods included
        total: (N, 3) force on what carries it all
        head: (N,) torque of each axis between platform and spindle
    """

    motion: LegMotion
    drives: Floats
    wrench: Floats
    total: Floats
    head: tuple[Floats, ...]


def _along(motion: LegMotion, mass: Floats, origin: Floats, offset: Floats, from_end: bool) -> tuple[Floats, Floats]:
    """Forces on A and B (N, K, 3) of masses (K,) at a distance (K,) along the leg from A, or from B where `from_end`."""
    e, span = motion.along, motion.spans[:, :, None]
    apart = motion.end_rates - motion.foot_rates
    stretch, faster = motion.span_rates[:, :, None], motion.span_accelerations[:, :, None]
    turned = (apart - stretch * e) / span
    a = (motion.end_accelerations - motion.foot_accelerations - faster * e - 2.0 * stretch * turned) / span
    f = mass[:, None] * (origin + offset[:, None] * a)
    aside = (offset[:, None] / span) * (f - e * dot(f, e)[:, :, None])
    return (-aside, f + aside) if from_end else (f - aside, aside)

