"""Reach along a path on which the axes turn: what velocity, acceleration and jerk of the joints leave along it.

With X = X(q), X''' = J q''' + 2 J' q'' + J'' q' (equation 3 of Grandguillaume, Lavernhe and Tournier 2017, derivatives by
time): where rotary joints turn, the polytope of a machine is moved by the last two terms as well as turned. A path that tool
and axis must keep leaves one freedom, s(t). Along it the same is said by the joints themselves: q' = dq/ds s', and
    |q_s s'| <= V,   |q_s s'' + q_ss s'^2| <= A,   |q_s s''' + 3 q_ss s' s'' + q_sss s'^3| <= J,
so that the reach at a place is the end of the interval of s', s'' or s''' that all joints leave. Each is given at the ball's
centre, whose path is the same whatever the axes are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.plan import plan
from postproc.joints.joint_path import nearest_solution
from postproc.orientation.turning.cutting_runs import TurningStretch
from postproc.orientation.turning.kept_contact import corner_centre
from postproc.orientation.turning.tilt_search import TiltField
from postproc.planning.geometry import MachinePath
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

PLACES = 400
"""of a stretch"""


@dataclass(frozen=True)
@arrays(s="N", speed="N", velocity="N", acceleration="N", jerk="N")
class ReachAlong:
    """At places s (N,) mm along a run, of the ball's centre: planned `speed` and largest `velocity`, mm/s; largest
    `acceleration`, mm/s2, at the planned speed, and largest `jerk`, mm/s3, at the planned speed and acceleration.

    `seconds`: planned, of the whole stretch.
    """

    s: Floats
    speed: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    seconds: float


def reach_along(stretch: TurningStretch, made: TiltField, limits: JointLimits) -> ReachAlong:
    """The reach along a stretch with the axes of a field; `limits` of the machine at feed, jerk finite."""
    limits = replace(limits, forces=None, tool=None)
    axis = made.turned(stretch.axis, made.at(stretch.s))
    kin, normal = made.run.whole.kin, made.run.normal_at(stretch.s)
    tip = made.run.kept(stretch.tip, stretch.axis, axis, normal)
    q = nearest_solution(kin, tip, axis, stretch.q) if made.field.any() else stretch.q
    path = MachinePath.through(stretch.s, np.hstack((q, tip, axis)), np.zeros(len(q), dtype=bool))
    motion = plan(path, limits, stretch.feed)
    s = np.linspace(stretch.s[0], stretch.s[-1], PLACES + 2)[1:-1]
    at, speed = path.derivatives(s), motion.speed(s)
    change = 0.5 * np.gradient(speed**2, s)
    corner = stretch.tip + corner_centre(stretch.axis, made.run.end, normal)
    centre = np.stack([np.interp(s, stretch.s, column) for column in corner.T], axis=1)
    scale = np.linalg.norm(np.gradient(centre, s, axis=0), axis=1)
    v = speed[:, None]
    with np.errstate(divide="ignore"):
        velocity = (limits.velocity / np.abs(at.dq)).min(axis=1)
    return ReachAlong(s, scale * speed, scale * velocity,
                      scale * _most(at.dq, at.d2q * v**2, limits.acceleration),
                      scale * _most(at.dq, at.d3q * v**3 + 3.0 * at.d2q * v * change[:, None], limits.jerk),
                      motion.seconds)


def _most(slope: Floats, taken: Floats, limit: Floats) -> Floats:
    """(N,) largest x with |slope x + taken| <= limit (J,) in every joint, slope and taken (N, J); 0 where none is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        left = (limit - np.sign(slope) * taken) / np.abs(slope)
    return np.asarray(np.maximum(np.where(slope == 0.0, np.inf, left).min(axis=1), 0.0))
