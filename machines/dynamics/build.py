"""The inverse dynamics of a machine from its `[dynamics]` table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from machines.dynamics.bodies import NEWTON, NEWTON_METRE, Drives, Dynamics, RigidBody, body, moments
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
    down = np.array(model.down)
    if (parts := kinematics.leg_parts) is not None:
        return _on_legs(machine, model, parts, down)
    if not kinematics.chain:
        return None
    primed = machine.structure.split()
    at = {name: k for k, name in enumerate(machine.axis_names)}
    sides: dict[float, list[AxisBody]] = {-1.0: [], 1.0: []}
    for joint in kinematics.chain:
        table = model.axes.get(joint.name, NOTHING)
        sense = -1.0 if f"{joint.name}'" in primed else 1.0
        sides[sense].append(AxisBody(joint, at[joint.name], sense, (_body(table, joint.point),)))
    gauge = kinematics.with_tool(0.0).forward(np.zeros((1, kinematics.joints)))[0][0]
    part = _at_end(sides[-1.0][::-1], _loose(model.part, np.zeros(3)))
    return ChainDynamics((part, _at_end(sides[1.0], _loose(model.tool, gauge))), _drives(machine, model), down)


def _drives(machine: Machine, model: DynamicsModel) -> Drives:
    tables = [model.axes.get(name, NOTHING) for name in machine.axis_names]
    per_speed = np.where(machine.rotary, NEWTON_METRE, 1.0)
    return Drives(np.array([t.rotor for t in tables]) * inertia_units(machine),
                  np.array([t.balance for t in tables]) * force_units(machine),
                  np.array([t.friction for t in tables]) * force_units(machine),
                  np.array([t.viscous for t in tables]) * per_speed)


def _at_end(side: Sequence[AxisBody], more: tuple[RigidBody, ...]) -> tuple[AxisBody, ...]:
    """A side, from the bed outwards, whose last axis carries more bodies; without an axis the bed carries them."""
    return (*side[:-1], replace(side[-1], bodies=(*side[-1].bodies, *more))) if side else ()


def _loose(model: BodyModel | None, point: Floats) -> tuple[RigidBody, ...]:
    """Part or tool, whose centre counts from a point (3,)."""
    if model is None:
        return ()
    own = body(model)
    return (replace(own, centre=own.centre + point),)


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


def _on_legs(machine: Machine, model: DynamicsModel, parts: LegParts, down: Floats) -> LegDynamics:
    legs, carriers = ([model.axes.get(machine.axis_names[k], NOTHING) for k in at]
                      for at in (parts.legs_at, parts.carriers_at))
    centres = np.array([point if t.centre is None else t.centre for t, point in zip(legs, parts.points, strict=True)])
    inertia = [float(parts.directions[k] ** 2 @ moments(t.inertia)) for k, t in enumerate(legs)]
    length = np.array([own if t.length is None else t.length for t, own in zip(legs, parts.lengths, strict=True)])
    table, head = (_next_to(model, parts, spindle) for spindle in (False, True))
    part, tool = _loose(model.part, np.zeros(3)), _loose(model.tool, parts.gauge)
    carried, under = np.array([t.mass for t in carriers]), np.array([t.under_part for t in carriers], dtype=np.bool_)
    if under.any() and not table:
        carried[np.flatnonzero(under)[-1]] += sum(one.mass for one in part)
    masses = LegMasses(np.array([t.mass for t in legs]), centres, np.array(inertia), np.array([t.rods for t in legs]),
                       np.array([t.joint for t in legs]), length, carried, under)
    platform = () if model.platform is None else (body(model.platform),)
    if head and model.head is not None:
        head = (*head[:-1], replace(head[-1], bodies=(*head[-1].bodies, body(model.head))))
    return LegDynamics(machine.kinematics, parts, masses, platform if head else (*platform, *tool),
                       _drives(machine, model), down, _at_end(table, part), _at_end(head, tool))


def _next_to(model: DynamicsModel, parts: LegParts, spindle: bool) -> tuple[AxisBody, ...]:
    """Rotary axes under the part, or between platform and spindle, with what their tables say."""
    found = []
    for axis in parts.axes:
        if axis.at_spindle == spindle:
            joint, table = Joint(axis.name, True, axis.direction, axis.point), model.axes.get(axis.name, NOTHING)
            found.append(AxisBody(joint, axis.at, 1.0 if spindle else -1.0, (_body(table, axis.point),)))
    return tuple(found)


def _body(table: AxisMassModel, point: Floats) -> RigidBody:
    return RigidBody(table.mass, np.array(point if table.centre is None else table.centre), moments(table.inertia))
