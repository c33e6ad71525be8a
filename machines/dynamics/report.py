"""Forces of the motors of a machine in one motion at one place, and their extremes over its workspace, as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.dynamics.bodies import NEWTON, Dynamics
from machines.dynamics.build import dynamics_of, force_limits_of, force_units, inertia_units, lumped
from machines.dynamics.legs import LegDynamics
from machines.dynamics.limits import ForceLimits, force_limits
from machines.dynamics.rods import rod_figures, rod_forces_in_motion
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.shapes import arrays
from toolpaths.units import DEG

GRID, LOOKS = (7, 7, 5, 5), 400
"""places and tilts of a platform; random positions of a chain of axes"""


@dataclass(frozen=True, eq=False)
@arrays(tip="3", axis="3", speed="3", acceleration="3", force="3")
class MotionAsked:
    """A motion of the tip in the table frame, tool axis held: mm, mm/s, mm/s2, N that push the tool; its length, mm."""

    tip: Floats
    axis: Floats
    speed: Floats
    acceleration: Floats
    force: Floats
    tool: float


def forces_at(machine: Machine, asked: MotionAsked) -> dict[str, Any]:
    """What each motor gives at a place, by parts: inertia, rates alone, gravity (counterbalances off it), friction (of an
    axis that is only about to move: against its acceleration), force at the tip.

    Raises:
        DiagnosticError: no masses, or the machine does not reach the place.
    """
    dynamics = needed(machine)
    kinematics = machine.kinematics.with_tool(asked.tool)
    q = kinematics.inverse(asked.tip[None], asked.axis[None])[0]
    if not np.isfinite(q).all():
        where = f"{asked.tip.tolist()} with the tool along {asked.axis.tolist()}"
        raise DiagnosticError([error("dynamics.reach", f"{machine.name} does not reach {where}",
                                     hint="name a place inside with --tip, or another --tool")])
    rate, acceleration = _held(machine, q, asked)
    units, still = force_units(machine), np.zeros_like(q)
    rates_alone = dynamics.forces(q, rate, acceleration, 0.0) - dynamics.forces(q, still, acceleration, 0.0)
    parts = {"inertia": dynamics.forces(q, still, acceleration, 0.0), "speed_squared": rates_alone,
             "gravity": dynamics.forces(q, still, still), "friction": dynamics.drives.resisting(rate, acceleration),
             "force_at_the_tip": -NEWTON * asked.force @ kinematics.jacobian(q)[:, :3]}
    parts["together"] = np.asarray(sum(parts.values()))
    limits = force_limits_of(machine) / units
    names = machine.axis_names
    scale = np.where(machine.rotary, DEG, 1.0)
    rows = {name: {key: float(part[0, j] / units[j]) for key, part in parts.items()} for j, name in enumerate(names)}
    for j, name in enumerate(names):
        rows[name] |= {"limit": float(limits[j]), "share": abs(rows[name]["together"]) / float(limits[j])} if np.isfinite(
            limits[j]) else {}
    found = {"machine": machine.name, "tool_mm": asked.tool, "tip_mm": asked.tip.tolist(), "tool_axis": asked.axis.tolist(),
             "speed_mm_per_s": asked.speed.tolist(), "acceleration_mm_per_s2": asked.acceleration.tolist(),
             "force_at_tip_n": asked.force.tolist()}
    found["joints"] = {name: float(v) for name, v in zip(names, (q / scale)[0], strict=True)}
    found["joint_acceleration"] = {name: float(v) for name, v in zip(names, (acceleration / scale)[0], strict=True)}
    found["force_n_or_n_m"] = rows
    if isinstance(dynamics, LegDynamics):
        found |= rod_forces_in_motion(machine, dynamics, (q, rate, acceleration), asked.force, asked.tool)
    return found


def needed(machine: Machine) -> Dynamics:
    """The dynamics of a machine.

    Raises:
        DiagnosticError: its file has no masses.
    """
    if (found := dynamics_of(machine)) is None:
        raise DiagnosticError([error("dynamics.missing", f"the machine file of {machine.name} has no masses",
                                     file=machine.file, hint="add [dynamics], with [dynamics.axes.LETTER] for each axis: "
                                     "mass, force (docs/reference/machine-files.md)")])
    return found


def _held(machine: Machine, q: Floats, asked: MotionAsked) -> tuple[Floats, Floats]:
    """Rates and accelerations (1, J) of the joints while the tip moves as asked and the tool axis stands.

    How the rates of the tool change along the rates of the joints is a central difference (II-26 takes a one-sided one).
    """
    kinematics = machine.kinematics.with_tool(asked.tool)
    back = np.linalg.pinv(kinematics.twist_jacobian(q)[0], rcond=1e-9)
    rate = back @ np.concatenate([asked.speed, np.zeros(3)])
    size = max(float(np.abs(rate / np.where(machine.rotary, DEG, 1.0)).max()), 1e-12)
    h = 0.01 / size
    ahead, behind = (kinematics.twist_jacobian(q + sign * h * rate)[0] @ rate for sign in (1.0, -1.0))
    bend = (ahead - behind) / (2.0 * h)
    return rate[None], (back @ (np.concatenate([asked.acceleration, np.zeros(3)]) - bend))[None]


def dynamics_figures(machine: Machine) -> dict[str, Any]:
    """Extremes over workspace or travel: gravity, mass that each motor feels, acceleration of the tip that the motors always
    give; of legs forces in rods, and what lumping the rods' masses changes. Nothing of a machine without masses."""
    if (dynamics := dynamics_of(machine)) is None:
        return {}
    q = positions(machine)
    units, names, still = force_units(machine), machine.axis_names, np.zeros_like(q)
    with np.errstate(invalid="ignore"):
        gravity = dynamics.forces(q, still, still)
    q, gravity = q[np.isfinite(gravity).all(axis=1)], gravity[np.isfinite(gravity).all(axis=1)]
    own = masses(dynamics, q)
    found: dict[str, Any] = {"tool_mm": machine.kinematics.tool_length, "positions": len(q), "gravity_n_or_n_m": {
        name: {"least": float(gravity[:, j].min() / units[j]), "largest": float(gravity[:, j].max() / units[j])}
        for j, name in enumerate(names)}}
    felt = own[:, np.arange(len(names)), np.arange(len(names))] / inertia_units(machine)
    found["felt_kg_or_kg_m2"] = {name: {"at_home": float(felt[0, j]), "least": float(felt[:, j].min()),
                                        "largest": float(felt[:, j].max())} for j, name in enumerate(names)}
    limits = force_limits(machine, machine.kinematics)
    if isinstance(limits, ForceLimits):
        found |= _guaranteed(machine, limits, q, own)
    if isinstance(dynamics, LegDynamics):
        found |= _lumped(dynamics, q, own) | rod_figures(machine, dynamics)
    return {"dynamics": found}


