"""Machines with masses by chance, and their bodies as point masses, placed by code of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import machines
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel, MassCentre
from machines.kinematics.chain import Joint
from machines.machine import Machine
from toolpaths.arrays import Floats

SIMPSON = ((0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0))
"""of a rod: the rule integrates squares along it exactly, with other points than the product's"""


def heavy(name: str, seed: int = 0) -> Machine:
    """A built-in machine with masses everywhere."""
    m, rng = machines.load(name), np.random.default_rng(seed)
    parts, axes = m.kinematics.leg_parts, dict[str, AxisMassModel]()
    for j, letter in enumerate(m.axis_names):
        keys = {"mass": float(rng.uniform(5, 50)), "rotor": float(rng.uniform(0, 2)),
                "friction": float(rng.uniform(0, 90)), "viscous": float(rng.uniform(0, 400))}
        if parts is not None and j in parts.legs_at:
            k = parts.legs_at.tolist().index(j)
            keys |= {"rods": float(rng.uniform(1, 20)), "joint": float(rng.uniform(0, 5))}
            keys |= {"length": float(rng.uniform(100, 600))} if parts.stretches[k] else {}
            axes[letter] = AxisMassModel(**keys, centre=_place(parts.points[k] + rng.uniform(-50, 50, 3)),
                                         inertia=float(rng.uniform(0, 3)) if parts.arm[k] else 0.0) if parts.arm[k] \
                else AxisMassModel(**keys)
        else:
            axes[letter] = AxisMassModel(**keys, centre=_place(rng.uniform(-200, 200, 3)), inertia=(1.1, 1.3, 0.9))
    platform = head = None
    if parts is not None:
        platform = BodyModel(mass=70.0, centre=(20.0, -30.0, 50.0), inertia=(1.2, 1.5, 1.1))
        if any(axis.at_spindle for axis in parts.axes):
            head = BodyModel(mass=20.0, centre=(10.0, 20.0, -60.0), inertia=(0.5, 0.6, 0.7))
    part = BodyModel(mass=40.0, centre=(60.0, -20.0, 90.0), inertia=(0.3, 0.4, 0.35))
    tool = BodyModel(mass=6.0, centre=(2.0, 1.0, -80.0), inertia=(0.02, 0.02, 0.01))
    return replace(m, dynamics=DynamicsModel(platform=platform, head=head, part=part, tool=tool, axes=axes))


def _place(v: Floats) -> MassCentre:
    x, y, z = v.tolist()
    return x, y, z


