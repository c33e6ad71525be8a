"""What every writer does: the frame of the program, commands, sections, tool lengths, numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from postproc.controllers.model import CannedCycle, ControllerFile, Mode
from postproc.controllers.texts import blocks_of
from postproc.program import Command, Hole, Program, Section
from toolpaths.arrays import Floats
from toolpaths.toolpath import Cycle


class Writer:
    """Writes one program; the state is what the controller holds while it reads.

    `law` is that of the words; `register` the length register of the tool in the spindle; `length_off` is True where the
    register is not in force and waits for the next block that states Z; `speed` is the spindle's (1/min, negative:
    anti-clockwise, 0 unknown).
    """

    def __init__(self, controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], length_offsets: bool,
                 smoothing: float, work_offset: str = "G54", axis_smoothing: float = 0.0, name: str = "") -> None:
        self.controller, self.program, self.cycles = controller, program, cycles
        self.length_offsets, self.smoothing, self.axis_smoothing = length_offsets, smoothing, axis_smoothing
        self.work_offset = controller.program.work_offsets.get(work_offset, work_offset)
        self.name = "".join(c if c.isascii() and c.isalnum() else "_" for c in name).upper()[:24] or "PROGRAM"
        self.space = " " if controller.format.space else ""
        self.number = 0
        self.law, self.register, self.length_off, self.speed = program.sections[0].law, "", False, 0.0
        self.in_cycle, self.cycle_text = False, ""
        self.restate()

    def restate(self) -> None:
        """Forget the modal codes: the next block states them anew."""
        self.motion, self.plane, self.mode, self.feed = "", 17, 0, ""

    # ---- the program --------------------------------------------------------------------------------------------

    def lines(self, header: list[str]) -> Iterator[str]:
        """The blocks of the whole program, without line ends."""
        frame = self.controller.program
        named = {"name": self.name, "number": f"{frame.number:04d}"}
        yield from (block.format(**named) for block in frame.begin)
        yield from map(self.comment, (*header, *self.relies_on()))
        for block in (*self.start(), *self.smoothing_blocks()):
            yield self.numbered(block)
        yield from map(self.numbered, self.body())
        for block in frame.ending:
            yield self.numbered(block)
        yield from (block.format(**named) for block in frame.end)

    def start(self) -> Iterator[str]:
        """Safe start: modes that the program uses off, then the preamble."""
        for mode in self.used_modes():
            yield from mode.start
        for block in self.controller.program.preamble:
            yield from blocks_of(block.replace("{work_offset}", self.work_offset))

    def used_modes(self) -> list[Mode]:
        """The modes of the program's sections."""
        laws = {section.law for section in self.program.sections}
        modes = {"tcp": self.controller.modes.tcp, "tilted": self.controller.modes.tilted}
        return [mode for law, mode in modes.items() if mode is not None and law in laws]

    def relies_on(self) -> list[str]:
        """Settings of the control that the program needs, each once."""
        return list(dict.fromkeys(f"needs {text}" for mode in self.used_modes() for text in mode.relies_on))

    def smoothing_blocks(self) -> list[str]:
        """Blocks that set the control's own smoothing, where something is left to it."""
        blocks = self.controller.program.path_tolerance
        if self.smoothing <= 0.0 and any("{" in block for block in blocks):
            return []
        values = {"tolerance": self.plain(self.smoothing), "chain": "", "axis": self.plain(self.axis_smoothing)}
        return [block.format(**values) for block in blocks]

    def numbered(self, block: str) -> str:
        """The block with its number where the controller numbers blocks."""
        style = self.controller.format
        if not style.sequence_step or block.startswith(self.controller.comment.open):
            return block
        self.number += style.sequence_step
        return f"{style.sequence_prefix}{self.number}{self.space}{block}"

    def comment(self, text: str) -> str:
        """One comment block, without characters that would end it, cut to the line length."""
        style = self.controller.comment
        clean = "".join(" " if c in style.forbidden or not 32 <= ord(c) < 127 else c for c in text)
        room = self.controller.format.line_length - len(style.open) - len(style.close) - 12
        return f"{style.open}{clean[:room]}{style.close}"

    def body(self) -> Iterator[str]:
        """Blocks between preamble and ending: stretches of plain motion at once, all else one by one."""
        p = self.program
        stops = sorted({*p.commands, *(h.first for h in p.holes), *(h.last + 1 for h in p.holes), len(p)})
        holes = {h.first: h for h in p.holes}
        at = 0
        for stop in stops:
            if stop > at:
                yield from self.end_cycle()
                yield from self.blocks(at, stop)
                at = stop
            for command in p.commands.get(stop, ()):
                yield from self.end_cycle()
                yield from self.command(command)
            if stop in holes:
                yield from self.hole(holes[stop])
                self.in_cycle = True
                at = holes[stop].last + 1
        yield from self.end_cycle()

    def end_cycle(self) -> Iterator[str]:
        """The block that ends a canned cycle that is in force."""
        if self.in_cycle and self.controller.cycles.cancel:
            yield self.controller.cycles.cancel
        if self.in_cycle:
            self.in_cycle, self.motion, self.cycle_text = False, "", ""

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        raise NotImplementedError

    def hole(self, hole: Hole) -> Iterator[str]:
        """A canned cycle: in full where anything but the place of the hole changes, else the place alone."""
        raise NotImplementedError

    # ---- numbers ------------------------------------------------------------------------------------------------

    def number_text(self, values: Floats, places: int) -> list[str]:
        """Numbers as text, rounded to `places`, -0 as 0."""
        style = self.controller.format
        sign = "+" if style.plus_sign else ""
        texts = [f"{v:{sign}.{places}f}" for v in (values + 0.0).tolist()]
        if style.trim_zeros and places:
            texts = [t.rstrip("0").rstrip("." if not style.decimal_point else "\0") for t in texts]
        elif style.decimal_point and not places:
            texts = [t + "." for t in texts]
        zero = sign + "0"
        texts = [t.replace("-0", zero) if t.strip("-0.") == "" and t.startswith("-") else t for t in texts]
        return texts

    def hole_feed(self, hole: Hole) -> float:
        """Feed of a hole's way down, mm/min."""
        p = self.program
        return float(p.feed[next(k for k in range(hole.first, hole.last + 1) if p.code[k] > 0)])

    def cycle_of(self, hole: Hole) -> CannedCycle:
        """The controller's cycle for a hole."""
        cycles = self.controller.cycles
        return (cycles.with_dwell if self.cycles[hole.cycle].dwell > 0.0 else cycles.table)[hole.key]

    def cycle_values(self, hole: Hole) -> dict[str, float]:
        """The values that the text of a cycle may name (`CYCLE_VALUES`)."""
        cycle, feed = self.cycles[hole.cycle], self.hole_feed(hole)
        surface = hole.plane_level - cycle.clearance
        depth, step = surface - hole.bottom, min(peck_of(cycle), surface - hole.bottom)
        pitch = cycle.pitch or (feed / abs(self.speed) if self.speed else 0.0)
        return {"retract": hole.retract, "surface": surface, "clearance": cycle.clearance, "bottom": hole.bottom,
                "depth": depth, "level": -depth, "step": step, "breaks": float(math.ceil(depth / step)),
                "dwell": cycle.dwell, "feed": feed, "pitch": -pitch if hole.key == "TAP_LEFT" else pitch,
                "speed": abs(self.speed), "second": hole.retract - surface}

    @staticmethod
    def plain(value: float | str) -> str:
        """A number without an exponent or needless zeros."""
        return f"{float(value):.6f}".rstrip("0").rstrip(".")

    # ---- sections -----------------------------------------------------------------------------------------------

    def mode_of(self, section: Section) -> Mode | None:
        """The controller's mode for the law of a section."""
        return getattr(self.controller.modes, section.law) if section.law != "axes" else None

    def enter(self, section: Section) -> Iterator[str]:
        """Blocks that switch the mode of a section on."""
        self.law = section.law
        mode = self.mode_of(section)
        if mode is None:
            return
        yield from self._length(mode.length)
        values = self.section_values(section)
        for block in mode.enter:
            if "{register}" in block:
                self.length_off = False
            yield block.format(**values)
        self.restate()

    def leave(self, section: Section) -> Iterator[str]:
        """Blocks that switch it off."""
        mode = self.mode_of(section)
        self.law = "axes"
        if mode is None:
            return
        holds = any("{register}" in block for block in mode.enter)
        if not holds:
            yield from self._length(mode.length)
        for block in mode.leave:
            yield block.format(**self.section_values(section))
        self.length_off |= holds
        self.restate()

    def _length(self, wanted: str) -> Iterator[str]:
        """The length register off or on, where it is not."""
        codes = self.controller.codes
        if wanted == "off" and self.register and not self.length_off:
            yield codes.length_cancel
            self.length_off = True
        elif wanted == "on" and self.register and self.length_off:
            yield codes.length_offset.format(register=self.register)
            self.length_off = False

    @property
    def length_waits(self) -> bool:
        """True where the next block that states Z has to put the length register in force."""
        return self.length_off and bool(self.register) and (self.length_offsets or self.law == "tilted")

    def section_values(self, section: Section) -> dict[str, str]:
        """What the text of a mode may name."""
        places = self.controller.modes.tilted.decimals if self.controller.modes.tilted else 0
        angles = dict(zip(("first", "second", "third"), self.number_text(np.array(section.angles), places), strict=False))
        tilt = next((angle for letter, angle in section.rotary if letter in "AB"), 0.0)
        direction = "-1" if tilt < 0.0 else "1"
        return {"register": self.register, "work_offset": self.work_offset, "direction": direction, **angles}

    # ---- commands -----------------------------------------------------------------------------------------------

    def command(self, command: Command) -> Iterator[str]:
        """The blocks of one canonical command."""
        codes = self.controller.codes
        fixed = {"STOP_SPINDLE_TURNING": codes.spindle_stop, "FLOOD_ON": codes.flood, "MIST_ON": codes.mist,
                 "THROUGH_ON": codes.through, "COOLANT_OFF": codes.coolant_off, "PROGRAM_STOP": codes.stop,
                 "OPTIONAL_PROGRAM_STOP": codes.optional_stop, "CUTTER_COMPENSATION_OFF": codes.compensation_off}
        if command.name in fixed:
            yield fixed[command.name]
        elif command.name in ("ENTER_SECTION", "LEAVE_SECTION"):
            section = self.program.sections[int(command.args[0])]
            yield from self.enter(section) if command.name == "ENTER_SECTION" else self.leave(section)
        elif command.name.startswith("START_SPINDLE"):
            yield from self.spindle(command)
        elif command.name == "COMMENT":
            yield self.comment(str(command.args[0]))
        elif command.name == "INSERT":
            yield str(command.args[0])
        else:
            yield from self.numbered_command(command)

    def spindle(self, command: Command) -> Iterator[str]:
        """The spindle's start, with its speed where one is given."""
        codes, clockwise = self.controller.codes, command.name.endswith("_CLOCKWISE")
        code = codes.spindle_cw if clockwise else codes.spindle_ccw
        if command.args:
            self.speed = float(command.args[0]) * (1.0 if clockwise else -1.0)
        yield f"S{self.plain(command.args[0])}{self.space}{code}" if command.args else code

    def numbered_command(self, command: Command) -> Iterator[str]:
        """Commands that carry a number."""
        codes, args = self.controller.codes, command.args
        value = self.plain(args[0]) if args else ""
        if command.name == "CHANGE_TOOL":
            yield from self.change_tool(value)
        elif command.name == "SELECT_TOOL":
            yield codes.tool_select.format(number=value)
        elif command.name == "USE_TOOL_LENGTH_OFFSET":
            yield from self.use_length(value)
        elif command.name == "DWELL":
            seconds = float(args[0])
            yield from blocks_of(codes.dwell.format(seconds=self.plain(seconds), milliseconds=round(seconds * 1000.0)))
        elif command.name.startswith("CUTTER_COMPENSATION"):
            code = codes.compensation_left if command.name.endswith("LEFT") else codes.compensation_right
            yield code.format(register=value) if value else code.split(" ")[0]
        else:
            raise ValueError(f"no text for the command {command.name}")

    def change_tool(self, number: str) -> Iterator[str]:
        """The tool change, with the length register off."""
        codes = self.controller.codes
        if self.length_offsets and codes.length_cancel and not self.length_off:
            yield codes.length_cancel
        yield from blocks_of(codes.tool_change.format(number=number))
        if self.controller.tools.length_automatic and not self.length_offsets and codes.length_cancel:
            yield codes.length_cancel
            self.length_off = True
        self.motion, self.register = "", ""

    def use_length(self, register: str) -> Iterator[str]:
        """The length register at once, or with the next block that states Z."""
        self.register = register
        self.length_off = self.controller.tools.length_with_z
        if not self.length_off and self.length_offsets and self.controller.codes.length_offset:
            yield self.controller.codes.length_offset.format(register=register)


def peck_of(cycle: Cycle) -> float:
    """Depth of a peck, mm: the whole way down where the cycle names none."""
    return cycle.steps[0] if cycle.steps else cycle.depth + cycle.clearance
