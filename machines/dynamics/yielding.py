"""How the tip moves as drives yield to what they give against weight and friction, by J K^-1 g: weight by another amount
from place to place, friction to the other side where an axis reverses."""

from __future__ import annotations

import numpy as np

from machines.dynamics.bodies import NEWTON
from machines.dynamics.build import dynamics_of
from machines.dynamics_models import StiffnessModel
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from machines.stiffness.along import PER_MRAD, PER_UM
from toolpaths.arrays import Floats


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
