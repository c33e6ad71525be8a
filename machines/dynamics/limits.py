"""What the forces of the motors allow along a path: the pose-dependent limits of its second order.

Along a path q(s) the motors give F = a s'' + b s'^2 + k s' + c with a = M q_s, b = M q_ss + h(q, q_s), k the viscous
friction of the drives times q_s and c = g(q) less counterbalances, and their dry friction in the sense of q_s: F is linear
in the accelerations and square in the rates.
Both sides count by themselves, -F_max <= F <= F_max: where gravity or friction helps,
there is more to brake or to accelerate with. A force at the tool in its worst direction, |J^T f|, is taken off both.

k s' is not linear in x = s'^2: s' <= v/2 + x/(2 v), equal at the largest speed v that a place allows (no more than that at
which friction alone takes what a motor has), stands in its place where friction takes force, and x/(2 v), less than s' up to
2 v, where it gives some. Up to 2 v the rows hold more than is needed, never less.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.dynamics.bodies import NEWTON, Dynamics
from machines.dynamics.build import dynamics_of, force_limits_of
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LEAST = 0.02
"""of a limit: where standing still takes more than the rest, this is what is left, so that a plan exists; it is reported"""
STEP = 0.02
"""mm or rad of the differences by which drives follow axes, over the root of the acceleration where that is the larger"""


@dataclass(frozen=True, eq=False)
@arrays(limits="J", acceleration="J")
class ForceLimits:
    """Of one machine with one tool.

    Attributes:
        limits: (J,) kg mm/s2, kg mm2/s2; infinite where there is none
        acceleration: (J,) about the acceleration that each allows by itself at home, infinite without a limit
        cutting: kg mm/s2 at the tip in the worst direction
    """

    dynamics: Dynamics
    kinematics: Kinematics
    limits: Floats
    acceleration: Floats
    cutting: float = 0.0

    def rows(self, q: Floats, dq: Floats, d2q: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
        """(a, b, o), each (N, J): |a x'/2 + b x + o| <= 1, x = s'^2, |o| < 1; 0 of motors without a limit.

        Args:
            q, dq, d2q: (N, J) joints and their derivatives along the path
            speed: (N,) largest s'; may be infinite
        """
        zero = np.zeros_like(dq)
        first, second = (self.dynamics.forces(q, *motion, 0.0) for motion in ((zero, dq), (dq, d2q)))
        low, high = self.room(q, np.sign(dq))
        per_speed = self.dynamics.drives.viscous * dq
        if per_speed.any():
            steady = self._steady(second, per_speed, low, high).min(axis=1)
            fastest = np.where(np.isfinite(speed), np.minimum(speed, np.maximum(steady, 0.5 * speed)), steady)
            with np.errstate(divide="ignore", invalid="ignore"):
                alone = np.where(per_speed > 0.0, high, low) / np.abs(per_speed)
            fastest = np.minimum(fastest, np.where(np.isfinite(alone), alone, np.inf).min(axis=1))
            fastest = np.where(np.isfinite(fastest) & (fastest > 0.0), fastest, 1.0)[:, None]
            second = second + per_speed / (2.0 * fastest)
            high, low = (np.maximum(side - np.maximum(sense * per_speed, 0.0) * 0.5 * fastest, LEAST * self.limits)
                         for side, sense in ((high, 1.0), (low, -1.0)))
        half = 0.5 * (high + low)
        with np.errstate(invalid="ignore"):
            first, second, middle = (np.nan_to_num(part / half) for part in (first, second, 0.5 * (low - high)))
        return first, second, middle

    def room(self, q: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """(N, J) how far what a motion takes may fall and rise at joints q; `direction` (N, J) signs of their rates."""
        zero = np.zeros_like(q)
        need = self.dynamics.forces(q, zero, zero) + self.dynamics.drives.friction * direction
        most = self.limits - self._cut(q)
        return np.maximum(most + need, LEAST * self.limits), np.maximum(most - need, LEAST * self.limits)

    def steady(self, q: Floats, dq: Floats, d2q: Floats) -> Floats:
        """(N, J) largest constant s' of each motor; infinite without a limit."""
        taken = self.dynamics.forces(q, dq, d2q, 0.0), self.dynamics.drives.viscous * dq
        return self._steady(*taken, *self.room(q, np.sign(dq)))

    def _steady(self, second: Floats, per_speed: Floats, low: Floats, high: Floats) -> Floats:
        return np.minimum(_reach(second, per_speed, high), _reach(-second, -per_speed, low))

    def use(self, q: Floats, rate: Floats, acceleration: Floats) -> Floats:
        """(N, J) by how much a motion is to be slowed, as the square of a factor on time, until its motors keep their
        limits: 1 where one is just kept, below it the share of what gravity and friction leave. 0 without a limit."""
        first, per_speed = self.dynamics.forces(q, rate, acceleration, 0.0), self.dynamics.drives.viscous * rate
        low, high = self.room(q, np.sign(np.where(rate == 0.0, acceleration, rate)))
        taken = first + per_speed
        sense = np.where(taken < 0.0, -1.0, 1.0)
        side = np.where(taken < 0.0, low, high)
        with np.errstate(invalid="ignore"):
            share = np.nan_to_num(np.abs(taken) / side)
        slower = _reach(sense * first, sense * per_speed, side)
        return np.where(share > 1.0, slower**-2.0, share)

    def _cut(self, q: Floats) -> Floats | float:
        """(N, J) what the force at the tip takes in its worst direction."""
        if not self.cutting:
            return 0.0
        return np.asarray(self.cutting * np.linalg.norm(self.kinematics.jacobian(q)[:, :3], axis=1))

    def loads(self, q: Floats, rate: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Shares (N, J) of the limits in steady motion at joints q with rates (N, J), and with accelerations up to
        `acceleration` (J,) of all joints in the signs that are worst for each motor; 0 of motors without a limit."""
        zero, drives = np.zeros_like(q), self.dynamics.drives
        moving = self.dynamics.forces(q, rate, zero)
        cut = self._cut(q)
        steady = np.abs(moving + drives.resisting(rate, zero)) + cut
        most = np.where(np.isfinite(acceleration), acceleration, 0.0)
        each = (self.dynamics.forces(q, zero, np.broadcast_to(row, q.shape), 0.0) for row in np.diag(most))
        taken = np.abs(moving) + drives.friction + drives.viscous * np.abs(rate) + cut
        ramp = taken + np.sum([np.abs(one) for one in each], axis=0)
        return np.nan_to_num(steady / self.limits), np.nan_to_num(ramp / self.limits)

    def names(self, machine: Machine) -> tuple[str, ...]:
        """Letters of the motors."""
        return machine.axis_names

    def standing(self, q: Floats) -> Floats:
        """(N, J) of the limits: what gravity, dry friction and the force at the tip take of each, hardly moving, at most."""
        zero = np.zeros_like(q)
        still = np.abs(self.dynamics.forces(q, zero, zero)) + self.dynamics.drives.friction + self._cut(q)
        return np.asarray(still / self.limits, dtype=np.float64)

    def left(self, q: Floats) -> Floats:
        """(N, J) what is left of the limits for motion on both sides."""
        return np.asarray(self.limits * np.maximum(1.0 - self.standing(q), LEAST), dtype=np.float64)


def _reach(square: Floats, linear: Floats, most: Floats) -> Floats:
    """The least v > 0 with square v^2 + linear v = most > 0; infinite where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = linear**2 + 4.0 * square * most
        below = linear + np.sqrt(np.where(inside >= 0.0, inside, np.nan))
        return np.where(below > 0.0, 2.0 * most / below, np.inf)


@dataclass(frozen=True, eq=False)
@arrays(acceleration="J")
class DriveLimits:
    """Of the drives of a platform whose joints here are the axes of its control's kinematics, as many as drives.

    Attributes:
        own: of the drives
        axes: what moves them
        acceleration: (J,) of an axis alone, as of `ForceLimits`
    """

    own: ForceLimits
    axes: Kinematics
    acceleration: Floats

    def rows(self, q: Floats, dq: Floats, d2q: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
        """See `ForceLimits`: joints are axes, rows are drives."""
        return self.own.rows(*drive_motion(self.axes, q, dq, d2q), speed)

    def steady(self, q: Floats, dq: Floats, d2q: Floats) -> Floats:
        """See `ForceLimits`."""
        return self.own.steady(*drive_motion(self.axes, q, dq, d2q))

    def use(self, q: Floats, rate: Floats, acceleration: Floats) -> Floats:
        """See `ForceLimits`."""
        return self.own.use(*drive_motion(self.axes, q, rate, acceleration))

    def loads(self, q: Floats, rate: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """See `ForceLimits`: of axes, each at its own acceleration; the drives follow them."""
        own, follow, _ = drive_motion(self.axes, q, rate, np.zeros_like(q))
        steady, _ = self.own.loads(own, follow, np.zeros(own.shape[1]))
        most = np.where(np.isfinite(acceleration), acceleration, 0.0)
        still, forces = np.zeros_like(q), np.zeros_like(steady)
        for row in np.diag(most):
            at, _, faster = drive_motion(self.axes, q, still, np.broadcast_to(row, q.shape))
            forces = forces + np.abs(self.own.dynamics.forces(at, np.zeros_like(at), faster, 0.0))
        return steady, np.nan_to_num(steady + forces / self.own.limits)

    def names(self, machine: Machine) -> tuple[str, ...]:
        """See `ForceLimits`."""
        return machine.axis_names if machine.by_drives is None else machine.by_drives.axis_names

    def standing(self, q: Floats) -> Floats:
        """See `ForceLimits`."""
        return self.own.standing(self.axes.drives(q))


def drive_motion(axes: Kinematics, q: Floats, rate: Floats, acceleration: Floats) -> tuple[Floats, Floats, Floats]:
    """Joints of the drives with their rates and accelerations, each (N, K), of axes (N, J) with theirs: differences along
    the parabola that the axes run."""
    largest = np.stack([np.abs(rate).max(axis=1), np.sqrt(np.abs(acceleration).max(axis=1))]).max(axis=0)[:, None]
    h = STEP / np.where(largest > 0.0, largest, 1.0)
    ahead, back = (axes.drives(q + side * h * rate + 0.5 * h**2 * acceleration) for side in (1.0, -1.0))
    at = axes.drives(q)
    return at, (ahead - back) / (2.0 * h), (ahead - 2.0 * at + back) / h**2


def _of_drives(machine: Machine, drives: Machine, kinematics: Kinematics, cutting: float) -> DriveLimits | None:
    """Of the machine by its control's axes; `kinematics` of these, at the tip."""
    own = force_limits(drives, drives.kinematics.with_tool(kinematics.tool_length), cutting)
    if not isinstance(own, ForceLimits):
        return None
    unit = np.eye(len(machine.home))
    used = own.use(*drive_motion(kinematics, np.tile(machine.home, (len(unit), 1)), 0.0 * unit, unit)).max(axis=1)
    with np.errstate(divide="ignore"):
        return DriveLimits(own, kinematics, 1.0 / used)


def force_limits(machine: Machine, kinematics: Kinematics, cutting: float = 0.0) -> ForceLimits | DriveLimits | None:
    """Of a machine; None where the machine file has no limit of a motor, or no masses.

    Args:
        kinematics: at the tip
        cutting: N there, in the direction that is worst for each motor
    """
    if machine.by_drives is not None:
        return _of_drives(machine, machine.by_drives, kinematics, cutting)
    limits = force_limits_of(machine)
    dynamics = dynamics_of(machine)
    if dynamics is None or not np.isfinite(limits).any():
        return None
    found = ForceLimits(dynamics, kinematics, limits, np.full(len(limits), np.inf), cutting * NEWTON)
    home = machine.home[None]
    unit = np.eye(len(limits))
    own = np.abs(np.stack([dynamics.forces(home, np.zeros_like(home), u[None], 0.0)[0, j] for j, u in enumerate(unit)]))
    with np.errstate(divide="ignore"):
        alone = found.left(home)[0] / own
    return replace(found, acceleration=alone)
