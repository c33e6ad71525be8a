"""Which directions the tool can take within the travel of the rotary axes and the tilt of the platform."""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from toolpaths.arrays import Bools, Floats
from toolpaths.units import DEG

HEADINGS = 72
STEP = 0.5
"""degrees between the tilts that are tried"""
SLACK = 1e-9
"""rad: round-off that passes no travel"""


def tilts(machine: Machine) -> tuple[float, float]:
    """(tilt from +z that the tool takes in every direction round z, largest tilt in any direction), degrees.

    On a grid of `STEP` degrees by `HEADINGS` directions; linear axes are taken to have travel enough.
    """
    tilt = np.arange(0.0, 180.0 + STEP, STEP)
    a, b = np.meshgrid(tilt * DEG, np.linspace(0.0, 2.0 * np.pi, HEADINGS, endpoint=False), indexing="ij")
    axis = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=-1).reshape(-1, 3)
    can = taken(machine, axis).reshape(a.shape)
    if not can[0].all():
        return float("nan"), float(tilt[can.any(axis=1)].max(initial=0.0))
    below = np.flatnonzero(~can.all(axis=1))
    return float(tilt[below[0] - 1] if len(below) else 180.0), float(tilt[can.any(axis=1)].max())


def taken(machine: Machine, axis: Floats) -> Bools:
    """True (N,) where the directions `axis` (N, 3) need no more than the travel of the rotary axes."""
    kinematics, tip = machine.kinematics, np.zeros(3)
    if kinematics.on_rods is not None:  # a tool that ends where the tilt turns it
        tip = kinematics.on_rods.workspace.middle
        kinematics = kinematics.with_tool(-kinematics.on_rods.gauge_below)
    elif not kinematics.straight_slides:  # slides have not travel enough everywhere
        tip = kinematics.forward(machine.home[None])[0][0]
    inside = np.all(np.abs(kinematics.nearest_axis(axis) - axis) < SLACK, axis=1)
    rotary, limits = np.array(machine.rotary), machine.limits
    found = np.zeros(len(axis), dtype=np.bool_)
    for q in kinematics.inverse(np.tile(tip, (len(axis), 1)), axis):
        fits = (q >= limits.lower - SLACK) & (q <= limits.upper + SLACK)
        found |= np.isfinite(q).all(axis=1) & np.all(fits | ~rotary, axis=1)
    return np.asarray(inside & found)
