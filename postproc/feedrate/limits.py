"""Limits of the joints as the planner sees them, and what they allow at a point of the path."""

from __future__ import annotations

from dataclasses import fields
from typing import Protocol

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
class ToolLimits:
    """Largest magnitudes at the tool: rate of its axis, rad/s; acceleration and jerk of the tip, mm/s2 and mm/s3."""

    tilt_rate: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf

    def __post_init__(self) -> None:
        if not min(self.tilt_rate, self.acceleration, self.jerk) > 0.0:
            raise ValueError(f"limits at the tool must be positive, found {self}")

    def ratios(self, tool: Floats) -> Floats:
        """(N, 3) how far a motion uses them, in velocity, acceleration and jerk: from its columns `rows.at_tool`."""
        return np.asarray(tool / np.array([self.tilt_rate, self.acceleration, self.jerk]))


TOOL_COLUMNS = len(fields(ToolLimits))
"""of a motion, one for each limit at the tool"""


class MotorLimits(Protocol):
    """Limits of forces that depend on place and speed: of second order, and square in the speed."""

    @property
    def acceleration(self) -> Floats:
        """(J,) about the acceleration of each joint that its force allows; infinite without a limit."""
        ...

    def rows(self, q: Floats, dq: Floats, d2q: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
        """(a, b, o), each (N, J): |a x'/2 + b x + o| <= 1, |o| < 1, of the squared speed x along a path q (N, J) with these
        derivatives, up to speeds (N,)."""
        ...

    def steady(self, q: Floats, dq: Floats, d2q: Floats) -> Floats:
        """(N, J) largest constant speed along the path under each."""
        ...

    def standing(self, q: Floats) -> Floats:
        """(N, J) of the limits, that standing still at joints (N, J) takes."""
        ...

    def use(self, q: Floats, rate: Floats, acceleration: Floats) -> Floats:
        """(N, J) of the limits, at joints (N, J) with their rates and accelerations in time."""
        ...


@dataclass(frozen=True)
@arrays(velocity="J", acceleration="J", jerk="J")
class JointLimits:
    """Largest magnitudes per joint (J,), in joint units per s, s2, s3; inf: unlimited; `tool`, `forces` where stated."""

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    tool: ToolLimits | None = None
    forces: MotorLimits | None = None

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk"):
            values = np.asarray(getattr(self, name))
            if not np.all(values > 0.0):
                raise ValueError(f"JointLimits.{name} must be positive, found {values.min()}")


def squared_speed(dq: Floats, velocity: Floats) -> Floats:
    """Largest x = sigma_dot^2 (N,) that keeps |q' sigma_dot| <= V in every joint; inf where nothing moves."""
    with np.errstate(divide="ignore"):
        return np.asarray((np.min(velocity / np.abs(dq), axis=1)) ** 2)


def steady_cap(d2q: Floats, d3q: Floats, limits: JointLimits) -> Floats:
    """Largest constant x (N,) under acceleration and jerk: |q''| x <= A, |q'''| x^1.5 <= J; inf on straight lines."""
    with np.errstate(divide="ignore"):
        acceleration = np.min(limits.acceleration / np.abs(d2q), axis=1)
        jerk = np.min(limits.jerk / np.abs(d3q), axis=1) ** (2.0 / 3.0)
    return np.asarray(np.minimum(acceleration, jerk))
