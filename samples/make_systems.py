"""Write systems/: a part that stands by a system of its CL file. python samples/make_systems.py [FOLDER]."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from cltext import ENGAGE_COLOR, RETRACT_COLOR, Cutter, Frame, NxFile

MILL = Cutter(2, "EM10", 10, rpm=8000)
UPSIDE_DOWN = Frame((393.0, -297.0, 3.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
"""z down, x and y changed, far from the model's origin"""
SETUP = '''# Set-up of upside_down.cls: the machining system stands on the table, not the model's origin.
description = "part by its machining system"

[part]
system = "MSYS 1"                   # or true: the system that is the work offset
origin = [20.0, -10.0, 0.0]         # of that system in the table frame, mm

[tools.2]
gauge_length = 120.0
'''


def upside_down() -> str:
    """A path round a corner and a slanted edge, both in the machining system."""
    nx = NxFile(("machining system MSYS turned upside down in the model and 493 mm away from its origin: z down, x and y",
                 "changed. With upside_down.setup.toml that system stands on the table, z up. Top of the part at its z = 0,",
                 "mm."), decimals=4)
    nx.operation("FACE", MILL, UPSIDE_DOWN)
    nx.rapid((-40, -20, 10))
    nx.rapid((-40, -20, 2))
    nx.feed(400, ENGAGE_COLOR)
    nx.go(np.array([[-40, -20, 0]], float))
    nx.feed(1200)
    nx.go(np.array([[36, -20, 0]], float))
    nx.arc((36, -16), (40, -16, 0), ccw=True)
    nx.go(np.array([[40, -12, 0], [-40, -12, 0]], float))
    nx.feed(2000, RETRACT_COLOR)
    nx.go(np.array([[-40, -12, 10]], float))
    nx.end()
    nx.operation("EDGE", MILL, UPSIDE_DOWN, load=False)
    lean = np.radians(25.0)
    axis = np.array([0.0, np.sin(lean), np.cos(lean)])
    nx.rapid((-40.0, 25.0, 30.0), axis)
    nx.feed(400, ENGAGE_COLOR)
    nx.go(np.array([[-40, 25, -5]], float))
    nx.feed(900)
    nx.go(np.array([[40, 25, -5]], float))
    nx.feed(2000, RETRACT_COLOR)
    nx.go(np.array([[40, 25, 30]], float))
    nx.end()
    return nx.text()


FILES = {"upside_down.cls": upside_down, "upside_down.setup.toml": lambda: SETUP}


def main(folder: Path) -> None:
    """Write every file into `folder`/systems."""
    target = folder / "systems"
    target.mkdir(exist_ok=True)
    for name, make in FILES.items():
        (target / name).write_bytes(make().encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
