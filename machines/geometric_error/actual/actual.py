"""The machine as it is: a nominal kinematics with its errors. What every kind of machine gives to the correction.

Everything is computed in coordinates `w` (N, 3 + R) in which any machine is a chain: three displacements of
the tip, then R turns. For a serial machine they are its joints, for a Delta the place of its platform, for one that tilts
next to a rotary axis place, tilt and that axis. `w` stands for commands: the errors come in between w and the tool.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from machines.geometric_error.actual.error_rates import ErrorRates
from machines.geometric_error.actual.lost_motion import carried_on
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats

ToolPlace = tuple[Floats, Floats, Floats]
"""tip, tool axis, x of the tool, each (N, 3), in the table frame"""
RESTS = 1e-6
"""part of the largest motion that counts as none"""
LEVER = 100.0
"""mm per rad"""
EDGE = 1e-6
"""mm or rad beyond what was measured that are numbers' own: a part that ends where the measurement does"""


class Actual(ABC):
    """A machine with errors; frozen."""

    kinematics: Kinematics
    """without errors, with its tool"""
    turns: int
    """R"""

    @property
    def held(self) -> int:
        """Coordinates behind the turns that no correction changes."""
        return 0

    @abstractmethod
    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """w (N, 3 + R), and `held` more, of joints q (N, J); `near` as in `Kinematics.pose`."""

    @abstractmethod
    def joints(self, w: Floats) -> Floats:
        """q (N, J), NaN where the machine cannot go."""

    @abstractmethod
    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """Where the tool is, exactly, when w (N, 3 + R) is commanded.

        Args:
            direction: (N, J) sign of each joint's last motion, for tables with two approach directions;
                without it their mean
        """

    def aim(self, w: Floats, direction: Floats | None = None) -> tuple[Floats, Floats]:
        """Tip and tool axis of `place`."""
        return self.place(w, direction)[:2]

    @abstractmethod
    def rates(self, w: Floats) -> Floats:
        """d(tip, axis)/dw (N, 6, 3 + R) of the machine without errors; the first three columns do not move the axis."""

    @abstractmethod
    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """First-order motion (N, 6, P) of the tip (mm) and turn (rad) per parameter, in the table frame."""

    @abstractmethod
    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """True (N, J) where a joint stands outside what was measured of it by more than `margin` mm or rad."""

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """How fast errors may change near joints q (N, J) while each joint moves by up to `reach` (N, J).

        None where no bound is known: the machine is then only checked at places.
        """
        return None

    def deviation(self, w: Floats, values: Floats, direction: Floats | None = None) -> Floats:
        """First-order displacement of the tip and turn (N, 6) for parameters (P,)."""
        result: Floats = self.sensitivity(w, direction) @ values
        return result


def approach(q: Floats) -> Floats:
    """Sign of each joint's last motion (N, J) along a path q (N, J): +1, -1; 0 before it has first moved."""
    moved = np.zeros(q.shape)
    moved[1:] = np.sign(np.diff(q, axis=0))
    return carried_on(moved)


def moving_sign(step: Floats, rotary: Bools) -> Floats:
    """Sign of motion (N, J) of joint steps (N, J): 0 for joints that move by less than RESTS of the one that moves most.

    Rotary joints count with LEVER mm per rad.
    """
    size = np.abs(step) * np.where(rotary, LEVER, 1.0)
    result: Floats = np.where(size > RESTS * size.max(axis=1, keepdims=True, initial=0.0), np.sign(step), 0.0)
    return result
