"""Times that others have measured or computed, next to ours.

    python tests/benchmarks/published.py

Beudaert, Lavernhe, Tournier, Int. J. Machine Tools and Manufacture 57, 2012: plane cubic B-spline at 3 m/min on a Mikron
UCP 710 with SINUMERIK 840D, 2.4 s measured.

Ma et al., J. Computational Design and Engineering 2022: side of a pocket in five axes, axis from a curve at the bottom to
one at the top; 9.44 s printed, after 904 s of computing. Which of the rotary axes has 0.4 and which 0.8 rad/s, and how the
slides stand to them, is read as A and C of a turning and tilting table in this order; the slides limit nothing either way.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from postproc.clock.control import execute
from postproc.clock.path import CommandedPath
from postproc.clock.settings import ControlSettings
from postproc.feedrate.feed import AllowedFeed
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import SplinePath
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.windows import Method, solved
from tests.postproc.feedrate_reference import relaxed_time
from toolpaths.arrays import Floats

KNOTS = np.array([0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1])
POLES = np.array([[10, 0], [20, 27], [12, 8], [10, 20], [8, 8], [0, 27], [10, 0]], dtype=np.float64)
MEASURED, FEED = 2.4, 50.0
CHORDS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
LIMITS = ControlSettings(np.array([500.0, 500.0]), np.array([2500.0, 3000.0]), np.array([5000.0, 5000.0]))
"""mm/s, mm/s2, mm/s3 of X and Y, as the paper's table has them"""


def points(chord: float, decimals: int = 3) -> Floats:
    """(V, 2) of the curve, `chord` mm apart, rounded as a program is."""
    curve, u = BSpline(KNOTS, POLES, 3), np.linspace(0.0, 1.0, 20_001)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve(u), axis=0), axis=1))])
    count = round(float(s[-1]) / chord)
    return np.asarray(curve(np.interp(np.linspace(0.0, s[-1], count + 1), s, u)).round(decimals))


def commanded(q: Floats, tolerance: float = 0.02, feed: float = FEED) -> CommandedPath:
    """Points (V, A) as a continuous path at one feed."""
    length = np.linalg.norm(np.diff(q, axis=0), axis=1)
    return CommandedPath(q, length, np.full(len(length), feed), np.full(len(q), tolerance), np.zeros(len(q), dtype=bool),
                         np.ones(q.shape[1]))


def optimum() -> float:
    """s of the planner on the curve itself."""
    q = points(0.05, 9)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    limits = JointLimits(LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk)
    spline = make_interp_spline(s, q, 5)
    return plan(SplinePath(spline.t, spline.c, 5), limits, feed=FEED, options=PlannerOptions(strict=True)).seconds


def lower_bound() -> float:
    """s under velocity and acceleration alone, on the curve itself: no control is faster."""
    q = points(0.05, 9)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    spline = make_interp_spline(s, q, 5)
    limits = JointLimits(LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk)
    return plan_second_order(SplinePath(spline.t, spline.c, 5), limits, feed=FEED).seconds


PRINTED = 9.44
POCKET_KNOTS = np.array([0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 1, 1, 1, 1])
BOTTOM = np.array([[5, 0, 0], [-10, 20, 0], [10, 20, 0], [20, 30, 0], [30, 30, 0], [40, 30, 0], [50, 20, 0], [55, 0, 0]],
                  dtype=float)
TOP = np.array([[0, 0, 15], [-15, 20, 15], [5, 25, 15], [15, 35, 15], [30, 35, 15], [45, 35, 15], [55, 25, 15], [60, 0, 15]],
               dtype=float)


def pocket(tilting: float = 0.4, turning: float = 0.8) -> tuple[SplinePath, JointLimits]:
    """The joints X, Y, Z (of the tip), A, C along the bottom curve, and their limits."""
    u = np.linspace(0.0, 1.0, 801)
    tip, axis = (BSpline(POCKET_KNOTS, poles, 3)(u) for poles in (BOTTOM, TOP))
    axis = (axis - tip) / np.linalg.norm(axis - tip, axis=1)[:, None]
    q = np.column_stack((tip, np.arccos(axis[:, 2]), np.unwrap(np.arctan2(axis[:, 0], -axis[:, 1]))))
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
    spline = make_interp_spline(s, q, 5)
    limits = JointLimits(np.array([100.0, 100.0, 100.0, tilting, turning]), np.array([500.0] * 3 + [0.5] * 2),
                         np.array([3000.0] * 3 + [1.5] * 2))
    return SplinePath(spline.t, spline.c, 5), limits


def pocket_times(tilting: float, turning: float) -> tuple[float, float]:
    """(s of the planner, s below which no motion on its knots is)."""
    path, limits = pocket(tilting, turning)
    made = plan(path, limits, options=PlannerOptions(strict=True))
    piece = plan(path, limits).pieces[0]
    grid = MotionKnots(piece.eased, piece.profile.sigma, limits, AllowedFeed(np.inf, 1.0))
    return made.seconds, relaxed_time(grid.problem(), solved(grid, Method()).c)


def main() -> None:
    for tilting, turning in ((0.4, 0.8), (0.8, 0.4)):
        ours, bound = pocket_times(tilting, turning)
        print(f"pocket, A {tilting} and C {turning} rad/s: printed {PRINTED} s, planner {ours:.3f} s, "
              f"bound by duality {bound:.3f} s")
    by_step, times = replace(LIMITS, corner_step=np.full(2, 8.333)), []
    for chord in CHORDS:
        t, steps = (float(execute(commanded(points(chord)), one).seconds) for one in (LIMITS, by_step))
        times.append(t)
        print(f"chord {chord:4} mm: measured {MEASURED} s, control {t:.3f} s ({100 * (t / MEASURED - 1):+.1f} %), "
              f"corners by step {steps:.3f} s ({100 * (steps / MEASURED - 1):+.1f} %)")
    every = np.array([float(execute(commanded(points(chord)), LIMITS).seconds) for chord in np.linspace(0.05, 1.0, 39)])
    print(f"most over least: these chords {100 * (max(times) / min(times) - 1):.1f} %, 39 chords "
          f"{100 * (every.max() / every.min() - 1):.1f} %, {every.min():.3f} to {every.max():.3f} s")
    print(f"optimum of the planner {optimum():.3f} s, bound without jerk {lower_bound():.3f} s")


if __name__ == "__main__":
    main()
