"""Accelerations of a platform on legs, exact: the closed loops differentiated twice.

With r = B - A, r.r = l^2 gives r.r'' + r'.r' = l'^2 + l l'', and B'' = a + alpha x b + omega x (omega x b), A'' = A_q q''
+ A_qq q'^2: as Jx (a, alpha) = Jq q'' + what the rates alone do. Source: Company 2000, II-25; II-26 and II-27 take
differences there.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.leg_motion import LegMotion
from machines.kinematics.legs.loops import Loops
from machines.kinematics.sliders import solved
from toolpaths.arrays import Floats
from toolpaths.rotations import cross, dot


def leg_motion(loops: Loops, pose: tuple[Floats, Floats], joints: tuple[Floats, Floats, Floats]) -> LegMotion:
    """Of poses (C (N, 3), R (N, 3, 3)) and joints, their rates and accelerations, each (N, K)."""
    (place, turn), (q, rate, acceleration), drives = pose, joints, loops.drives
    arms, feet = loops.arms(turn), drives.feet(q)
    rods = loops.ends(place, turn) - feet
    rates = loops.rates(place, turn, q)
    twist = np.einsum("nik,nk->ni", rates, rate)
    omega = twist[:, None, 3:]
    moved = drives.moved(q)
    foot_rate = moved * rate[:, :, None]
    foot_acceleration = moved * acceleration[:, :, None] - drives.swung(q) * rate[:, :, None] ** 2
    end_rate = twist[:, None, :3] + cross(omega, arms)
    inward = cross(omega, cross(omega, arms))
    apart, span, span_rate, span_acceleration = (end_rate - foot_rate, drives.spans(q), drives.stretch * rate,
                                                 drives.stretch * acceleration)
    right = dot(rods, foot_acceleration - inward) - dot(apart, apart) + span_rate**2 + span * span_acceleration
    held = None if loops.holds is None else -loops.holds.bent(place, turn, twist)
    found = loops.twists(solved(loops.matrix(rods, arms, pose), loops.driven(right, held)))
    end_acceleration = found[:, None, :3] + cross(found[:, None, 3:], arms) + inward
    return LegMotion(place, turn, twist, found, rates, np.array(arms), feet, foot_rate, foot_acceleration, end_rate,
                     end_acceleration, np.array(moved), rods, span, span_rate, span_acceleration)
