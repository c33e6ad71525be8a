"""Speed, memory and optimality of the planned motion, compared with toppra, Clarabel and copp-py in one run.

    python tests/benchmarks/bench_feedrate.py [speed] [cl] [copp] [memory] [optimality] [corners] [limits] [stops]

speed: points per second of processor against toppra (velocity and acceleration only), path evaluation included, medians of
interleaved runs ("2 threads" by the clock on the wall).
cl: the same on smoothed CL points, knots by the mesh. copp: against copp-py's TOPP3-LP, where that is
installed. memory: growth of the resident set at 10^6 knots, in a process of its own. optimality: 150 random paths
against a converged sequence of convex problems. corners: strict next to the optimum on polylines with tight blends.
limits: worst ratio in the 1 ms samples, fast and strict. stops: a stop each 2 mm. Compiled code is warm.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import gc
import logging
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from postproc.feedrate.interior import NumpySteps
from postproc.feedrate.limits import JointLimits, squared_speed
from postproc.feedrate.mesh import Spacing
from postproc.feedrate.motion import Plan
from postproc.feedrate.paths import Eased, SplinePath
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.second_order import least_time, second_order
from postproc.feedrate.windows import Method, solve_problem
from postproc.planning.geometry import MachinePath
from tests.benchmarks.copp_reference import copp_times
from tests.benchmarks.feedrate_paths import blended, cl_path
from tests.postproc.feedrate.test_feedrate_second_order import toppra_time
from tests.postproc.feedrate_kit import MIKRON, bezier, random_path, uniform, zigzag
from tests.postproc.feedrate_reference import least_jerk_time
from toolpaths.arrays import Floats

STEP = 0.1


def own_second_order(path: SplinePath, sigma: Floats) -> float:
    at = path.derivatives(sigma)
    cap = squared_speed(at.dq, MIKRON.velocity)
    return least_time(sigma, second_order(sigma, at.dq, at.d2q, MIKRON.acceleration, cap, kernel=True))


PATHS = [("bezier", bezier(), 1000, 7), ("bezier", bezier(), 10_000, 5), ("zigzag", zigzag(100.0), 1000, 7),
         ("zigzag", zigzag(1000.0), 10_000, 5), ("zigzag", zigzag(10_000.0), 100_000, 3),
         ("zigzag", zigzag(100_000.0), 1_000_000, 1)]
COLUMNS = ("2nd", "fast", "2 threads", "mesh", "strict", "numpy")
Run = Callable[[], tuple[float, int]]
"""A plan's time of motion and its number of points."""


def jerk(path: SplinePath, knots: Floats | None, strict: bool = False, threads: int = 1,
         kernel: bool = True) -> Run:
    def run() -> tuple[float, int]:
        options = PlannerOptions(method=Method(kernel=kernel, threads=threads), strict=strict)
        made = plan(path, MIKRON, options=options, knots=knots)
        return made.seconds, len(made.pieces[0].profile.sigma)
    return run


def contenders(path: SplinePath, count: int) -> dict[str, Run]:
    """toppra and the own plans of one path; without numpy on the longest."""
    plain = np.linspace(path.start, path.end, count + 1)
    sigma = np.linspace(0.0, Eased.between(path, path.start, path.end, 25.0).end, count + 1)
    runs: dict[str, Run] = {
        "toppra": lambda: (toppra_time(path, plain), count + 1), "2nd": lambda: (own_second_order(path, plain), count + 1),
        "fast": jerk(path, sigma), "2 threads": jerk(path, sigma, threads=2), "mesh": jerk(path, None),
        "strict": jerk(path, None, strict=True)}
    if count <= 100_000:
        runs["numpy"] = jerk(path, sigma, kernel=False)
    return runs


