"""Inverse dynamics of a chain of axes: recursive Newton-Euler from the bed outwards, on the part's side and on the tool's.

Screws and motions are (omega, v) with v at the machine's origin, in the frame of the bed. With V of the axes nearer the
bed, S the screw of an axis: V' = sum of S q'' + (V x S) q'; a point r of a body has the acceleration v' + omega' x r +
omega x (v + omega x r). The motor of an axis carries the component along its screw of all forces beyond it. The axes
between part and bed move bodies against the senses in which they move the tool. Source: Featherstone, Rigid
RigidBody Dynamics Algorithms (2008), chapter 5; the same forces by a Jacobian: Company 2000, II-28.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.dynamics.bodies import GRAVITY, Dynamics, RigidBody
from machines.kinematics.chain import Joint
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, rotation
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
class AxisBody:
    """One axis of a side, from the bed outwards: its joint, index in q, sense, and the body that it moves."""

    joint: Joint
    at: int
    sense: float
    body: RigidBody


@dataclass(frozen=True, eq=False)
@arrays(rotor="J", balance="J", down="3")
class ChainDynamics(Dynamics):
    """Sides of a machine, each a chain from the bed outwards.

    Attributes:
        sides: axes of each
        rotor: (J,) inertia of motors, kg or kg mm2
        balance: (J,) of counterbalances, kg mm/s2 or kg mm2/s2
        down: (3,) direction of gravity
    """

    sides: tuple[tuple[AxisBody, ...], ...]
    rotor: Floats
    balance: Floats
    down: Floats

    def forces(self, q: Floats, rate: Floats, acceleration: Floats, gravity: float = GRAVITY) -> Floats:
        """See the base class."""
        result = np.asarray(self.rotor * acceleration - (self.balance if gravity else 0.0), dtype=np.float64)
        for side in self.sides:
            for axis, force in zip(side, side_forces(side, q, rate, acceleration, gravity * self.down), strict=True):
                result[:, axis.at] += force
        return result


def side_forces(side: Sequence[AxisBody], q: Floats, rate: Floats, acceleration: Floats, gravity: Floats) -> list[Floats]:
    """(N,) of each axis of a side, from the bed outwards."""
    n = len(q)
    turn, shift = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    omega, v, alpha, a = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.tile(-gravity, (n, 1))
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
        loads.append(_load(axis.body, turn, shift, (omega, v, alpha, a)))
    moment, force = np.zeros((n, 3)), np.zeros((n, 3))
    found = []
    for (s, t), load in zip(reversed(screws), reversed(loads), strict=True):
        moment, force = moment + load[0], force + load[1]
        found.append(dot(s, moment) + dot(t, force))
    return found[::-1]


def _moved(joint: Joint, at: Floats, turn: Floats, shift: Floats) -> tuple[Floats, Floats]:
    """The frame (R (N, 3, 3), p (N, 3)) carried by a joint at values (N,)."""
    if not joint.rotary:
        return turn, shift + at[:, None] * (turn @ joint.direction)
    own = rotation(joint.direction, at)
    return np.asarray(turn @ own), shift + np.einsum("nij,nj->ni", turn, joint.point - own @ joint.point)


def _load(body: RigidBody, turn: Floats, shift: Floats,
          moving: tuple[Floats, Floats, Floats, Floats]) -> tuple[Floats, Floats]:
    """(moment about the origin, force), each (N, 3), that a body takes."""
    omega, v, alpha, a = moving
    centre = turn @ body.centre + shift
    force = body.mass * (a + cross(alpha, centre) + cross(omega, v + cross(omega, centre)))
    return cross(centre, force) + spun(body.inertia, turn, omega, alpha), force


def spun(inertia: Floats, turn: Floats, omega: Floats, alpha: Floats) -> Floats:
    """(N, 3) I alpha + omega x I omega of moments of inertia (3,) in a frame turned by (N, 3, 3)."""
    if not np.any(inertia):
        return np.zeros_like(omega)
    whole = np.einsum("nij,j,nkj->nik", turn, inertia, turn)
    spinning = np.einsum("nij,nj->ni", whole, omega)
    return np.asarray(np.einsum("nij,nj->ni", whole, alpha) + cross(omega, spinning), dtype=np.float64)
