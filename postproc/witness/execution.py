"""The state of a reading of a CL file: what holds from which position on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import postproc.witness.arcs as arcs
from postproc.witness.commanded import OFF, OWN, UNKNOWN, Pause, WitnessCycle
from postproc.witness.dialect import WitnessDialect
from postproc.witness.text import Array, ClText

Z = (0.0, 0.0, 1.0)


class HeldValues:
    """Values that hold from a row on; of several for one row the last counts."""

    def __init__(self, first: Any) -> None:
        self.rows, self.values = [0], [first]

    def set(self, row: int, value: Any) -> None:
        """From `row` on."""
        if self.rows[-1] == row:
            self.values[-1] = value
        else:
            self.rows.append(row)
            self.values.append(value)

    @property
    def now(self) -> Any:
        """The last value."""
        return self.values[-1]

    def column(self, n: int, dtype: Any) -> Array:
        """(n,) value of every row."""
        return self.spread(np.array(self.values, dtype), n)

    def spread(self, values: Array, n: int) -> Array:
        """(n,) one of values (K,), for each that was set, of every row; where all are one it is kept once, read-only."""
        if (values == values[0]).all() or (values != values).all():
            return np.broadcast_to(values[0], n)
        return np.repeat(values, np.diff(np.minimum(np.append(self.rows, n), n)))


class Execution:
    """The state of a reading; `row` counts all positions."""

    def __init__(self, text: ClText, dialect: WitnessDialect, scale: float) -> None:
        self.text, self.dialect, self.scale = text, dialect, scale
        self.row = 0
        self.extra: list[tuple[int, Any, Any, int]] = []
        self.rapid: set[int] = set()
        self.start: set[int] = set()
        self.deltas: list[tuple[int, tuple[float, ...]]] = []
        self.unread: dict[str, int] = {}
        self.axes: dict[int, tuple[float, ...]] = {}
        self.systems: dict[str, tuple[Array, Array]] = {}
        self.frame, self.frames, self._seen = HeldValues(0), [(np.eye(3), np.zeros(3))], dict[bytes, int]()
        self.known, self.gap = HeldValues(True), set[int]()
        self.feed: HeldValues = HeldValues((math.nan, False, False))
        self.tool, self.name, self.names = HeldValues(UNKNOWN), HeldValues(-1), list[str]()
        self.register, self.side = HeldValues(OWN), HeldValues(OFF)
        self.spindle: HeldValues = HeldValues((UNKNOWN, math.nan))
        self.last_direction = 1
        self.coolant, self.cycle, self.cycles = HeldValues(UNKNOWN), HeldValues(-1), list[WitnessCycle]()
        self.armed = -1
        self.radius, self.cutter = HeldValues(math.nan), HeldValues(math.nan)
        self.end: HeldValues = HeldValues((math.nan, math.nan))
        self.surface: dict[int, tuple[float, ...]] = {}
        self.rests, self.stops = list[Pause](), list[Pause]()
        self.arcs: dict[int, arcs.Given] = {}
        self.toward: tuple[float, ...] | None = None
        self.spline: tuple[list[float], list[tuple[float, ...]]] = ([], [])
        self.spline_line, self.splines = 0, dict[int, tuple[list[float], Array]]()
        self.inside = HeldValues(0)
        self.shifted = False
        self.height: float | None = None
        self.turn = np.eye(3)
        self.upright: tuple[float, ...] = Z

    def lost(self, what: str, line: int) -> None:
        """Something that was not understood."""
        self.unread.setdefault(what, line)

    def point(self, xyz: Any, axis: Any, line: int) -> None:
        """A position that no plain GOTO gives."""
        self.extra.append((self.row, xyz, axis, line))
        self.row += 1

    def system(self, matrix: Array, origin: Array, word: str, row: int) -> None:
        """Positions from here on are in a system, along its z until they say otherwise."""
        key = (np.append(matrix, origin) + 0.0).tobytes()
        if key not in self._seen:
            self.systems[f"{word} {len(self.systems) + 1}"] = matrix, origin
            self._seen[key] = len(self.frames)
            self.frames.append((matrix, origin))
        self.frame.set(row, self._seen[key])
        self.axes[row] = Z
        if not self.shifted:
            self.known.set(row, True)