def speed() -> None:
    """Interleaved runs on uniform grids (2nd, fast, 2 threads, numpy) and on the mesh (mesh, strict)."""
    print(f"{'path, points':16} {'toppra':>10} | points per second over toppra's:",
          "".join(f"{name:>10}" for name in COLUMNS), sep="")
    for name, path, count, repeats in PATHS:
        runs = contenders(path, count)
        motion = {key: run()[0] for key, run in runs.items()} if repeats > 1 else {}
        rates: dict[str, list[float]] = {key: [] for key in runs}
        for _ in range(repeats):
            for key, run in runs.items():
                clock = time.perf_counter if key == "2 threads" else time.process_time
                start = clock()
                motion[key], points = run()
                rates[key].append(points / (clock() - start))
        rate = {key: statistics.median(values) for key, values in rates.items()}
        ratios = "".join(f"{rate[key] / rate['toppra']:10.1f}" if key in rate else "         -" for key in COLUMNS)
        print(f"{name + ' ' + str(count):16} {rate['toppra'] / 1e3:6.1f} k/s |{' ' * 33}{ratios}", flush=True)
        print(f"    motion: 2nd {motion['2nd']:.4f} s, over toppra's {motion['2nd'] / motion['toppra'] - 1.0:+.0e}; "
              f"jerk fast {motion['fast']:.4f} s, on the mesh {motion['mesh']:.4f} s, "
              f"strict {motion['strict'] / motion['mesh'] - 1.0:+.2%}")


def cl() -> None:
    """Smoothed CL points on the Mikron UCP 710; toppra on as many equal steps as the mesh has knots."""
    for points in (5000, 50_000):
        path, most = cl_path(points)
        count = len(plan(path, most, options=PlannerOptions(method=Method(kernel=True))).pieces[0].profile.sigma)
        plain = np.linspace(path.start, path.end, count)

        def own(strict: bool, path: MachinePath = path, most: JointLimits = most) -> Plan:
            return plan(path, most, options=PlannerOptions(method=Method(kernel=True), strict=strict))

        rates: dict[str, list[float]] = {"toppra": [], "fast": [], "strict": []}
        for _ in range(3):
            start = time.process_time()
            toppra_time(path.spline, plain)
            rates["toppra"].append(count / (time.process_time() - start))
            made = {}
            for name in ("fast", "strict"):
                start = time.process_time()
                made[name] = own(name == "strict")
                rates[name].append(len(made[name].pieces[0].profile.sigma) / (time.process_time() - start))
        rate = {name: statistics.median(values) for name, values in rates.items()}
        print(f"{points} CL points, {path.end:.0f} mm, {count} knots: fast {rate['fast'] / rate['toppra']:.1f}, strict "
              f"{rate['strict'] / rate['toppra']:.1f} times toppra's points per second ({rate['toppra'] / 1e3:.1f} k/s); "
              f"worst ratio {made['fast'].usage().worst:.3f}, strict {made['strict'].usage().worst:.9f}; "
              f"strict {made['strict'].seconds / made['fast'].seconds - 1.0:+.2%}", flush=True)


def copp() -> None:
    """Time to solution and time of motion after 1 to 4 linear programs."""
    if find_spec("copp_py") is None:
        print("copp-py is not installed; left out")
        return
    for name, path, count, _ in (PATHS[0], PATHS[2], PATHS[3]):
        run = jerk(path, uniform(path, count).sigma)
        run()
        times = []
        for _ in range(5):
            start = time.process_time()
            motion, _ = run()
            times.append(time.process_time() - start)
        own, start = statistics.median(times), time.process_time()
        found = [(time.process_time() - start, seconds) for seconds in
                 copp_times(path, np.linspace(path.start, path.end, count + 1), MIKRON, 4)]
        print(f"{name} {count}: own {own * 1e3:.1f} ms, motion {motion:.4f} s; TOPP3-LP after 1 to 4 programs: "
              + ", ".join(f"{spent / own:.0f}x as long, motion {seconds / motion - 1.0:+.2%}" for spent, seconds in found),
              flush=True)


def corners() -> None:
    """Strict next to one solve on knots three times as dense, which exceeds limits between them but is no slower."""
    worst = []
    for seed in range(6):
        for size in (0.004, 0.015, 0.06):
            path = blended(seed, size)
            dense = plan(path, MIKRON, options=PlannerOptions(spacing=Spacing(dt=8e-4))).seconds
            strict = plan(path, MIKRON, options=PlannerOptions(strict=True))
            assert strict.usage().worst <= 1.0
            worst.append((strict.seconds / dense - 1.0, size))
    print(f"18 polylines with blended corners: strict above the dense optimum median "
          f"{statistics.median(above for above, _ in worst):.2%}, most {max(worst)[0]:.2%} (corner {max(worst)[1]} mm)")


