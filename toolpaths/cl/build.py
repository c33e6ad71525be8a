"""The state of reading: where we are in the file, what holds from here on, what was found so far.

Plain points are never touched one by one: a record that changes something notes the row from which it holds
(`ModalValue`), and `assemble` spreads these over the rows at the end.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Generic, TypeVar

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.choices import CubicPieces, LengthUnit
from toolpaths.cl.arcs import ArcTable
from toolpaths.cl.text.dialects import SCALE, Dialect
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.scan import Points
from toolpaths.cl.text.statements import COMMENT, Statement, StatementList
from toolpaths.cl.text.subprograms import Called, Subprograms
from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Cycle, Event, FeedMode, Frame, Operation, Role, Tool

Triple = tuple[float, float, float]
Map = tuple[Floats, Floats]
"""rotation (3, 3) and origin (3,) mm: local to part frame"""
NO_NUMBERS: Triple = (float("nan"),) * 3
BETWEEN = frozenset({"FEDRAT", "PPRINT", "REMARK", "LPRINT", "COOLNT", "SPINDL", "CUTCOM", "MOVE_ATTRIB", "PAINT",
                     "$$"})
"""Records that may stand between an arc and the GOTO of its end."""
V = TypeVar("V")


class ModalValue(Generic[V]):
    """A value that holds from a row on until the next change."""

    __slots__ = ("starts", "values")

    def __init__(self, first: V):
        self.starts, self.values = [0], [first]

    def set(self, row: int, value: V) -> None:
        """From `row` on."""
        if self.starts[-1] == row:
            self.values[-1] = value
        elif value != self.values[-1]:
            self.starts.append(row)
            self.values.append(value)

    @property
    def now(self) -> V:
        """The value at the end."""
        return self.values[-1]


@dataclass
class Declared:
    """Lists that text of our own writer states outright, and the tool index in use."""

    units: LengthUnit
    spline_slack: float = 0.0
    frames: list[Frame] = field(default_factory=list)
    tools: list[Tool] = field(default_factory=list)
    operations: list[Operation] = field(default_factory=list)
    tool: ModalValue[int] = field(default_factory=lambda: ModalValue(-1))


@dataclass(frozen=True)
class Heights:
    """Planes of a cycle as heights (mm) over the origin of the system, along the tool axis; NaN: `Cycle.clearance` holds.

    from_bottom: the GOTO is the hole's bottom
    """

    start: float
    retract: float
    from_bottom: bool


class Extras:
    """Points that are not plain GOTO lines, as written; NaN where a record has no numbers of that kind."""

    def __init__(self) -> None:
        self.xyz: list[Triple] = []
        self.axis: list[Triple] = []
        self.third: list[Triple] = []
        self.line: list[int] = []


class ToolpathBuilder:
    """Reads one program. Handlers get it with the statement and use what they need."""

    def __init__(self, program: StatementList, points: Points, dialect: Dialect, units: LengthUnit, log: DiagnosticLog,
                 allow_unknown: Iterable[str] = (), spline_slack: float = 0.0, cubics: CubicPieces = "",
                 passive: frozenset[str] = frozenset()):
        self.program, self.points, self.dialect, self.log = program, points, dialect, log
        self.units, self.scale, self.spline_slack, self.cubics = units, SCALE[units], spline_slack, cubics
        self.passive = passive  # words that a package says to be without effect
        self.allow_unknown = frozenset(w.upper() for w in allow_unknown) | passive
        self.row = self.fast = self.line = self.index = self.stop = 0
        self._piece = 0
        self.pieces: list[tuple[int, int]] = []
        self.extras = Extras()
        self._start_tracks()
        self._start_lists()

    def _start_tracks(self) -> None:
        self.feed: ModalValue[tuple[float, FeedMode]] = ModalValue((float("nan"), FeedMode.PER_TIME))
        self.feed_units: dict[str, int] = {}
        """units that feeds are stated in, and the line of the first in each"""
        self.tool: ModalValue[Tool | None] = ModalValue(None)
        self.operation = ModalValue(-1)
        self.cycle = ModalValue(-1)
        self.system = ModalValue(-1)
        self.map = ModalValue(0)
        self.in_subprogram = ModalValue(False)
        self.frame_faults: ModalValue[object] = ModalValue("")
        """what the file contradicts about the frame of its points (`indexing`)"""
        self.dropped_at: ModalValue[object] = ModalValue(False)
        """where the translation of a CSYS remark is not added"""

    def _start_lists(self) -> None:
        self.maps: list[Map | None] = [None]
        self.map_index = {b"": 0}
        self.axis_marks: list[tuple[int, Triple]] = []
        self.world_axes: list[tuple[int, Triple, int]] = []
        """row, axis in the part frame and line of TLAXIS where ROTABL must agree with it (`.clt`)"""
        self.multax_off: list[tuple[int, int]] = []
        """row and line of MULTAX/OFF where the system does not say what the axis is then"""
        self.rapids: list[int] = []
        self.roles: dict[int, Role] = {}
        self.deltas: list[tuple[int, Triple]] = []
        self.arcs = ArcTable()
        self.events: list[Event] = []
        self.frames: list[Frame] = []
        self.frame_index: dict[object, int] = {}
        self.operations: list[Operation] = []
        self.cycles: list[Cycle] = []
        self.heights: dict[int, Heights] = {}
        """by cycle, where the file states its planes as heights"""
        self.turning: set[tuple[int, int]] = set()
        """(operation, row) where words of turning stood"""
        self.surface_speed: set[tuple[int, int]] = set()
        """(operation, row) where a surface speed stood: a lathe has one mostly, a mill may."""
        self.declared: Declared | None = None
        self.zsurf: float | None = None
        self.subprograms: Subprograms | None = None
        self.open_paths: list[tuple[int, str]] = []
        """line and name of the operations that END-OF-PATH has yet to end"""
        self.paths_ended = False
        """END-OF-PATH stood in the file"""
        self.finished = -1
        """row at the first FINI"""
        self._start_turned_and_called()

    def _start_turned_and_called(self) -> None:
        self.calls: list[tuple[int, int]] = []
        self.table = [0.0, 0.0, 0.0]
        self.turned_at = 0
        """row at which ROTABL has last turned the frame of the points"""
        self.turned_lines: dict[int, int] = {}
        """line of the last ROTABL that turns the frame of the points by row, where TLAXIS begins with it upright"""
        self.turned: Floats = np.eye(3)
        self.table_turn: Floats = np.eye(3)
        """turned machine to part, by ROTATE alone (Creo)"""
        self.table_here: Floats = np.eye(3)
        """the same where the last system was stated"""
        self.unknown_turn = ""
        """what is not known of the angle of ROTATE (Creo), until a system is stated"""
        self.turns_at: list[int] = []
        """rows before which ROTATE stands"""
        self.about_axis = False
        self.indexed_subs: frozenset[Called] | None = None
        self.caller_row = 0
        """first row since the last subroutine ended"""
        self.entries: list[tuple[int, int]] = []
        """first row of the caller's own points and first row of the subroutine, by CALSUB"""
        self.here: Map = (np.eye(3), np.zeros(3))
        self.shift: Floats = np.zeros(3)
        self.toward: Triple | None = None
        self.splines = 0
        self.uniform_end = -1
        """rows when a spline with equal knots had ended"""
        self.contacts: list[int] = []
        self.axis_system: list[list[float]] | None = None
        self.name = ""
        self.unknown: dict[str, list[tuple[int, int, int]]] = {}
        self.texts: list[tuple[int, str]] = []
        """line and text of what has not the form of a record"""
        self.neutral_texts = 0
        self.called: set[tuple[int, int]] = set()
        """subroutines that ran"""
        self.uncalled = 0
        """records of subroutines that nothing calls, left out as asked"""
        self.taken: set[int] = set()
        """statements of `UNSUPPORTED_MOTION` that mean something where they stand: those of a spline, NOMORE, left out"""
        self.memory: dict[str, object] = {}
        """what one file of handlers keeps between records (tool in hand, last cycle)"""
        self.cycle_records = 0
        self.arc_records = 0

    def advance(self, before: int) -> None:
        """Pass the plain points that stand before the next statement."""
        self.row += before - self.fast
        self.fast = before

    def add_point(self, xyz: Triple, axis: Triple = NO_NUMBERS, third: Triple = NO_NUMBERS,
                  role: Role = Role.POINT) -> None:
        """A row of its own."""
        self._end_piece()
        self.pieces.append((-1 - len(self.extras.line), -1 - len(self.extras.line)))
        self.extras.xyz.append(xyz)
        self.extras.axis.append(axis)
        self.extras.third.append(third)
        self.extras.line.append(self.line)
        if role is not Role.POINT:
            self.roles[self.row] = role
        self.row += 1

    def _end_piece(self) -> None:
        if self.fast > self._piece:
            self.pieces.append((self._piece, self.fast))
        self._piece = self.fast

    def jump(self, fast: int) -> None:
        """Go on at another plain point (subprograms)."""
        self._end_piece()
        self.fast = self._piece = fast

    def finish_rows(self) -> None:
        """Pass what is left of the plain points."""
        self.advance(len(self.points))
        self._end_piece()

    def use_map(self, found: Map | None) -> None:
        """Points from here on are in that frame (None: the part frame)."""
        if found is not None and np.array_equal(found[0], np.eye(3)) and not found[1].any():
            found = None
        key = b"" if found is None else (found[0] + 0.0).tobytes() + (found[1] + 0.0).tobytes()
        index = self.map_index.setdefault(key, len(self.maps))
        if index == len(self.maps):
            self.maps.append(found)
        self.map.set(self.row, index)

    def event(self, word: str, values: tuple[str | float, ...] = ()) -> None:
        """Note an event before the next row."""
        self.events.append(Event(self.row, word, values, self.line))

    def turns(self) -> None:
        """The operation of the next row is turning, whatever still begins before that row."""
        self.turning.add((self.operation.now, self.row))

    def has_surface_speed(self) -> None:
        """The operation of the next row is turning, unless its tool axis leans or its points lie in no plane."""
        self.surface_speed.add((self.operation.now, self.row))

    def mills(self) -> None:
        """The operation of the next row is none of turning, whatever was said before that row."""
        self.turning.discard((self.operation.now, self.row))
        self.surface_speed.discard((self.operation.now, self.row))

    def last_point(self) -> Triple | None:
        """Coordinates of the row before, as written; None where there is none."""
        if self.fast > self._piece:
            x, y, z = self.points.xyz[self.fast - 1].tolist()
            return x, y, z
        if not self.pieces:
            return None
        low, high = self.pieces[-1]
        if low < 0:
            return self.extras.xyz[-1 - low]
        x, y, z = self.points.xyz[high - 1].tolist()
        return x, y, z

    def next_point(self) -> Triple | None:
        """Coordinates of the next point, as written; None where another record than those of `BETWEEN` stands before it."""
        statements, before = self.program.statements, self.program.before
        for i in range(self.index + 1, self.stop):
            if before[i] > self.fast:
                break
            if statements[i].major not in BETWEEN:
                n = statements[i].numbers if statements[i].major == "GOTO" else []
                return (n[0], n[1], n[2]) if len(n) >= 3 else None
        if self.fast >= (before[self.stop] if self.stop < len(before) else len(self.points)):
            return None
        x, y, z = self.points.xyz[self.fast].tolist()
        return x, y, z

    def next_is_point(self) -> bool:
        """True where the next record that moves the tool or changes how it moves (`BETWEEN` apart) is a GOTO."""
        statements, before = self.program.statements, self.program.before
        for i in range(self.index + 1, self.stop):
            if before[i] > self.fast:
                return True
            if statements[i].major not in BETWEEN:
                return statements[i].major == "GOTO"
        end = before[self.stop] if self.stop < len(before) else len(self.points)
        return end > self.fast

    def next_statement_is(self, major: str) -> bool:
        """True where the very next record, remarks apart, is of that word, without a point before it."""
        statements, i = self.program.statements, self.index + 1
        while i < self.stop and statements[i].major == COMMENT:
            i += 1
        return i < self.stop and statements[i].major == major and self.program.before[i] == self.fast

    def note_unknown(self, statement: Statement, word: str) -> None:
        """Count a word that the reader does not know."""
        numbers = sum(isinstance(w, float) for w in statement.words)
        self.unknown.setdefault(word, []).append((self.line, self.row, numbers))
