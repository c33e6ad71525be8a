"""Masses as the equations of motion use them: kg, mm, s, so forces in kg mm/s2 (0.001 N) and torques in kg mm2/s2."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from machines.dynamics_models import BodyModel, Inertia
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

NEWTON, NEWTON_METRE, KG_M2 = 1e3, 1e6, 1e6
"""kg mm/s2 per N; kg mm2/s2 per N m; kg mm2 per kg m2"""
GRAVITY = 9806.65
"""mm/s2 (standard gravity)"""


@dataclass(frozen=True, eq=False)
@arrays(centre="3", inertia="3")
class RigidBody:
    """kg; centre of mass (3,) mm; moments of inertia (3,) kg mm2 about it, along the axes of the frame at rest."""

    mass: float
    centre: Floats
    inertia: Floats


def body(model: BodyModel) -> RigidBody:
    """Of a table of the machine file."""
    return RigidBody(model.mass, np.array(model.centre), moments(model.inertia))


def moments(inertia: Inertia) -> Floats:
    """(3,) kg mm2 of one or three kg m2."""
    return np.broadcast_to(np.asarray(inertia, dtype=np.float64), 3) * KG_M2


@dataclass(frozen=True, eq=False)
@arrays(rotor="J", balance="J", friction="J", viscous="J")
class Drives:
    """Of the motors of J axes, in kg mm/s2 and mm, of rotary axes kg mm2/s2 and rad.

    Attributes:
        rotor: (J,) inertia of motor and gear
        balance: (J,) what counterbalances give
        friction: (J,) dry friction, whatever the speed
        viscous: (J,) friction per speed
    """

    rotor: Floats
    balance: Floats
    friction: Floats
    viscous: Floats

    def resisting(self, rate: Floats, acceleration: Floats) -> Floats:
        """(N, J) what the motors give against friction at rates (N, J); an axis at rest that is accelerated breaks loose."""
        way = np.sign(np.where(rate == 0.0, acceleration, rate))
        return np.asarray(self.friction * way + self.viscous * rate, dtype=np.float64)


class Dynamics(ABC):
    """Inverse dynamics of one machine: joints in mm and rad, forces in kg mm/s2, torques in kg mm2/s2."""

    drives: Drives
    """its motors"""

    @abstractmethod
    def forces(self, q: Floats, rate: Floats, acceleration: Floats, gravity: float = GRAVITY) -> Floats:
        """(N, J) what the motors give at joints (N, J) with their rates and accelerations, counterbalances off it, without
        friction.

        `gravity` mm/s2; 0: inertia alone, without gravity and counterbalances.
        """
