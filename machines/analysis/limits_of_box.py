"""What ends the box that a machine reaches, and how near its parts come to each other and to their stops."""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.analysis.box import Box
from machines.machine import Machine
from machines.reach import is_checked, reach
from toolpaths.arrays import Floats
from toolpaths.units import DEG

POINTS, BEYOND = 5, 1.002
"""points per direction of a box; how much larger the box is where its ends are looked for"""
TILT = "tilt"
"""margin to the ends of the declared tilt: they are the workspace's own"""
GRID = (5, 5, 5, 5)
"""places and tilts at which margins are looked at"""


def ends_of_box(machine: Machine, box: Box | None) -> list[str]:
    """What stops the tool just outside a reachable box, most frequent first: travel of an axis, a leg, a clearance."""
    if box is None:
        return []
    lower, upper = np.array(box.lower), np.array(box.upper)
    middle, half = 0.5 * (lower + upper), 0.5 * BEYOND * (upper - lower)
    tip = np.stack(np.meshgrid(*(np.linspace(m - h, m + h, POINTS) for m, h in zip(middle, half, strict=True))),
                   axis=-1).reshape(-1, 3)
    axis = np.broadcast_to(machine.home_axis, tip.shape)
    branches = machine.kinematics.inverse(tip, axis)
    good = np.array([_inside(machine, q).all(axis=1) for q in branches]).any(axis=0)
    q, names, counts = branches[0][~good], machine.axis_names, dict[str, int]()
    for j, column in enumerate(_inside(machine, q).T):
        counts[f"travel of {names[j]}"] = int((~column & np.isfinite(q[:, j])).sum())
    counts["reach of a leg"] = int(np.isnan(q).any(axis=1).sum())
    if is_checked(machine.kinematics):
        q = branches[0][good]
        margins = reach(machine.kinematics, q[np.isfinite(q).all(axis=1)])
        counts |= {name: int((column < 0.0).sum()) for name, column, own in zip(
            margins.names, margins.values.T, margins.of_box, strict=True) if not own}
    return [what for what, count in sorted(counts.items(), key=lambda one: -one[1]) if count]


def _inside(machine: Machine, q: Floats) -> Any:
    with np.errstate(invalid="ignore"):
        return (q >= machine.limits.lower) & (q <= machine.limits.upper)


def least_margins(machine: Machine) -> dict[str, dict[str, Any]]:
    """The nearest joint stop (degrees) and the nearest two parts (mm) on a grid of the workspace, with the place of each."""
    kinematics = machine.kinematics
    over = kinematics.over_workspace
    if over is None:
        return {}
    place, tilt = over.workspace.grid(GRID)
    q = machine.joints_over_workspace(np.column_stack([place, tilt]))
    known = np.isfinite(q).all(axis=1)
    if not known.any():
        return {}
    margins, place, tilt = reach(kinematics, q[known]), place[known], tilt[known]
    counts = ~margins.of_box & np.isfinite(margins.values).any(axis=0)
    found = dict[str, dict[str, Any]]()
    for what, unit, size, kind in (("stop", "deg", DEG, margins.angular), ("parts", "mm", 1.0, ~margins.angular)):
        columns = [j for j in np.flatnonzero(counts & kind).tolist() if margins.names[j] != TILT]
        if columns:
            values = np.where(np.isfinite(margins.values), margins.values, np.inf)[:, columns]
            k, j = np.unravel_index(int(values.argmin()), values.shape)
            found[f"nearest_{what}"] = {"what": margins.names[columns[int(j)]], unit: float(values[k, j]) / size,
                                        "at_mm": place[k].tolist(), "at_tilt_deg": float(tilt[k]) / DEG}
    return found


def extents(machine: Machine) -> dict[str, Any]:
    """How far along x, y and z the drives' joints come over the workspace, mm, and those of the contracted model, whose
    platform joints are one point (table III-5, annex C of Company 2000); nothing of a machine without a platform."""
    kinematics = machine.kinematics
    over, legs = kinematics.over_workspace, kinematics.leg_geometry
    if over is None or legs is None:
        return {}
    place, tilt = over.workspace.grid(GRID)
    q = machine.joints_over_workspace(np.column_stack([place, tilt]))
    feet = kinematics.rig(q[np.isfinite(q).all(axis=1)]).carriages
    if not len(feet):
        return {}
    found = {"extents_mm": _sizes(feet)}
    if not legs.turns:
        found["extents_of_the_contracted_model_mm"] = _sizes(feet - legs.joints)
    return found


def _sizes(points: Floats) -> dict[str, float]:
    return dict(zip("xyz", np.ptp(points.reshape(-1, 3), axis=0).tolist(), strict=True))