@dataclass
class Points:
    """Masses (kg) of points and where they stand at joints (J,)."""

    machine: Machine

    def masses_and_places(self, q: Floats) -> tuple[Floats, Floats]:
        """((P,), (P, 3)) mm."""
        found = self._legs(q) if self.machine.kinematics.leg_parts is not None else self._chain(q)
        return np.array([m for m, _ in found]), np.array([p for _, p in found])

    def _chain(self, q: Floats) -> list[tuple[float, Floats]]:
        m, found = self.machine, list[tuple[float, Floats]]()
        assert m.dynamics is not None and m.dynamics.part is not None and m.dynamics.tool is not None
        primed = [token[0] for token in m.structure.split() if token.endswith("'")]
        chain = {joint.name: joint for joint in m.kinematics.chain}
        for names, sense in (([n for n in chain if n in primed][::-1], -1.0), ([n for n in chain if n not in primed], 1.0)):
            move = _stay
            for name in names:
                move = _then(move, chain[name], sense * q[m.axis_names.index(name)])
                table = m.dynamics.axes[name]
                centre = np.array(chain[name].point if table.centre is None else table.centre)
                found += [(mass, move(x)) for mass, x in _rigid(table.mass, centre, table.inertia)]
            if names:
                found += [(mass, move(x)) for mass, x in (_of(m.dynamics.part, np.zeros(3)) if sense < 0.0 else _of(
                    m.dynamics.tool, m.kinematics.forward(np.zeros((1, len(q))))[0][0]))]
        return found

    def platform(self, q: Floats) -> tuple[Floats, Rotation]:
        """MassCentre and turn of the platform by its loops alone."""
        k = self.machine.kinematics
        legs = getattr(k, "on_legs", k)
        if legs.loops.holds is not None:
            place, turns = legs.platform_pose(q[None, :legs.joints])
            return place[0] - q[legs.carriers_at] @ legs.carriers, Rotation.from_matrix(turns[0])
        own, free = q[legs.legs_at], [("x", "y", "z", "a", "b", "c").index(f) for f in legs.loops.freedoms]
        feet, spans = self._feet(own), legs.loops.drives.lengths + legs.loops.drives.stretch * own
        place0, turn0, _ = legs.home
        kept = 0.0 if legs.loops.kept is None else legs.loops.kept

        def pose(x: Floats) -> tuple[Floats, Rotation]:
            whole = np.zeros(6)
            whole[free] = x
            return place0 + 100.0 * whole[:3], Rotation.from_rotvec(whole[3:]) * Rotation.from_matrix(turn0)

        def gap(x: Floats) -> Floats:
            place, turn = pose(x)
            ends = place + turn.apply(np.array(legs.loops.joints)) + kept
            return (np.linalg.norm(ends - feet, axis=1) - spans) / 100.0
        x, _, good, text = fsolve(gap, np.zeros(len(free)), xtol=1e-14, full_output=True)
        assert good == 1 or np.abs(gap(x)).max() < 1e-12, text
        return pose(x)

    def _feet(self, own: Floats) -> Floats:
        parts = self.machine.kinematics.leg_parts
        assert parts is not None
        k = self.machine.kinematics
        arms = getattr(k, "on_legs", k).loops.drives.arms
        feet = np.array(parts.points)
        for i in range(len(own)):
            if parts.arm[i]:
                feet[i] += Rotation.from_rotvec(own[i] * parts.directions[i]).apply(np.array(arms[i]))
            elif not parts.stretches[i]:
                feet[i] += own[i] * parts.directions[i]
        return feet

    def _legs(self, q: Floats) -> list[tuple[float, Floats]]:
        m, k = self.machine, self.machine.kinematics
        parts, model = k.leg_parts, m.dynamics
        assert parts is not None and model is not None and model.platform is not None
        legs, own = getattr(k, "on_legs", k), q[parts.legs_at]
        place, turn = self.platform(q)
        ends = place + turn.apply(np.array(legs.loops.joints))
        kept = 0.0 if legs.loops.kept is None else legs.loops.kept
        feet, found = self._feet(own), list[tuple[float, Floats]]()
        found += [(mass, place + turn.apply(x)) for mass, x in
                  _rigid(model.platform.mass, np.array(model.platform.centre), model.platform.inertia)]
        for i in range(len(own)):
            letter = m.axis_names[parts.legs_at[i]]
            table = model.axes[letter]
            a, b = feet[i], (ends + kept)[i]
            e, span = (b - a) / np.linalg.norm(b - a), np.linalg.norm(b - a)
            reach = table.length if parts.stretches[i] and table.length else span
            found.append((table.joint, ends[i]))
            found += [(share * table.rods, b - u * reach * e) for u, share in SIMPSON]
            if parts.stretches[i]:
                found += [(share * table.mass, a + u * reach * e) for u, share in SIMPSON]
            elif parts.arm[i]:
                turned = Rotation.from_rotvec(own[i] * parts.directions[i])
                found += [(mass, parts.points[i] + turned.apply(x - parts.points[i])) for mass, x in
                          _rigid(table.mass, np.array(table.centre), table.inertia)]
            else:
                found.append((table.mass, a))
        shift = q[parts.carriers_at] @ parts.carriers if len(parts.carriers_at) else np.zeros(3)
        found = [(mass, x + shift) for mass, x in found]
        for i, j in enumerate(parts.carriers_at):
            found.append((model.axes[m.axis_names[j]].mass, q[parts.carriers_at[:i + 1]] @ parts.carriers[:i + 1]))
        return found + self._next_to(q, place, turn)

    def _next_to(self, q: Floats, place: Floats, turn: Rotation) -> list[tuple[float, Floats]]:
        """Rotary axes, part and tool of a platform on legs."""
        parts, model = self.machine.kinematics.leg_parts, self.machine.dynamics
        assert parts is not None and model is not None and model.part is not None and model.tool is not None
        found, ends = list[tuple[float, Floats]](), dict[bool, Callable[[Floats], Floats]]()
        for spindle, start in ((False, _stay), (True, lambda x: place + turn.apply(x))):
            move, axes = start, [axis for axis in parts.axes if axis.at_spindle == spindle]
            for axis in axes:
                move = _then(move, Joint(axis.name, True, axis.direction, axis.point), q[axis.at] * (1 if spindle else -1))
                table = model.axes[axis.name]
                found += [(mass, move(x)) for mass, x in _rigid(table.mass, np.array(table.centre), table.inertia)]
            if spindle and axes and model.head is not None:
                found += [(mass, move(x)) for mass, x in _of(model.head, np.zeros(3))]
            ends[spindle] = move
        under = [i for i, j in enumerate(parts.carriers_at) if model.axes[self.machine.axis_names[j]].under_part]
        if ends[False] is not _stay:
            found += [(mass, ends[False](x)) for mass, x in _of(model.part, np.zeros(3))]
        assert not under
        shift = q[parts.carriers_at] @ parts.carriers if len(parts.carriers_at) else np.zeros(3)
        return found + [(mass, ends[True](x) + shift) for mass, x in _of(model.tool, parts.gauge)]


def _of(model: BodyModel, point: Floats) -> list[tuple[float, Floats]]:
    return _rigid(model.mass, np.array(model.centre) + point, model.inertia)


def _stay(x: Floats) -> Floats:
    return x


def _then(before: Callable[[Floats], Floats], joint: Joint, at: float) -> Callable[[Floats], Floats]:
    """A point moved by a joint, then by what is nearer the bed."""
    if not joint.rotary:
        return lambda x: before(x + at * joint.direction)
    return lambda x: before(Rotation.from_rotvec(at * joint.direction).apply(x - joint.point) + joint.point)


def _rigid(mass: float, centre: Floats, inertia: float | tuple[float, float, float]) -> list[tuple[float, Floats]]:
    """A body as six points on its axes: m/6 at +-a_i with I_x = m/3 (a_y^2 + a_z^2)."""
    i = np.broadcast_to(np.asarray(inertia, dtype=np.float64), 3) * 1e6
    squares = 1.5 / mass * (i.sum() - 2.0 * i)
    assert (squares >= 0.0).all()
    return [(mass / 6.0, centre + sign * np.sqrt(squares[k]) * np.eye(3)[k]) for k in range(3) for sign in (1.0, -1.0)]
