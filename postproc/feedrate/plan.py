"""The planner: path, limits, feed and stops in; the motion of least time out. It knows no machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import partial
from itertools import pairwise

import numpy as np

from postproc.feedrate.feed import AllowedFeed, FeedLimit
from postproc.feedrate.limits import JointLimits, squared_speed
from postproc.feedrate.mesh import Marks, Spacing, mesh, ramp_time
from postproc.feedrate.motion import SAMPLE, MotionPiece, Plan
from postproc.feedrate.paths import Eased, ParametricPath
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.profile import knots_profile, linear_profile, spline_profile
from postproc.feedrate.rows import forces_bind, rows, steady_force_speed, steady_tool_speed
from postproc.feedrate.second_order import second_order
from postproc.feedrate.shares import shares
from postproc.feedrate.slowdown import slowed_within
from postproc.feedrate.solve_again import solved_again
from postproc.feedrate.strict import strictly
from postproc.feedrate.windows import Method, SolvedWindows
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass


@dataclass(frozen=True)
class PlannerOptions:
    """`ease`: length of path at each stop over which the parameter is changed; `spacing` of knots; `method` of solving;
    `strict`: nothing exceeded in the delivered samples; `step` of these; `passes` of tightening in strict mode;
    `override`: factor on the feed, as the operator's switch; limits of the machine stay."""

    ease: float = 25.0
    spacing: Spacing | None = None
    method: Method = field(default_factory=Method)
    strict: bool = False
    step: float = SAMPLE
    passes: int = 3
    override: float = 1.0

    @property
    def knots(self) -> Spacing:
        """`spacing`, by default narrower in strict mode, where each per mille between the knots slows the whole piece."""
        return self.spacing or Spacing(dt=2e-3 if self.strict else 2.5e-3)


def plan(path: ParametricPath, limits: JointLimits, feed: FeedLimit = np.inf, stops: Sequence[float] = (),
         options: PlannerOptions | None = None,
         knots: Floats | None = None) -> Plan:
    """Least time under velocity, acceleration, jerk and feed, from rest at the start to rest at the end.

    Args:
        path: three times continuously differentiable between `stops`
        limits: per joint of the path, jerk finite
        feed: largest ds/dt
        stops: s of exact stops inside the path; corners must be among them
        options: see `PlannerOptions`
        knots: sigma of the knots, instead of the mesh; only without stops

    What is not solved at once is solved again on finer knots (`retried`). A motion that is not `solved` even
    then is slowed down until its samples keep all limits, as in strict mode: it takes longer than it need,
    and exceeds nothing.

    Raises:
        ValueError: stops outside the path or not rising; knots with stops; an infinite jerk limit everywhere.
    """
    options = options or PlannerOptions()
    if not np.all(np.isfinite(limits.jerk)):
        raise ValueError("a joint without a jerk limit: plan_second_order is for machines that state none")
    allowed = AllowedFeed(feed, options.override)
    if knots is not None and len(stops):
        raise ValueError("knots are for a motion without stops")
    pieces, reports, guess = [], [], []
    stretches = _stretches(path, stops, options.ease)
    options = replace(options, method=options.method.settled())
    for eased in stretches:
        sigma = knots if knots is not None else mesh_between(eased, limits, allowed, options.knots)
        felt = limits if forces_bind(eased, sigma, limits, allowed) else replace(limits, forces=None)
        found, report, slower = _solve(MotionKnots(eased, sigma, felt, allowed), options)
        profile = (knots_profile(found.sigma, eased.ease, report.c) if report.basis is None else
                   spline_profile(found.sigma, report.basis, report.c))
        pieces.append(MotionPiece(eased, profile, shares(report.weights, len(limits.velocity), float(profile.times[-1]))))
        reports.append((report.iterations, report.mismatch, report.solved))
        guess.append(slower)
        del found, report
    made = Plan(tuple(pieces), limits, allowed, options.step, max(one[0] for one in reports),
                max(one[1] for one in reports), all(one[2] for one in reports))
    return slowed_within(made, np.array(guess)) if options.strict or not made.solved else made


