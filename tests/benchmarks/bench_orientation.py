"""Figures of the choice of orientations: python tests/benchmarks/bench_orientation.py [part | full | brute |
five | many | ranking].

part: the paper's test part under its jerks alone; full: samples under all limits; brute: distance to a grid of orientations,
all planned; five: five parts on two machines; many: seconds for 500 passes; ranking: what times on shared knots are off by.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import turned, turned_all
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.ranking import Ranking, load_compiler
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.setup.model import load_setup
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples"
sys.path.insert(0, str(SAMPLES))
import orientation as samples  # noqa: E402  # found on the path set above

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


def shown(name: str, choice: OrientationChoice, seconds: float, cores: float) -> None:
    """The plans side by side, how many candidates the bound discarded."""
    plans = {"paper": choice.paper, **choice.plans}
    figures = ", ".join(f"{k} {v.seconds:.3f}" for k, v in plans.items())
    cuts = ", ".join(f"{k} {sum(made.seconds for made in v.picked):.3f}" for k, v in plans.items())
    pruned, planned = (sum(getattr(one, what) for one in choice.tried) for what in ("pruned", "planned"))
    share = 100.0 * pruned / max(1, pruned + planned)
    print(f"{name}: seconds {figures}\n  cutting {cuts}\n  {share:.0f} % of {pruned + planned} candidates discarded by the "
          f"bound, {seconds:.1f} s ({cores:.1f} s of cores) for {len(choice.tried)} passes")


def timed(name: str, path: Toolpath, m: Machine, setup: str = "tools.setup.toml") -> None:
    """One file on one machine."""
    begin, before = time.perf_counter(), _cores_spent()
    choice = chosen(path, m, setup)
    shown(name, choice, time.perf_counter() - begin, _cores_spent() - before)


def _cores_spent() -> float:
    """Seconds of this process and of its workers that have ended."""
    spent = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in spent)


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


def _grid_best(one: Pass, m: Machine, limit: AllowedAxes) -> float:
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
    """The search compared with a grid (8, then 1.6 and 0.32 degrees round the best) on three passes."""
    m = machines.load("mikron-ucp710")
    settings, _ = load_setup(SAMPLES / "tools.setup.toml")
    assert settings is not None
    work, _ = work_of(toolpaths.read(SAMPLES / "test_part.cls")[0], m, settings, Options())
    assert work is not None
    for k in (0, 2, 4):
        one, limit = work.passes[k], AllowedAxes(60.0 * DEG)
        best, grid = tried(one, m, limit).best.seconds, _grid_best(one, m, limit)
        print(f"Xp = {one.tip[1, 0]:4.0f}: search {best:.4f} s, grid {grid:.4f} s, {100.0 * (best / grid - 1.0):+.2f} %")


def five(names: tuple[str, ...] = ("mikron-ucp710", "trunnion-bc")) -> None:
    """The five parts of samples/orientation.py on two machines."""
    for name in names:
        for part_name, make in samples.PARTS.items():
            timed(f"{part_name} on {name}", _read(make()[0]), machines.load(name))


def many(count: int = 500) -> None:
    """Strips of the bicubic surface."""
    timed(f"{count} strips on mikron-ucp710", _read(samples.surface(count)[0]),
          machines.load("mikron-ucp710"))


def _read(text: str) -> Toolpath:
    path, found = toolpaths.read_bytes(text.encode(), file="part.cls")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


def ranking() -> None:
    """Times on shared knots compared with plans on knots of their own, random axes of 20 passes."""
    m, rng, off, spent = machines.load("mikron-ucp710"), np.random.default_rng(1), [], [0.0, 0.0]
    settings, _ = load_setup(SAMPLES / "tools.setup.toml")
    assert settings is not None
    for name in ("test_part.cls", "bicubic.cls"):
        work, _ = work_of(toolpaths.read(SAMPLES / name)[0], m, settings, Options())
        assert work is not None
        load_compiler()
        for one in work.passes[::max(1, len(work.passes) // 10)]:
            axes = np.column_stack((rng.uniform(-0.7, 0.7, (20, 2)), np.ones(20)))
            ranked = Ranking(turned(one, one.axis, m))
            for made in turned_all(one, axes / np.linalg.norm(axes, axis=1, keepdims=True), m):
                if not made.refused:
                    begin = time.process_time()
                    seconds = ranked.seconds(made)
                    middle = time.process_time()
                    off.append(abs(seconds / made.seconds - 1.0))
                    spent[0] += middle - begin
                    spent[1] += time.process_time() - middle
    print(f"{len(off)} axes: shared knots off by {np.median(off):.1e} (median), {max(off):.1e} (most); a plan takes "
          f"{spent[1] / spent[0]:.1f} times as long ({1e3 * spent[1] / len(off):.1f} ms)")


if __name__ == "__main__":
    known = {"part": part, "full": full, "brute": brute, "five": five, "many": many, "ranking": ranking}
    for name in sys.argv[1:] or known:
        known[name]()
