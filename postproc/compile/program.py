"""The canonical program: moves and commands named as the NIST canonical functions; it knows no controller."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from functools import cached_property
from typing import Literal

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.control.planes import Plane
from postproc.control.rollover import Rollover
from postproc.reference.coolant import CoolantCommand
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.choices import CycleKind
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

PER_MINUTE, INVERSE = 0, 1


CycleKey = Literal[CycleKind, "TAP_LEFT", ""]
"""of the controller's tables: the kind, and whether a tap turns anti-clockwise; "" for a tap that stands"""
CommandName = Literal[
    "CHANGE_TOOL", "SELECT_TOOL", "USE_TOOL_LENGTH_OFFSET", "CANCEL_TOOL_LENGTH_OFFSET",
    "CUTTER_COMPENSATION_LEFT", "CUTTER_COMPENSATION_RIGHT", "CUTTER_COMPENSATION_OFF",
    "START_SPINDLE_CLOCKWISE", "START_SPINDLE_COUNTERCLOCKWISE", "STOP_SPINDLE_TURNING", CoolantCommand,
    "PROGRAM_STOP", "OPTIONAL_PROGRAM_STOP", "DWELL", "COMMENT", "INSERT",
    "ENTER_SECTION", "LEAVE_SECTION", "OPERATION_START", "SET_ORIGIN_OFFSETS", "RESTATE", "CLAMP", "UNCLAMP", "HOOK",
    "SMOOTHING"]
"""canonical functions without motion, named as in NIST RS274/NGC where that has them"""


@dataclass(frozen=True, slots=True)
class Command:
    """A canonical function without motion, e.g. ("START_SPINDLE_CLOCKWISE", (1200.0,)); `line` is its CL line.

    ("ENTER_SECTION", (i,)) and ("LEAVE_SECTION", (i,)) stand where a section that needs codes begins and
    ends, ("OPERATION_START", (name,)) or (name, 1.0) where the program can be taken up, with 1.0 from home,
    ("SET_ORIGIN_OFFSETS", (k,)) where the work offset becomes that of place k,
    ("SMOOTHING", (name,)) where the control's own smoothing becomes that of an operation, ("RESTATE",) behind
    blocks that a switch may leave out: modal codes are stated again. `skip`: the block switch leaves it out.
    """

    name: CommandName
    args: tuple[float | str, ...] = ()
    line: int = 0
    skip: bool = False


Commands = dict[int, tuple[Command, ...]]
"""commands by the block that they stand before"""


@dataclass(frozen=True, eq=False)
class Section:
    """Blocks from `first` to the next section, whose words mean the same.

    Attributes:
        first: number of the first block
        law: "axes", "tcp" (X, Y, Z are the tip in the work offset) or "tilted" (the tip in `plane`)
        plane: of "tilted", as the controller's printed angles give it; its origin is the work offset's zero
        angles: the printed angles in degrees, in the order of the controller's convention
        rotary: words (degrees) where the rotary axes stand on entering, by letter
        place: number of the place whose work offset is in force
        out: Z of a plane, mm, without a tool length, at which the length goes off where the section ends: just below home;
            NaN where the tool does not go home from there along Z of the plane: a block with Z would move it by what its
            length differs from the stated one
        into: the same of the machine coordinates from which a plane is entered
    """

    first: int
    law: InterpolationMode
    plane: Plane | None = None
    angles: tuple[float, ...] = ()
    rotary: tuple[tuple[str, float], ...] = ()
    place: int = 0
    out: float = float("nan")
    into: float = float("nan")


@dataclass(frozen=True)
class Hole:
    """A hole that may be written as a canned cycle instead of its blocks `first` to `last`.

    Levels are words on the axis of the tool (mm); `initial` is the level that the tool comes from.
    """

    first: int
    last: int
    cycle: int
    plane_level: float
    bottom: float
    retract: float
    initial: float
    key: CycleKey
    """of the controller's tables"""
    drill: int
    """the block that goes to the bottom; its feed is that of the cycle"""


