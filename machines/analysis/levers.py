"""How far the tip comes from each rotary axis of a chain: the torque of that axis per force at the tip."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from machines.analysis.chain import rotary_positions
from machines.machine import Machine


def levers(machine: Machine) -> dict[str, dict[str, Any]]:
    """By letter: the largest distance of the tip from the axis within travel, mm, and the position where it is.

    A force F at the tip, square to axis and distance, asks F times that distance of the axis (virtual work: the row of
    the Jacobian, mm per rad). For fixed rotary axes the distance is convex in the slides, so it is largest at their ends.
    {} for machines that are no chain with rotary axes, or whose slides have no ends.
    """
    kin, rotary = machine.kinematics, np.array(machine.rotary)
    slides = np.flatnonzero(~rotary)
    ends = np.stack([machine.limits.lower[slides], machine.limits.upper[slides]])
    if not kin.straight_slides or not rotary.any() or not np.isfinite(ends).all():
        return {}
    turned = rotary_positions(machine)
    corners = np.array(list(product(*ends.T)))
    q = np.repeat(turned, len(corners), axis=0)
    q[:, slides] = np.tile(corners, (len(turned), 1))
    arms = np.linalg.norm(kin.jacobian(q)[:, :3], axis=1)
    found: dict[str, dict[str, Any]] = {}
    for j in np.flatnonzero(rotary).tolist():
        k = int(arms[:, j].argmax())
        shown = np.where(rotary, np.degrees(q[k]), q[k]).round(4) + 0.0
        found[machine.axis_names[j]] = {
            "mm": float(arms[k, j]), "at": dict(zip(machine.axis_names, shown.tolist(), strict=True))}
    return found
