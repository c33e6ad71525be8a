"""Times that others have measured or computed, next to ours.

    python tests/benchmarks/published.py

Beudaert, Lavernhe, Tournier, Int. J. Machine Tools and Manufacture 57, 2012: plane cubic B-spline at 3 m/min on a Mikron
UCP 710 with SINUMERIK 840D, 2.4 s measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from postproc.clock.control import execute
from postproc.clock.path import CommandedPath
from postproc.clock.settings import ControlSettings
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import SplinePath
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from toolpaths.arrays import Floats

KNOTS = np.array([0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1])
POLES = np.array([[10, 0], [20, 27], [12, 8], [10, 20], [8, 8], [0, 27], [10, 0]], dtype=np.float64)
MEASURED, FEED = 2.4, 50.0
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


def main() -> None:
    for chord in (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0):
        t = float(execute(commanded(points(chord)), LIMITS).seconds)
        print(f"chord {chord:4} mm: measured {MEASURED} s, control {t:.3f} s ({100 * (t / MEASURED - 1):+.1f} %)")
    print(f"optimum of the planner {optimum():.3f} s, bound without jerk {lower_bound():.3f} s")


if __name__ == "__main__":
    main()
