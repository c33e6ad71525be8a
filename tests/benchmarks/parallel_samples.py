"""Worst read-back deviation of the samples on every parallel machine, each part where `setup new --yes` puts it.

    python tests/benchmarks/parallel_samples.py [MACHINE ...]

A line a conversion: blocks, deviation of tip and axis as proved (or as seen at places, where cuts have no bound), processor
seconds. A sample that a machine cannot take is named with the first reason. Last the worst of all.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import machines
import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.setup_sheet.make import new_setup
from postproc.setup_sheet.questions import GivenAnswers
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples"
THREE_AXIS = ("pocket.cls", "bicubic.cls", "inch_plate.apt")
FIVE_AXIS = ("h4a_dome.cls", "h4a_indexed.cls", "five_tilted.cls", "blade.cls", "five_faces.cls", "tool_axis_tour.apt")
SOME = 1e-3
"""of a direction: less is none"""


def line(file: str, machine: Machine) -> tuple[str, float, float]:
    """One conversion as text; mm and rad that it is off, 0 of one that is refused."""
    path, found = toolpaths.read(SAMPLES / file)
    begun, head = time.process_time(), f"{machine.name:24} {file:18}"
    sheet = new_setup(path, machine, "linuxcnc", Options(), GivenAnswers(), None, True, found)
    seen = sheet.fit.result.comparison if sheet.fit is not None and sheet.text else None
    if sheet.fit is None or seen is None:
        return f"{head} refused: {next(str(d) for d in sheet.diagnostics if d.severity is Severity.ERROR)}", 0.0, 0.0
    return (f"{head} {len(path):5} points {len(seen.executed[1]):5} blocks  tip {seen.tip_bound:.6f} mm  axis "
            f"{seen.axis_bound / DEG:.6f} degrees  {seen.bounded_cuts} of {seen.cuts} cuts bounded  "
            f"{time.process_time() - begun:.1f} s", seen.tip_bound, seen.axis_bound)


def tilts(machine: Machine) -> bool:
    """Whether platform or axes give the tool other directions than z."""
    asked = np.array([[0.05, 0.0, 1.0], [0.0, 0.05, 1.0]]) / np.hypot(0.05, 1.0)
    return bool(np.abs(machine.kinematics.nearest_axis(asked)[:, :2]).max() > SOME)


def main() -> None:
    """Print all of them."""
    tip, axis, count = 0.0, 0.0, 0
    for name in sys.argv[1:] or machines.names():
        machine = machines.load(name)
        if machine.kinematics.straight_slides:
            continue
        for file in THREE_AXIS + (FIVE_AXIS if tilts(machine) else ()):
            text, one, other = line(file, machine)
            print(text, flush=True)
            tip, axis, count = max(tip, one), max(axis, other), count + (one > 0.0)
    print(f"{count} programs: tip at most {tip:.6f} mm, axis at most {axis / DEG:.6f} degrees")


if __name__ == "__main__":
    main()
