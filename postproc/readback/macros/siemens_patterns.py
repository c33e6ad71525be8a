"""Hole patterns of SINUMERIK under MCALL: HOLES1 (row), HOLES2 (circle), CYCLE801 (grid): places in the order of drilling.

Programming Manual Cycles, drilling patterns: HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM),
HOLES2(CPA, CPO, RAD, STA1, INDA, NUM), CYCLE801(SPCA, SPCO, STA, DIS1, DIS2, NUM1, NUM2). A row begins at the end that is
nearer to the tool; a grid at the nearest corner, to and fro along the side that makes the shorter travel, the first
where both are alike (assumed); a circle at its first hole, INDA = 0 shares the full circle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from postproc.readback.macros.expressions import MacroFault

HolePlace = tuple[float, float]
PATTERNS = {"HOLES1": 6, "HOLES2": 6, "CYCLE801": 7}
"""values that each needs"""
MOST_HOLES = 100_000


def positions(name: str, values: Sequence[float | str | None], here: HolePlace | None) -> list[HolePlace]:
    """Places of the holes, in units of the program; `here`: where the tool stands, None where that is not known."""
    needed = PATTERNS[name]
    full = [0.0 if (name, k, v) == ("HOLES2", 4, None) else v for k, v in enumerate(values)]
    given = [v for v in full[:needed] if isinstance(v, float)]
    further = [v for v in values[needed:] if v not in (None, "", 0.0)]
    if len(given) < needed or further:
        raise MacroFault("gcode.cycle", f"{name} without its {needed} values" if len(given) < needed else
                         f"{name} with further values ({', '.join(map(str, further))}): hidden places, frames and sheared "
                         "grids are not executed", "state the places one by one, in blocks under MCALL")
    counts = given[5:needed] if name == "CYCLE801" else given[5:6]
    if any(n != round(n) or n < 1.0 for n in counts) or math.prod(counts) > MOST_HOLES:
        raise MacroFault("gcode.cycle", f"{name} with {' by '.join(f'{n:g}' for n in counts)} holes",
                         f"whole numbers, from 1 to {MOST_HOLES} holes")
    x, y, a, b, c, *_ = given
    count = round(counts[0])
    if name == "HOLES2":
        return _circle(x, y, a, b, c, count)
    return _row(x, y, a, b, c, count, here) if name == "HOLES1" else _grid(x, y, a, b, c, count, round(counts[1]), here)


def _turned(x: float, y: float, angle: float) -> HolePlace:
    a = math.radians(angle)
    return x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)


def _circle(x: float, y: float, radius: float, first: float, step: float, count: int) -> list[HolePlace]:
    step = step or 360.0 / count
    return [(x + dx, y + dy) for dx, dy in (_turned(radius, 0.0, first + k * step) for k in range(count))]


def _row(x: float, y: float, angle: float, first: float, step: float, count: int, here: HolePlace | None) -> list[HolePlace]:
    made = [(x + dx, y + dy) for dx, dy in (_turned(first + k * step, 0.0, angle) for k in range(count))]
    nearer = here is not None and math.dist(here, made[-1]) < math.dist(here, made[0]) - 1e-9
    return made[::-1] if nearer else made


def _grid(x: float, y: float, angle: float, across: float, up: float, columns: int, rows: int,
          here: HolePlace | None) -> list[HolePlace]:
    """To and fro along the side that makes the shorter travel, from the nearest corner."""
    along = rows * (columns - 1) * abs(across) + (rows - 1) * abs(up)
    other = columns * (rows - 1) * abs(up) + (columns - 1) * abs(across)
    best: list[HolePlace] = []
    for turn_i in (False, True):
        for turn_j in (False, True):
            i = [*range(columns)][::-1] if turn_i else [*range(columns)]
            j = [*range(rows)][::-1] if turn_j else [*range(rows)]
            steps = [(a, b) for n, b in enumerate(j) for a in (i if n % 2 == 0 else i[::-1])] if along <= other else \
                [(a, b) for n, a in enumerate(i) for b in (j if n % 2 == 0 else j[::-1])]
            made = [(x + dx, y + dy) for dx, dy in (_turned(a * across, b * up, angle) for a, b in steps)]
            if not best or (here is not None and math.dist(here, made[0]) < math.dist(here, best[0]) - 1e-9):
                best = made
    return best
