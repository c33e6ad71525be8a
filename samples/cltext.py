"""Text of CL files: records as Siemens NX spells them, written from absolute positions and counted on the path."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Triple = Sequence[float] | Floats
Triples = Sequence[Triple] | Floats

UP = (0.0, 0.0, 1.0)
RAPID_COLOR, ENGAGE_COLOR, CUT_COLOR, RETRACT_COLOR, APPROACH_COLOR = 211, 42, 31, 37, 186


def number(value: float, decimals: int) -> str:
    """`value` with fixed decimals, never "-0.0000"."""
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}"


def numbers(values: Iterable[float], decimals: int) -> str:
    """Numbers joined by commas."""
    return ",".join(number(v, decimals) for v in values)


@dataclass(frozen=True)
class Frame:
    """A right-handed system: origin, X and Y axes in absolute coordinates."""

    origin: Triple = (0.0, 0.0, 0.0)
    x: Triple = (1.0, 0.0, 0.0)
    y: Triple = (0.0, 1.0, 0.0)

    @property
    def rotation(self) -> Floats:
        """(3, 3), columns X, Y, Z."""
        return np.column_stack((self.x, self.y, np.cross(self.x, self.y)))

    def point_out(self, point: Triple) -> Floats:
        """Local point to absolute."""
        return np.asarray(self.origin, float) + self.vector_out(point)

    def vector_out(self, vector: Triple) -> Floats:
        """Local direction to absolute."""
        return np.asarray(self.rotation @ np.asarray(vector, float))

    def point_in(self, point: Triple) -> Floats:
        """Absolute point to local."""
        return self.vector_in(np.asarray(point, float) - np.asarray(self.origin, float))

    def vector_in(self, vector: Triple) -> Floats:
        """Absolute direction to local."""
        return np.asarray(self.rotation.T @ np.asarray(vector, float))


WORLD = Frame()


def face_frame(origin: Triple, normal: Triple) -> Frame:
    """Frame on a face: Z along the outward normal, X level (absolute x on a level face)."""
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    level = np.cross(UP, n)
    size = float(np.linalg.norm(level))
    x = level / size if size > 1e-9 else np.array([1.0, 0.0, 0.0])
    return Frame(origin, tuple(x), tuple(np.cross(n, x)))


@dataclass(frozen=True)
class Cutter:
    """A tool as NX names it; lengths in mm."""

    number: int
    name: str
    diameter: float
    corner_radius: float = 0.0
    drill_point: float = 0.0
    """degrees; 0 for a mill"""
    rpm: int = 6000

    def tldata(self) -> str:
        """The TLDATA record."""
        if self.drill_point:
            return f"TLDATA/DRILL,MILL,{numbers((self.diameter, 0, 80, self.drill_point, 60), 4)}"
        return f"TLDATA/MILL,{numbers((self.diameter, self.corner_radius, 75, 0, 0), 4)}"


@dataclass
class NxFile:
    """Builds one NX file. Positions and directions are given in `place`, written in the operation's MSYS."""

    comments: Sequence[str]
    decimals: int = 4
    axis_decimals: int = 7
    units: str = ""
    lines: list[str] = field(default_factory=list)
    positions: list[Floats] = field(default_factory=list)
    axes: list[Floats] = field(default_factory=list)
    feed_length: float = 0.0
    cutter: Cutter = Cutter(0, "NONE", 0.0)
    msys: Frame = WORLD
    place: Frame = WORLD
    axis: Triple = UP
    axis_written: str = ""
    color_written: int = 0
    feed_written: str = ""
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(
        ("points", "rapids", "arcs", "cycles", "holes", "operations"), 0))

    def __post_init__(self) -> None:
        self.lines += [f"$$ {text}" for text in self.comments]
        if self.units:
            self.lines.append(f"UNITS/{self.units}")

    def operation(self, name: str, cutter: Cutter, msys: Frame = WORLD, place: Frame | None = None,
                  load: bool = True) -> None:
        """Open an operation; `place` (default the MSYS) is the system its moves are given in."""
        self.cutter, self.msys, self.place = cutter, msys, msys if place is None else place
        self.axis, self.axis_written, self.color_written, self.feed_written = UP, "", 0, ""
        self.counts["operations"] += 1
        self.lines += [f"TOOL PATH/{name},TOOL,{cutter.name}", cutter.tldata(),
                       f"MSYS/{numbers(msys.origin, 4)},{numbers((*msys.x, *msys.y), 7)}",
                       "$$ centerline data", "PAINT/PATH", "PAINT/SPEED,10"]
        if load:
            self.lines.append(f"LOAD/TOOL,{cutter.number},ADJUST,{cutter.number}")
        self.lines += [f"SPINDL/RPM,{cutter.rpm},CLW", "COOLNT/FLOOD"]

    def end(self) -> None:
        """Close the operation."""
        self.lines += ["COOLNT/OFF", "PAINT/SPEED,10", "PAINT/TOOL,NOMORE", "END-OF-PATH"]

    def color(self, code: int) -> None:
        """Display colour, where it changes."""
        if code != self.color_written:
            self.lines.append(f"PAINT/COLOR,{code}")
            self.color_written = code

    def feed(self, rate: float, color: int = CUT_COLOR) -> None:
        """FEDRAT in mm/min, where it changes."""
        self.color(color)
        record = f"FEDRAT/MMPM,{number(rate, 4)}"
        if record != self.feed_written:
            self.lines.append(record)
            self.feed_written = record

    def rapid(self, point: Triple, axis: Triple | None = None) -> None:
        """RAPID and its GOTO."""
        self.color(RAPID_COLOR)
        self.lines.append("RAPID")
        self.counts["rapids"] += 1
        self._goto(point, axis)

    def go(self, points: Triples, axes: Triples | None = None) -> None:
        """Straight moves at feed."""
        for point, axis in zip(points, repeat(None, len(points)) if axes is None else axes, strict=True):
            start = self.positions[-1]
            self._goto(point, axis)
            self.feed_length += float(np.linalg.norm(self.positions[-1] - start))

    def arc(self, center: Triple, end: Triple, ccw: bool, turns: int = 0) -> None:
        """Arc or helix about the tool axis, in the XY plane of `place`; `center` two numbers, `end` three.

        NX is left-handed: (i, j, k) along the tool axis means clockwise. The centre stands at the end's height.
        """
        start = self.place.point_in(self.positions[-1])
        a, b = np.asarray(start[:2]) - center[:2], np.asarray(end[:2], float) - center[:2]
        radius = float(np.hypot(*a))
        sweep = (np.arctan2(b[1], b[0]) - np.arctan2(a[1], a[0])) * (1 if ccw else -1) % (2 * np.pi) + turns * 2 * np.pi
        self.feed_length += float(np.hypot(radius * sweep, end[2] - start[2]))
        middle = self.msys.point_in(self.place.point_out((center[0], center[1], end[2])))
        sense = self.msys.vector_in(self.place.vector_out((0, 0, -1 if ccw else 1)))
        times = f",TIMES,{turns}" if turns else ""
        self.lines.append(f"CIRCLE/{numbers(middle, self.decimals)},{numbers(sense, 7)},{numbers((radius,), 4)},"
                          f"{numbers((0.03, 0.5, self.cutter.diameter, self.cutter.corner_radius), 4)}{times}")
        self.counts["arcs"] += 1
        self._goto(end, None)

    def holes(self, cycle: str, points: Triples) -> None:
        """A CYCLE, one GOTO per hole, CYCLE/OFF."""
        self.color(CUT_COLOR)
        self.lines.append(f"CYCLE/{cycle}")
        for point in points:
            self._goto(point, None)
        self.lines.append("CYCLE/OFF")
        self.counts["cycles"] += 1
        self.counts["holes"] += len(points)

    def _goto(self, point: Triple, axis: Triple | None) -> None:
        self.axis = self.axis if axis is None else tuple(axis)
        position, direction = self.place.point_out(point), self.place.vector_out(self.axis)
        written = numbers(self.msys.vector_in(direction), self.axis_decimals)
        tail = f",{written}" if written != self.axis_written else ""
        self.lines.append(f"GOTO/{numbers(self.msys.point_in(position), self.decimals)}{tail}")
        self.axis_written = written
        self.positions.append(position)
        self.axes.append(direction)
        self.counts["points"] += 1

    def text(self) -> str:
        """The whole file."""
        return "\n".join(self.lines) + "\n"

    def expected(self) -> dict[str, object]:
        """What a reader must find: counts, extents of the positions (part frame, mm), largest tilt, feed length."""
        return {**self.counts, "starts": 0, "homes": 0, "units": "mm",
                **measures(np.array(self.positions), np.array(self.axes)), "feed_length_mm": round(self.feed_length, 3)}


def leaning(tilt: Floats, azimuth: Floats) -> Floats:
    """Unit axes (N, 3) from tilt from z and azimuth from x, rad."""
    return np.column_stack((np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)))


def measures(tip: Floats, axis: Floats) -> dict[str, object]:
    """Extents and largest tilt (degrees from +z) of positions (N, 3) with axes (N, 3)."""
    extents = {c: [round(float(f(tip[:, i])), 4) + 0.0 for f in (np.min, np.max)] for i, c in enumerate("xyz")}
    tilt = np.degrees(np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2]))
    return {"extents_mm": extents, "largest_tilt_deg": round(float(tilt.max()), 3)}
