"""Forces in the rods of a platform on legs: in a motion, and per force, moment and unbalanced inertia on the platform.

With rows T = (e, OB x e) and what the platform needs, W = sum of T_k f_k, f = T^-t W; positive pushes the platform. Forces
of heavy rods across themselves are in W. Per unit of load: eta_bf of a force in any direction, eta_bm of a moment, eta_bfm
of the inertia of a mass whose centre stands at `platform.centre` (distance e of III.6.4). Source: Company 2000, II-34 to
II-38, III-18 to III-22 (m_y = +h f_x as its errata have it), III.6.4.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.dynamics.bodies import NEWTON
from machines.dynamics.legs import LegDynamics
from machines.machine import Machine
from machines.stiffness.statics import force_rows
from machines.tolerances.influence import PlatformPoses, poses_over
from machines.tolerances.report import rods_of
from toolpaths.arrays import Floats


def rod_forces_in_motion(machine: Machine, dynamics: LegDynamics, joints: tuple[Floats, Floats, Floats], force: Floats,
                         tool: float) -> dict[str, Any]:
    """N in each rod at joints (1, J) with rates and accelerations, under a force (3,) N at the tip; {} of legs with bars."""
    legs = machine.kinematics.leg_geometry
    if legs is None or not legs.plain:
        return {}
    rods = rods_of(machine)
    load = dynamics.loads(*joints)
    turn = load.motion.turn
    poses = PlatformPoses(load.motion.place, turn, np.zeros((1, 5)))
    wrench = load.wrench[0].copy()
    reach = turn[0] @ (rods.legs.gauge - np.array([0.0, 0.0, tool]))
    wrench -= NEWTON * np.concatenate([force, np.cross(reach, force)])
    rows = force_rows(rods, poses, np.zeros(3))
    f = np.linalg.pinv(rows.rods[0][:, rows.columns].T) @ wrench[rows.columns]
    return {"rod_force_n": {name: float(v) for name, v in zip(rods.names, f / NEWTON, strict=True)}}


def rod_figures(machine: Machine, dynamics: LegDynamics) -> dict[str, Any]:
    """Largest force in a rod over the workspace, per load on the platform; {} of legs with bars."""
    legs = machine.kinematics.leg_geometry
    if legs is None or not legs.plain:
        return {}
    rods = rods_of(machine)
    poses = poses_over(rods.legs)
    rows = force_rows(rods, poses, np.zeros(3))
    t = np.swapaxes(rows.rods[:, :, rows.columns], 1, 2)
    back = np.zeros((len(t), rows.rods.shape[1], 6))
    back[:, :, rows.columns] = np.linalg.pinv(t)
    bodies = dynamics.platform
    mass = sum(one.mass for one in bodies)
    centre = poses.turn @ (sum((one.mass * one.centre for one in bodies), np.zeros(3)) / (mass or 1.0))
    zero = np.zeros(len(centre))
    x, y, z = centre.T
    lever = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    kinds = {"per_force": back[:, :, :3], "per_moment_per_m": 1e3 * back[:, :, 3:],
             "per_inertia_of_the_platform": back[:, :, :3] + back[:, :, 3:] @ lever}
    found = dict[str, Any]()
    for key, rates in kinds.items():
        most = np.linalg.norm(rates, axis=2)
        k, rod = np.unravel_index(int(most.argmax()), most.shape)
        found[key] = {"largest": float(most[k, rod]), "rod": rods.names[int(rod)], "at_mm": poses.pose[k, :3].tolist()}
    return {"rod_force": found}
