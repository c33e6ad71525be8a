"""Speed and memory of the whole road, compared with a bare count of the same file's lines, in one run.

    python tests/benchmarks/bench_road.py [POINTS] [MACHINE] [CONTROLLER]

Each figure comes from a process of its own, so that peak memory is that of the stage. Compiled code is warm.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
COUNT = "import sys; print(sum(1 for _ in open(sys.argv[1], 'rb')))"
READ = "import sys, toolpaths; print(len(toolpaths.read(sys.argv[1])[0]))"


def measured(*command: str) -> tuple[float, float, float]:
    """(wall seconds, processor seconds, peak memory in 10^6 bytes) of a command that must succeed."""
    start = time.perf_counter()
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status:
        raise SystemExit(f"{' '.join(command)} ended with status {status}")
    return wall, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6


def main() -> None:
    """Print the table."""
    points = sys.argv[1] if len(sys.argv) > 1 else "100000"
    machine = sys.argv[2] if len(sys.argv) > 2 else "mikron-ucp710"
    controller = sys.argv[3] if len(sys.argv) > 3 else "linuxcnc"
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("3 axes", "5 axes"):
            source, target = Path(folder, "big.cls"), Path(folder, "big.ngc")
            extra = ["--five-axis"] if kind == "5 axes" else []
            measured(sys.executable, "samples/make_big.py", points, str(source), *extra)
            convert = (sys.executable, "-m", "postproc.cli.app", "convert", str(source), "-m", machine, "-c", controller,
                       "-o", str(target))
            measured(*convert)
            base = measured(sys.executable, "-c", COUNT, str(source))
            size = source.stat().st_size / 1e6
            print(f"{points} points, {kind}, {machine}, {controller}: {size:.1f} MB of CL text")
            for name, command in (("line count", (sys.executable, "-c", COUNT, str(source))),
                                  ("read", (sys.executable, "-c", READ, str(source))), ("convert", convert)):
                wall, used, peak = measured(*command)
                print(f"  {name:10} {wall:8.2f} s wall {used:8.2f} s processor ({used / base[1]:7.1f} x line count)  "
                      f"peak {peak:7.0f} MB ({peak / size:.1f} x file)")


if __name__ == "__main__":
    main()
