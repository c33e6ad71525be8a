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
from postproc.feedrate.motion import CHUNK, SAMPLE, MotionPiece, Plan
from postproc.feedrate.paths import Eased, ParametricPath
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.profile import Profile, linear_profile, spline_profile
from postproc.feedrate.rows import forces_bind, rows, steady_force_speed, steady_tool_speed
from postproc.feedrate.second_order import second_order
from postproc.feedrate.shares import shares
from postproc.feedrate.solve_again import solved_again
from postproc.feedrate.spline import rest_basis
from postproc.feedrate.tightening import SPLIT, tightened
from postproc.feedrate.windows import Method, SolvedWindows
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

ROUNDS = 12
FITS = 0.9995
"""Ratio, as a factor on time, from which a strict plan is fast enough, for the first TRIES looks at its samples."""
TRIES = 3


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
        profile, report, slower = _solve(MotionKnots(eased, sigma, felt, allowed), options)
        pieces.append(MotionPiece(eased, profile, shares(report.weights, len(limits.velocity), float(profile.times[-1]))))
        reports.append(report)
        guess.append(slower)
    made = Plan(tuple(pieces), limits, allowed, options.step, max(r.iterations for r in reports),
                max(r.mismatch for r in reports), all(r.solved for r in reports))
    return _within(made, np.array(guess)) if options.strict or not made.solved else made


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
        most, dq, d2q = limits.acceleration, at.dq, at.d2q
        if limits.tool is not None or limits.forces is not None:
            found = rows(eased, sigma, limits, allowed)
            most, dq, d2q = found.limits.acceleration, found.dq, found.d2q
            cap = found.cap if limits.tool is None else np.minimum(
                found.cap, steady_tool_speed(eased, sigma, limits.tool) ** 2)
        x = second_order(sigma, dq, d2q, most, cap, options.method.kernel)
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


def _solve(grid: MotionKnots, options: PlannerOptions) -> tuple[Profile, SolvedWindows, float]:
    """One solve; in strict mode again with tightened limits where they are exceeded between the knots.

    The fastest of them with the factor on time that it still needs there; 1 in fast mode.
    """
    grid, report = solved_again(grid, options.method)
    profile = _profile(grid, report.c)
    if not options.strict:
        return profile, report, 1.0
    slower, better = tightened(grid, profile, SPLIT[0], bool(options.method.kernel))
    best = slower * float(profile.times[-1]), slower, grid, report
    for before in range(1, options.passes + 1):
        if better is None:
            break
        grid, report = solved_again(better, options.method, report.c if len(better.sigma) == len(grid.sigma) else None)
        profile = _profile(grid, report.c)
        slower, better = tightened(grid, profile, SPLIT[min(before, len(SPLIT) - 1)],
                                   bool(options.method.kernel))
        best = min(best, (slower * float(profile.times[-1]), slower, grid, report), key=lambda one: one[0])
    _, slower, grid, last = best
    return profile if last is report else _profile(grid, last.c), last, slower


def _profile(grid: MotionKnots, c: Floats) -> Profile:
    """Piecewise cubic, made in chunks."""
    count = len(grid.sigma)
    cuts = np.linspace(0, count, max(1, count // CHUNK) + 1).astype(int)
    pieces = np.empty((4, count - 1))
    for first, last in pairwise(cuts.tolist()):
        stop = min(last + 1, count)
        basis = rest_basis(grid.sigma, grid.eased.ease, first, stop)
        pieces[:, first:stop - 1] = spline_profile(grid.sigma[first:stop], basis, c[first:stop + 2]).pieces
    return Profile(grid.sigma, pieces)


def _within(made: Plan, guess: Floats) -> Plan:
    """Slow each piece down until nothing is exceeded in the samples that are delivered, first by `guess`.

    All limits are homogeneous in time, so that x/g^2 divides velocity by g, acceleration by g^2 and jerk by
    g^3. Samples of the slower motion fall elsewhere, so it is measured again.
    """
    factor = guess
    for turn in range(ROUNDS):
        pieces = tuple(piece if g == 1.0 else piece.slower(g)
                       for piece, g in zip(made.pieces, factor.tolist(), strict=True))
        made = replace(made, pieces=pieces)
        needed = _needed(made)
        fits = (needed <= 1.0) & (needed > (FITS if turn < TRIES else 0.0))
        if fits.all():
            return made
        factor = np.where(fits, 1.0, needed * (1.0 + 1e-6 * 4.0**turn))
    raise ArithmeticError(f"limits still exceeded by {needed.max() - 1.0:.2g} after slowing down {ROUNDS} times")


def _needed(made: Plan) -> Floats:
    """Factor on the time of each piece that its samples ask for."""
    needed = np.zeros(len(made.pieces))
    for chunk, own in made.chunks():
        which = np.minimum(np.searchsorted(made.ends, chunk.t[own], side="right"), len(needed) - 1)
        np.maximum.at(needed, which, chunk.worst_slowdown(made.limits)[own])
    return needed
