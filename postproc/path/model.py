"""What building a path hands on: blocks in joints, each with the move that it serves and the frame of its words."""

from __future__ import annotations

from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.modes import WordFrame
from postproc.joints.singular_detours import SingularPassage
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

TRAVERSE, FEED, ARC = 0, 1, 2
"""codes of blocks"""


@dataclass(frozen=True)
@arrays(q="K J", move="K", u="K", code="int8: K", home="K", seconds="K", plane="int8: K", ccw="K", center="K 3",
        state="K J", frame="K", begin="M+1", singular="M", turns="T", rewinds="W")
class JointPath:
    """Blocks in joints, K of them, and where the rows of Moves begin among them.

    Attributes:
        q (K, J): joints at the end of the block
        move (K,): row of Moves that the block serves
        u (K,): where on that row's curve it ends; NaN for linking blocks
        code (K,): TRAVERSE, FEED, ARC
        home (K,): True where the block is meant in machine coordinates
        seconds (K,): time it should take at the tip's feed; NaN for rapids, 0 for turns on the spot and rapids at feed
        plane, ccw, center: of the ARC blocks (K rows); the centre is relative to the block's start, in its words
        state (K, J): axes that the block states; where it names none, it states those that change
        frame (K,): index into `frames`: what the words of the block mean
        begin (M + 1,): the block before which the records without motion of a move act
        singular (M,): moves whose pose lies along a rotary axis; turns: moves that begin with a turn on the spot
        worst_tip, worst_axis: bound of the deviation between points, mm and rad
        rewinds (W,): moves before or in which the tool is drawn back to unwind an axis
        events: passages by singular directions: first and last move, and what was done
        opened: what the machine leaves open, as it was planned: name, least and greatest, rad or mm
        split_seconds: s of the joints with carriers and platform as planned, and with the carriers alone; () without
    """

    q: Floats
    move: Ints
    u: Floats
    code: Array
    home: Bools
    seconds: Floats
    plane: Array
    ccw: Bools
    center: Floats
    state: Bools
    frame: Ints
    begin: Ints
    singular: Bools
    turns: Ints
    worst_tip: float
    worst_axis: float
    frames: tuple[WordFrame, ...]
    rewinds: Ints
    events: tuple[tuple[int, int, SingularPassage], ...]
    opened: tuple[tuple[str, float, float], ...] = ()
    split_seconds: tuple[float, ...] = ()

    def __len__(self) -> int:
        return len(self.q)

    def by_control(self) -> list[tuple[Control, Ints]]:
        """Each control with the numbers of its blocks, in order."""
        return [(self.frames[int(self.frame[k[0]])].control, k) for k in groups(self.frame)]
