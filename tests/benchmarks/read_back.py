"""Worst deviation that the read-back finds, over all samples, machines and controllers that can convert.

    python tests/benchmarks/read_back.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import machines
import postproc
import toolpaths
from postproc.controllers.model import builtin_files
from postproc.setup import load_setup

SAMPLES = Path(__file__).parents[2] / "samples"


def sample_files() -> list[Path]:
    """CL files of the samples, the dialects too."""
    found = [*SAMPLES.glob("*.cls"), *SAMPLES.glob("*.apt"), *(SAMPLES / "dialects").iterdir()]
    return sorted(p for p in found if p.suffix not in (".md", ".py", ".json"))


def main() -> None:
    """Print a line per machine: conversions, worst tip, worst axis."""
    total = 0
    for name in machines.names():
        setup, _ = load_setup(SAMPLES / ("h4a.setup.toml" if name.startswith("h4a") else "tools.setup.toml"))
        count, tip, axis = 0, 0.0, 0.0
        for file in sample_files():
            path, found = toolpaths.read(file)
            for controller in builtin_files():
                result = postproc.convert(path, machines.load(name), controller, setup=setup, diagnostics=found)
                if result.comparison is not None and result.ok:
                    count += 1
                    tip, axis = max(tip, result.comparison.worst_tip), max(axis, result.comparison.worst_axis)
        total += count
        print(f"{name:26} {count:3} conversions, tip {tip:.6f} mm, axis {np.degrees(axis):.5f} degrees")
    print(f"{total} conversions, allowed 0.01 mm and 0.05 degrees")


if __name__ == "__main__":
    main()
