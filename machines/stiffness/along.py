"""How far the tip yields at joints of a machine whose file says what its parts yield by.

Of a platform on legs by rods, joints and drives (II-43 to II-51 of Company 2000, `statics.py`); of a chain of axes by its
drives alone: the tip moves by J K^-1 J^T F.
"""

from __future__ import annotations

import numpy as np

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


def _of_chain(given: StiffnessModel, kinematics: Kinematics, q: Floats) -> Floats:
    per = {False: 0.0 if given.drive is None else 1.0 / (given.drive * PER_UM),
           True: 0.0 if given.turn is None else 1.0 / (given.turn * PER_MRAD)}
    rates = kinematics.jacobian(q)[:, :3]
    yielding = np.array([per[turns] for turns in kinematics.rotary])
    return np.asarray((rates * yielding) @ np.swapaxes(rates, 1, 2), dtype=np.float64)
