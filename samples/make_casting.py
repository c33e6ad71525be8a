"""Write casting/: a casting cut from five sides, as Creo writes it, and a trunnion that turns it over.

python samples/make_casting.py [FOLDER]. The sides look along +z, up at 45 degrees, along x, -z and -x; where
the tool is along z it lies along C of the trunnion (A at 0 and at 180). The part stands off both rotary axes.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cltext import Floats, Frame, face_frame, number

HALF = 0.5 ** 0.5
TOOLS = {1: (20.0, 2600), 2: (8.0, 6200), 3: (6.8, 2100)}
"""diameter mm, rpm"""
SETUP = '''# Set-up of the casting: it stands off both rotary axes, its tools have different lengths.
description = "casting on a trunnion that reaches A 180"

[part]
origin = [45.0, -30.0, 60.0]

[tools.1]
gauge_length = 120.0

[tools.2]
gauge_length = 95.5

[tools.3]
gauge_length = 143.25
'''
MACHINE = '''# No particular machine: travel and dynamics are round figures of the class, hence all assumed. A reaches 180
# degrees, so that the part is cut from below too; its line lies 35 mm in front of and 20 mm below that of C.
description = "5-axis mill with a trunnion table that turns the part over, A carries C"
retract_axis = "Z"

[kinematics]
family = "serial"
structure = "w C' A' b X Y Z (C1) t"

[kinematics.axes.A]
point = [0, -35, -20]

[kinematics.axes.C]
point = [0, 0, 0]

[axes.X]
travel = [-500, 500]
velocity = 500
acceleration = 3000
jerk = 30000
home = 0
assumed = ["travel", "velocity", "acceleration", "jerk"]

[axes.Y]
travel = [-500, 500]
velocity = 500
acceleration = 3000
jerk = 30000
home = 0
assumed = ["travel", "velocity", "acceleration", "jerk"]

[axes.Z]
travel = [-300, 700]
velocity = 500
acceleration = 3000
jerk = 30000
home = 700
assumed = ["travel", "velocity", "acceleration", "jerk"]

[axes.A]
travel = [-45, 185]
velocity = 120
acceleration = 600
jerk = 6000
home = 0
assumed = ["travel", "velocity", "acceleration", "jerk"]

[axes.C]
travel = "unlimited"
velocity = 240
acceleration = 1200
jerk = 12000
home = 0
assumed = ["travel", "velocity", "acceleration", "jerk"]

[timing]
tool_change = 5
clamp = 0.5
unclamp = 0.5
assumed = ["tool_change", "clamp", "unclamp"]
'''


@dataclass(frozen=True)
class Side:
    """One side: origin and outward normal of its seat, size of the pocket, holes, all in the seat's system."""

    origin: tuple[float, float, float]
    normal: tuple[float, float, float]
    width: float
    holes: tuple[tuple[float, float], ...]
    cut: int
    """tool of the pocket"""


