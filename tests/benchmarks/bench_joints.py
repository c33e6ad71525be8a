"""Plan of the joints against a greedy post, bound of linearising against dense truth, time for a million points.

    python tests/benchmarks/bench_joints.py [POINTS]

Every figure is of one run; processor times stand compared with those of the inverse kinematics of the same points.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import machines
from machines.machine import Limits, Machine
from postproc.control.control import Control
from postproc.joints.greedy import greedy
from postproc.joints.lattice import PoseRun, lattice_of
from postproc.joints.plan import plan_runs
from postproc.joints.singular_detours import lead_past
from postproc.path.linearise import linearise
from tests.postproc.joint_kit import solve
from toolpaths.shape import Curves
from toolpaths.units import DEG

TIP, AXIS = 0.01, 0.05 * DEG


def leaning(tilt: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3), degrees."""
    a, b = np.broadcast_arrays(np.radians(tilt), np.radians(heading))
    return np.stack((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)), axis=-1)


def paths(rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Twenty paths: (name, tip, axis, pauses): spirals, zig-zags, wavy rounds and paths past +z."""
    for k in range(20):
        n = int(rng.integers(600, 1500))
        t = np.linspace(0.0, 1.0, n)
        kind = ("spiral", "zig-zag", "wave", "past +z")[k % 4]
        turns = rng.uniform(2, 12)
        heading = rng.uniform(0, 360) + {"spiral": 360 * turns * t, "zig-zag": 300 * np.sin(np.pi * turns * t),
                                          "wave": 360 * turns * t + 80 * np.sin(40 * t), "past +z": 40 * np.sin(9 * t)}[kind]
        tilt = rng.uniform(15, 25) + {"spiral": 5 * t, "zig-zag": 0 * t, "wave": 10 * np.sin(25 * t),
                                      "past +z": 35 * np.sin(np.pi * turns * t) - 20}[kind]
        tip = np.column_stack((25 * np.cos(7 * t), 25 * np.sin(7 * t), -8 * t))
        yield f"{kind} {k + 1}", tip, leaning(tilt, heading), np.arange(n) % 50 == 0


def limited(machine: Machine) -> Limits:
    """The machine's limits with its last rotary axis within +-400 degrees."""
    lower, upper = machine.limits.lower.copy(), machine.limits.upper.copy()
    lower[-1], upper[-1] = -400 * DEG, 400 * DEG
    return replace(machine.limits, lower=lower, upper=upper)


def against_greedy() -> None:
    """Rewinds, poses outside, and time with every axis at its velocity."""
    print("20 paths, C within +-400 degrees: rewinds, poses outside travel, joint time in s (planned | greedy)")
    total = np.zeros(6)
    for name in ("mikron-ucp710", "nutating-head"):
        m = machines.load(name)
        limits = limited(m)
        for label, tip, axis, rest in paths(np.random.default_rng(1)):
            run = PoseRun(m.kinematics, tip, axis, rest)
            found = plan_runs([run], limits, m.home)[0]
            other = greedy(lattice_of(run, limits, m.home[None]), m.home)
            stops = [m.home[None], *np.split(found.q, [r.row + 1 for r in found.rewinds])]
            stops = [x for k, x in enumerate(stops) if k == 0 or len(x)]
            joined = [stops[0], stops[1]]
            for r, x in zip(found.rewinds, stops[2:], strict=True):
                joined += [r.after[None], x]
            travel = np.abs(np.diff(np.concatenate(joined), axis=0)) / limits.velocity
            row = np.array([len(found.rewinds), found.outside, travel.max(axis=1).sum(), other.rewinds, other.outside,
                            other.seconds])
            total += row
            print(f"  {name:14} {label:12} {columns(row)}")
    print(f"  {'all':27} {columns(total)}")


def columns(row: np.ndarray) -> str:
    """Rewinds, poses outside, time of both."""
    return " | ".join(f"{a:3.0f} {b:4.0f} {c:8.1f}" for a, b, c in (row[:3], row[3:]))


def moves(name: str, rng: np.random.Generator, count: int) -> tuple[Curves, np.ndarray, np.ndarray]:
    """Straight moves inside the workspace with the joints at both ends."""
    m = machines.load(name)
    kin = m.kinematics
    start = rng.uniform(-60, 60, (count, 3))
    end = start + rng.normal(0, 15, (count, 3))
    if not kin.straight_slides:
        start, _ = kin.workspace.random(rng, count)
        space = kin.workspace
        end = np.clip(start + rng.normal(0, 15, (count, 3)), space.lower, space.upper)
    tilt, heading = rng.uniform(5, 25, (2, count)), rng.uniform(0, 360, count)
    axes = [leaning(tilt[0], heading), leaning(tilt[1], heading + rng.uniform(-40, 40, count))]
    if not any(m.rotary):
        axes = [np.tile((0.0, 0.0, 1.0), (count, 1))] * 2
    zero = np.zeros((count, 3))
    curves = Curves(start, end, axes[0], axes[1], np.zeros(count, dtype=bool), zero, zero, np.zeros(count))
    q = []
    for k in range(count):
        tip, axis = curves.take(np.full(30, k)).at(np.linspace(0, 1, 30))
        found = solve(kin, tip, axis, m.limits, m.home).q
        q.append((found[0], found[-1]))
    q0, q1 = np.array([a for a, _ in q]), np.array([b for _, b in q])
    good = np.flatnonzero(np.isfinite(q0).all(axis=1) & np.isfinite(q1).all(axis=1))
    return curves.take(good), q0[good], q1[good]


def against_truth() -> None:
    """The worst bound next to the worst deviation at 201 places of every block."""
    print(f"bound compared with dense truth, allowed {TIP} mm and {AXIS / DEG:.3g} degrees")
    for name in ("mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab", "nutating-head", "h4a-c-table",
                 "h4a-spindle-axis", "delta-parallel-z", "uranesx"):
        m = machines.load(name)
        control = Control(m, "axes", np.zeros(3))
        curves, q0, q1 = moves(name, np.random.default_rng(2), 40)
        got = linearise(control, m.kinematics, curves, q0, q1, np.zeros(len(curves), dtype=bool), TIP, AXIS)
        head = np.append(True, np.diff(got.curve) > 0)
        qa, ua = np.where(head[:, None], q0[got.curve], np.roll(got.q, 1, axis=0)), np.where(head, 0.0, np.roll(got.u, 1))
        tip_off = axis_off = 0.0
        for t in np.linspace(0, 1, 201):
            tip, axis, _ = control.between(qa, got.q, np.full(len(qa), t), m.kinematics)
            d, e, _ = curves.take(got.curve).deviation(tip, axis, ua + t * (got.u - ua))
            tip_off, axis_off = max(tip_off, float(d.max())), max(axis_off, float(e.max()))
        print(f"  {name:16} {len(curves):3} moves, {len(got.q) - len(curves):4} points added; tip {got.worst_tip:.6f} >= "
              f"{tip_off:.6f} mm, axis {got.worst_axis / DEG:.5f} >= {axis_off / DEG:.5f} degrees")


def clocked(label: str, n: int, base: float, call: object) -> float:
    start = time.process_time()
    call()
    used = time.process_time() - start
    adjacent = f"  {used / base:5.1f} x the inverse" if base else ""
    print(f"  {label:34} {used:6.2f} s  {n / used / 1e6:6.2f} M points/s{adjacent}")
    return used


def speed(n: int) -> None:
    """A cut of n points with a turning axis."""
    for name, limits_of in (("mikron-ucp710", None), ("mikron-ucp710", limited), ("head-table", None)):
        m = machines.load(name)
        limits = m.limits if limits_of is None else limits_of(m)
        t = np.linspace(0, n / 1000.0, n)
        tip = np.stack((30 * np.cos(t), 30 * np.sin(t), 10 * np.sin(t / 50)), axis=1)
        axis = leaning(20 + 8 * np.sin(0.7 * t), 170 * np.sin(t / 3) + (0 if limits_of is None else 3 * t))
        print(f"{n} points, {name}" + (", C within +-400 degrees" if limits_of else ""))
        base = clocked("inverse kinematics, all branches", n, 0.0, lambda: m.kinematics.inverse(tip, axis))  # noqa: B023  # called at once
        found: list[np.ndarray] = []
        clocked("plan", n, base, lambda: found.append(plan_runs(  # noqa: B023  # called at once
            [PoseRun(m.kinematics, tip, axis)], limits, m.home)[0].q))  # noqa: B023  # called at once
        zero = np.zeros((n - 1, 3))
        curves = Curves(tip[:-1], tip[1:], axis[:-1], axis[1:], np.zeros(n - 1, dtype=bool), zero, zero,
                        np.zeros(n - 1))
        clocked("leading past singular directions", n, base, lambda: lead_past(
            m.kinematics, curves, curves.length() / 20.0, AXIS / 2, limits.velocity))  # noqa: B023  # called at once
        clocked("linearising, proved", n, base, lambda: linearise(
            Control(m, "axes", np.zeros(3)), m.kinematics, curves, found[0][:-1], found[0][1:],  # noqa: B023  # called at once
            np.zeros(n - 1, dtype=bool), TIP, AXIS))


def main() -> None:
    """Print every figure."""
    against_greedy()
    against_truth()
    speed(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)


if __name__ == "__main__":
    main()
