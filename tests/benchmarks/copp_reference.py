"""Jerk-limited times by copp-py (`pip install copp-py`, not among the requirements): TOPP3-LP, a sequence of
linear programs on a grid in s with end conditions of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import ParametricPath
from toolpaths.arrays import Floats


def copp_times(path: ParametricPath, s: Floats, limits: JointLimits, passes: int,
               unit: float = 10.0) -> Iterator[float]:
    """Time of motion after each linear program on the grid s (N,); the parameter in units of `unit`, which suits it.

    The first one is linearised about the second-order optimum, each further one about the last motion.
    """
    import copp_py as copp

    at = path.derivatives(s)
    robot: Any = copp.Robot(at.q.shape[1], capacity=len(s))
    robot.append_s(s / unit)
    robot.set_q(at.q, at.dq * unit, at.d2q * unit**2, 0, dddq=at.d3q * unit**3)
    robot.add_velocity_limits(limits.velocity, -limits.velocity, start_idx_s=0)
    robot.add_acceleration_limits(limits.acceleration, -limits.acceleration, start_idx_s=0)
    second = copp.solver.topp2_ra.Problem(robot.constraints, idx_s_interval=(0, len(s) - 1),
                                          a_boundary=(0.0, 0.0))
    about: dict[str, Any] = {}
    speed = copp.solver.topp2_ra.solve(second, copp.solver.topp2_ra.Options())
    robot.add_jerk_limits(limits.jerk, -limits.jerk, start_idx_s=0)
    for _ in range(passes):
        problem = copp.solver.topp3_lp.Problem(robot.constraints, speed, idx_s_start=0, a_boundary=(0.0, 0.0),
                                               b_boundary=(0.0, 0.0), num_stationary_max=3, **about)
        found = copp.solver.topp3_lp.solve(problem)
        speed, about = found.a, {"b_linearization": np.asarray(found.b)}
        yield float(copp.interpolation.s_to_t_topp3(s / unit, found, 0.0)[0])
