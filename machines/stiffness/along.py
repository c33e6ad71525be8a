"""How far the tip yields at joints of a machine whose file says what its parts yield by.

Of a platform on legs by rods, joints and drives (II-43 to II-51 of Company 2000, `statics.py`); of a chain of axes by its
drives alone: the tip moves by J K^-1 J^T F. What the drives give against weight and friction makes them yield too, by
J K^-1 g: weight by another amount from place to place, friction to the other side where an axis reverses.
"""

from __future__ import annotations

import numpy as np

from machines.dynamics.bodies import NEWTON
from machines.dynamics.build import dynamics_of
from machines.dynamics_models import StiffnessModel
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from machines.stiffness.statics import Springs, compliance, force_rows
from machines.tolerances.influence import PlatformPoses
from machines.tolerances.report import rods_of
from toolpaths.arrays import Floats

PER_UM, PER_MRAD = 1e3, 1e6
"""N/mm per N/um; N mm/rad per N m/mrad"""


def tip_compliance(machine: Machine, kinematics: Kinematics, q: Floats) -> Floats | None:
    """(N, 3, 3) mm/N at joints (N, J); `kinematics` at the tip. None where the machine file does not say, of platforms whose
    rods it does not place, and of those with an axis at the spindle."""
    given = machine.stiffness
    if given is None:
        return None
    if (drives := machine.by_drives) is not None:
        return tip_compliance(drives, drives.kinematics.with_tool(kinematics.tool_length), kinematics.drives(q))
    if (parts := kinematics.leg_parts) is None:
        return _of_chain(given, kinematics, q)
    legs, placed = kinematics.leg_geometry, kinematics.clearance_parts
    if given.rod is None or legs is None or not legs.plain or legs.head or placed is None or placed.clearance is None:
        return None
    motion = kinematics.leg_motion(q, np.zeros_like(q), np.zeros_like(q))
    poses = PlatformPoses(motion.place, motion.turn, np.zeros((len(q), 5)))
    others = (np.inf if value is None else value * PER_UM for value in (given.joint, given.drive))
    point = legs.gauge - np.array([0.0, 0.0, kinematics.tool_length])
    found = compliance(force_rows(rods_of(machine), poses, point), Springs(given.rod * PER_UM, *others))
    drive = 0.0 if given.drive is None or not len(parts.carriers) else 1.0 / (given.drive * PER_UM)
    return np.asarray(found + drive * parts.carriers.T @ parts.carriers, dtype=np.float64)


def drive_moves(machine: Machine, kinematics: Kinematics, q: Floats) -> tuple[Floats, Floats] | None:
    """What drives that yield do to the tip at joints (N, J): its move (N, 3) mm under all weights, and how far it moves at
    most (N,) mm when all axes reverse against their dry friction. None where the machine file has no masses, or no stiffness
    of a drive; `kinematics` at the tip."""
    if (drives := machine.by_drives) is not None:
        return drive_moves(drives, drives.kinematics.with_tool(kinematics.tool_length), kinematics.drives(q))
    dynamics = dynamics_of(machine)
    if dynamics is None or machine.stiffness is None:
        return None
    yields = _drive_yields(machine.stiffness, kinematics, q)
    if not yields.any():
        return None
    still = np.zeros_like(q)
    rates = kinematics.jacobian(q)[:, :3]
    weight = np.einsum("nij,nj->ni", rates, -yields * dynamics.forces(q, still, still) / NEWTON)
    friction = 2.0 * (np.linalg.norm(rates, axis=1) * yields * dynamics.drives.friction / NEWTON).sum(axis=1)
    return weight, friction


def _drive_yields(given: StiffnessModel, kinematics: Kinematics, q: Floats) -> Floats:
    """(N, J) mm per N, rad per N mm of the drives."""
    slide = 0.0 if given.drive is None else 1.0 / (given.drive * PER_UM)
    turn = 0.0 if given.turn is None else 1.0 / (given.turn * PER_MRAD)
    if (parts := kinematics.leg_parts) is None:
        return np.tile(np.where(kinematics.rotary, turn, slide), (len(q), 1))
    still = np.zeros_like(q)
    arms = np.linalg.norm(kinematics.leg_motion(q, still, still).moved, axis=2)
    yields = np.zeros(q.shape)
    yields[:, parts.carriers_at] = slide
    yields[:, parts.legs_at] = slide / np.where(parts.arm, arms, 1.0) ** 2
    return yields


def _of_chain(given: StiffnessModel, kinematics: Kinematics, q: Floats) -> Floats:
    per = {False: 0.0 if given.drive is None else 1.0 / (given.drive * PER_UM),
           True: 0.0 if given.turn is None else 1.0 / (given.turn * PER_MRAD)}
    rates = kinematics.jacobian(q)[:, :3]
    yielding = np.array([per[turns] for turns in kinematics.rotary])
    return np.asarray((rates * yielding) @ np.swapaxes(rates, 1, 2), dtype=np.float64)
