"""What the witness is given of a program, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np

from postproc.witness.text import Array


@dataclass(frozen=True)
class Case:
    """A conversion: the CL file, as a call that gives its bytes, and how it is to be read, machine file over its bases,
    set-up, tolerances.

    Attributes:
        machine: the parsed file, then its base and that one's
        errors: the program corrects geometric errors; error_model: the parsed file of them over its bases, empty where there
            is none, its tables by the names that stand in `error_tables`
        cl_lines: of the CL file, by line of `cl`, where that is made of another text; None where it is the file
        registers: False where the control has no length registers to be named; radius_named: its cutter compensation
            names one; coolants: bits of the kinds that it has codes for: it gives the nearest of them for others
        program: its text, where it is one file; clamps: codes that clamp and release, by letter of the axes
        modulo: "shortest" or "sign" by letter of axes counted modulo 360 degrees: which path a word turns them
        chosen (N, 3): tool axes in the file's absolute frame that were chosen in the place of its own; None: those are kept
        limits (J, 6): of the joints as used, least, greatest, velocity, acceleration, jerk, home, mm, rad and s
        origin (3,): zero of the work offset in the table frame as the program takes it; work_offset (J,): joints at which
            the tip of a tool without length stands there, None where it has no such joints
    """

    cl: Callable[[], bytes]
    machine: list[dict[str, Any]]
    setup: dict[str, Any]
    tolerance: float
    axis_tolerance: float
    units: str | None = None
    dialect: str | None = None
    bent_rapids: bool = False
    planned: bool = False
    errors: bool = False
    error_model: dict[str, Any] = field(default_factory=dict)
    error_tables: dict[str, bytes] = field(default_factory=dict)
    registers: bool = True
    radius_named: bool = False
    coolants: int = 15
    program: bytes = b""
    modulo: dict[str, Literal["shortest", "sign"]] = field(default_factory=dict)
    clamps: dict[str, tuple[str, str]] = field(default_factory=dict)
    origin: Array | None = None
    limits: Array | None = None
    work_offset: Array | None = None
    chosen: Array | None = None
    cl_lines: tuple[int, ...] | None = None


@dataclass(frozen=True)
class ExecutedBlocks:
    """E blocks of a program as its reader has executed them.

    Attributes:
        letters: of the joints, words: of the columns of `steps`
        joints: (K, J) at the end of blocks (K,), mm and rad; start (J,)
        line, code (E,): line of the program; 0 rapid, 1 feed, 2 arc; straight (E,): True where joints go straight
        sweep (E,): rad of arcs, NaN; feed (E,): F word in force, degrees, or lengths of which each is `unit` (E,) mm,
            per minute, or 1/min where `inverse` (E,)
        steps: words (K, J) of blocks less those where they begin, mm and degrees; by_tip (E,): X, Y, Z are the tip
        rule: what a feed per minute refers to ("xyz-first", "geometry", "all"); degree_is_inch: with all axes in
            inches, degrees count as such, else as mm; by_angle: inverse time of arcs counts rad
        side (E,): cutter compensation, 40 off, 41 left, 42 right; radius (E,): its register; contour (E, 4): X, Y from where
            the tool's centre begins and ends the block to the contour as programmed, 0 where the words are the centre's
        stops: (block before which it stands, M number) of each
        tool, spindle, rpm, coolant, dwell, pitch, hole (E,): as in force; pitch NaN outside taps, hole True in cycles
        register (E,): length register in force, -1 for none; lengthless (E,): True where none may be, since
            the joints hold the tool's length already
        joints_at: joints (K, J) of blocks (K,) at a fraction of each
        poses_at: (tip, axis) of blocks as the reader has them: the claim that rods are held against
        approach_at: from which direction joints (K, J) are where they are, 1 forwards, -1 backwards; None where
            no errors depend on it
        begins: joints (E, J) where blocks begin, where that is not where the one before ends; None: it is
    """

    letters: tuple[str, ...]
    words: tuple[str, ...]
    joints: Callable[[Array], Array]
    start: Array
    line: Array
    code: Array
    straight: Array
    sweep: Array
    feed: Array
    inverse: Array
    unit: Array
    by_tip: Array
    rule: Literal["xyz-first", "geometry", "all"]
    degree_is_inch: bool
    by_angle: bool
    side: Array
    radius: Array
    contour: Array
    stops: tuple[tuple[int, float], ...]
    tool: Array
    spindle: Array
    rpm: Array
    coolant: Array
    dwell: Array
    pitch: Array
    hole: Array
    register: Array
    lengthless: Array
    steps: Callable[[Array], Array]
    joints_at: Callable[[Array, Any], Array]
    poses_at: Callable[[Array, Any], tuple[Array, Array]]
    approach_at: Callable[[Array, Any], Array] | None = None
    begins: Array | None = None

    def __len__(self) -> int:
        return len(self.line)

    def before(self, rows: Array) -> Array:
        """(K, J) joints where blocks begin."""
        if self.begins is not None:
            return np.asarray(self.begins[rows])
        return np.where((rows == 0)[:, None], self.start, self.joints(np.maximum(rows - 1, 0)))

    def take(self, rows: Array) -> ExecutedBlocks:
        """Some of the blocks, each beginning where the program has it begin."""
        columns = {f.name: getattr(self, f.name)[rows] for f in fields(self)
                   if f.name not in ("start", "begins") and isinstance(getattr(self, f.name), np.ndarray)}
        approach = self.approach_at
        stops = tuple((int(np.searchsorted(rows, k)), number) for k, number in self.stops)
        return replace(self, **columns, begins=self.before(rows), stops=stops, joints=lambda some: self.joints(rows[some]),
                       steps=lambda some: self.steps(rows[some]),
                       joints_at=lambda some, t: self.joints_at(rows[some], t),
                       poses_at=lambda some, t: self.poses_at(rows[some], t),
                       approach_at=None if approach is None else lambda some, t: approach(rows[some], t))


FindingCode = Literal["position", "path", "kind", "clearance", "arc", "hole", "feed", "velocity", "tool", "length",
                      "spindle", "coolant", "compensation", "rest", "limits", "offset", "turning", "clamp", "errors", "rods",
                      "spin"]
"""what is found to differ; `witness.` with it is the code of the error"""
Aspect = Literal["positions", "arcs", "holes", "feeds", "length registers", "tools", "spindle states", "coolant states",
                 "cutter compensation", "rests and stops", "work offset", "turns of modulo axes", "clamps", "curves",
                 "turns of tools about themselves"]


@dataclass(frozen=True)
class Finding:
    """A place where program and CL file differ: CL line and program line (0: none), `count` of such places."""

    code: FindingCode
    message: str
    line: int
    block: int
    count: int = 1


@dataclass(frozen=True)
class Compared:
    """How many places were compared in one respect."""

    what: Aspect
    count: int

    def __str__(self) -> str:
        return f"{self.count} {self.what}"


@dataclass(frozen=True)
class NotCompared:
    """What was not compared, and why: everything, the machine's kinematics (poses are then those of the read-back), the
    spindle, or a record of the CL file by its text. `line` of the CL file, 0 for none."""

    what: Literal["all", "kinematics", "spindle", "record", "choice of tool axes", "text"]
    why: str
    line: int = 0

    def __str__(self) -> str:
        if self.what == "record":
            return f"{self.why} (line {self.line})"
        return f"{self.what} ({self.why}{f', line {self.line}' if self.line else ''})"


@dataclass(frozen=True)
class Testimony:
    """What was compared, what not and why, what was found; the worst tip (mm) and axis (rad) that was seen."""

    compared: tuple[Compared, ...]
    not_compared: tuple[NotCompared, ...]
    findings: tuple[Finding, ...] = ()
    points: int = 0
    worst_tip: float = 0.0
    worst_axis: float = 0.0
    seconds: float = 0.0

    @property
    def own_kinematics(self) -> bool:
        """True where positions are compared by the witness's own reading of the machine file."""
        return bool(self.compared) and all(one.what != "kinematics" for one in self.not_compared)


def together(said: list[Testimony]) -> Testimony:
    """What was said of each place of a program as one."""
    if len(said) < 2:
        return said[0] if said else Testimony((), ())
    counts = {c.what: sum(d.count for one in said for d in one.compared if d.what == c.what)
              for one in said for c in one.compared}
    return Testimony(tuple(Compared(what, n) for what, n in counts.items()),
                     tuple(dict.fromkeys(n for one in said for n in one.not_compared)),
                     tuple(f for one in said for f in one.findings), sum(one.points for one in said),
                     max(one.worst_tip for one in said), max(one.worst_axis for one in said),
                     sum(one.seconds for one in said))
