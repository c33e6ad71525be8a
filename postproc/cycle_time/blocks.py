"""The motion of a program as the models of controls take it: arrays of blocks, and the pauses between them."""

from __future__ import annotations

from dataclasses import field, replace
from enum import IntEnum

import numpy as np

from machines.machine import Machine
from postproc.cycle_time.tip_path import TipPath
from toolpaths.arrays import Array, Bools, Floats, Ints, as_slice, shared
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays, rows_of

ARM, ARMS = 50.0, (1.0, 1000.0)
"""mm from a rotary axis at which its deviations count where no program says what it may take, and what programs may say"""
OFF = -1.0
"""level of smoothing that is not switched on"""


class CornerMode(IntEnum):
    """What a control does where two blocks meet."""

    STOP = 0
    """rest at the end of every block (G61.1, G9)"""
    EXACT = 1
    """on the path; through corners that are tangent without a stop (G61)"""
    BLEND = 2
    """corners may be rounded off within the tolerance (G64)"""


class Cause(IntEnum):
    """Why a machine rests by command."""

    DWELL = 0
    TOOL_CHANGE = 1
    SPINDLE = 2
    INDEXING = 3
    OTHER = 4
    """a command that the control carries out at rest, such as coolant or an offset: no time of its own"""


@dataclass(frozen=True)
@arrays(rotary="A", velocity="A", acceleration="A", jerk="A", xyz="3")
class Axes:
    """What the columns of a program may do.

    Attributes:
        letters: of the columns; rotary (A,): True for turning axes
        velocity, acceleration, jerk (A,): largest magnitudes, mm or rad per s, s2, s3
        xyz (3,): columns of X, Y, Z, -1 where there is none
    """

    letters: tuple[str, ...]
    rotary: Bools
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    xyz: Ints

    @staticmethod
    def of(machine: Machine) -> Axes:
        """The axes of a machine; tip coordinates of a control that runs the kinematics have the limits of the
        joint of the same letter, as LinuxCNC's axis sections do."""
        names, limits = machine.axis_names, machine.limits
        return Axes(names, np.array(machine.rotary), limits.velocity, limits.acceleration, limits.jerk,
                    np.array([names.index(k) if k in names else -1 for k in "XYZ"]))

    def points(self, rows: Floats) -> Floats:
        """(K, 3) X, Y, Z of rows (K, A); 0 where there is no such axis."""
        return np.where(self.xyz >= 0, rows[:, self.xyz], 0.0)

    def group(self, letters: str) -> Ints:
        """Columns whose letter is one of `letters`."""
        return np.array([j for j, name in enumerate(self.letters) if name in letters], dtype=np.int64)


@dataclass(frozen=True)
@arrays(block="P", cause="int8: P", seconds="P", line="P")
class Pauses:
    """P times at rest, in order.

    Attributes:
        block (P,): the block at whose end the machine rests, -1 before the first
        cause (P,): Cause; seconds (P,): commanded or of the machine; line (P,): line of the program
    """

    block: Ints
    cause: Array
    seconds: Floats
    line: Ints

    @staticmethod
    def none() -> Pauses:
        """No pause at all."""
        none = np.zeros(0, dtype=np.int64)
        return Pauses(none, none, np.zeros(0), none)

    def __len__(self) -> int:
        return len(self.block)


_SHARED = ("line", "rapid", "arc", "center", "normal", "sweep", "speed", "path", "tolerance", "chain",
           "operation", "given", "pieces", "tool", "level", "turn_tolerance")
"""columns that are kept once where all rows are the same"""


@dataclass(frozen=True)
@arrays(start="E #axes.letters", end="E #axes.letters", line="E", rapid="E", arc="E", center="E 3", normal="E 3",
        sweep="E", speed="E", path="int8: E", tolerance="E", chain="E", operation="E", cl_line="E", move="E", given="E",
        pieces="E", row="E", tool="E", level="E",
        turn_tolerance="E")
