"""Choice of orientations compared with all that it could choose, and what decides.

python tests/benchmarks/bench_orientation_limits.py [brute | plans | cases]; brute: the search compared with a
grid of 0.25 degrees, every axis planned in full, on three passes of the test part; plans: `auto` compared
with all sequences of such axes on six strips;
cases: what travel, indexing time and a free rotary axis decide.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
import toolpaths
from machines.machine import Machine, Timing
from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import Candidate, turned_all
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.initial_axes import across
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, PassContext, work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.index_time import all_ends, links_between
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.shortest_sequence import shortest
from postproc.setup.model import SetupFile, load_setup
from toolpaths.arrays import Floats
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples"
GRID = 0.25 * DEG
CAP = 15.0 * DEG
SMALL_CAP = 6.0 * DEG
_MANY = 500


def setup_of(name: str) -> SetupFile:
    """A set-up of the samples."""
    settings, _ = load_setup(SAMPLES / name)
    assert settings is not None
    return settings


def disc(axis: Floats, cap: float, step: float) -> Floats:
    """Axes (M, 3) within `cap` of `axis`, on a square grid of `step` rad, `axis` first."""
    x, y = across(axis)
    count = int(cap / step + 1e-9)
    u, v = (g.ravel() * step for g in np.meshgrid(np.arange(-count, count + 1), np.arange(-count, count + 1)))
    size = np.hypot(u, v)
    u, v, size = (g[np.argsort(size, kind="stable")][:int((size <= cap + 1e-9).sum())] for g in (u, v, size))
    flat = np.divide(np.sin(size), size, out=np.ones_like(size), where=size > 0.0)
    return np.asarray(np.cos(size)[:, None] * axis + flat[:, None] * (u[:, None] * x + v[:, None] * y))


def grid_of(one: Pass, m: Machine, allowed: AllowedAxes, centre: Floats, cap: float,
            step: float) -> list[Candidate]:
    """The pass along every allowed axis of a disc that the machine can run it along."""
    axes = disc(centre, cap, step)
    axes = axes[allowed.mask(one, axes)]
    made = [each for k in range(0, len(axes), _MANY) for each in turned_all(one, axes[k:k + _MANY], m, allowed.touching)]
    return [each for each in made if not each.refused]


def compared(name: str, one: Pass, m: Machine, allowed: AllowedAxes, centre: Floats | None, cap: float,
             step: float) -> float:
    """Seconds of the search over the least of the grid, both planned in full, less 1."""
    begin = time.perf_counter()
    found = tried(one, m, allowed).best
    middle = time.perf_counter()
    grid = grid_of(one, m, allowed, found.axis if centre is None else centre, cap, step)
    least = next(each.seconds for each in sorted(grid, key=lambda each: each.seconds) if not each.touching)
    loss = found.seconds / least - 1.0
    print(f"{name}: search {found.seconds:.5f} s ({middle - begin:.2f} s), {len(grid)} axes of the grid {least:.5f} s "
          f"({time.perf_counter() - middle:.0f} s), {100.0 * loss:+.3f} %", flush=True)
    return loss


def test_part(m: Machine) -> PassContext:
    """The paper's part on a machine."""
    work, found = work_of(toolpaths.read(SAMPLES / "test_part.cls")[0], m,
                          setup_of("tools.setup.toml"), Options())
    assert work is not None, found
    return work


def brute() -> None:
    """Xp = 0, 15, 30 under all limits: within 15 degrees of the CL's axis, and round the best within 60 degrees of it."""
    m = machines.load("mikron-ucp710")
    for k in (0, 2, 4):
        one = test_part(m).passes[k]
        name = f"Xp = {one.tip[1, 0]:.0f}"
        compared(f"{name}, within 15 degrees of the CL's axis", one, m, AllowedAxes(CAP), one.axis, CAP, GRID)
        compared(f"{name}, round the best of 60 degrees", one, m, AllowedAxes(60.0 * DEG), None, CAP, GRID)