def masses(dynamics: Dynamics, q: Floats) -> Floats:
    """M (N, J, J) at joints (N, J): column k is what the motors give for the acceleration of joint k alone."""
    still = np.zeros_like(q)
    return np.stack([dynamics.forces(q, still, np.tile(one, (len(q), 1)), 0.0) for one in np.eye(q.shape[1])], axis=2)


def tip_acceleration(machine: Machine, limits: ForceLimits, q: Floats, own: Floats) -> Floats:
    """(N, J) mm/s2 that each motor allows the tip in every direction from rest, tool axis held, after gravity."""
    back = np.linalg.pinv(machine.kinematics.twist_jacobian(q), rcond=1e-9)[:, :, :3]
    with np.errstate(divide="ignore"):
        return np.asarray(limits.left(q) / np.linalg.norm(own @ back, axis=2), dtype=np.float64)


def _guaranteed(machine: Machine, limits: ForceLimits, q: Floats, own: Floats) -> dict[str, Any]:
    each = tip_acceleration(machine, limits, q, own)
    least = each.min(axis=1)
    k, standing = int(least.argmin()), limits.standing(q)
    worst = np.unravel_index(int(standing.argmax()), standing.shape)
    tips = machine.kinematics.forward(q)[0]
    return {"standing_still": {"largest_share_of_a_limit": float(standing[worst]), "axis": machine.axis_names[int(worst[1])],
                               "at_tip_mm": tips[int(worst[0])].tolist()},
            "tip_acceleration_by_forces_mm_per_s2": {
                "at_home": float(least[0]), "worst": float(least[k]), "axis": machine.axis_names[int(each[k].argmin())],
                "at_tip_mm": tips[k].tolist(), "best": float(least.max())}}


def _lumped(dynamics: LegDynamics, q: Floats, own: Floats) -> dict[str, Any]:
    """Largest difference of M with halves of the rods at their ends, as a share of the largest entry of its row."""
    apart = np.abs(masses(lumped(dynamics), q) - own).max(axis=2) / np.abs(own).max(axis=2)
    return {"lumped_rods_apart": float(apart.max())}


def positions(machine: Machine) -> Floats:
    """(N, J): home, then a grid of the workspace, or of a chain of axes ends of travel and random positions."""
    kinematics = machine.kinematics
    home = machine.home[None]
    if (over := kinematics.over_workspace) is not None:
        place, tilt = over.workspace.grid(GRID)
        turning = () if kinematics.leg_parts is None else kinematics.leg_parts.axes
        turn = np.tile(machine.home[sorted(axis.at for axis in turning)], (len(place), 1))
        q = over.joints_at(np.column_stack([place, tilt]), turn)
        return np.concatenate([home, q[np.isfinite(q).all(axis=1)]])
    low = np.where(np.isfinite(machine.limits.lower), machine.limits.lower, -np.pi)
    high = np.where(np.isfinite(machine.limits.upper), machine.limits.upper, np.pi)
    some = np.random.default_rng(0).uniform(low, high, (LOOKS, len(low)))
    return np.concatenate([home, low[None], high[None], some])

