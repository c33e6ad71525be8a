"""`time --check toppra`: the planned passes held against toppra's least time under velocity, acceleration and feed.

toppra (Pham and Pham, IEEE T-RO 34 (2018)) knows no jerk, so that no plan may be faster; how much longer the plan is says
what jerk costs. It gets the same paths on the same grids as the own second-order plan, each in units in which speeds are
about 1.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from postproc.cycle_time.planned import motion_of
from postproc.feedrate.feed import AllowedFeed
from postproc.feedrate.limits import JointLimits, MotorLimits
from postproc.feedrate.paths import ParametricPath
from postproc.feedrate.plan import plan_second_order
from postproc.feedrate.second_order import least_time
from postproc.pipeline.result import PostResult
from postproc.planning.geometry import MachinePath
from postproc.planning.planned import pass_feed
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import REPORT, Diagnostic, error
from toolpaths.extras import need

BEYOND = 1e-3
"""part by which a plan may seem faster than the second order on its grid"""
SLACK, STILL = 1e-9, 1e-9
"""of a speed, and mm or rad per s below which a joint stands"""


@dataclass(frozen=True)
class ToppraCheck:
    """Seconds of all passes: by toppra and by the own planner at second order, and as planned."""

    passes: int
    toppra: float
    own: float
    plan: float

    def as_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"passes": self.passes, "toppra_s": self.toppra, "second_order_s": self.own, "plan_s": self.plan}

    def line(self) -> str:
        """For people."""
        jerk = 100.0 * (self.plan / self.toppra - 1.0) if self.toppra > 0.0 else 0.0
        return (f"check by toppra, {self.passes} passes: second order {self.toppra:.3f} s, own second order {self.own:.3f} s"
                f", the plan {self.plan:.3f} s (jerk costs {jerk:.1f} %)")


def check(result: PostResult) -> tuple[ToppraCheck | None, list[Diagnostic]]:
    """The passes of a conversion by both planners; an error where a plan is faster than its lower bound.

    Raises:
        DiagnosticError: toppra is not there, or the passes cannot be planned.
    """
    motion = motion_of(result)
    if motion is None:
        return None, []
    bound = own = 0.0
    for one in motion.passes:
        limits, feed = motion.source.bounds_of(one), pass_feed(one, motion.source.moves)
        for path in one.paths:
            made = plan_second_order(path, limits, feed)
            own += made.seconds
            sigma = np.concatenate([piece.eased.parameter(piece.profile.sigma)[0] for piece in made.pieces])
            bound += least_seconds(path, limits, made.feed, np.clip(np.unique(sigma), path.start, path.end))
    found = ToppraCheck(len(motion.passes), bound, own, motion.seconds)
    if found.plan >= (1.0 - BEYOND) * found.toppra:
        return found, []
    return found, [error("time.check", f"the plan takes {found.plan:.4f} s, toppra's least time at second order is "
                         f"{found.toppra:.4f} s", file=result.toolpath.file, hint=REPORT)]


def least_seconds(path: MachinePath, limits: JointLimits, feed: AllowedFeed, s: Floats) -> float:
    """toppra's least time of a path from rest to rest on the grid s (N,), s.

    Raises:
        DiagnosticError: toppra is not there.
    """
    toppra, constraint = _toppra()
    at = path.derivatives(s)
    cap = np.minimum(feed(s), np.min(limits.velocity / np.maximum(np.abs(at.dq), STILL), axis=1))
    unit = float(np.median(cap))

    def derivative(_: object, x: Any, order: int = 0) -> Any:
        found = path.derivatives(np.clip(np.atleast_1d(x) * unit, s[0], s[-1]))[order] * unit**order
        return found[0] if np.ndim(x) == 0 else found

    made = type("Path", (toppra.interpolator.AbstractGeometricPath,), {
        "dof": path.joints, "path_interval": np.array([s[0], s[-1]]) / unit, "waypoints": None, "__call__": derivative})

    def velocity(x: float) -> Floats:
        place = np.clip(np.atleast_1d(x) * unit, s[0], s[-1])
        most = np.minimum(limits.velocity, np.abs(path.derivatives(place).dq[0]) * feed(place)[0] * (1.0 + SLACK) + STILL)
        return np.stack((-most, most), axis=1)

    both = constraint.DiscretizationType.Interpolation
    rows = [constraint.JointVelocityConstraintVarying(velocity),
            constraint.JointAccelerationConstraint(np.stack((-limits.acceleration, limits.acceleration), axis=1),
                                                   discretization_scheme=both)]
    if limits.forces is not None:
        rows.append(_force_rows(constraint.JointAccelerationConstraint, limits.forces, path, (unit, cap / unit), both))
    speed = toppra.algorithm.TOPPRA(rows, made(), gridpoints=s / unit, solver_wrapper="seidel").compute_parameterization(
        0.0, 0.0, return_data=True)[1]
    return float(least_time(s / unit, speed**2))


def _force_rows(base: Any, forces: MotorLimits, path: ParametricPath, scaled: tuple[float, Floats],
                both: Any) -> Any:
    """Limits of forces for toppra: its limits of acceleration, -1 to 1, of rows (a, b) in the place of (q', q''), and what
    is added to them; `scaled`: the unit of its parameter, the largest speeds in it at the grid points."""
    unit, speed = scaled

    def used(_: object, made: object, gridpoints: Floats, *more: Any) -> Any:
        at = path.derivatives(np.clip(gridpoints * unit, path.start, path.end))
        first, second, middle = forces.rows(at.q, at.dq * unit, at.d2q * unit**2, speed)
        stand_in = type("Rows", (), {"dof": first.shape[1], "__call__": lambda _, x, order: first if order == 1 else second})
        a, b, _, *rest = base.compute_constraint_params(rows, stand_in(), gridpoints, *more)
        return a, b, np.column_stack((middle, np.vstack((middle[1:], middle[-1:])))), *rest

    joints = path.derivatives(np.array([path.start])).q.shape[1]
    made = type("Forces", (base,), {"compute_constraint_params": used})
    rows = made(np.tile([-1.0, 1.0], (joints, 1)), discretization_scheme=both)
    return rows


def _toppra() -> tuple[Any, Any]:
    """The package and its constraints, imported where they are needed."""
    need("toppra", "--check toppra needs")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import toppra
        import toppra.algorithm
        from toppra import constraint
    return toppra, constraint
