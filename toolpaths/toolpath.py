"""What the cutter must do: positions, axes and feeds in the part's frame, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, fields
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Array, Floats, Ints, shared
from toolpaths.aside import Aside
from toolpaths.choices import CycleKind, GivenDialect, GivenUnit, LengthUnit
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, value_shown
from toolpaths.given_arrays import CLOSE, GivenArrays, given_rows, off_circle, passes, unit_rows
from toolpaths.plug_ins import PlugIn
from toolpaths.shapes import arrays


class Kind(IntEnum):
    """How a point is reached from the one before it."""

    RAPID = 0
    FEED = 1
    ARC = 2


class Role(IntEnum):
    """Which record of the CL file put the point there."""

    POINT = 0
    """GOTO, GODLTA, or the end of an arc or spline."""
    HOLE = 1
    """GOTO under an armed CYCLE: the top of a hole, `cycle` names the cycle."""
    START = 2
    """FROM: where the tool stands; no motion leads there."""
    HOME = 3
    """GOHOME with a point."""
    SPLINE = 4
    """On a spline between its ends: the program does not command it."""
    CUBIC = 5
    """Inside a piece of a spline, which is one cubic from the point before the first of them to the one behind the last, at
    equal steps of its parameter; the program does not command it."""


class FeedMode(IntEnum):
    """What the number in `feed` means."""

    PER_TIME = 0
    """mm/s"""
    PER_REVOLUTION = 1
    """mm per spindle revolution"""
    INVERSE_TIME = 2
    """1/s: the block takes 1/feed"""


@dataclass(frozen=True, slots=True)
class RecordCounts:
    """Records of a CL file: all, executed, neutral (nothing for the machine), dropped (then the file has an error)."""

    total: int = 0
    executed: int = 0
    neutral: int = 0
    dropped: int = 0

    def __str__(self) -> str:
        return f"{self.total:,} records: {self.executed:,} executed, {self.neutral:,} neutral, {self.dropped:,} dropped"


@dataclass(frozen=True, slots=True)
class Event:
    """A record without motion that acts before point `index` (APT word and its parameters, as in the file)."""

    index: int
    word: str
    values: tuple[str | float, ...] = ()
    line: int = 0


@dataclass(frozen=True, slots=True)
class Tool:
    """A cutter. Lengths in mm, angles in rad; None where the file does not say."""

    number: int
    name: str = ""
    shape: str = ""
    """MILL, DRILL, ... as the file says"""
    diameter: float | None = None
    corner_radius: float | None = None
    length: float | None = None
    """length of the cutter as CAM draws it, not the gauge length"""
    taper: float | None = None
    tip_angle: float | None = None
    flute_length: float | None = None
    length_register: int | None = None
    """ADJUST or OSETNO"""
    cutter: tuple[float, ...] = ()
    """APT seven parameters of CUTTER, mm and degrees as written"""


@dataclass(frozen=True, slots=True)
class Frame:
    """A named system of the file: `rotation` (3, 3) and `origin` (3,) take its coordinates to the part frame."""

    name: str
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation of the CAM system. `turning` operations are read but cannot be converted."""

    name: str = ""
    tool_name: str = ""
    frame: int = 0
    turning: bool = False
    line: int = 0


@dataclass(frozen=True, slots=True)
class Cycle:
    """A drilling cycle; lengths in mm measured from the hole's top along the tool axis, up is positive.

    `depth` is positive downwards. `retract` None means: back to the level the tool came from.
    `feed` and `feed_mode` as in Toolpath; `steps` are the pecks (first, following).
    """

    kind: CycleKind
    depth: float
    clearance: float
    retract: float | None
    feed: float
    feed_mode: FeedMode = FeedMode.PER_TIME
    steps: tuple[float, ...] = ()
    dwell: float = 0.0
    """s"""
    dwell_revolutions: float = 0.0
    pitch: float | None = None
    """mm per revolution of a tap, where the file states it"""
    words: tuple[str | float, ...] = ()
    """the parameters as written"""
    line: int = 0


