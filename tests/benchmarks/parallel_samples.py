"""Worst read-back deviation of the samples on every parallel machine.

    python tests/benchmarks/parallel_samples.py

A sample that a machine cannot take is named with the first reason.
"""

from __future__ import annotations

from pathlib import Path

import machines
import postproc
import toolpaths
from postproc.setup.model import load_setup
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples"
THREE_AXIS = ("pocket.cls", "bicubic.cls", "inch_plate.apt")
FIVE_AXIS = ("h4a_dome.cls", "h4a_indexed.cls", "five_tilted.cls", "blade.cls", "five_faces.cls",
             "tool_axis_tour.apt")


def line(file: str, name: str, setup_name: str) -> str:
    """One conversion."""
    path, found = toolpaths.read(SAMPLES / file)
    setup, _ = load_setup(SAMPLES / f"{setup_name}.setup.toml")
    result = postproc.convert(path, machines.load(name), "linuxcnc", setup, diagnostics=found)
    head = f"{name:24} {file:18}"
    if result.comparison is None or not result.ok:
        reason = next(d for d in result.diagnostics if d.severity is Severity.ERROR)
        return f"{head} refused: [{reason.code}] {reason.message}"
    worst = result.comparison
    return (f"{head} {len(path):5} points {len(result.program or ()):5} blocks  tip {worst.worst_tip:.6f} mm  "
            f"axis {worst.worst_axis / DEG:.6f} degrees")


def main() -> None:
    """Print all of them."""
    for name in machines.names():
        if machines.load(name).kinematics.straight_slides:
            continue
        tilting = any(machines.load(name).rotary)
        setup_name = "h4a" if tilting else "tools" if name == "linuxcnc-lineardelta" else "delta"
        for file in THREE_AXIS + (FIVE_AXIS if tilting else ()):
            print(line(file, name, setup_name), flush=True)


if __name__ == "__main__":
    main()
