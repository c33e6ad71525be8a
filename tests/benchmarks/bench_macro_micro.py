"""Macro-micro against the macro alone (Company 2000, chapter IV): planned seconds of a zigzag, by its stroke.

    python tests/benchmarks/bench_macro_micro.py [STROKE ...]

Each stroke mm is gone to and fro, nine rows a tenth of it apart, at a feed that no axis reaches, on `macro-micro` and on a
mill whose three axes have the limits of its gantry. Seconds are those of --feed planned, cuts alone, each axis inside its
own velocity, acceleration and jerk.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import machines
import postproc
import toolpaths
from machines.machine import Machine
from postproc.setup.model import load_setup
from toolpaths.diagnostics import Severity

CONTROL = "siemens-840d"


def gantry(folder: Path) -> Machine:
    """A mill with the limits of the carriers of `macro-micro`."""
    carried, own = machines.load("macro-micro"), ['base = "mill-3axis"']
    for letter in "XYZ":
        j = carried.axis_names.index(letter)
        own += [f"[axes.{letter}]", "travel = [-1000, 1000]", "home = 500", *(
            f"{name} = {float(getattr(carried.limits, name)[j])!r}" for name in ("velocity", "acceleration", "jerk"))]
    (folder / "gantry.toml").write_text("\n".join(own))
    return machines.load(folder / "gantry.toml")


def seconds(machine: Machine, stroke: float, folder: Path) -> float:
    """s of the planned cuts."""
    rows = [f"GOTO/{side * stroke / 2:g},{(k - 4) * stroke / 10:g},0" for k in range(9)
            for side in ((-1, 1) if k % 2 else (1, -1))]
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,9000,CLW", "RAPID", rows[0][:-1] + "20", "FEDRAT/MMPM,120000", *rows,
             "RAPID", rows[-1][:-1] + "20", "FINI"]
    path, found = toolpaths.read_bytes("\n".join([*lines, ""]), file="zigzag.apt")
    (folder / "s.toml").write_text("[part]\norigin = [0, 0, -250]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 15\n")
    setup, _ = load_setup(folder / "s.toml")
    result = postproc.convert(path, machine, CONTROL, setup, postproc.Options(feed="planned"), diagnostics=list(found))
    if result.motion is None or not result.ok:
        raise SystemExit(next(str(d) for d in result.diagnostics if d.severity is Severity.ERROR))
    return result.motion.seconds


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        alone, both = gantry(folder), machines.load("macro-micro")
        print("stroke, mm   macro-micro, s   macro alone, s   ratio")
        for stroke in [float(one) for one in sys.argv[1:]] or [10.0, 30.0, 100.0, 200.0]:
            fast, slow = seconds(both, stroke, folder), seconds(alone, stroke, folder)
            print(f"{stroke:10g} {fast:16.3f} {slow:16.3f} {fast / slow:7.3f}", flush=True)


if __name__ == "__main__":
    main()
