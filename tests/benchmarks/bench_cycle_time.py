"""Figures of the cycle time: `python tests/benchmarks/bench_cycle_time.py [simulator|speed|calibration] ...`

simulator: our time compared with LinuxCNC's machine time, program by program. speed: seconds per 10^6 blocks, and as a share
of reading the program. calibration: hidden parameters found from noisy logs, and how often bands on other programs hold.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from postproc.cycle_time.bound import lower_bound
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.report import as_dict
from tests.linuxcnc import simulator, test_cycle_time
from tests.linuxcnc.time_programs import END, PROGRAMS
from tests.linuxcnc.time_programs import machine as untimed
from tests.postproc.time_fit import test_cycle_time_calibrate as calibration
from tests.postproc.time_kit import HEAD, blocks, machine, model

COUNT = 1_000_000
TRIALS = 40


def simulated() -> None:
    if reason := simulator.missing():
        print(reason)
        return
    off = []
    print("| program | simulator s | ours s | off | bound s |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (letters, text) in PROGRAMS.items():
            on = untimed(letters)
            measured = test_cycle_time.run(simulator.simulate, text + END, on, Path(folder)).seconds
            e = test_cycle_time.estimated(text + END, on)
            ours = test_cycle_time.in_motion(e)
            off.append(ours / measured - 1.0)
            print(f"| {name} | {measured:.3f} | {ours:.3f} | {100 * off[-1]:+.2f} % | {e.lower_bound:.2f} |")
    print(f"mean {100 * np.mean(np.abs(off)):.2f} %, most {100 * np.max(np.abs(off)):.2f} % of {len(off)} programs")


def surface(count: int, axes: str) -> str:
    """A wavy cut of short lines, with or without rotary axes."""
    k = np.arange(count)
    columns = [np.cumsum(0.05 * np.cos(k / 40)), np.cumsum(0.05 * np.sin(k / 55)), 200 + np.sin(k / 300)]
    columns += [20 + 10 * np.sin(k / 500), 0.01 * k] if len(axes) > 3 else []
    return "\n".join("G1 " + " ".join(f"{a}{v:.4f}" for a, v in zip(axes, row, strict=True))
                     for row in zip(*columns, strict=True))


def took(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def speed(count: int = COUNT) -> None:
    print(f"| {count} blocks | read s | model s | bound s | with band s | report s |\n|---|---|---|---|---|---|")
    for name, axes, letters, mode in (("3 axes", "XYZ", "mill-3axis", "G64 P0.01 Q0"),
                                      ("5 axes", "XYZAC", "mikron-ucp710", "G64 P0.01")):
        text, on = f"{HEAD} {mode}\nF3000\n{surface(count, axes)}", machine(letters)
        start = time.perf_counter()
        b = blocks(text, on)
        read = time.perf_counter() - start
        for kind in ("linuxcnc", "lookahead"):
            m = model(kind)
            timed(b, m)
            e = estimate(b, on, m)
            figures = took(lambda b=b, m=m: timed(b, m)), took(lambda b=b, m=m: lower_bound(b, m)), \
                took(lambda b=b, m=m, on=on: estimate(b, on, m)), took(lambda e=e: as_dict(e))
            print(f"| {name}, {kind} | {read:.2f} | " + " | ".join(f"{s:.2f} ({s / read:.2f} of reading)" for s in figures)
                  + " |")


def calibrated(trials: int = TRIALS) -> None:
    rng = np.random.default_rng(11)
    inside, off, narrower = [], [], []
    names = ("corner_tolerance", "block_time", "rapid", "override", "stop_time")
    for _ in range(trials):
        truth = calibration.hidden(rng)
        made = calibration.fit(truth, rng)
        off.append([abs(np.log(made.values[name][0] / getattr(truth, name))) for name in names])
        for seed in (1, 2, 3):
            other = calibration.finishing(seed)
            e, wide = (estimate(other, machine(), m) for m in (made.model, model("lookahead")))
            inside.append(e.band[0] <= total(other, timed(other, truth)) <= e.band[1])
            narrower.append((e.band[1] - e.band[0]) / (wide.band[1] - wide.band[0]))
    print(f"{trials} hidden sets of parameters, {calibration.CLOCK * 1e3:g} ms of noise on every time stamp")
    for name, values in zip(names, np.transpose(off), strict=True):
        print(f"  {name:18} off by {100 * np.median(values):.1f} % (median), {100 * np.quantile(values, 0.95):.1f} % (95 %)")
    print(f"  bands on {len(inside)} other programs hold in {100 * np.mean(inside):.1f} %, at "
          f"{100 * np.median(narrower):.0f} % of their width before")


if __name__ == "__main__":
    wanted = sys.argv[1:] or ["simulator", "speed", "calibration"]
    for part, run in (("simulator", simulated), ("speed", speed), ("calibration", calibrated)):
        if part in wanted:
            run()