@dataclass(frozen=True)
@arrays(begins="_", words="K J", write="K J", code="int8: K", feed="K", mode="int8: K", plane="int8: K", ccw="K",
        center="K 3", home="K", link="K", row="K", line="K", decimals="J", skip="K", curve="K", curves="C 3 2", spline="K")
class Program:
    """K blocks with the commands before them.

    Attributes:
        letters: the axis words, the order of the columns of `words`
        words (K, J): end positions, mm and degrees, already rounded to the controller's decimals, those of
            inches in a program in inches; positions of `home` (K,) blocks are machine coordinates
        write (K, J): words that the block states
        code (K,): 0 STRAIGHT_TRAVERSE, 1 STRAIGHT_FEED, 2 ARC_FEED
        feed (K,): F as it is written: mm, inches (or parts of them) or degrees per minute, or 1/min where mode
            is INVERSE; NaN for traverses
        mode (K,): PER_MINUTE or INVERSE
        plane, ccw, center: of the arcs; center (K, 3) is relative to the block's start, mm
        row (K,): row of the Toolpath; line (K,): CL line; link (K,): True for linking blocks
        commands: commands before block k, by k; K holds what follows the last block
        holes: by running number
        decimals (J,): of the words
        skip (K,): True for blocks that the block switch leaves out ("/")
        curve (K,): number of the cubic that a block runs, -1 for none
        curves (C, 3, 2): its second and third coefficient in X, Y, Z, mm, the parameter going from 0 to 1; the first follows
            from begin and end of the block
        spline (K,): number of the spline of which a block states a control point, -1 for none; its words are that point
        rolls: modulo axes by column; `words` count their turns, the text does not
        begins (J,): words of the machine's home
        turning: letters whose words are degrees; A, B and C may be slides of a platform on legs
        sections: in order, the first begins at block 0 in the law that the control starts with
    """

    letters: tuple[str, ...]
    words: Floats
    write: Bools
    code: Array
    feed: Floats
    mode: Array
    plane: Array
    ccw: Bools
    center: Floats
    home: Bools
    link: Bools
    row: Ints
    line: Ints
    commands: dict[int, tuple[Command, ...]]
    holes: tuple[Hole, ...]
    decimals: Ints
    sections: tuple[Section, ...] = (Section(0, "axes"),)
    skip: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))
    curve: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    curves: Floats = field(default_factory=lambda: np.zeros((0, 3, 2)))
    rolls: dict[int, Rollover] = field(default_factory=dict)
    begins: Floats = field(default_factory=lambda: np.zeros(0))
    turning: tuple[str, ...] = ("A", "B", "C")
    spline: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        if not len(self.skip):
            object.__setattr__(self, "skip", np.zeros(len(self), dtype=bool))
        if not len(self.curve):
            object.__setattr__(self, "curve", np.full(len(self), -1))
        if not len(self.spline):
            object.__setattr__(self, "spline", np.full(len(self), -1))

    def before(self, axis: int) -> Floats:
        """(K,) degrees where a modulo axis stands before each block: as the block before has stated it last."""
        if axis not in self._before:
            rows = np.where(self.write[:, axis], np.arange(1, len(self) + 1), 0)
            last = np.maximum.accumulate(np.concatenate([[0], rows[:-1]])) if len(self) else rows
            self._before[axis] = np.concatenate([self.begins[axis:axis + 1], self.words[:, axis]])[last]
        return self._before[axis]

    @cached_property
    def _before(self) -> dict[int, Floats]:
        return {}

    def __len__(self) -> int:
        return len(self.words)

    def ordered(self) -> Iterator[tuple[int, Command]]:
        """(block that it stands before, command) in the order of the program."""
        for block, group in sorted(self.commands.items()):
            for command in group:
                yield block, command
