"""Moves of a test program: which kinds of motion show what a control does, as records of a CL file in a box of air."""

from __future__ import annotations

import math
from collections.abc import Sequence

from toolpaths.dataclass import dataclass

FEEDS = (1000.0, 3000.0, 8000.0)
"""mm/min at which moves are tried, up to what the machine's slowest linear axis can do"""
LEAN, TURNS = 8.0, 12
"""degrees by which the tool leans where turning axes move, and moves of them"""
STARTS, SPEED = 3, 1000.0
"""starts of the spindle, and its speed in rev/min"""
SETTLE = 0.2
"""s of the dwells between short moves"""
_START = f"SPINDL/RPM,{SPEED:g},CLW"

Point = tuple[float, float, float]


@dataclass(frozen=True)
class CandidateMoves:
    """Moves that are run together: name, the records of the CL file from the box's corner (0, 0, 0), and where they end."""

    name: str
    records: tuple[str, ...]
    end: Point


def candidates(size: float, fastest: float, turns: bool, spindle: bool) -> tuple[CandidateMoves, ...]:
    """What a test program may be made of.

    Args:
        size: mm, edge of the box in X and Y; a quarter of it in Z
        fastest: mm/min that every linear axis reaches; turns: turning axes may move the tool; spindle: it may be started
    """
    feeds = sorted({min(feed, fastest) for feed in FEEDS})
    result = [_rapids("rapids along X, Y", _zigzag(6, size, size / 6.0)),
              _rapids("short rapids", _zigzag(16, 0.06 * size, 0.03 * size)),
              _rapids("rapids along Z", [(0.0, 0.0, (k % 2) * 0.25 * size) for k in range(1, 7)]),
              _dwells("moves with a dwell after each", _zigzag(8, 0.1 * size, 0.02 * size), feeds[-1])]
    for feed in feeds:
        result += [_lines("lines with corners of 90 degrees", _zigzag(12, 0.2 * size, 0.04 * size), feed),
                   _lines("long lines", _zigzag(4, size, 0.1 * size), feed),
                   _lines("short lines round a circle", _round(80, 0.1 * size), feed),
                   _lines("shortest lines round a circle", _round(240, 0.04 * size), feed),
                   _arcs("arcs", 8, 0.05 * size, feed), _arcs("small arcs", 10, 0.01 * size, feed)]
        result += [_turning("moves of turning axes", 0.1 * size, feed)] if turns else []
    return (*result, *([_starts("starts of the spindle", feeds[0])] if spindle else []))


def cl_text(chosen: Sequence[CandidateMoves], tool: int, notes: Sequence[str]) -> str:
    """A CL file of the moves, an operation each, notes at its begin. Rapids back to the corner move one axis at a time."""
    lines = ["UNITS/MM"]
    for k, moves in enumerate(chosen):
        lines += [f"TOOL PATH/{moves.name.replace(',', ' AT').upper()},TOOL,TEST"]
        lines += [f"LOAD/TOOL,{tool}", *(f"PPRINT/{note}" for note in notes), _START] if k == 0 else []
        back = ((moves.end[0], 0.0, 0.0), (0.0, 0.0, 0.0))
        lines += ["RAPID", f"GOTO/{_at((0.0, 0.0, 0.0))}", *moves.records, *_at_rapid(back), "END-OF-PATH"]
    return "\n".join([*lines, "FINI", ""])


def _at(point: Point, axis: Point = (0.0, 0.0, 1.0)) -> str:
    return ",".join(f"{v + 0.0:.6f}" for v in (*point, *axis))


def _zigzag(count: int, long: float, step: float) -> list[Point]:
    """Corners of `count` strokes of `long` mm along X with steps along Y between them."""
    return [(long * ((k + 1) % 2), step * (k + side), 0.0) for k in range(count) for side in (0, 1)]


def _round(count: int, radius: float) -> list[Point]:
    """A circle of `count` lines that begins and ends in the corner."""
    turns = [2.0 * math.pi * k / count for k in range(1, count + 1)]
    return [(radius * (1.0 - math.cos(a)), radius * math.sin(a), 0.0) for a in turns]


def _at_rapid(points: Sequence[Point]) -> tuple[str, ...]:
    return tuple(record for point in points for record in ("RAPID", f"GOTO/{_at(point)}"))


def _rapids(name: str, points: Sequence[Point]) -> CandidateMoves:
    return CandidateMoves(name, _at_rapid(points), points[-1])


def _lines(name: str, points: Sequence[Point], feed: float) -> CandidateMoves:
    return CandidateMoves(f"{name}, F{feed:g}", (_feed(feed), *(f"GOTO/{_at(point)}" for point in points)), points[-1])


def _feed(feed: float) -> str:
    return f"FEDRAT/{feed:g},MMPM"


def _dwells(name: str, points: Sequence[Point], feed: float) -> CandidateMoves:
    stops = (record for point in points for record in (f"GOTO/{_at(point)}", f"DELAY/{SETTLE:g}"))
    return CandidateMoves(f"{name}, F{feed:g}", (_feed(feed), *stops), points[-1])


def _arcs(name: str, count: int, radius: float, feed: float) -> CandidateMoves:
    """Half circles one behind the other along X, their sides in turn."""
    records = [_feed(feed)]
    for k in range(count):
        centre = (radius * (2 * k + 1), 0.0, 0.0)
        records += [f"CIRCLE/{_at(centre, (0.0, 0.0, 1.0 if k % 2 else -1.0))},{radius:.6f},0.03,0.5,6,0",
                    f"GOTO/{_at((radius * (2 * k + 2), 0.0, 0.0))}"]
    return CandidateMoves(f"{name}, F{feed:g}", tuple(records), (2.0 * radius * count, 0.0, 0.0))


def _turning(name: str, size: float, feed: float) -> CandidateMoves:
    """The tool leans to and fro while the tip goes on, upright at the end."""
    records = [_feed(feed)]
    for k in range(1, TURNS + 1):
        lean = math.radians(LEAN * (k % 3) / 2.0)
        records.append(f"GOTO/{_at((size * k / TURNS, 0.0, 0.0), (math.sin(lean), 0.0, math.cos(lean)))}")
    return CandidateMoves(f"{name}, F{feed:g}", tuple(records), (size, 0.0, 0.0))


def _starts(name: str, feed: float) -> CandidateMoves:
    records = (record for k in range(STARTS) for record in (
        "SPINDL/OFF", *_at_rapid([(0.5 + k, 0.0, 0.0)]), _START, _feed(feed), f"GOTO/{_at((1.0 + k, 0.0, 0.0))}"))
    return CandidateMoves(name, tuple(records), (float(STARTS), 0.0, 0.0))
