"""Inverse dynamics of a chain of axes: recursive Newton-Euler from the bed outwards, on the part's side and on the tool's.

Screws and motions are (omega, v) with v at the machine's origin, in the frame of the bed. With V of the axes nearer the
bed, S the screw of an axis: V' = sum of S q'' + (V x S) q'; a point r of a body has the acceleration v' + omega' x r +
omega x (v + omega x r). The motor of an axis carries the component along its screw of all forces beyond it. The axes
between part and bed move bodies against the senses in which they move the tool. Source: Featherstone, Rigid
RigidBody Dynamics Algorithms (2008), chapter 5; the same forces by a Jacobian: Company 2000, II-28.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from machines.dynamics.bodies import GRAVITY, Drives, Dynamics, RigidBody
from machines.kinematics.chain import Joint
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, rotation
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
class AxisBody:
    """One axis of a side, from the bed outwards: its joint, index in q, sense, and the bodies that it moves."""

    joint: Joint
    at: int
    sense: float
    bodies: tuple[RigidBody, ...]


@dataclass(frozen=True, eq=False)
@arrays(turn="N 3 3", shift="N 3", omega="N 3", v="N 3", alpha="N 3", a="N 3")
class MovingFrame:
    """What carries a side: its frame, its motion as that of the point at the machine's origin, gravity as -a."""

    turn: Floats
    shift: Floats
    omega: Floats
    v: Floats
    alpha: Floats
    a: Floats

    @classmethod
    def bed(cls, count: int, gravity: Floats) -> Self:
        """The bed, under `gravity` (3,)."""
        zero = np.zeros((count, 3))
        return cls(np.tile(np.eye(3), (count, 1, 1)), zero, zero, zero, zero, np.tile(-gravity, (count, 1)))


@dataclass(frozen=True, eq=False)
@arrays(down="3")
class ChainDynamics(Dynamics):
    """Sides of a machine, each a chain from the bed outwards.

    Attributes:
        sides: axes of each
        drives: the motors
        down: (3,) direction of gravity
    """

    sides: tuple[tuple[AxisBody, ...], ...]
    drives: Drives
    down: Floats

    def forces(self, q: Floats, rate: Floats, acceleration: Floats, gravity: float = GRAVITY) -> Floats:
        """See the base class."""
        drives = self.drives
        result = np.asarray(drives.rotor * acceleration - (drives.balance if gravity else 0.0), dtype=np.float64)
        bed = MovingFrame.bed(len(q), gravity * self.down)
        for side in self.sides:
            for axis, force in zip(side, side_forces(side, q, rate, acceleration, bed)[0], strict=True):
                result[:, axis.at] += force
        return result


def side_forces(side: Sequence[AxisBody], q: Floats, rate: Floats, acceleration: Floats,
                bed: MovingFrame) -> tuple[list[Floats], Floats, Floats]:
    """(N,) of each axis of a side, from the bed outwards; moment about the machine's origin and force (N, 3) on the bed."""
    n = len(q)
    turn, shift, omega, v, alpha, a = bed.turn, bed.shift, bed.omega, bed.v, bed.alpha, bed.a
    screws, loads = [], []
    for axis in side:
        at, step = q[:, axis.at] * axis.sense, (rate[:, axis.at, None], acceleration[:, axis.at, None])
        u = axis.sense * (turn @ axis.joint.direction)
        if axis.joint.rotary:
            s, t = u, cross(turn @ axis.joint.point + shift, u)
        else:
            s, t = np.zeros((n, 3)), u
        alpha = alpha + s * step[1] + cross(omega, s) * step[0]
        a = a + t * step[1] + (cross(omega, t) + cross(v, s)) * step[0]
        omega, v = omega + s * step[0], v + t * step[0]
        turn, shift = _moved(axis.joint, at, turn, shift)
        screws.append((s, t))
        loads.append(loads_of(axis.bodies, MovingFrame(turn, shift, omega, v, alpha, a)))
    moment, force = np.zeros((n, 3)), np.zeros((n, 3))
    found = []
    for (s, t), load in zip(reversed(screws), reversed(loads), strict=True):
        moment, force = moment + load[0], force + load[1]
        found.append(dot(s, moment) + dot(t, force))
    return found[::-1], moment, force


def _moved(joint: Joint, at: Floats, turn: Floats, shift: Floats) -> tuple[Floats, Floats]:
    """The frame (R (N, 3, 3), p (N, 3)) carried by a joint at values (N,)."""
    if not joint.rotary:
        return turn, shift + at[:, None] * (turn @ joint.direction)
    own = rotation(joint.direction, at)
    return np.asarray(turn @ own), shift + np.einsum("nij,nj->ni", turn, joint.point - own @ joint.point)


def loads_of(bodies: Sequence[RigidBody], frame: MovingFrame) -> tuple[Floats, Floats]:
    """(moment about the origin, force), each (N, 3), that bodies take that move with a frame."""
    moment, force = np.zeros_like(frame.v), np.zeros_like(frame.v)
    for body in bodies:
        centre = frame.turn @ body.centre + frame.shift
        spin = cross(frame.omega, frame.v + cross(frame.omega, centre))
        f = body.mass * (frame.a + cross(frame.alpha, centre) + spin)
        force, moment = force + f, moment + cross(centre, f) + spun(body.inertia, frame.turn, frame.omega, frame.alpha)
    return moment, force


def spun(inertia: Floats, turn: Floats, omega: Floats, alpha: Floats) -> Floats:
    """(N, 3) I alpha + omega x I omega of moments of inertia (3,) in a frame turned by (N, 3, 3)."""
    if not np.any(inertia):
        return np.zeros_like(omega)
    whole = np.einsum("nij,j,nkj->nik", turn, inertia, turn)
    spinning = np.einsum("nij,nj->ni", whole, omega)
    return np.asarray(np.einsum("nij,nj->ni", whole, alpha) + cross(omega, spinning), dtype=np.float64)
