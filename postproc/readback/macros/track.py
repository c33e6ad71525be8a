"""Where the axes stand in a program that is executed, and what G10, G52, G92 and TRANS have moved its coordinates by.

Words are written on in the coordinates of the work offsets as the set-up has them: each shift is added to absolute words.
"""

from __future__ import annotations

from collections import defaultdict

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.frame import AXES, CoordinateFrame
from postproc.readback.macros.held import Held

ROTARY = "ABC"
NO_LENGTH = -1


class Track:
    """Modal state and position; lengths in mm and degrees, seen from the work offset of the set-up.

    Attributes:
        at: by axis, None where it is not known; motion: code in force, None before any
        local, zero: shifts by G52 (TRANS) and G92; moved: shifts of each register by G10; lengthened: mm by length register
        register: of the work offset in force, None before any; length: register in force, None where nothing states it
        line: of the block that runs
        set_itself: registers and axes that the program has set itself; taken: registers that the set-up does not state, with
            the line that reads the set-up's own offset in their place
        frame: that turns, scales or mirrors the coordinates of the program, None for none
    """

    def __init__(self, held: Held) -> None:
        self.held = held
        self.at: dict[str, float | None] = dict.fromkeys(held.axes)
        self.local, self.zero = defaultdict[str, float](float), defaultdict[str, float](float)
        self.moved = defaultdict[float, defaultdict[str, float]](lambda: defaultdict(float))
        self.lengthened = defaultdict[int, float](float)
        self.unit, self.absolute, self.plane, self.level = 1.0, True, 17, 98
        self.motion: float | None = None
        self.register: float | None = None
        self.length: int | None = None
        self.shifted = False
        self.frame: CoordinateFrame | None = None
        self.line = 0
        self.set_itself: set[tuple[float, str]] = set()
        self.taken: dict[float, int] = {}

    def scale(self, axis: str) -> float:
        """mm, or degrees, of a unit of a word."""
        return 1.0 if axis in ROTARY else self.unit

    def shift(self, axis: str) -> float:
        """What is added to absolute words of an axis."""
        if not self.shifted:
            return 0.0
        moved = self.moved[self.register][axis] if self.register is not None else 0.0
        drawn = self.lengthened[self.length] if axis == "Z" and self.length is not None else 0.0
        return self.local[axis] + self.zero[axis] + moved + drawn

    def position(self, axis: str) -> float:
        """Of an axis in the coordinates that the program sees."""
        if self.frame is not None and axis in AXES:
            back = self.frame.inverse()[AXES.index(axis)]
            return sum(share * (self.known(a) - self.frame.shift[k])
                       for k, (a, share) in enumerate(zip(AXES, back, strict=True)) if share)
        return self.known(axis) - self.shift(axis)

    def known(self, axis: str) -> float:
        """Of an axis in the work offset of the set-up."""
        here = self.at.get(axis)
        if here is None:
            raise MacroFault("gcode.position_unknown", f"where {axis} stands here is not known: no block since its "
                             "last move in machine coordinates, or change of offset or length, states it absolutely",
                             f"state {axis} with G90 before this block")
        return here

    def work(self, register: float, axis: str) -> float:
        """A work offset of the set-up in machine coordinates."""
        if self.held.work is None:
            raise MacroFault("gcode.position_unknown", "a work offset in machine coordinates needs the set-up",
                             "name the set-up of the program with --setup")
        return float(self.held.work(register)[self.held.axes.index(axis)])

    def offset(self, register: float, axis: str) -> float:
        """What a register holds, mm."""
        stated = self.held.stated
        if stated is not None and register not in stated and (register, axis) not in self.set_itself:
            self.taken.setdefault(register, self.line)
        return self.work(register, axis) + self.moved[register][axis]

    def take_offset(self, register: float) -> None:
        """Another work offset in force: the axes stand still."""
        if register == self.register:
            return
        for axis, here in self.at.items():
            known = here is not None and self.register is not None and self.held.work is not None
            self.at[axis] = here + self.work(self.register, axis) - self.work(register, axis) \
                if known and here is not None and self.register is not None else None
        self.register = register

    def take_length(self, register: int | None) -> None:
        """Another tool length in force: Z stands still, its coordinate is another."""
        if register != self.length:
            self.at["Z"] = None
        self.length = register

    def go(self, axis: str, value: float) -> float:
        """An axis word obeyed, in units of the program; the word as it is written on."""
        scale = self.scale(axis)
        if not self.absolute:
            here = self.at.get(axis)
            self.at[axis] = None if here is None else here + value * scale
            return value
        shift = self.shift(axis)
        self.at[axis] = value * scale + shift
        return value + shift / scale if shift else value

    def go_machine(self, axis: str, value: float) -> None:
        """An axis at `value`, mm or degrees, in machine coordinates."""
        self.at[axis] = None
        if self.held.work is None or self.register is None or (axis == "Z" and self.length is None):
            return
        drawn = self.held.lengths.get(self.length, 0.0) if axis == "Z" and self.length is not None else 0.0
        self.at[axis] = value - self.work(self.register, axis) - drawn

    def set_work(self, register: float, axis: str, value: float, added: bool = False) -> None:
        """G10 L2: a work offset is `value` mm in machine coordinates, or that more than it was."""
        held = self.moved[register][axis]
        self.moved[register][axis] = held + value if added else value - self.work(register, axis)
        if not added:
            self.set_itself.add((register, axis))
        self.shifted = True

    def set_position(self, register: float, axis: str, value: float) -> None:
        """G10 L20 of LinuxCNC: a work offset in which the axis stands at `value` mm."""
        if register == self.register:
            self.moved[register][axis] += self.position(axis) - value
        else:
            self.position(axis)
            before, self.register = self.register, register
            here = self.at[axis]
            if before is None or here is None:
                raise MacroFault("gcode.position_unknown", "no work offset is in force here", "state G54 before this block")
            there = here + self.work(before, axis) - self.work(register, axis)
            self.moved[register][axis] += there - self.shift(axis) - value
            self.register = before
        self.shifted = True

    def set_length(self, register: int, value: float, added: bool = False) -> None:
        """G10 of a length: a register holds `value` mm, or that more than it did."""
        now = self.lengthened[register]
        self.lengthened[register] = now + value if added else value - self.held.lengths.get(register, 0.0)
        self.shifted = True
