"""Write joints/: paths that ask for a plan of the joints of the whole program. python samples/make_joints.py [FOLDER]."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from cltext import ENGAGE_COLOR, RETRACT_COLOR, Cutter, Floats, NxFile
from surfaces import ball_tip, follow

BALL = Cutter(4, "BALL6", 6, 3, rpm=12000)


def leaning(tilt: Floats | float, heading: Floats | float) -> Floats:
    """Unit vectors (N, 3) at `tilt` from z towards `heading`, degrees."""
    a, b = np.broadcast_arrays(np.radians(tilt), np.radians(heading))
    return np.stack((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)), axis=-1)


def singular_pass() -> str:
    """Passes along x over a ridge, the axis on the path from -12 to 12 degrees of lean."""
    nx = NxFile(("continuous 5-axis: three passes over a ridge, the tool axis leans from -12 to 12 degrees along it; in",
                 "the first it goes through +z, in the second it passes 0.01 degrees next to it, in the third 0.5 degrees.",
                 "Top of the ridge at the origin, mm."), decimals=5, axis_decimals=9)
    tilt = np.linspace(-12, 12, 33)
    for name, miss, y in (("THROUGH", 0.0, -8.0), ("BESIDE", 0.01, 0.0), ("APART", 0.5, 8.0)):
        nx.operation(name, BALL, load=name == "THROUGH")
        across = np.radians(miss)
        along = leaning(np.abs(tilt), np.where(tilt < 0.0, 180.0, 0.0))
        axis = np.cos(across) * along + np.sin(across) * np.array((0.0, 1.0, 0.0))
        normal = along
        contact = np.column_stack((100.0 * normal[:, 0], np.full(33, y), 100.0 * (normal[:, 2] - 1.0)))
        follow(nx, ball_tip(contact, normal, axis, 3.0), axis, 1500)
        nx.end()
    return nx.text()


def cone(radius: float, height: float, turns: float, count: int) -> tuple[Floats, Floats]:
    """(tip, axis) (N, 3) of a spiral down a cone, the axis leaning outwards by 25 degrees."""
    t = np.linspace(0.0, 1.0, count)
    angle = 360.0 * turns * t
    r, z = radius * (0.4 + 0.6 * t), -height * t
    return np.column_stack((r * np.cos(np.radians(angle)), r * np.sin(np.radians(angle)), z)), leaning(25.0, angle)


def forced_rewind() -> str:
    """Four turns round a cone in one run, the tool lifted by 3 mm for a moment after each."""
    nx = NxFile(("continuous 5-axis: four turns down a cone, axis leaning outwards by 25 degrees; after each turn the tool"
                 " is",
                 "lifted by 3 mm in rapid and goes on where it was. An axis with less than four turns must be unwound:"
                 " there.",
                 "Tip of the cone at the origin, mm."), decimals=5)
    nx.operation("CONE", BALL)
    tip, axis = cone(30.0, 25.0, 4.0, 241)
    nx.rapid(tip[0] + 30 * axis[0], axis[0])
    nx.feed(300, ENGAGE_COLOR)
    nx.go(tip[:1])
    for turn in range(4):
        part = slice(60 * turn + 1, 60 * turn + 61)
        nx.feed(1200)
        nx.go(tip[part], axis[part])
        nx.rapid(tip[part][-1] + 3 * axis[part][-1])
        nx.feed(600, ENGAGE_COLOR)
        nx.go(tip[part][-1:])
    nx.feed(3000, RETRACT_COLOR)
    nx.go([tip[-1] + 5 * axis[-1]])
    nx.rapid(tip[-1] + 30 * axis[-1])
    nx.end()
    return nx.text()


def full_sphere() -> str:
    """A spiral over a ball from its top to 20 degrees below its middle, the axis on the normal."""
    nx = NxFile(("continuous 5-axis: one spiral over a ball of 25 mm from its top to 20 degrees below its middle, 12 turns,",
                 "axis on the normal, so that it starts along +z and ends pointing downwards. Middle of the ball at 0 0 0."),
                decimals=5)
    nx.operation("BALL", BALL)
    t = np.linspace(0.0, 1.0, 12 * 40 + 1)
    normal = leaning(110.0 * t, 360.0 * 12 * t)
    follow(nx, ball_tip(25.0 * normal, normal, normal, 3.0), normal, 1500)
    nx.end()
    return nx.text()


def turned_over() -> str:
    """Work on the underside of a part, tool axes round -z, in the part's own frame."""
    nx = NxFile(("continuous 5-axis on the underside of a part: tool axes within 20 degrees of -z. With",
                 "turned_over.setup.toml the part lies on its back. Origin in the middle of the upper side, part 20 mm"
                 " high."),
                decimals=5)
    nx.operation("UNDERSIDE", BALL)
    t = np.linspace(0.0, 1.0, 181)
    normal = leaning(180.0 - 20.0 * np.sin(np.pi * t), 540.0 * t)
    contact = np.column_stack((25 * np.cos(4 * t), 25 * np.sin(4 * t), np.full(181, -20.0)))
    follow(nx, ball_tip(contact, np.tile((0.0, 0.0, -1.0), (181, 1)), normal, 3.0), normal, 1200)
    nx.end()
    return nx.text()


def spiral_50() -> str:
    """Fifty turns down a cone without a stop."""
    nx = NxFile(("continuous 5-axis: fifty turns down a cone in one cut, axis leaning outwards by 25 degrees.",
                 "Tip of the cone at the origin, mm."), decimals=4)
    nx.operation("SPIRAL", BALL)
    follow(nx, *cone(40.0, 40.0, 50.0, 50 * 36 + 1), 2000)
    nx.end()
    return nx.text()


LIMITED = '''# The mikron-ucp710 with a C table that stops after a turn and a bit, so that long paths have to be unwound.
base = "mikron-ucp710"
description = "Mikron UCP 710 with a C axis of +-400 degrees, for the samples"

[axes.C]
travel = [-400, 400]
'''
TURNED = '''# Set-up of turned_over.cls: the part lies on its back, its z axis pointing down.
description = "part turned over"

[part]
x_axis = [1.0, 0.0, 0.0]
y_axis = [0.0, -1.0, 0.0]

[tools.4]
gauge_length = 130.25
'''
STOCK = '''# Set-up of forced_rewind.cls: the tool is drawn out of a blank 70 mm across, and comes back at 400 mm/min.
description = "rewinds out of the blank"

[tools.4]
gauge_length = 130.25

[rewind]
feed = 400

[rewind.stock]
low = [-35, -35, -40]
high = [35, 35, 0]
'''
FILES = {"singular_pass.cls": singular_pass, "forced_rewind.cls": forced_rewind, "full_sphere.cls": full_sphere,
         "turned_over.cls": turned_over, "spiral_50.cls": spiral_50, "limited_c.toml": lambda: LIMITED,
         "turned_over.setup.toml": lambda: TURNED, "forced_rewind.setup.toml": lambda: STOCK}


def main(folder: Path) -> None:
    """Write every file into `folder`/joints."""
    target = folder / "joints"
    target.mkdir(exist_ok=True)
    for name, make in FILES.items():
        (target / name).write_bytes(make().encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
