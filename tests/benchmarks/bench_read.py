"""Seconds and memory of reading points in each spelling, compared with a bare count of the same file's lines, in one run.

    python tests/benchmarks/bench_read.py [POINTS]

Each figure comes from a process of its own, the best of three in processor time; memory is the peak of the process.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from bench_road import COUNT, measured

READ = ("from toolpaths.cl.read import read_file; r = read_file(sys.argv[1]); "
        "assert len(r.toolpath) == int(sys.argv[2]), r.diagnostics")
START = "import sys; sys.path.insert(0, '.'); "
TIMES = 3
AXIS = "{3:.7f},{4:.7f},{5:.7f}"
SPELLINGS = {
    "NX, 3 numbers": ("TOOL PATH/A,TOOL,B\nFEDRAT/MMPM,500\n", "GOTO/{0:.4f},{1:.4f},{2:.4f}\n"),
    "NX, 6 numbers": ("TOOL PATH/A,TOOL,B\nFEDRAT/MMPM,500\n", f"GOTO/{{0:.4f}},{{1:.4f}},{{2:.4f}},{AXIS}\n"),
    "CATIA, columns": ("$$ CATIA APT\nFEDRAT/500.,MMPM\n",
                       "GOTO  / {0:11.5f},{1:11.5f},{2:11.5f},{3:9.6f},{4:9.6f},{5:9.6f}\n"),
    "Creo, continued": ("$$-> MFGNO / A\nUNITS / MM\nFEDRAT / 500.0,  MMPM\nMULTAX / ON\n",
                        "GOTO / {0:.10f}, {1:.10f}, {2:.10f}, $\n {3:.10f}, {4:.10f}, {5:.10f}\n"),
    "blanks for commas": ("UNITS/MM\nFEDRAT/500\n", "GOTO/{0:.4f} {1:.4f} {2:.4f}\n"),
}


def make(path: Path, name: str, count: int) -> None:
    """Write `count` random points; in a process of its own, whose memory is not counted with the others'."""
    import numpy as np

    rng = np.random.default_rng(1)
    axis = rng.normal(size=(count, 3))
    axis[:, 2] += 5.0
    rows = np.column_stack((rng.uniform(-200, 200, (count, 3)), axis / np.linalg.norm(axis, axis=1)[:, None]))
    head, line = SPELLINGS[name]
    path.write_text(head + "".join(line.format(*row) for row in rows.tolist()), encoding="ascii")


def best(*command: str) -> tuple[float, float, float]:
    """(wall s, processor s, MB) of the run that took least processor time."""
    return min((measured(*command) for _ in range(TIMES)), key=lambda m: m[1])


def main() -> None:
    """Print the table."""
    count = sys.argv[1] if len(sys.argv) > 1 else "1000000"
    start = best(sys.executable, "-c", START + "from toolpaths.cl.read import read_file")
    print(f"{count} points; start of the interpreter with numpy: {start[1]:.2f} s, {start[2]:.0f} MB")
    with tempfile.TemporaryDirectory() as folder:
        for name in SPELLINGS:
            source = Path(folder, "points.cls")
            measured(sys.executable, __file__, "--make", str(source), name, count)
            size = source.stat().st_size / 1e6
            _, base, least = best(sys.executable, "-c", COUNT, str(source))
            wall, used, peak = best(sys.executable, "-c", START + READ, str(source), count)
            print(f"{name:18} {size:6.1f} MB  line count {base:5.2f} s {least:4.0f} MB   read {used:6.2f} s processor "
                  f"({wall:.2f} wall), {used / base:6.1f} x line count, {peak:5.0f} MB ({peak / size:.1f} x file)")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--make"]:
        make(Path(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
    else:
        main()
