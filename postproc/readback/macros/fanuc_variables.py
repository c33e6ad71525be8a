"""Variables of custom macro B: local, common, and the system variables that follow from the program or the set-up.

B-64484EN, custom macro (system variables): #3006 stop with a message; #4001 on modal codes, of the block before; #5001 on
the end
of the block before, #5041 on where the axes stand, in workpiece coordinates; #5021 on in machine coordinates; #5201 on
work offsets.
"""

from __future__ import annotations

from postproc.readback.macros.expressions import MacroFault, MacroValue, plain
from postproc.readback.macros.held import Held
from postproc.readback.macros.word_blocks import Blocks

_PASSIVE = frozenset({3003, 3004, 3005, 3001, 3002})
_LETTERS = {4102: "B", 4107: "D", 4109: "F", 4111: "H", 4113: "M", 4119: "S", 4120: "T"}
_FIRST_OFFSET = 5221
_AXES = "XYZABC"


class Variables:
    """Common variables, and those of the system."""

    def __init__(self, blocks: Blocks, held: Held) -> None:
        self.blocks, self.held = blocks, held
        self.common: dict[int, MacroValue] = {}

    def get(self, index: int, local: dict[int, MacroValue]) -> MacroValue:
        """The value of a variable; None where it is vacant."""
        if index == 0:
            return None
        if 1 <= index <= 33:
            return local.get(index)
        if index < 1000 or index in self.common:
            return self._common(index)
        if 4001 <= index <= 4130:
            return self._modal(index)
        if self.blocks.within and index > 5000:
            raise MacroFault("gcode.mode", f"#{index} under {self.blocks.within} is not executed",
                             "read positions and offsets before it")
        if 5001 <= index <= 5006 or 5041 <= index <= 5046:
            axis = self._axis(index % 20 if index < 5020 else index - 5040)
            return self.blocks.track.position(axis) / self.blocks.track.scale(axis)
        if 5021 <= index <= 5026:
            return self._machine(self._axis(index - 5020))
        if _FIRST_OFFSET <= index <= 5326:
            return self._offset(index)
        raise _refused(index)

    def put(self, index: int, value: MacroValue, local: dict[int, MacroValue], line: int) -> None:
        """A variable set; line: of the block."""
        if 1 <= index <= 33:
            local[index] = value
        elif 100 <= index < 1000:
            self.common[index] = value
        elif index == 3006:
            self.blocks.write("M0", line)
        elif index in _PASSIVE:
            return
        elif _FIRST_OFFSET <= index <= 5326:
            register, axis = self._place(index)
            track = self.blocks.track
            track.set_work(register, axis, plain(value) * track.scale(axis))
        else:
            raise _refused(index)

    def _common(self, index: int) -> MacroValue:
        if index in self.common:
            return self.common[index]
        if index < 100:
            raise _refused(index)
        raise MacroFault("gcode.variable", f"#{index} is read before the program sets it: what it holds was left there by "
                         "another program, or by hand", f"set it first, in a copy of the program: #{index}=...")

    def _modal(self, index: int) -> MacroValue:
        group = index - 4000
        held = self.blocks.state.get(_LETTERS.get(index, group))
        if index == 4014 and self.blocks.track.register is not None:
            held = self.blocks.track.register
        if held is None:
            raise MacroFault("gcode.variable", f"#{index} is read, and the program has not stated what it says",
                             "state the code that it says before this block")
        return held

    def _axis(self, number: int) -> str:
        if number > len(self.held.axes):
            raise MacroFault("gcode.variable", f"the machine has no axis {number}",
                             f"its axes are {', '.join(self.held.axes)}")
        ordered = sorted(self.held.axes, key=lambda a: _AXES.find(a) if a in _AXES else len(_AXES))
        return ordered[number - 1]

    def _machine(self, axis: str) -> float:
        track = self.blocks.track
        if track.register is None or (axis == "Z" and track.length is None):
            raise MacroFault("gcode.position_unknown", f"where {axis} stands in machine coordinates is not known here",
                             "state the work offset, and the length or G49, before this block")
        drawn = self.held.lengths.get(track.length, 0.0) if axis == "Z" and track.length is not None else 0.0
        here = track.position(axis) + track.shift(axis) + track.work(track.register, axis) + drawn
        return here / track.scale(axis)

    def _place(self, index: int) -> tuple[float, str]:
        register, axis = divmod(index - _FIRST_OFFSET, 20)
        if axis >= 6:
            raise _refused(index)
        return 54.0 + register, self._axis(axis + 1)

    def _offset(self, index: int) -> float:
        register, axis = self._place(index)
        track = self.blocks.track
        return track.offset(register, axis) / track.scale(axis)


def _refused(index: int) -> MacroFault:
    return MacroFault("gcode.variable", f"system variable #{index} is not read: what it holds is not in the program, nor "
                                        f"in the "
                      "set-up", "put the figure that the control would find there in its place, in a copy of the program")
