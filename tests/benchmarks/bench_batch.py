"""A batch on one and on two processes of this computer, and by schedule on many.

    python tests/benchmarks/bench_batch.py [RUNS]

Prints wall and processor time of RUNS conversions (default 60) in this process and on two warm workers, the load of the
computer (above 1 wall times are no measure; processor times are), how long the scheduler takes for a task that is done
already, and what these figures give for 10,000 runs on 64 and 1000 workers: tasks go to the worker that is free first, the
scheduler hands out one after the other.
"""

from __future__ import annotations

import heapq
import os
import resource
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from postproc.batch.run import Ran, Runner, Where, runs  # noqa: E402  # of this tree
from postproc.cli.app import run_command  # noqa: E402  # of this tree
from tests.postproc.batch.batch_kit import batch_folder, with_keys  # noqa: E402  # of this tree

JOBS = """output = "out"
controllers = ["linuxcnc"]
machines = ["mikron-ucp710"]
[options]
setup = "{setup}"
tolerance = [{tolerances}]
[[jobs]]
files = {files}
"""
PARTS = ("pocket.cls", "five_faces.cls", "bicubic.cls")


def nothing(arguments: Sequence[str]) -> Ran:
    """A task that does nothing."""
    return Ran(0, ())


def scheduled(seconds: Sequence[float], workers: int, handing_out: float) -> float:
    """Wall time: each task begins when a worker is free and the scheduler has handed it out."""
    free = [0.0] * workers
    for number, one in enumerate(seconds):
        begin = max(heapq.heappop(free), number * handing_out)
        heapq.heappush(free, begin + one)
    return max(free)


def processor() -> float:
    """Seconds of processor of this process and of those that have ended below it."""
    own, ended = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + ended.ru_utime + ended.ru_stime


def timed(folder: Path, jobs: str, runner: Runner, where: Where) -> tuple[float, list[float]]:
    """Wall time of a batch, and seconds of each of its tasks."""
    tasks = with_keys(batch_folder(folder, jobs))
    began = time.perf_counter()
    found = dict(runs(tasks, runner, where))
    return time.perf_counter() - began, [found[k].seconds for k in range(len(tasks))]


def main(count: int) -> None:
    """Print the figures."""
    steps = max(1, count // len(PARTS))
    jobs = JOBS.format(setup=ROOT / "samples" / "tools.setup.toml", files=[str(ROOT / "samples" / p) for p in PARTS],
                       tolerances=", ".join(f"{0.01 + 1e-5 * k:g}" for k in range(steps)))
    figures = []
    for where in (Where(1), Where(2)):
        with tempfile.TemporaryDirectory() as folder:
            before, load = processor(), os.getloadavg()[0]
            figures.append(timed(Path(folder), jobs, run_command, where))
            print(f"{where.workers} worker(s): {len(figures[-1][1])} runs in {figures[-1][0]:.1f} s, "
                  f"{processor() - before:.1f} s of processor; load before {load:.1f}", flush=True)
    few = JOBS.format(setup=ROOT / "samples" / "tools.setup.toml", files=[str(ROOT / "samples" / "pocket.cls")],
                      tolerances=", ".join(f"{0.01 + 1e-5 * k:g}" for k in range(400)))
    with tempfile.TemporaryDirectory() as folder:
        timed(Path(folder), few, nothing, Where())
        done, _ = timed(Path(folder), few, nothing, Where(2))
        start, _ = timed(Path(folder), few.replace(few[few.index("tolerance"):few.index("[[jobs]]")], ""), nothing, Where(2))
    handing_out = max(done - start, 0.0) / 399
    print(f"start of two workers {start:.1f} s; a task that is done already {1e3 * handing_out:.1f} ms")
    print(f"speed-up on 2, start included: {figures[0][0] / figures[1][0]:.2f}, without it "
          f"{figures[0][0] / max(figures[1][0] - start, 1e-9):.2f}")
    sample = figures[0][1]
    many = [sample[k % len(sample)] for k in range(10_000)]
    for workers in (2, 64, 1000):
        wall = scheduled(many, workers, handing_out)
        print(f"10,000 runs on {workers} workers: {wall:.1f} s, speed-up {sum(many) / wall:.0f}; handing out alone "
              f"{10_000 * handing_out:.1f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
