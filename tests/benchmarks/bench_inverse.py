"""Time of the inverse for a million points, parallel machines compared with a serial one, in one run.

    python tests/benchmarks/bench_inverse.py [POINTS]

Processor time, best of three; the ratio is to the serial machine with two rotary axes.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import machines
from toolpaths.arrays import Floats

SERIAL = "mikron-ucp710"
NAMES = (SERIAL, "mill-3axis", "uranesx", "delta-hybrid", "linuxcnc-lineardelta", "h4a-c-table",
         "h4a-spindle-axis")
TOOL = 60.0


def poses(name: str, n: int) -> tuple[Floats, Floats]:
    """n poses that the machine can take, tool axes within 25 degrees of z where it can tilt."""
    rng = np.random.default_rng(0)
    kinematics = machines.load(name).kinematics
    tilt, heading = np.radians(rng.uniform(0.5, 25.0, n)), rng.uniform(-np.pi, np.pi, n)
    axis = np.stack([np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)], axis=1)
    axis = kinematics.nearest_axis(axis)
    home = kinematics.with_tool(TOOL).forward(machines.load(name).home[None])[0]
    return home + rng.uniform(-40.0, 40.0, (n, 3)), axis


def seconds(name: str, n: int) -> tuple[float, int]:
    """(processor seconds of `inverse`, branches)."""
    kinematics = machines.load(name).kinematics.with_tool(TOOL)
    tip, axis = poses(name, n)
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        q = kinematics.inverse(tip, axis)
        best = min(best, time.process_time() - start)
    if not np.isfinite(q[0]).all():
        raise SystemExit(f"{name}: {np.isnan(q[0]).any(axis=1).sum()} poses are out of reach")
    return best, kinematics.branches


def main() -> None:
    """Print the table."""
    n = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000
    found = {name: seconds(name, n) for name in NAMES}
    print(f"inverse of {n} poses   seconds  branches  times {SERIAL}")
    for name, (time_taken, branches) in found.items():
        print(f"  {name:22} {time_taken:7.3f}  {branches:8}  {time_taken / found[SERIAL][0]:7.2f}")


if __name__ == "__main__":
    main()
