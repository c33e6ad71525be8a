"""Write indexing/: a round part on a fourth axis, indexed by Creo. python samples/make_indexing.py [FOLDER].

Fourteen slots in seats 56.66 mm off the rotation axis, by a subroutine between TRANS +h and -h, and fourteen
holes between them, by a subroutine about the rotation axis; steps of 360/14 degrees, written as 25.714, from 45 degrees on.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cltext import Floats, number

COUNT, START, STEP = 14, 45.0, 25.714
HEIGHT = 56.66
SLOT = ((0.0, 0.0, -4.0), (30.0, 0.0, -4.0), (30.0, 0.0, 12.0))
"""in the seat: down, along, out"""
HOLE = ((42.0, 0.0, 48.0), (42.0, 0.0, 75.0))
"""about the rotation axis: down, out"""
SLOT_APPROACH, HOLE_APPROACH = (0.0, 0.0, 12.0), (42.0, 0.0, 75.0)
SETUP = '''# Set-up of the indexed parts: the rotation axis of the file is that of the table.
description = "indexed by Creo"

[tools.1]
gauge_length = 120.0

[tools.2]
gauge_length = 95.5
'''


@dataclass(frozen=True)
class SpellingOptions:
    """How the file writes it: MULTAX, and where the approach stands to ROTATE and the CSYS remark of its position."""

    multax: bool = False
    approach: str = "after"
    """before (ROTATE), between, after (the remark)"""
    units: str = "MM"


def turned(angle: float) -> Floats:
    """(3, 3) rotation about x, degrees."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def angles(start: float) -> list[float]:
    """Degrees by which the frame of each position is turned in the part."""
    return [start + STEP * k for k in range(COUNT)]


def csys(angle: float, height: float) -> list[str]:
    """The remark, with the seat's place in every fourth number."""
    rotation = turned(angle)
    rows = np.column_stack((rotation, rotation @ [0.0, 0.0, height]))
    text = [", ".join(number(v, 10) for v in row) for row in rows]
    return [f"$$-> CSYS / {text[0]},  $", f"\t    {text[1]},  $", f"\t    {text[2]}"]


def goto(point: tuple[float, ...], run_options: SpellingOptions) -> list[str]:
    """A point of the position's frame."""
    scale = 1.0 if run_options.units == "MM" else 25.4
    text = "GOTO / " + ", ".join(number(v / scale, 10) for v in point)
    return [f"{text}, $", " 0.0000000000, 0.0000000000, 1.0000000000"] if run_options.multax else [text]


def subroutine(n: int, points: tuple[tuple[float, ...], ...], run_options: SpellingOptions) -> list[str]:
    """DEFSUB with cuts and the retract."""
    lines = [f"DEFSUB / {n}", "FEDRAT / 250.000000,  MMPM"]
    for point in points[:-1]:
        lines += goto(point, run_options)
    return [*lines, "RAPID", *goto(points[-1], run_options), "ENDSUB"]


def position(n: int, angle: float, step: float, approach: tuple[float, ...], height: float,
             run_options: SpellingOptions) -> list[str]:
    """One position of the table: ROTATE, remark, approach and the call."""
    scale = 1.0 if run_options.units == "MM" else 25.4
    move = ["RAPID", *goto(approach, run_options)]
    h = number(height / scale, 10)
    call = [f"TRANS / 0.0000000000, 0.0000000000, {h}", f"CALSUB / {n}", f"TRANS / 0.0000000000, 0.0000000000, -{h}",
            "TRANS / 0.0000000000, 0.0000000000, 0.0000000000"] if height else [f"CALSUB / {n}"]
    parts = {"rotate": [f"ROTATE / AAXIS, INCR, {-step:.3f}, CCLW"], "csys": csys(angle, HEIGHT / scale), "move": move}
    order = {"before": ("move", "rotate", "csys"), "between": ("rotate", "move", "csys"),
             "after": ("rotate", "csys", "move")}[run_options.approach]
    return [line for name in order for line in parts[name]] + call


def text_of(run_options: SpellingOptions) -> str:
    """The whole file."""
    lines = ["$$ A round part on a fourth axis: Pro/CLfile text, indexed by ROTATE, subroutines between TRANS.",
             "$$-> MFGNO / INDEXED", "PARTNO / INDEXED", "MACHIN / UNCX01, 1",
             f"UNITS / {'MM' if run_options.units == 'MM' else 'INCHES'}"]
    lines += subroutine(1, SLOT, run_options) + subroutine(2, HOLE, run_options)
    last = 0.0
    for n, start, approach, height, diameter in ((1, START, SLOT_APPROACH, HEIGHT, 8.0),
                                                 (2, START + STEP / 2, HOLE_APPROACH, 0.0, 6.0)):
        lines += [f"$$-> FEATNO / {100 + n}", f"LOADTL / {n}", f"$$-> CUTTER / {diameter:.6f}",
                  *(["MULTAX / ON"] if run_options.multax else []), "SPINDL / RPM, 3000.000000,  CLW", "COOLNT / FLOOD"]
        for angle in angles(start):
            lines += position(n, angle, round(angle, 3) - last, approach, height, run_options)
            last = round(angle, 3)
        lines += ["COOLNT / OFF", "$$-> END /"]
    return "\n".join([*lines, f"ROTATE / AAXIS, INCR, {last:.3f}, CCLW", "FINI"]) + "\n"


FILES = {"creo_rotate.ncl": lambda: text_of(SpellingOptions()),
         "creo_rotate_multax.ncl": lambda: text_of(SpellingOptions(multax=True)),
         "indexing.setup.toml": lambda: SETUP}


def main(folder: Path) -> None:
    """Write all into `folder`/indexing."""
    (folder / "indexing").mkdir(exist_ok=True)
    for name, make in FILES.items():
        (folder / "indexing" / name).write_bytes(make().encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
