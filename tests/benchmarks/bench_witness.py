"""What the second witness costs, as a share of the conversion: python tests/benchmarks/bench_witness.py [POINTS ...]

Processor seconds of `postproc.convert` on files of three and of five axes (samples/make_big.py), the second of two runs.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import postproc
import toolpaths

ROOT = Path(__file__).parents[2]


def main() -> None:
    """Print the table."""
    for points in sys.argv[1:] or ["1000", "100000"]:
        for kind in ([], ["--five-axis"]):
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder, "big.cls")
                subprocess.run([sys.executable, "samples/make_big.py", points, str(file), *kind], cwd=ROOT, check=True)
                for _ in range(2):
                    begun = time.process_time()
                    path, found = toolpaths.read(file)
                    result = postproc.convert(path, "mikron-ucp710", "linuxcnc", diagnostics=found)
                    whole = time.process_time() - begun
                assert result.witness is not None and not result.witness.findings, [str(d) for d in result.diagnostics]
                own = result.witness.seconds
                print(f"{points} points, {'5' if kind else '3'} axes: conversion {whole:.3f} s, second witness {own:.3f} s, "
                      f"{100.0 * own / whole:.1f} % of it")


if __name__ == "__main__":
    main()