def stops() -> None:
    """500 stops."""
    path, places = zigzag(1000.0), np.linspace(0.0, 1000.0, 501)[1:-1].tolist()
    for strict in (False, True):
        start = time.process_time()
        made = plan(path, MIKRON, stops=places, options=PlannerOptions(strict=strict, method=Method(kernel=True)))
        print(f"a stop each 2 mm, {'strict' if strict else 'fast'}: {(time.process_time() - start) / 0.5:.1f} ms per stop, "
              f"{made.seconds:.1f} s of motion")


def peak() -> float:
    """Highest resident set since the peak was last forgotten, MB."""
    status = Path("/proc/self/status").read_text().split()
    return int(status[status.index("VmHWM:") + 1]) / 1024.0


def memory() -> None:
    """Growth of the peak resident set by planning 10^6 knots, the path itself left out."""
    if "--inner" not in sys.argv:
        subprocess.run([sys.executable, __file__, "memory", "--inner"], check=True)
        return
    small = zigzag(3000.0)
    for strict, length in ((False, 100_000.0), (True, 170_000.0)):
        path = zigzag(length)
        options = PlannerOptions(method=Method(kernel=True), strict=strict)
        plan(small, MIKRON, options=options)
        sigma = None if strict else uniform(path, 1_000_000).sigma
        gc.collect()
        Path("/proc/self/clear_refs").write_text("5")  # forgets the peak so far
        before = peak()
        made = plan(path, MIKRON, options=options, knots=sigma)
        grown = peak() - before
        print(f"{'strict' if strict else 'fast'}, {len(made.pieces[0].profile.sigma)} knots: {grown:.0f} MB more, stitches "
              f"{made.mismatch:.1e}, {made.iterations} iterations, {made.seconds:.1f} s of motion", flush=True)


def optimality() -> None:
    """150 random paths on 256 intervals."""
    above, iterations, unsolved = [], [], 0
    own, other, failed = 0.0, 0.0, 0
    for seed in range(150):
        problem = uniform(random_path(seed, bend=(0.3, 1.0, 3.0)[seed % 3]), 256).problem()
        start = time.process_time()
        found = solve_problem(problem, NumpySteps)
        middle = time.process_time()
        iterations.append(found.iterations)
        unsolved += not found.solved
        try:
            best = least_jerk_time(problem, 0.8 * found.c)
        except ArithmeticError:
            failed += 1
            continue
        own, other = own + middle - start, other + time.process_time() - middle
        above.append(float(np.sum(problem.weight * problem.basis.values(found.c)[0] ** -0.5)) / best - 1.0)
    print(f"150 random paths: {unsolved} unsolved, iterations median {statistics.median(iterations):.0f} "
          f"most {max(iterations)}; "
          f"time above the reference median {statistics.median(above):.1e} most {max(above):.1e} "
          f"least {min(above):.1e}; "
          f"reference {other / own:.0f}x as long, not converged on {failed}")


def limits() -> None:
    """Worst ratios over 1 ms samples, differences included, and the price of strict."""
    worst: dict[bool, list[float]] = {False: [], True: []}
    price, bound = [], []
    for seed in range(50):
        path = random_path(seed, bend=(0.3, 1.0, 3.0)[seed % 3])
        made = {strict: plan(path, MIKRON, options=PlannerOptions(strict=strict)) for strict in (False, True)}
        for strict, one in made.items():
            worst[strict].append(one.usage().worst)
        price.append(made[True].seconds / made[False].seconds - 1.0)
        bound.append(made[False].seconds / plan_second_order(path, MIKRON).seconds)
    print(f"50 random paths: worst ratio fast median {statistics.median(worst[False]):.3f} most {max(worst[False]):.3f}, "
          f"strict most {max(worst[True]):.9f}; "
          f"strict is slower by median {statistics.median(price):.2%} most {max(price):.2%}; "
          f"jerk costs {statistics.median(bound):.2f}x the second-order time")


def main() -> None:
    """Run what is named, or all."""
    logging.disable(logging.CRITICAL)
    parts = {"speed": speed, "cl": cl, "copp": copp, "memory": memory, "optimality": optimality, "corners": corners,
             "limits": limits, "stops": stops}
    for name in [arg for arg in sys.argv[1:] if arg in parts] or parts:
        parts[name]()


if __name__ == "__main__":
    main()
