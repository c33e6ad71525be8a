"""The inverse dynamics of a machine from its `[dynamics]` table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.dynamics.bodies import NEWTON, NEWTON_METRE, Dynamics, RigidBody, body, moments
from machines.dynamics.chain import AxisBody, ChainDynamics
from machines.dynamics.legs import LegDynamics, LegMasses
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel
from machines.kinematics.chain import Joint
from machines.kinematics.leg_motion import LegParts
from machines.machine import Machine
from toolpaths.arrays import Floats

NOTHING = AxisMassModel()
"""of an axis without a table"""


def dynamics_of(machine: Machine) -> Dynamics | None:
    """None of a machine whose file has no masses, or of a kind that is neither a chain of axes nor a platform on legs."""
    model, kinematics = machine.dynamics, machine.kinematics
    if model is None:
        return None
    tables = [model.axes.get(name, NOTHING) for name in machine.axis_names]
    rotor = np.array([t.rotor for t in tables]) * inertia_units(machine)
    balance = np.array([t.balance for t in tables]) * force_units(machine)
    down = np.array(model.down)
    if (parts := kinematics.leg_parts) is not None:
        return _on_legs(machine, model, parts, (rotor, balance, down))
    if not kinematics.chain:
        return None
    primed = machine.structure.split()
    at = {name: k for k, name in enumerate(machine.axis_names)}
    sides: dict[float, list[AxisBody]] = {-1.0: [], 1.0: []}
    for joint in kinematics.chain:
        table = model.axes.get(joint.name, NOTHING)
        sense = -1.0 if f"{joint.name}'" in primed else 1.0
        sides[sense].append(AxisBody(joint, at[joint.name], sense, _body(table, joint.point)))
    return ChainDynamics((tuple(sides[-1.0][::-1]), tuple(sides[1.0])), rotor, balance, down)


def force_limits_of(machine: Machine) -> Floats:
    """(J,) kg mm/s2, kg mm2/s2: what each motor can give; infinite where the machine file does not say."""
    axes = {} if machine.dynamics is None else machine.dynamics.axes
    given = [axes.get(name, NOTHING).force for name in machine.axis_names]
    return np.array([np.inf if force is None else force for force in given]) * force_units(machine)


def force_units(machine: Machine) -> Floats:
    """(J,) kg mm/s2 per N, of rotary axes kg mm2/s2 per N m."""
    return np.where(machine.rotary, NEWTON_METRE, NEWTON)


def inertia_units(machine: Machine) -> Floats:
    """(J,) 1 for kg, of rotary axes kg mm2 per kg m2."""
    return np.where(machine.rotary, NEWTON_METRE, 1.0)


def lumped(dynamics: LegDynamics) -> LegDynamics:
    """The same with halves of the rods at their ends (Company 2000, III-15, III-16)."""
    return replace(dynamics, masses=replace(dynamics.masses, lumped=True))


def _on_legs(machine: Machine, model: DynamicsModel, parts: LegParts, axes: tuple[Floats, Floats, Floats]) -> LegDynamics:
    legs, carriers = ([model.axes.get(machine.axis_names[k], NOTHING) for k in at]
                      for at in (parts.legs_at, parts.carriers_at))
    centres = np.array([point if t.centre is None else t.centre for t, point in zip(legs, parts.points, strict=True)])
    inertia = [float(parts.directions[k] ** 2 @ moments(t.inertia)) for k, t in enumerate(legs)]
    length = np.array([own if t.length is None else t.length for t, own in zip(legs, parts.lengths, strict=True)])
    masses = LegMasses(np.array([t.mass for t in legs]), centres, np.array(inertia), np.array([t.rods for t in legs]),
                       np.array([t.joint for t in legs]), length, np.array([t.mass for t in carriers]),
                       np.array([t.under_part for t in carriers], dtype=np.bool_))
    axis, head = parts.axis, None
    table: tuple[AxisBody, ...] = ()
    if axis is not None and axis.at_spindle:
        head = _of(model.head)
    elif axis is not None:
        joint = Joint(axis.name, True, axis.direction, axis.point)
        own = _body(model.axes.get(axis.name, NOTHING), joint.point)
        table = (AxisBody(joint, machine.kinematics.joints - 1, -1.0, own),)
    return LegDynamics(machine.kinematics, parts, masses, _of(model.platform), *axes, head, table)


def _of(model: BodyModel | None) -> RigidBody:
    return RigidBody(0.0, np.zeros(3), np.zeros(3)) if model is None else body(model)


def _body(table: AxisMassModel, point: Floats) -> RigidBody:
    return RigidBody(table.mass, np.array(point if table.centre is None else table.centre), moments(table.inertia))
