"""Correction of geometric errors: what is left, and its time beside the inverse kinematics, in one run.

    python tests/benchmarks/bench_compensation.py [POINTS]

Realistic errors (all component errors and locations of serial machines, all dimensions of parallel ones: 10 to 50 um, 5 to
20 arcsec and more at the tip). Joint commands before formatting; axis figures away from poles, where the turn is free, and
over all points. Processor time, best of two.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

import machines
from machines.geometric_error.correction import correct
from tests.machines.error_models import joints, model
from toolpaths.units import DEG

NAMES = ("mikron-ucp710", "nutating-head", "head-table", "mill-4axis", "mill-3axis", "uranesx", "h4a-c-table",
         "h4a-spindle-axis")
TOOL, ARCSEC = 80.0, DEG / 3600.0


def seconds(run: Callable[[], object]) -> float:
    """Best of two."""
    best = np.inf
    for _ in range(2):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return float(best)


def main() -> None:
    """Print the table."""
    n = int(float(sys.argv[1])) if len(sys.argv) > 1 else 100_000
    print(f"{n} points          tip um           axis arcsec                    s      times")
    print("                 before   after   before  after (poles)  steps  correct  inverse")
    for name in NAMES:
        kin = machines.load(name).kinematics.with_tool(TOOL)
        actual, q = model(kin, 11).on(kin), joints(kin, n, 7)
        tip, axis = kin.forward(q)
        found = correct(actual, q, tip, axis)
        away = ~found.partial
        inverse, corrected = seconds(lambda k=kin, t=tip, a=axis: k.inverse(t, a)), \
            seconds(lambda m=actual, j=q, t=tip, a=axis: correct(m, j, t, a))
        print(f"{name:16} {1e3 * found.tip_before.max():6.1f} {1e3 * found.tip_after.max():8.1e} "
              f"{found.axis_before.max() / ARCSEC:7.1f} {found.axis_after[away].max(initial=0.0) / ARCSEC:8.1e} "
              f"({found.axis_after.max() / ARCSEC:5.1f}) {found.steps:4} {corrected:9.2f} {corrected / inverse:7.1f}")


if __name__ == "__main__":
    main()