def plan_second_order(path: ParametricPath, limits: JointLimits, feed: FeedLimit = np.inf, stops: Sequence[float] = (),
                      options: PlannerOptions | None = None, knots: Floats | None = None) -> Plan:
    """Least time under velocity, acceleration and feed only: a bound, and the plan of machines that state no jerk.

    A jerk limit of the tool holds where the speed is constant.
    """
    options = options or PlannerOptions()
    allowed = AllowedFeed(feed, options.override)
    pieces = []
    for eased in _stretches(path, stops, 0.0):
        sigma = knots if knots is not None else mesh_between(eased, limits, allowed, options.knots)
        at = eased.derivatives(sigma)
        cap = np.minimum(squared_speed(at.dq, limits.velocity), allowed(eased.parameter(sigma)[0]) ** 2)
        most, dq, d2q, middle = limits.acceleration, at.dq, at.d2q, None
        if limits.tool is not None or limits.forces is not None:
            found = rows(eased, sigma, limits, allowed)
            most, dq, d2q, middle = found.limits.acceleration, found.dq, found.d2q, found.middle
            cap = found.cap if limits.tool is None else np.minimum(
                found.cap, steady_tool_speed(eased, sigma, limits.tool) ** 2)
        x = second_order(sigma, dq, d2q, most, cap, options.method.kernel, middle)
        pieces.append(MotionPiece(eased, linear_profile(sigma, x)))
    return Plan(tuple(pieces), limits, allowed, options.step)


def mesh_between(eased: Eased, limits: JointLimits, feed: AllowedFeed, spacing: Spacing) -> Floats:
    """Knots between two stops, fine enough next to them and where the feed changes."""
    ends = np.array([eased.first, np.nextafter(eased.last, eased.first)])
    ramp = ramp_time(eased.path.derivatives(ends).dq, limits, feed(ends))
    marks = None
    if feed.steady and np.all(np.isfinite(feed(ends))):
        inside = feed.breaks[(feed.breaks > eased.first) & (feed.breaks < eased.last)]
        marks = Marks(eased.sigma(inside), eased.speed_limit(eased.sigma(inside), feed))
    return mesh(eased, limits, partial(_top, eased, limits, None if marks else feed), spacing, ramp, marks)


def _top(eased: Eased, limits: JointLimits, feed: AllowedFeed | None, sigma: Floats) -> Floats:
    """Largest constant sigma_dot (N,) under the feed, unless it has marks of its own, and limits of tool and forces."""
    allowed = np.full(len(sigma), np.inf) if feed is None else eased.speed_limit(sigma, feed)
    if limits.tool is not None:
        allowed = np.minimum(allowed, steady_tool_speed(eased, sigma, limits.tool))
    return allowed if limits.forces is None else np.minimum(allowed, steady_force_speed(eased, sigma, limits.forces))


def _stretches(path: ParametricPath, stops: Sequence[float], ease: float) -> list[Eased]:
    """One eased stretch between each two stops."""
    ends = np.concatenate(([path.start], np.asarray(stops, dtype=np.float64), [path.end]))
    if np.any(np.diff(ends) <= 0.0):
        raise ValueError(f"stops must rise strictly between {path.start} and {path.end}, found {list(stops)}")
    return [Eased.between(path, first, last, ease) for first, last in pairwise(ends)]


def _solve(grid: MotionKnots, options: PlannerOptions) -> tuple[MotionKnots, SolvedWindows, float]:
    """One solve; in strict mode again where limits are exceeded between the knots.

    With the factor on time that it still needs there; 1 in fast mode.
    """
    if not options.strict:
        return *solved_again(grid, options.method), 1.0
    found = strictly(grid, options.method, options.passes)
    return found.grid, found.report, found.slower