@dataclass(frozen=True)
@arrays(center="K 3", normal="K 3", radius="K", sweep="K")
class Arcs:
    """K circular arcs or helices, in the part frame.

    Attributes:
        center (K, 3): a point of the axis, at the height of the arc's start
        normal (K, 3): unit, the motion is counter-clockwise seen against it (right-hand)
        radius (K,): mm, distance of the start from the axis
        sweep (K,): rad, positive, whole turns included
    """

    center: Floats
    normal: Floats
    radius: Floats
    sweep: Floats

    def __len__(self) -> int:
        return len(self.radius)

    @staticmethod
    def none() -> Arcs:
        """No arcs at all."""
        return Arcs(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


_SHARED = ("tip", "axis", "feed", "feed_mode", "kind", "role", "arc", "cycle", "tool", "operation",
           "pass_", "line")
"""columns that are kept once where all rows are the same"""


@dataclass(frozen=True)
class ClSource:
    """The CL file that a path was read from (`data`: its bytes), and with which units and dialect ("": as the file says).

    Where a plug-in reads the file: which, the records that it makes of it, as APT text, and the line of the file by record
    (None where the text stands line for line).
    """

    held: bytes | Aside
    units: GivenUnit = ""
    dialect: GivenDialect = ""
    plug_in: PlugIn | None = None
    records: bytes = b""
    lines: tuple[int, ...] | None = None

    @property
    def data(self) -> bytes:
        """The bytes of the file, read again where they are on disk."""
        return self.held if isinstance(self.held, bytes) else self.held.data()

    @property
    def text(self) -> bytes:
        """What the file says as text that needs no plug-in."""
        return self.data if self.plug_in is None else self.records


@dataclass(frozen=True)
@arrays(tip="N 3", axis="N 3", feed="N", feed_mode="int8: N", kind="int8: N", role="int8: N", arc="int32: N",
        cycle="int32: N", tool="int32: N", operation="int32: N", pass_="int32: N", line="int64: N", normal="N 3",
        contact="N 3", spin="N")
class Toolpath:
    """The path of the cutter in the part frame (the absolute frame of the CL file), N commanded positions, a row each.

    Attributes:
        tip (N, 3): mm, the tool tip
        axis (N, 3): unit, from the tip to the spindle
        feed (N,): see `feed_mode`; NaN where the file had stated none, and for rapids
        feed_mode (N,): FeedMode
        kind (N,): Kind of the motion that ends here
        role (N,): Role of the record
        arc (N,): index into `arcs`, -1 for straight motion
        cycle (N,): index into `cycles` for holes, else -1
        tool (N,): index into `tools`, -1 where none was named yet
        operation (N,): index into `operations`
        pass_ (N,): number of the pass; a pass is an unbroken run of cutting motion, rapids before it count to it
        line (N,): 1-based line of the file
        normal (N, 3) or None: unit surface normal, NaN where a point has none
        contact (N, 3) or None: contact point, NaN where a point has none
        spin (N,) or None: rad about the tool axis from the x direction that the least rotation taking z to
            the axis carries along to the tool's own x direction; NaN where any will do. No CL file says it.
        units: "mm" or "inch": what the file was written in (the arrays are mm)
    """

    tip: Floats
    axis: Floats
    feed: Floats
    feed_mode: Array
    kind: Array
    role: Array
    arc: Array
    cycle: Array
    tool: Array
    operation: Array
    pass_: Array
    line: Array
    arcs: Arcs = field(default_factory=Arcs.none)
    cycles: tuple[Cycle, ...] = ()
    tools: tuple[Tool, ...] = ()
    operations: tuple[Operation, ...] = (Operation(),)
    frames: tuple[Frame, ...] = (Frame("absolute"),)
    events: tuple[Event, ...] = ()
    normal: Floats | None = None
    contact: Floats | None = None
    units: LengthUnit = "mm"
    name: str = ""
    """PARTNO"""
    file: str = ""
    faults: tuple[Diagnostic, ...] = ()
    """errors that reading met: what they stand for is missing, so that nothing may be written from the path"""
    spin: Floats | None = None
    records: RecordCounts = field(default_factory=RecordCounts)
    """what became of the records of the file"""
    spline_slack: float = 0.0
    """mm that arcs and chords in the place of splines may be off them; 0 without splines"""
    source: ClSource | None = field(default=None, init=False, repr=False, compare=False)
    """where the path is exactly what reading a file gave: a path that is made otherwise, or changed, has none"""

    def __post_init__(self) -> None:
        for name in _SHARED:
            object.__setattr__(self, name, shared(np.asarray(getattr(self, name))))
        for name, count in (("arc", len(self.arcs)), ("cycle", len(self.cycles)), ("tool", len(self.tools)),
                            ("operation", len(self.operations))):
            column = getattr(self, name)
            if len(column) and int(column.max()) >= count:
                raise ValueError(f"Toolpath.{name} holds {int(column.max())}, only {count} exist")

    @classmethod
    def from_arrays(cls, tip: npt.ArrayLike, axis: npt.ArrayLike = (0.0, 0.0, 1.0), feed: npt.ArrayLike = np.nan, *,
                    rapid: npt.ArrayLike | None = None, feed_mode: npt.ArrayLike = FeedMode.PER_TIME,
                    arc: npt.ArrayLike = -1, arcs: Arcs | None = None, cycle: npt.ArrayLike = -1,
                    cycles: Sequence[Cycle] = (), tool: npt.ArrayLike = 0, tools: Sequence[Tool] = (Tool(1),),
                    operation: npt.ArrayLike = 0, operations: Sequence[Operation] = (Operation(),),
                    events: Sequence[Event] = (), spindle: float | None = None, normal: npt.ArrayLike | None = None,
                    contact: npt.ArrayLike | None = None, name: str = "", file: str = "arrays") -> Toolpath:
        """The path of arrays that a program has computed: one row per position, in the part frame.

        Diagnostics of later stages name rows as lines, counted from 1. No CL file stands behind such a path: its program is
        "proved by read-back", without the second reading that "proved by read-back, second reading" names.

        Args:
            tip: (N, 3) mm
            axis: (N, 3) or (3,), from the tip to the spindle, of any length
            feed: (N,) or one number; mm/s, or as `feed_mode` says; NaN for rapids, or where none is stated
            rapid: (N,) True where the position is reached in rapid; default: where `feed` is NaN and no arc or
                cycle is named
            feed_mode: (N,) or one FeedMode
            arc, arcs: (N,) index of the arc that ends in the row, -1 for straight motion; an arc begins at the row before
            cycle, cycles: (N,) index of the cycle whose hole the row is, -1 for none
            tool, tools: (N,) index into `tools`; default: T1 throughout
            operation, operations: (N,) index into `operations`
            events: records without motion; spindle: rev/min at the begin, negative anti-clockwise (SPINDL)
            normal, contact: (N, 3) surface normals of any length, contact points, NaN where a row has none

        Raises:
            DiagnosticError: names each array that is wrong, with its rows.
        """
        g, tips = given_rows(tip, file)
        arcs = Arcs.none() if arcs is None else next(iter(g.listed("arcs", [arcs], Arcs)), Arcs.none())
        cycles, tools = g.listed("cycles", cycles, Cycle), g.listed("tools", tools, Tool)
        operations, events = g.listed("operations", operations, Operation), g.listed("events", events, Event)
        arc_, cycle_ = g.whole("arc", arc, -1, len(arcs)), g.whole("cycle", cycle, -1, len(cycles))
        tool_, operation_ = g.whole("tool", tool, 0, len(tools)), g.whole("operation", operation, 0, len(operations))
        feeds, mode = g.floats("feed", feed, gaps=True), g.whole("feed_mode", feed_mode, 0, len(FeedMode))
        hole = cycle_ >= 0
        free = np.isnan(feeds) & (arc_ < 0) & ~hole if rapid is None else g.flags("rapid", rapid) & ~hole
        if (bad := (feeds <= 0.0) & ~free).any():
            g.fault("feed is not above 0", "give a feed above 0, or NaN where none is stated", bad)
        if (bad := (arc_ >= 0) & (free | hole)).any():
            g.fault("an arc is no rapid and no hole", "give arcs a feed, and rapid and cycle no arc", bad)
        axes = unit_rows(g, "axis", axis)
        more = [None if a is None else unit_rows(g, "normal", a, gaps=True) for a in (normal,)]
        more += [None if a is None else g.floats("contact", a, 3, gaps=True) for a in (contact,)]
        records = _records(g, events, tool_, tools, spindle)
        g.require()
        _check_arcs(g, tips, arc_, arcs)
        kind = np.where(arc_ >= 0, Kind.ARC, np.where(free | hole, Kind.RAPID, Kind.FEED))
        n32 = np.int32
        return cls(tips, axes, np.where(free | hole, np.nan, feeds), mode.astype(np.int8), kind.astype(np.int8),
                   np.where(hole, Role.HOLE, Role.POINT).astype(np.int8), arc_.astype(n32), cycle_.astype(n32),
                   tool_.astype(n32), operation_.astype(n32), passes(free, operation_, tool_),
                   np.arange(1, len(tips) + 1, dtype=np.int64), arcs, tuple(cycles), tuple(tools), tuple(operations),
                   events=records, normal=more[0], contact=more[1], name=name, file=file)

    def __len__(self) -> int:
        return len(self.tip)

    def equals(self, other: Toolpath) -> bool:
        """True where every value is the same bit for bit, apart from source lines, faults, counts and the file's name."""
        for f in fields(self):
            if f.name in ("line", "file", "faults", "records", "source"):
                continue
            if not _same(getattr(self, f.name), getattr(other, f.name)):
                return False
        return True


def _records(given: GivenArrays, events: Sequence[Event], tool: Ints, tools: Sequence[Tool],
             spindle: float | None) -> tuple[Event, ...]:
    """The events that were given, behind LOADTL where the tool changes and no event loads it, and SPINDL at the begin."""
    index = [e.index for e in events]
    if index != sorted(index) or any(not 0 <= k <= given.rows for k in index):
        given.fault(f"events act before rows {index[:6]}", f"give them in order, each with an index of 0 to {given.rows}")
    if spindle is not None and (not isinstance(spindle, (int, float, np.number)) or not np.isfinite(spindle) or not spindle):
        given.fault(f"spindle is {value_shown(spindle)}", "give rev/min, negative for anti-clockwise")
        spindle = None
    loaded = {e.index for e in events if e.word == "LOADTL"}
    own = [Event(k, "LOADTL", (float(tools[tool[k]].number),), k + 1)
           for k in (0, *(np.flatnonzero(np.diff(tool)) + 1).tolist()) if k not in loaded and len(tools)]
    if spindle is not None:
        own.insert(1 if own and own[0].index == 0 else 0,
                   Event(0, "SPINDL", ("RPM", float(abs(spindle)), "CLW" if spindle > 0.0 else "CCLW"), 1))
    return tuple(sorted([*own, *events], key=lambda e: e.index))


def _check_arcs(given: GivenArrays, tip: Floats, arc: Ints, arcs: Arcs) -> None:
    """Begin and end of each arc on its circle.

    Raises:
        DiagnosticError: names the rows that are off it.
    """
    rows = np.flatnonzero(arc >= 0)
    k, wrong = arc[rows], np.zeros(len(tip), bool)
    off = off_circle(tip[rows - 1], tip[rows], arcs.center[k], arcs.normal[k], arcs.radius[k], arcs.sweep[k])
    wrong[rows] = (off > CLOSE) | (rows == 0)
    if wrong.any():
        given.fault(f"begin or end is more than {CLOSE:g} mm off its arc", "let the row before be the begin of the arc, "
                    "sweep be in rad, positive, right-hand about normal", wrong)
    given.require()


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) != isinstance(b, np.ndarray):
        return False
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
    if isinstance(a, Arcs) and isinstance(b, Arcs):
        return all(_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, (Event, Operation, Cycle)) and type(a) is type(b):
        return all(_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a) if f.name != "line")
    return a == b
