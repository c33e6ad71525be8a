"""What the second witness and the bound cost in a conversion: python tests/benchmarks/bench_witness.py [POINTS ...]

Processor seconds of `postproc.convert` on files of three and of five axes (samples/make_big.py), the second
of two runs (of a million points and more, the first).
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import postproc
import toolpaths
from postproc.readback.comparison import compare

ROOT = Path(__file__).parents[2]
LARGE = 1_000_000


class Clocked:
    """A function, and the processor seconds of its last call."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.seconds = function, 0.0

    def __call__(self, *given: Any) -> Any:
        """Called as the function is."""
        begun = time.process_time()
        try:
            return self.function(*given)
        finally:
            self.seconds = time.process_time() - begun


def main() -> None:
    """Print the table."""
    bound = Clocked(compare.bound_of_blocks)
    compare.bound_of_blocks = bound
    for points in sys.argv[1:] or ["1000", "100000"]:
        for kind in ([], ["--five-axis"]):
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder, "big.cls")
                subprocess.run([sys.executable, "samples/make_big.py", points, str(file), *kind],
                               cwd=ROOT, check=True)
                for _ in range(2 if int(points) < LARGE else 1):
                    begun = time.process_time()
                    path, found = toolpaths.read(file)
                    result = postproc.convert(path, "mikron-ucp710", "linuxcnc", diagnostics=found)
                    whole = time.process_time() - begun
                assert result.ok and result.witness is not None and result.comparison is not None, result.diagnostics
                own = result.witness.seconds
                c = result.comparison
                print(f"{points} points, {'5' if kind else '3'} axes: conversion {whole:.3f} s, second witness {own:.3f} s, "
                      f"{100.0 * own / whole:.1f} % of it, bound {bound.seconds:.3f} s, "
                      f"{100.0 * bound.seconds / whole:.1f} %; tip {c.tip_bound:.6f} mm, seen {c.worst_tip:.6f}", flush=True)


if __name__ == "__main__":
    main()
