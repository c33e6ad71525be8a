"""Which directions a platform on legs can give its tool, by the turns that it is free in and its largest tilts."""

from __future__ import annotations

import numpy as np

from machines.kinematics.legs.loops import PlatformTurns
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between

UP = np.array([0.0, 0.0, 1.0])
ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same"""


def nearest_directions(turns: PlatformTurns, tilt: tuple[float, float], axis: Floats) -> Floats:
    """The nearest directions (N, 3) to `axis` (N, 3) that the platform can take; those that it can take to the last bit.

    Args:
        turns: about x, y, z
        tilt: rad, least and largest, about the one axis or from z
    """
    if turns in ("", "c"):
        return np.broadcast_to(UP, axis.shape)
    if len(turns) == 1:
        return _about_one(axis, 0 if turns == "a" else 1, tilt)
    most, angle = tilt[1], angle_between(axis, np.broadcast_to(UP, axis.shape))
    flat = np.hypot(axis[:, 0], axis[:, 1])
    heading = np.where((flat > 0.0)[:, None], axis[:, :2] / np.where(flat > 0.0, flat, 1.0)[:, None], [1.0, 0.0])
    edge = np.column_stack([np.sin(most) * heading, np.full(len(axis), np.cos(most))])
    return np.where((angle > most + ROUND_OFF)[:, None], edge, axis)


def _about_one(axis: Floats, about: int, allowed: tuple[float, float]) -> Floats:
    side, sign = (1, -1.0) if about == 0 else (0, 1.0)
    tilt = np.arctan2(sign * axis[:, side], axis[:, 2])
    low, high = allowed
    held = np.clip(tilt, low, high)
    nearest = np.zeros(axis.shape)
    nearest[:, side], nearest[:, 2] = sign * np.sin(held), np.cos(held)
    keep = (np.abs(axis[:, about]) <= ROUND_OFF) & (tilt >= low - ROUND_OFF) & (tilt <= high + ROUND_OFF)
    return np.where(keep[:, None], axis, nearest)


def direction_of(turns: PlatformTurns, tilt: Floats, heading: Floats) -> Floats:
    """Tool axes (N, 3) of tilts (N,) rad, about the platform's one axis, else from z towards `heading` (N,) rad from x."""
    heading = np.full(len(tilt), -0.5 * np.pi) if turns == "a" else 0.0 * tilt if turns == "b" else heading
    return np.stack([np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)], axis=1)


def attitude(turns: PlatformTurns, tilt: Floats, heading: Floats) -> tuple[Floats, Floats]:
    """(tool axes (N, 3), spins (N,) rad) of tilts as `direction_of` has them; of a platform that turns about z its turns."""
    if turns == "c":
        return np.array(np.broadcast_to(UP, (len(tilt), 3))), tilt
    return direction_of(turns, tilt, heading), np.zeros(len(tilt))


def tilt_of(turns: PlatformTurns, axis: Floats) -> Floats:
    """Tilts (N,) rad of tool axes (N, 3): the inverse of `direction_of`, from z without a sign."""
    if turns == "a":
        return np.asarray(np.arctan2(-axis[:, 1], axis[:, 2]), dtype=np.float64)
    if turns == "b":
        return np.asarray(np.arctan2(axis[:, 0], axis[:, 2]), dtype=np.float64)
    return angle_between(axis, np.broadcast_to(UP, axis.shape))
