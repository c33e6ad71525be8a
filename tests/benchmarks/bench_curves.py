"""Lines of a program of 70 curves of the CL file (NURBS records), by control and by what is bought: docs/controls.md.

    python tests/benchmarks/bench_curves.py [CURVES] [CONTROLLER ...]

Curves of 5 to 12 control points round a circle that waves, once in a plane and once in space, one after the other with
a rapid between; no rotary axis, the part off the machine's origin. Each program is written and proved at 0.01 mm: with
arcs and chords, and on Siemens and TNC as cubics (`[control] splines = true`: POLY, SPL) and, on Siemens, by control
points (`splines = "bspline"`). Each row: lines of the program, and the mm that are proved.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import machines
import postproc
from postproc.base.options import Options
from postproc.setup.model import SetupFile
from toolpaths.arrays import Floats
from toolpaths.cl.read import read_bytes

TOLERANCE = 0.01
HEAD = ("TOOL PATH/CURVES,TOOL,BALL6\nUNITS/MM\nTLDATA/MILL,6.0,3.0,75.0,0.0,0.0\n"
        "MSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\nSPINDL/RPM,9000,CLW\n")
SETUP = SetupFile.model_validate({"tools": {"1": {"gauge_length": 95.5}}, "part": {"origin": (31.0, -12.0, -160.0)}})
BOUGHT = {"chords and arcs": "", "cubics": "splines = true", "control points": 'splines = "bspline"'}
WORDS = {"siemens-840d": ("cubics", "control points"), "heidenhain-tnc640": ("cubics",)}
"""what the control has words for besides chords and arcs"""
CONTROLLERS = ("fanuc-30i", "haas-ngc", "linuxcnc", "siemens-840d", "heidenhain-tnc640")


def control_points(random: np.random.Generator, space: bool) -> Floats:
    """(5 to 12, 3) round a circle that waves, in mm."""
    count = int(random.integers(5, 13))
    angle = np.linspace(0.0, random.uniform(1.0, 5.0), count)
    radius = random.uniform(8.0, 40.0) * (1.0 + random.uniform(0.05, 0.25) * np.sin(random.uniform(1.0, 5.0) * angle))
    height = random.uniform(1.0, 8.0) * np.sin(random.uniform(0.5, 2.0) * angle) if space else np.zeros(count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def part(curves: int, space: bool) -> str:
    """A CL file (NX) of so many curves; what each of them is hangs on its number alone."""
    out = [HEAD]
    for seed in range(curves):
        random = np.random.default_rng(seed)
        points = control_points(random, space)
        knots = np.append(np.sort(random.uniform(0.05, 0.95, len(points) - 4)), 1.0)
        words = [f"{x:.6f},{y:.6f},{z:.6f}" for x, y, z in points]
        (x, y, _), (u, v, _) = points[0], points[-1]
        out.append(f"RAPID\nGOTO/{x:.6f},{y:.6f},30\nFEDRAT/MMPM,400\nGOTO/{words[0]}\nFEDRAT/MMPM,900\nNURBS/\nKNOT/"
                   + ",$\n".join(f"{k:.9f}" for k in knots) + "\n" + "".join(f"CNTRL/{w}\n" for w in words[1:])
                   + f"RAPID\nGOTO/{u:.6f},{v:.6f},30\n")
    return "".join(out) + "END-OF-PATH\n"


def row(folder: Path, text: str, controller: str, bought: str) -> str:
    """One conversion: lines, what is proved, seconds."""
    file = folder / "shop.toml"
    file.write_text(f'base = "mill-3axis"\n[control]\n{BOUGHT[bought]}\n')
    start, read = time.process_time(), read_bytes(text, tolerance=TOLERANCE)
    made = postproc.convert(read.toolpath, machines.load(file), controller, SETUP, Options(tolerance=TOLERANCE),
                            list(read.diagnostics))
    if not made.ok or made.comparison is None:
        return "refused: " + "; ".join(str(d) for d in made.diagnostics if d.severity.name == "ERROR")[:120]
    return (f"{len(made.text.splitlines()):7} lines, {made.comparison.tip_bound:.4f} mm proved, "
            f"{time.process_time() - start:5.1f} s")


def main(curves: int, controllers: list[str]) -> None:
    with TemporaryDirectory() as folder:
        for space in (False, True):
            text = part(curves, space)
            for controller in controllers:
                for bought in ("chords and arcs", *WORDS.get(controller, ())):
                    print(f"{'in space' if space else 'in a plane':10}  {controller:17}  {bought:15}  "
                          f"{row(Path(folder), text, controller, bought)}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 70, sys.argv[2:] or list(CONTROLLERS))
