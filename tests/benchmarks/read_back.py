"""Worst deviation that the read-back finds, over all samples, machines, controllers and output modes that can convert.

    python tests/benchmarks/read_back.py [MACHINE ...]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import machines
import postproc
import toolpaths
from postproc.base.options import OutputMode
from postproc.controllers.model import builtin_files
from postproc.setup.model import load_setup

SAMPLES = Path(__file__).parents[2] / "samples"


def sample_files() -> list[Path]:
    """CL files of the samples, the dialects too."""
    found = [*SAMPLES.glob("*.cls"), *SAMPLES.glob("*.apt"), *(SAMPLES / "dialects").iterdir()]
    return sorted(p for p in found if p.suffix not in (".md", ".py", ".json"))


MODES: tuple[OutputMode, ...] = ("axes", "tcp", "tilted")
Key = tuple[str, str, str]
"""machine, controller, mode"""


def convert_all(name: str) -> Iterator[tuple[Key, postproc.PostResult]]:
    """Every conversion of a machine that succeeds."""
    setup, _ = load_setup(SAMPLES / ("h4a.setup.toml" if name.startswith("h4a") else "tools.setup.toml"))
    machine = machines.load(name)
    for file in sample_files():
        path, found = toolpaths.read(file)
        for controller in builtin_files():
            for mode in MODES:
                result = postproc.convert(path, machine, controller, setup=setup, diagnostics=found,
                                          options=postproc.Options(output=mode))
                if result.ok:
                    yield (name, controller, mode), result


def main() -> None:
    """Print, by machine and by controller and mode: conversions, worst tip, worst axis."""
    worst: dict[str, list[float]] = {}
    for name in sys.argv[1:] or machines.names():
        for (machine, controller, mode), result in convert_all(name):
            assert result.comparison is not None
            for key in (machine, f"{controller} {mode}"):
                row = worst.setdefault(key, [0.0, 0.0, 0.0])
                row[:] = [row[0] + 1, max(row[1], result.comparison.worst_tip), max(row[2], result.comparison.worst_axis)]
    for key, (count, tip, axis) in worst.items():
        print(f"{key:26} {int(count):3} conversions, tip {tip:.6f} mm, axis {np.degrees(axis):.5f} degrees")
    print("allowed 0.01 mm and 0.05 degrees")


if __name__ == "__main__":
    main()
