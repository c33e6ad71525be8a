"""Rotary joints of a planned path where it passes near a singular direction.

Where the tool lies nearly along a rotary axis, deviations of its direction far inside the tolerance turn that
axis by any angle, so that joints solved from a smoothed direction are noise there. Inside such a zone the
rotary joints are those of a spline through the joints before and behind it; the slides keep the tip. Where
the tool axis would leave the tolerance by that (the rotary axis really has to swing), the solved joints stay.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import angle_between

ZONE = np.sin(np.radians(1.0))
"""Sine of the angle between tool and rotary axis below which joints are not solved from the direction."""
DEGREE = 5
CHUNK = 32768


def past_poles(s: Floats, q: Floats, tip: Floats, axis: Floats, near: Bools, kin: Kinematics,
               tolerance: float) -> tuple[Floats, Bools]:
    """Joints (N, J) at rising s (N,) with the zones led through, and True (N,) where that was done.

    Args:
        q (N, J): joints solved for tip and axis (N, 3)
        near (N,): of `near_poles`
        tolerance: rad that the axis may be off by it
    """
    inside = near.copy()
    inside[[0, -1]] = False
    led = np.zeros(len(s), dtype=bool)
    if not kin.straight_slides or not inside.any() or (~inside).sum() <= DEGREE:
        return q, led
    rotary = np.array(kin.rotary)
    changed = q.copy()
    from scipy.interpolate import make_interp_spline

    through = make_interp_spline(s[~inside], q[~inside][:, rotary], k=DEGREE)
    where = np.flatnonzero(inside)
    changed[np.ix_(where, rotary)] = through(s[where])
    changed[where] = kin.at_tip(tip[where], changed[where], np.flatnonzero(~rotary))
    off = np.zeros(len(s))
    off[where] = angle_between(kin.forward(changed[where])[1], axis[where])
    zone = np.cumsum(np.diff(inside.astype(np.int64), prepend=0) == 1)
    worst = np.zeros(int(zone[-1]) + 1)
    np.maximum.at(worst, zone[where], off[where])
    led[where] = worst[zone[where]] <= tolerance
    return np.where(led[:, None], changed, q), led


def near_poles(q: Floats, kin: Kinematics) -> Bools:
    """(N,) places where the tool lies nearly along a rotary axis of a machine that has two."""
    rotary = np.flatnonzero(np.array(kin.rotary))
    result = np.zeros(len(q), dtype=bool)
    if len(rotary) < 2:
        return result
    for k in range(0, len(q), CHUNK):
        turned = np.linalg.norm(kin.jacobian(q[k:k + CHUNK])[:, 3:][:, :, rotary], axis=1)
        result[k:k + CHUNK] = (turned < ZONE).any(axis=1)
    return result