class MotionBlocks:
    """E blocks that move, in mm, rad and s.

    Attributes:
        axes: of the columns
        start, end (E, A): where the block begins and ends
        line (E,): line of the program
        rapid, arc (E,): kind; neither is a straight feed
        center, normal (E, 3), sweep (E,): of arcs in X, Y, Z: counter-clockwise about `normal` by `sweep`
            rad, the center at the height of the start
        speed (E,): what the feed word asks for along `length`, inf for rapids
        path (E,): Path that holds at the block; tolerance (E,): mm of its blends, inf without a limit, NaN
            where the program does not say; chain (E,): mm within which short lines may be merged, 0 for not
        operation (E,): index into `operations`
        pauses: rests by command
        cl_line (E,): line of the CL file that the block comes from, -1 where that is not known
        move (E,): row of the job's moves that the block does, -1 where none is known
        given (E,): path that the feed refers to where the columns do not determine it (the tip's, under a
            control's own kinematics), NaN elsewhere
        pieces (E,): of how many rows its block of the program consists; None: all of one
        row (E,): row of the executed motion that the block is, or is a piece of; None where none is known
        tool (E,): number of the tool in the spindle, -1 where the program states none
        tip: of the motion that `row` counts in; None where none is known
        level (E,): of the control's smoothing, NaN where the program states none, OFF where it has not switched it on; None
            where no dialect says
        turn_tolerance (E,): rad that the smoothing may take of rotary axes (third value of CYCLE832, TA of cycle 32); NaN
            or inf where the program does not say; None where no dialect says
    """

    axes: Axes
    start: Floats
    end: Floats
    line: Ints
    rapid: Bools
    arc: Bools
    center: Floats
    normal: Floats
    sweep: Floats
    speed: Floats
    path: Array
    tolerance: Floats
    chain: Floats
    operation: Ints
    operations: tuple[str, ...] = ("",)
    pauses: Pauses = field(default_factory=Pauses.none)
    cl_line: Ints | None = None
    move: Ints | None = None
    given: Floats | None = None
    pieces: Ints | None = None
    row: Ints | None = None
    tool: Ints | None = None
    tip: TipPath | None = None
    level: Floats | None = None
    turn_tolerance: Floats | None = None

    def __post_init__(self) -> None:
        for name in _SHARED:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, shared(np.asarray(getattr(self, name))))

    def __len__(self) -> int:
        return len(self.line)

    def take(self, rows: Ints | Bools) -> MotionBlocks:
        """Some of the blocks; the pauses stay with the last block that is left before them."""
        rows = np.arange(len(self))[rows]
        moved = replace(self.pauses, block=np.searchsorted(rows, self.pauses.block, side="right") - 1)
        return replace(rows_of(self, "E", as_slice(rows)), pauses=moved)

    @property
    def arms(self) -> Floats:
        """(A,) mm that a unit of each axis counts in deviations: of rotary axes the tolerance over that of turns where the
        program states both (the median), else ARM."""
        arm, blended = ARM, self.path == CornerMode.BLEND
        if self.turn_tolerance is not None and blended.any():
            both = (self.tolerance / self.turn_tolerance)[blended & (self.turn_tolerance > 0.0)]
            both = both[np.isfinite(both) & (both > 0.0)]
            arm = float(np.clip(np.median(both), *ARMS)) if len(both) else ARM
        return np.where(self.axes.rotary, arm, 1.0)

    @property
    def xyz(self) -> Floats:
        """(E + 1, 3) X, Y, Z at the block ends, the first start first; 0 where there is no such axis."""
        return self.axes.points(np.concatenate([self.start[:1], self.end]))

    def xyz_before(self, rows: Ints) -> Floats:
        """(K, 3) X, Y, Z at the ends of the blocks before `rows` (K,), the first start before the first."""
        ends = self.end[np.maximum(rows - 1, 0)]
        ends[rows == 0] = self.start[:1]
        return self.axes.points(ends)

    @property
    def forced(self) -> Bools:
        """(E,) True where a command makes the machine rest at the end of the block."""
        result = np.zeros(len(self), dtype=bool)
        result[self.pauses.block[self.pauses.block >= 0]] = True
        return result
