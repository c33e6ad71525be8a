"""Figures of the choice of orientations: python tests/benchmarks/bench_orientation.py [part | full | brute | many].

part: the paper's test part under its jerks alone; full: samples under all limits; brute: distance to a grid of orientations,
all planned; many: seconds for 500 passes.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
import toolpaths
from machines.machine import Machine
from postproc.options import Options
from postproc.orientation.allowed import Allowed
from postproc.orientation.candidates import tried
from postproc.orientation.orient import OrientationChoice, orient
from postproc.orientation.passes import Pass, work_of
from postproc.orientation.timed import turned
from postproc.setup import load_setup
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples"
GRID = 8.0
"""degrees, of the brute force; the neighbourhood of its best is searched again at a fifth and a twenty-fifth"""


def jerk_only(m: Machine) -> Machine:
    """No limit but the jerk of the slides: 5 m/s3 on the Mikron."""
    rotary, free = np.array(m.rotary), np.full(len(m.rotary), 1e9)
    jerk = np.where(rotary, 1e12, m.limits.jerk)
    return replace(m, limits=replace(m.limits, velocity=free, acceleration=free, jerk=jerk))


def chosen(path: Toolpath, m: Machine, setup: str) -> OrientationChoice:
    """All plans."""
    settings, _ = load_setup(SAMPLES / setup)
    assert settings is not None
    choice, found = orient(path, m, settings, Options())
    assert choice is not None, found
    return choice


def shown(name: str, choice: OrientationChoice, seconds: float) -> None:
    """The plans side by side, how many candidates the bound discarded."""
    plans = {"paper": choice.paper, **choice.plans}
    figures = ", ".join(f"{k} {v.seconds:.3f}" for k, v in plans.items())
    cuts = ", ".join(f"{k} {sum(made.seconds for made in v.picked):.3f}" for k, v in plans.items())
    pruned, planned = (sum(getattr(one, what) for one in choice.tried) for what in ("pruned", "planned"))
    share = 100.0 * pruned / max(1, pruned + planned)
    print(f"{name}: seconds {figures}\n  cutting {cuts}\n  {share:.0f} % of {pruned + planned} candidates discarded by the "
          f"bound, {seconds:.1f} s for {len(choice.tried)} passes")


def timed(name: str, path: Toolpath, m: Machine, setup: str = "tools.setup.toml") -> None:
    """One file on one machine."""
    begin = time.perf_counter()
    choice = chosen(path, m, setup)
    shown(name, choice, time.perf_counter() - begin)


def part() -> None:
    """Gains per pass under jerk alone: tables 2 and 3."""
    m = jerk_only(machines.load("mikron-ucp710"))
    choice = chosen(toolpaths.read(SAMPLES / "test_part.cls")[0], m, "tools.setup.toml")
    for one in choice.tried:
        assert one.aimed is not None
        gains = [100.0 * (1.0 - made.seconds / one.own.seconds) for made in (one.aimed, one.best)]
        print(f"Xp = {one.own.one.tip[1, 0]:4.0f}: {one.own.seconds:.4f} s, mean direction on a vertex {gains[0]:5.2f} %, "
              f"best {gains[1]:5.2f} %")
    timed("test_part.cls, jerk only", choice.work.toolpath, m)


def full() -> None:
    """Samples under all limits."""
    for name, machine, setup in (("test_part.cls", "mikron-ucp710", "tools.setup.toml"),
                                 ("bicubic.cls", "mikron-ucp710", "tools.setup.toml"),
                                 ("bicubic.cls", "trunnion-bc", "tools.setup.toml"),
                                 ("bicubic.cls", "mill-4axis", "tools.setup.toml"),
                                 ("bicubic.cls", "h4a-c-table", "h4a.setup.toml")):
        timed(f"{name} on {machine}", toolpaths.read(SAMPLES / name)[0], machines.load(machine), setup)


def _grid_best(one: Pass, m: Machine, limit: Allowed) -> float:
    """Least time over orientations A, C on a grid, then on a finer one round the best."""
    best, centre, span, step = np.inf, (0.0, 0.0), (60.0, 180.0), GRID
    for _ in range(3):
        tilts = np.arange(max(0.0, centre[0] - span[0]), min(60.0, centre[0] + span[0]) + 1e-9, step) * DEG
        turns = np.arange(centre[1] - span[1], centre[1] + span[1], step) * DEG
        for a in tilts:
            for c in turns:
                axis = np.array([np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)])
                made = turned(one, axis, m)
                if limit.refused(one, axis) or made.bound >= best:
                    continue
                if made.seconds < best:
                    best, centre = made.seconds, (a / DEG, c / DEG)
        span, step = (step, step), step / 5.0
    return best


def brute() -> None:
    """The search beside a grid (8, then 1.6 and 0.32 degrees round the best) on three passes."""
    m = machines.load("mikron-ucp710")
    settings, _ = load_setup(SAMPLES / "tools.setup.toml")
    assert settings is not None
    work, _ = work_of(toolpaths.read(SAMPLES / "test_part.cls")[0], m, settings, Options())
    assert work is not None
    for k in (0, 2, 4):
        one, limit = work.passes[k], Allowed(60.0 * DEG)
        best, grid = tried(one, m, limit).best.seconds, _grid_best(one, m, limit)
        print(f"Xp = {one.tip[1, 0]:4.0f}: search {best:.4f} s, grid {grid:.4f} s, {100.0 * (best / grid - 1.0):+.2f} %")


def many(count: int = 500) -> None:
    """Straight passes in directions that turn slowly."""
    lines = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,20000"]
    for k in range(count):
        x, y = 80.0 * np.cos(0.003 * k), 80.0 * np.sin(0.003 * k)
        start, end = f"0,{0.2 * k:.4f}", f"{x:.4f},{y + 0.2 * k:.4f}"
        lines += ["RAPID", f"GOTO/{start},5", "RAPID", f"GOTO/{start},0", f"GOTO/{end},0", "RAPID", f"GOTO/{end},5"]
    path, _ = toolpaths.read_bytes("\n".join([*lines, "FINI"]).encode(), file="many.apt")
    timed(f"{count} passes on mikron-ucp710", path, machines.load("mikron-ucp710"))


if __name__ == "__main__":
    known = {"part": part, "full": full, "brute": brute, "many": many}
    for name in sys.argv[1:] or known:
        known[name]()
