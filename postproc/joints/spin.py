"""A tool that is held about its own axis: the rotary joint that its direction leaves free must stand at one value."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats
from toolpaths.rotations import wrap


def free_joint(kin: Kinematics, tip: Floats, axis: Floats, home: Floats) -> int:
    """The rotary joint that a tool along `axis` (3,) leaves free at `tip` (3,); -1 where it leaves none."""
    q = _at(kin, tip, axis, home)
    if not np.isfinite(q).all() or not bool(kin.singular(q[None])[0]):
        return -1
    rotary = np.array(kin.rotary)
    return int(np.where(rotary, np.abs(_at(kin, tip, axis, home + rotary) - q), -1.0).argmax())


def held_joints(kin: Kinematics, tip: Floats, axis: Floats, spin: float, home: Floats) -> Floats | None:
    """`home` (J,) with the free joint where the tool has that spin (rad, see Toolpath) in the table frame;
    None where the tool leaves no joint free."""
    joint = free_joint(kin, tip, axis, home)
    if joint < 0:
        return None
    result, (at, after) = home.copy(), _spins(kin, tip, axis, home, joint)
    result[joint] += np.sign(wrap(after - at)) * wrap(spin - at)
    return result


def spin_of(kin: Kinematics, q: Floats) -> float:
    """The spin at joints (J,), as in Toolpath, rad."""
    return float(kin.pose(q[None])[2][0])


def spins_off(kin: Kinematics, q: Floats, tip: Floats, axis: Floats, spin: Floats) -> Floats:
    """By how much (N,) rad tools at joints (N, J), tips and axes (N, 3) are turned about themselves off
    `spin` (N,); 0 where that is NaN."""
    result, asked = np.zeros(len(q)), np.flatnonzero(np.isfinite(spin))
    if len(asked):
        found = kin.pose(q[asked], np.hstack((tip, axis))[asked])[2]
        result[asked] = np.abs(wrap(found - spin[asked]))
    return result


def _at(kin: Kinematics, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """Joints (J,) of the first branch."""
    return np.asarray(kin.inverse(tip[None], axis[None], near=near)[0, 0])


def _spins(kin: Kinematics, tip: Floats, axis: Floats, home: Floats, joint: int) -> tuple[Floats, Floats]:
    """The spin with the free joint as in `home`, and a little further."""
    further = home.copy()
    further[joint] += 0.1
    found = kin.pose(np.stack([_at(kin, tip, axis, near) for near in (home, further)]))[2]
    return found[0], found[1]