def strips(directions: list[float], cutter: str = "16,8", length: float = 80.0,
           pitch: float = 1.0) -> Toolpath:
    """Level straight passes next to each other; directions in degrees from +x."""
    lines = ["UNITS/MM", f"CUTTER/{cutter}", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,60000"]
    for k, angle in enumerate(directions):
        travel = np.array([np.cos(angle * DEG), np.sin(angle * DEG)])
        middle = pitch * k * np.array([-travel[1], travel[0]])
        start, end = (f"{p[0]:.5f},{p[1]:.5f}" for p in (middle - 0.5 * length * travel, middle + 0.5 * length * travel))
        lines += ["RAPID", f"GOTO/{start},10", "RAPID", f"GOTO/{start},0", f"GOTO/{end},0", "RAPID", f"GOTO/{end},10"]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]).encode(), file="strips.apt")
    assert not toolpaths.diagnostics.has_errors(found)
    return path


def chosen(path: Toolpath, m: Machine, setup: SetupFile, max_tilt: float = 60.0) -> OrientationChoice:
    """All plans."""
    choice, found = orient(path, m, setup, Options(max_tilt=max_tilt))
    assert choice is not None, found
    return choice


def whole(m: Machine, path: Toolpath, cap: float, step: float) -> tuple[float, float, float]:
    """(seconds of `keep`, of `auto`, least seconds of all sequences of axes of the grid), within `cap` of the CL's axes."""
    choice = chosen(path, m, setup_of("tools.setup.toml"), cap / DEG)
    work, allowed = choice.work, AllowedAxes(cap)
    states = [grid_of(one, m, allowed, one.axis, cap, step) for one in work.passes]
    edges = [all_ends(row, work) for row in states]
    cost = [np.array([made.seconds for made in row]) + np.array([e.rapids for e in edge])
            for row, edge in zip(states, edges, strict=True)]
    return choice.plans["keep"].seconds, choice.plans["auto"].seconds, shortest(cost, links_between(work, edges))[1]


def plans() -> None:
    """Six strips in two directions, rotary axes that need no clamping or little: turning between them pays or does not."""
    m, path = machines.load("mikron-ucp710"), strips([0.0, 0.0, 0.0, 70.0, 70.0, 70.0], length=160.0)
    for clamp in (0.0, 0.05):
        begin = time.perf_counter()
        keep, auto, least = whole(replace(m, timing=Timing(0.0, clamp, clamp)), path, SMALL_CAP, GRID)
        print(f"clamp {clamp:g} s: keep {keep:.5f} s, auto {auto:.5f} s, all sequences {least:.5f} s, "
              f"{100.0 * (auto / least - 1.0):+.3f} % ({time.perf_counter() - begin:.0f} s)", flush=True)


def shown(name: str, choice: OrientationChoice) -> None:
    """The plans side by side, and what `auto` takes."""
    seconds = ", ".join(f"{key} {plan.seconds:.2f}" for key, plan in choice.plans.items())
    taken = {" ".join(f"{key}{value:.1f}" for key, value in made.rotary().items()) for made in choice.plans["auto"].picked}
    print(f"{name}: {seconds} s; auto takes {', '.join(sorted(taken))}", flush=True)


def cases() -> None:
    """What decides: travel of the trunnion, indexing time, and the angle of a table that the tool leaves free."""
    m, tools = machines.load("mikron-ucp710"), setup_of("tools.setup.toml")
    for end in (120.0, 30.0):
        upper = np.where([name == "A" for name in m.axis_names], end * DEG, m.limits.upper)
        narrow = replace(m, limits=replace(m.limits, upper=upper))
        shown(f"10 strips, A to {end:g} degrees", chosen(strips([0.0] * 10), narrow, tools))
    for clamp in (0.5, 3.0):
        slow = replace(m, timing=Timing(0.0, clamp, clamp))
        shown(f"10 strips, clamp {clamp:g} s", chosen(strips([0.0] * 10), slow, tools))
    shown("40 strips of a flat cutter on mikron-ucp710", chosen(strips([0.0] * 40, "16,1"), m, tools))
    h4a = machines.load("h4a-c-table")
    for cutter in ("16,8", "16,1"):
        shown(f"80 strips along y, cutter {cutter}, on h4a-c-table", chosen(strips([90.0] * 80, cutter), h4a,
                                                                            setup_of("h4a.setup.toml"), 40.0))


if __name__ == "__main__":
    known = {"brute": brute, "plans": plans, "cases": cases}
    for name in sys.argv[1:] or known:
        known[name]()
