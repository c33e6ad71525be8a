"""Smoothing of CL points and what is planned on it.

    python tests/benchmarks/bench_smoothing.py [speed] [plan] [samples] [parallel]

speed: points per second of the processor and deviation over the tolerance, 10^3 to 10^6 points in steps of 0.05 to 0.4 mm.
plan: planned time of smoothed points over that of the noise-free curve, and of a spline through the rounded points.
samples: time of geometry and feeds next to the rest of the conversion, planned seconds next to those at the feed.
parallel: one pass on `uranesx` and on `h4a-c-table` under the limits of the slides, and under the largest box of
platform rates that keeps them anywhere in the workspace. Compiled code is warm.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

sys.path.insert(0, str(Path(__file__).parents[2]))

import postproc
import toolpaths
from machines.machine import Machine
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import SplinePath
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.pipeline.result import PostResult
from postproc.pipeline.stages import plan_motion
from postproc.planning.geometry import MachinePath
from postproc.planning.pass_geometry import PassGeometry, pass_geometry, stops_of
from postproc.planning.planned import joint_limits
from tests.postproc.feedrate_kit import MIKRON
from tests.postproc.kit import SAMPLES, good, machine
from tests.toolpaths.smoothing.test_smoothing import chain, off, wave
from tests.toolpaths.smoothing_kit import smooth
from toolpaths.arrays import Floats
from toolpaths.shape import Curves
from toolpaths.smoothing.smooth import Smooth, Tolerance
from toolpaths.units import DEG

TOLERANCE = Tolerance(0.005, 0.025 * DEG)
FAST = 2000.0
"""mm/s: a feed that leaves only the machine's limits"""


def rounded(count: int, step: float, places: int = 4) -> Curves:
    """The wave, drifting so that it does not repeat, as a CL file has it."""
    tip, axis = exact(count, step)
    axis = np.round(axis, 6)
    return chain(np.round(tip, places), axis / np.linalg.norm(axis, axis=1, keepdims=True))


def exact(count: int, step: float) -> tuple[Floats, Floats]:
    tip, axis = wave(np.arange(count) * step)
    tip[:, 2] += 0.01 * step * np.arange(count)
    return tip, axis


def smoothed(curves: Curves) -> Smooth:
    found = smooth(curves, TOLERANCE)
    assert found is not None
    return found


def timed(run: Callable[[], object], repeats: int) -> float:
    """Median seconds of the processor, one thread: what others do on the host counts little."""
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        seconds.append(time.process_time() - start)
    return statistics.median(seconds)


def speed() -> None:
    smoothed(rounded(40_000, 0.05))
    for step in (0.05, 0.1, 0.2, 0.4):
        for count in (1000, 10_000, 100_000, 1_000_000):
            curves = rounded(count, step)
            seconds = timed(lambda curves=curves: smoothed(curves), 5 if count < 1_000_000 else 1)
            found = smoothed(curves)
            tip, axis = off(found, curves, 17) if count <= 100_000 else (np.nan, np.nan)
            print(f"step {step:4} mm, {count:8} points: {count / seconds / 1e6:5.2f} M/s, bound {found.worst:.3f}, seen "
                  f"{tip / TOLERANCE.tip:.3f} (tip) {axis / TOLERANCE.axis:.3f} (axis) of the tolerance, "
                  f"{np.median(np.diff(found.s)):.3f} mm between points", flush=True)


def five(s: Floats, tip: Floats, axis: Floats) -> SplinePath:
    """Three slides and the axis's first two components as joints."""
    found = make_interp_spline(s, np.hstack((tip, axis[:, :2])), k=5)
    return SplinePath(found.t, found.c)


def planned() -> None:
    for step, places in ((0.05, 4), (0.05, 3), (0.1, 4), (0.2, 4), (0.3, 4), (0.4, 4)):
        count = int(200.0 / step)
        tip, axis = exact(count, step)
        free = plan(five(smoothed(chain(tip, axis)).s, tip, axis), MIKRON).seconds
        curves = rounded(count, step, places)
        found = smoothed(curves)
        s = np.linspace(0.0, found.s[-1], 4 * count)
        own = plan(five(s, *found.at(s)), MIKRON).seconds
        rough = plan(five(found.s, *(np.concatenate((a[:1], b)) for a, b in
                                     ((curves.start, curves.end), (curves.axis0, curves.axis1)))), MIKRON).seconds
        print(f"step {step} mm, {places} decimals: noise-free {free:.4f} s, smoothed {own / free - 1.0:+.3%}, through the "
              f"points {rough / free - 1.0:+.1%}", flush=True)


def sample(file: str, name: str, setup: str, **options: object) -> PostResult:
    path, _ = toolpaths.read(SAMPLES / file)
    return postproc.convert(path, machine(name), "linuxcnc", SAMPLES / f"{setup}.setup.toml",
                            postproc.Options(**options))