SIDES = (Side((0.0, 0.0, 70.0), (0.0, 0.0, 1.0), 60.0, ((-25.0, 10.0), (25.0, 10.0)), 1),
         Side((25.0, 43.3, 55.0), (0.5 * HALF, 0.75 ** 0.5 * HALF, HALF), 40.0, ((0.0, -6.0),), 2),
         Side((80.0, 5.0, 30.0), (1.0, 0.0, 0.0), 30.0, ((0.0, 8.0),), 2),
         Side((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 50.0, ((-15.0, 12.0), (15.0, -12.0)), 1),
         Side((-80.0, -10.0, 35.0), (-1.0, 0.0, 0.0), 30.0, ((-8.0, 0.0), (8.0, 0.0)), 2))


def csys(seat: Frame) -> list[str]:
    """The remark, with the seat's place in every fourth number."""
    rows = np.column_stack((seat.rotation, np.asarray(seat.origin, float)))
    text = [", ".join(number(v, 10) for v in row) for row in rows]
    return [f"$$-> CSYS / {text[0]},  $", f"\t    {text[1]},  $", f"\t    {text[2]}"]


def goto(seat: Frame, point: Floats | tuple[float, ...]) -> list[str]:
    """A point of the seat in the common frame, and the tool axis."""
    place = ", ".join(number(v, 10) for v in seat.point_out(point))
    return [f"GOTO / {place}, $", " " + ", ".join(number(v, 10) for v in seat.rotation[:, 2])]


def rapid(seat: Frame, *points: tuple[float, ...]) -> list[str]:
    """RAPID and its GOTO, each."""
    return [line for point in points for line in ("RAPID", *goto(seat, point))]


def pocket(seat: Frame, width: float) -> list[str]:
    """Down, a lap with one round corner, up."""
    a, b = width / 2.0, width / 4.0
    corner = seat.point_out((a - 5.0, b - 5.0, -6.0))
    lines = [*rapid(seat, (-a, -b, 40.0), (-a, -b, 2.0)), "FEDRAT / 250.000000,  MMPM", *goto(seat, (-a, -b, -6.0)),
             "FEDRAT / 600.000000,  MMPM", *goto(seat, (a, -b, -6.0)), *goto(seat, (a, b - 5.0, -6.0)),
             "CIRCLE / " + ", ".join(number(v, 10) for v in corner) + ", $",
             ", ".join(number(v, 10) for v in (*seat.rotation[:, 2], 5.0)), *goto(seat, (a - 5.0, b, -6.0)),
             *goto(seat, (-a, b, -6.0)), *goto(seat, (-a, -b, -6.0))]
    return [*lines, *rapid(seat, (-a, -b, 40.0))]


def drilled(seat: Frame, holes: tuple[tuple[float, float], ...]) -> list[str]:
    """Above the first hole, the cycle, up above the last."""
    return [*rapid(seat, (*holes[0], 40.0)),
            "CYCLE / DRILL, DEPTH, 12.000000, MMPM, 180.000000, CLEAR, 3.000000, $", "RETURN, 20.000000",
            *(line for hole in holes for line in goto(seat, (*hole, 0.0))), "CYCLE / OFF", *rapid(seat, (*holes[-1], 40.0))]


def sequence(number_: int, tool: int, seat: Frame, moves: list[str]) -> list[str]:
    """One NC sequence."""
    diameter, rpm = TOOLS[tool]
    return [f"$$-> FEATNO / {number_}", f"LOADTL / {tool}", f"$$-> CUTTER / {diameter:.6f}", *csys(seat), "MULTAX / ON",
            f"SPINDL / RPM, {rpm:.6f},  CLW", "COOLNT / FLOOD", *moves, "COOLNT / OFF", "$$-> END /"]


def casting() -> str:
    """Pockets of all sides, then their holes."""
    lines = ["$$ A casting cut from five sides, one of them from below: Pro/CLfile text.", "$$-> MFGNO / CASTING",
             "PARTNO / CASTING", "MACHIN / UNCX01, 1", "UNITS / MM"]
    seats = [face_frame(side.origin, side.normal) for side in SIDES]
    for n, (side, seat) in enumerate(zip(SIDES, seats, strict=True)):
        lines += sequence(201 + n, side.cut, seat, pocket(seat, side.width))
    for n, (side, seat) in enumerate(zip(SIDES, seats, strict=True)):
        lines += sequence(301 + n, 3, seat, drilled(seat, side.holes))
    return "\n".join([*lines, "FINI"]) + "\n"


FILES = {"casting.ncl": casting, "casting.setup.toml": lambda: SETUP, "trunnion_over.toml": lambda: MACHINE}


def main(folder: Path) -> None:
    """Write all into `folder`/casting."""
    (folder / "casting").mkdir(exist_ok=True)
    for name, make in FILES.items():
        (folder / "casting" / name).write_bytes(make().encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
