"""Moves from rest to rest without a path to keep: rapids, indexing, retracts, tool change. The only user of ruckig.

Ruckig plans from state to state here. Its way-points are never set: the library would ask a service on the
network for them, and its motion between them leaves the path anyway.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.trajectory import JointTrajectory
from toolpaths.arrays import Floats


class PointToPointMode(StrEnum):
    """How a control moves the joints of a move without a path.

    STRAIGHT: on a straight line in the joints, as fast as the joint that allows least; DOG_LEG: each joint as fast as it
    can, so that the short paths end first; SYNCHRONISED: each joint its own motion, all end together.
    """

    STRAIGHT = "straight"
    DOG_LEG = "dog-leg"
    SYNCHRONISED = "synchronised"


def rest_seconds(q0: Floats, q1: Floats, limits: JointLimits, law: PointToPointMode | str) -> Floats:
    """Least times (N,) of many moves from rest at q0 (N, J) to rest at q1 (N, J), in closed form.

    Under velocity V, acceleration A and jerk J, of which A' = min(A, sqrt(V J)) is reached at most, a path D takes
        D/V + V/A' + A'/J               where D >= V (V/A' + A'/J),
        D/v + v/A' + A'/J               with v (v/A' + A'/J) = D, where D >= 2 A'^3/J^2,
        (32 D/J)^(1/3)                  below.
    (The seven phases of constant jerk, added up; Biagiotti and Melchiorri, Trajectory Planning, 2008, section 3.4.)

    Raises:
        ValueError: positions that are not finite; a joint that moves without any limit on acceleration and jerk.
    """
    travel = _travel(q0, q1)
    if PointToPointMode(law) is PointToPointMode.STRAIGHT:
        return np.asarray(_seconds(np.where(travel.max(axis=1) > 0.0, 1.0, 0.0), *_along(travel, limits)))
    return np.asarray(_seconds(travel, limits.velocity, limits.acceleration, limits.jerk).max(axis=1))


def rest_to_rest(q0: Floats, q1: Floats, limits: JointLimits, law: PointToPointMode | str,
                 step: float = 1e-3) -> JointTrajectory:
    """One move from rest at q0 (J,) to rest at q1 (J,), samples each `step`; s is the share of the time.

    Raises:
        ValueError: as `rest_seconds`.
        ArithmeticError: ruckig found no motion.
    """
    travel = _travel(q0[None], q1[None])
    law = PointToPointMode(law)
    if law is PointToPointMode.STRAIGHT and np.any(travel > 0.0):
        rates = _along(travel, limits)
        unit = _states(np.zeros(1), np.ones(1), rates, law, step)
        q, *rest = (values * (q1 - q0) for values in unit)
        return _sampled([q0 + q, *rest], step)
    return _sampled(_states(q0, q1, (limits.velocity, limits.acceleration, limits.jerk), law, step), step)


def _travel(q0: Floats, q1: Floats) -> Floats:
    """Magnitudes of the paths (N, J)."""
    travel = np.abs(np.asarray(q1, dtype=np.float64) - q0)
    if not np.all(np.isfinite(travel)):
        raise ValueError("a move from rest to rest needs finite positions")
    return travel


def _along(travel: Floats, limits: JointLimits) -> tuple[Floats, Floats, Floats]:
    """Limits (N,) of the share of a straight path (N, J) that is covered."""
    with np.errstate(divide="ignore"):
        velocity, acceleration, jerk = (np.min(limit / travel, axis=1)
                                        for limit in (limits.velocity, limits.acceleration, limits.jerk))
    return velocity, acceleration, jerk


def _seconds(travel: Floats, velocity: Floats, acceleration: Floats, jerk: Floats) -> Floats:
    """See `rest_seconds`; arguments of one shape or broadcast to it; 0 where there is no path."""
    v, a, j = (np.where(travel > 0.0, limit, 1.0) for limit in (velocity, acceleration, jerk))
    peak = np.minimum(a, np.sqrt(v * j))
    if np.any(np.isinf(peak) & np.isinf(j)):
        raise ValueError("a joint without limits of acceleration and jerk needs no time to start: state one of them")
    rise = peak / j
    with np.errstate(over="ignore", invalid="ignore"):
        # v (v/A' + A'/J) = D: the positive root, in the form that does not cancel.
        top = 2.0 * travel / (rise + np.sqrt(rise**2 + 4.0 * travel / peak))
        top = np.minimum(v, top)
        return np.where(travel >= 2.0 * peak * rise**2, travel / top + top / peak + rise,
                        np.cbrt(32.0 * travel / j))


def _states(q0: Floats, q1: Floats, limits: tuple[Floats, Floats, Floats], law: PointToPointMode,
            step: float) -> list[Floats]:
    """Positions, velocities, accelerations and jerks (N, J) each `step`, the last at rest."""
    import ruckig

    joints = len(q0)
    wanted, found = ruckig.InputParameter(joints), ruckig.Trajectory(joints)
    wanted.current_position, wanted.target_position = q0.tolist(), q1.tolist()
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = (np.ravel(limit).tolist() for limit in limits)
    wanted.synchronization = ruckig.Synchronization.No if law is PointToPointMode.DOG_LEG else ruckig.Synchronization.Time
    result = ruckig.Ruckig(joints).calculate(wanted, found)
    if result != ruckig.Result.Working:
        raise ArithmeticError(f"no motion from {q0} to {q1}: ruckig answers {result.name}")
    t = np.float64(step) * np.arange(int(np.ceil(found.duration / step)) + 1)
    states = [np.stack(rows, axis=1) for rows in zip(*(_read(joint, t) for joint in found.profiles[0]), strict=True)]
    states[0][0], states[0][-1] = q0, q1
    return states


def _read(profile: Any, t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Position, velocity, acceleration and jerk of one joint at times t (N,), from its seven phases of constant jerk."""
    starts = np.append(0.0, np.cumsum(profile.t))
    phase = np.minimum(np.searchsorted(starts, t, side="right") - 1, 7)
    j = np.append(profile.j, 0.0)[phase]
    p = np.array(profile.p)[phase]
    v, a = (np.append(values[:7], 0.0)[phase] for values in (profile.v, profile.a))
    d = t - starts[phase]
    return p + d * (v + d * (a / 2.0 + d * j / 6.0)), v + d * (a + d * j / 2.0), a + d * j, j


def _sampled(states: list[Floats], step: float) -> JointTrajectory:
    """As `JointTrajectory`, s from 0 to 1."""
    count = len(states[0])
    share = np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1)
    rate = np.full(count, share[-1] / ((count - 1) * step) if count > 1 else 0.0)
    q, qd, qdd, qddd = states
    return JointTrajectory(np.float64(step) * np.arange(count), share, q, qd, qdd, qddd, rate,
                           np.full(count, np.inf))