def samples() -> None:
    for file, name, setup in (("blade.cls", "mikron-ucp710", "tools"), ("bicubic.cls", "mill-3axis", "tools"),
                              ("pocket.cls", "mill-3axis", "tools"), ("h4a_dome.cls", "h4a-c-table", "h4a")):
        result = sample(file, name, setup)
        job, path = result.job, result.path
        assert job is not None and path is not None
        asked = replace(job, options=replace(job.options, feed="planned"))
        plain = timed(lambda file=file, name=name, setup=setup: sample(file, name, setup), 3)
        own = timed(lambda asked=asked, path=path: plan_motion(asked, asked.moves, path), 3)
        motion, _ = plan_motion(asked, asked.moves, path)
        assert motion is not None
        start = time.perf_counter()
        seconds = motion.seconds
        took = time.perf_counter() - start
        block = np.concatenate([one.block for one in motion.passes])
        asked_s, steady = path.seconds[block].sum(), np.fmax(path.seconds, motion.needed)[block].sum()
        print(f"{file} on {name}: {len(motion.passes)} passes; feeds {own:.2f} s next to {plain:.2f} s of the conversion, "
              f"plan {took:.2f} s; at the feed {asked_s:.1f} s, at planned F words {steady:.1f} s, planned motion "
              f"{seconds:.1f} s", flush=True)


def first_pass(file: str, name: str, setup: str) -> PassGeometry:
    result = good(sample(file, name, setup))
    assert result.job is not None and result.path is not None
    job = result.job
    found, _ = pass_geometry(result.path, job.moves, job.kinematics, Tolerance(0.01, 0.05 * DEG),
                             stops_of(job.toolpath, job.moves))
    return max(found, key=lambda one: float(one.smooth.s[-1]))


def platform(made: Machine, q: Floats) -> Floats:
    """Platform coordinates (N, P) of slides: x, y, z, on the H4 the tilt besides."""
    kin = made.kinematics
    found = kin.solve_platform(q) if hasattr(kin, "solve_platform") else kin.forward(q)[0]
    return np.asarray(found)


def slides(made: Machine, p: Floats) -> Floats:
    """Slides (N, S) of platform coordinates."""
    kin = made.kinematics
    if hasattr(kin, "solve_platform"):
        return np.asarray(kin.platform.inverse(p))
    return np.asarray(kin.inverse(p, np.tile([0.0, 0.0, 1.0], (len(p), 1)))[0])


def box(made: Machine, p: Floats, weight: Floats) -> JointLimits:
    """Largest rates weight (P,) times one number, for each order, that keep the slides' limits at all p (N, P)."""
    h, columns = 1e-4, []
    for k in range(p.shape[1]):
        step = np.zeros(p.shape[1])
        step[k] = h
        columns.append((slides(made, p + step) - slides(made, p - step)) / (2.0 * h))
    gain = np.einsum("kns,k->ns", np.abs(columns), weight)
    gain = gain[np.isfinite(gain).all(axis=1)]
    count = gain.shape[1]
    return JointLimits(*(weight * np.min(limit[:count] / gain) for limit in
                         (made.limits.velocity, made.limits.acceleration, made.limits.jerk)))


def with_c(bounds: JointLimits, made: Machine) -> JointLimits:
    """The box with the rotary axis's own limits behind it."""
    last = made.limits.velocity[4:], made.limits.acceleration[4:], made.limits.jerk[4:]
    return JointLimits(*(np.concatenate(pair) for pair in
                         zip((bounds.velocity, bounds.acceleration, bounds.jerk), last, strict=True)))


def workspace(made: Machine, rng: np.random.Generator) -> Floats:
    """Random platform coordinates of the workspace, its corners included."""
    space = made.kinematics.workspace
    place, tilt = space.random(rng, 20_000)
    if not hasattr(made.kinematics, "solve_platform"):
        return np.asarray(place)
    return np.column_stack([place, tilt])


def parallel() -> None:
    rng = np.random.default_rng(1)
    for file, name, setup in (("bicubic.cls", "uranesx", "delta"), ("h4a_dome.cls", "h4a-c-table", "h4a")):
        made = machine(name)
        p = workspace(made, rng)
        weight = np.array([1.0, 1.0, 1.0, 1.0 / 300.0])[:p.shape[1]]
        inner = with_c(box(made, p, weight), made)
        one = first_pass(file, name, setup)
        own = sum(plan(path, joint_limits(made.limits), FAST, options=PlannerOptions(strict=True)).seconds
                  for path in one.paths)
        other, worst = 0.0, 0.0
        for path in one.paths:
            gauge = path.values[:, :path.joints]
            coordinates = np.hstack((platform(made, gauge), gauge[:, 4:]))
            virtual = MachinePath.through(path.s, np.hstack((coordinates, path.values[:, path.joints:])), path.led)
            boxed = plan(virtual, inner, FAST, options=PlannerOptions(strict=True))
            other += boxed.seconds
            run = boxed.trajectory()
            q = slides(made, run.q[:, :p.shape[1]])
            for order, limit in enumerate((made.limits.velocity, made.limits.acceleration, made.limits.jerk), start=1):
                ratio = np.abs(np.diff(q, order, axis=0)) / (run.step**order * limit[:q.shape[1]])
                worst = max(worst, float(ratio.max()))
        print(f"{name}, {file}: pass of {one.smooth.s[-1]:.1f} mm, under the slides' limits {own:.4f} s, under the box "
              f"{inner.velocity[0]:.0f} mm/s, {inner.acceleration[0]:.0f} mm/s2, {inner.jerk[0]:.0f} mm/s3 {other:.4f} s "
              f"({other / own - 1.0:+.1%}), which uses at most {worst:.2f} of the slides' limits")


PARTS: dict[str, Callable[[], None]] = {"speed": speed, "plan": planned, "samples": samples, "parallel": parallel}

if __name__ == "__main__":
    for part in [a for a in sys.argv[1:] if a in PARTS] or list(PARTS):
        PARTS[part]()
