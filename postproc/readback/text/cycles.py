"""Canned cycles leg by leg, in the coordinates of the law in force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.readback.text.canonical import Drill, DrillStyle
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error

CycleLeg = tuple[int, Floats, float, float]
"""code, end, feed (NaN: the F word in force), rest at the end (s) of one leg"""
EPSILON = 1e-9
MOST = 10_000
"""pecks of one hole, and holes of one block: more are a typing error"""
_STYLES: dict[int, DrillStyle] = {73: "break", 83: "peck", 74: "feed_out", 84: "feed_out", 85: "feed_out", 89: "feed_out"}
"""by the G code; others drill"""


def legs(drill: Drill, start: Floats, target: Floats, z: int, first: float | None = None) -> list[CycleLeg]:
    """The legs from `start` (J,) over the hole, whose place is that of `target` (J,), to the level where the cycle ends.

    `z` is the column of the tool's axis. `first`: the level where the sequence of cycles began, on controls that leave the
    level of the last hole on the path: where it is below the plane they first go to the plane; from there or lower they
    travel aslant to where the cycle ends (LinuxCNC 2.9, as its interpreter shows). Others travel at the level
    where the tool stands.
    """
    level, result, nothing = float(start[z]), [], float("nan")
    if first is not None:
        if first < drill.plane - EPSILON and abs(level - drill.plane) > EPSILON:
            level = drill.plane
            result.append((0, _at(start, z, level), nothing, 0.0))
        level = level if level > drill.plane + EPSILON else drill.out
    over = _at(target, z, level)
    if (over != (result[-1][1] if result else start)).any():
        result.append((0, over, nothing, 0.0))
    if abs(level - drill.plane) > EPSILON:
        result.append((0, _at(target, z, drill.plane), nothing, 0.0))
    return result + _down(drill, target, z) + _out(drill, target, z)


def _at(base: Floats, z: int, height: float) -> Floats:
    point: Floats = base.copy()
    point[z] = height
    return point


def _down(drill: Drill, target: Floats, z: int) -> list[CycleLeg]:
    """From the plane to the bottom, peck by peck."""
    result: list[CycleLeg] = []
    nothing = float("nan")
    for depth in drill.bottoms[:-1]:
        result.append((1, _at(target, z, depth), drill.feed, 0.0))
        if drill.style == "peck":
            result.append((0, _at(target, z, drill.plane), nothing, 0.0))
        if drill.relief > 0.0:
            result.append((0, _at(target, z, min(depth + drill.relief, drill.plane)), nothing, 0.0))
    return [*result, (1, _at(target, z, drill.bottom), drill.feed, drill.dwell)]


def _out(drill: Drill, target: Floats, z: int) -> list[CycleLeg]:
    result: list[CycleLeg] = []
    nothing = float("nan")
    if drill.style == "feed_out":
        result.append((1, _at(target, z, drill.plane), drill.feed_out, 0.0))
        if abs(drill.out - drill.plane) > EPSILON:
            result.append((0, _at(target, z, drill.out), nothing, 0.0))
        return result
    if drill.feed_out > 0.0:
        return [(1, _at(target, z, drill.out), drill.feed_out, 0.0)]
    return [(0, _at(target, z, drill.out), nothing, 0.0)]


def unfit(drill: Drill) -> tuple[str, str] | None:
    """(what is wrong with a cycle, what to do); None where it makes a hole."""
    if not drill.bottom < drill.plane - EPSILON:
        return "whose bottom does not lie below its plane: a hole without depth", "state Z below R"
    return (f"of more than {MOST} pecks", "state a larger peck") if len(drill.bottoms) > MOST else None


def pecks(plane: float, bottom: float, first: float, less: float = 0.0,
          least: float = 0.0) -> tuple[float, ...]:
    """Depths of pecks below `plane`: `first` mm, then each by `less` mm less, `least` mm at least; the last is `bottom`.

    More than MOST end there: `unfit` refuses them.
    """
    depths: list[float] = []
    depth, step = plane - first, first
    while depth > bottom + EPSILON and len(depths) <= MOST:
        depths.append(depth)
        step = max(step - less, least, EPSILON * 10.0) if less > 0.0 else step
        depth -= step
    return (*depths, bottom)


@dataclass
class Sticky:
    """What a canned cycle of RS274/NGC kind holds from block to block: Z, R, Q, P, I, J, K and its first level."""

    values: Floats
    code: int = 0
    initial: float = float("nan")
    relief: float = 0.0

    def enter(self, level: float) -> None:
        """A sequence of cycles begins with the tool at a level."""
        self.initial, self.code = level, 0

    def drill(self, code: int, stated: Floats, scale: float, shift: float, to_plane: bool, relative: bool, file: str,
              line: int, found: list[Diagnostic]) -> Drill | None:
        """The cycle of one block that states Z, R, Q, P (s), I, J, K (7,); None where it lacks something.

        Relative (G91): R counts from the first level, Z from R (RS274/NGC 3.5.16.1, Fanuc B-64484EN 5.1).
        """
        if code != self.code:
            self.values[:] = np.nan
        self.code = code
        self.values = np.where(np.isfinite(stated), stated, self.values)
        z, r, q, dwell, first, less, least = self.values.tolist()
        tapered = code in (73, 83) and first > 0.0
        if not np.isfinite([z, r]).all() or (code in (73, 83) and not (q > 0.0 or tapered)):
            lacks = "Q" if np.isfinite([z, r]).all() else "Z or R"
            found.append(error("gcode.cycle", f"G{code} lacks {lacks}", file=file, lines=[line],
                               hint="state Z and R, and Q for pecking, with the code"))
            return None
        plane = self.initial + r * scale if relative else r * scale + shift
        bottom = plane + z * scale if relative else z * scale + shift
        out = plane if to_plane else max(plane, self.initial)
        if tapered:
            bottoms = pecks(plane, bottom, first * scale, np.nan_to_num(less) * scale,
                            np.nan_to_num(least) * scale)
        else:
            bottoms = pecks(plane, bottom, q * scale) if code in (73, 83) else (bottom,)
        rest = dwell if code not in (81, 85) and np.isfinite(dwell) else 0.0
        return Drill(plane, bottom, out, bottoms, _STYLES.get(code, "drill"),
                     self.relief if code in (73, 83) else 0.0, rest)
