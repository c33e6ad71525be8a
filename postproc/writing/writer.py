"""What every writer does: the frame of the program, operations, commands."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from machines.hooks import filled
from postproc.compile.clamps import CLAMP, UNCLAMP
from postproc.compile.hooks import HOOK
from postproc.compile.program import PER_MINUTE, Command, Hole
from postproc.control.rollover import HALF
from postproc.controllers.texts import blocks_of
from postproc.reference.coolant import COMMANDS
from postproc.writing.state import NUMBER_ROOM, WriterState, plain_name, without_off
from toolpaths.arrays import Ints
from toolpaths.pattern import pattern

_LABEL = pattern(r"%|[NO]\d")
"""blocks that carry a number of their own"""
_HUNDRED = pattern(r"N\d+")
"""number of an operation"""
SKIP = "/"
"""before blocks that a switch at the control leaves out"""
MARK = "\0"
"""stands in the body where an operation begins"""
OF_PROGRAM = "of program"
"""begins the comment by which a subprogram's file names the program that calls it"""
FULL_TURN = 360.0
"""degrees"""
CHUNK = 20_000
"""blocks whose words are made at a time"""
_TOGETHER = 10_000
"""blocks that are put together at a time, so that a long program is never a list of all its blocks"""
NEXT = "\1"
"""before an operation's number, which is the next hundred of the running numbers"""


class Writer(WriterState, ABC):
    """Writes one program."""

    def text(self, header: list[str]) -> str:
        """The whole program; subprograms of files of their own go into `files`."""
        parts, some = list[str](), list[str]()
        for block in self.lines(header):
            some.append(block)
            if len(some) >= _TOGETHER:
                parts.append("\n".join(some))
                some.clear()
        return "\n".join([*parts, *some, ""])

    def lines(self, header: list[str]) -> Iterator[str]:
        """The blocks of the whole program, without line ends; subprograms of files of their own go into `files`."""
        frame, place = self.controller.program, self.controller.subprograms.place
        named = self.named(f"{frame.number:04d}")
        main, subs = self.sorted_blocks()
        inside = [block for blocks in subs.values() for block in blocks] if place != "files" else []
        yield from (self.framed(block.format(**named)) for block in frame.begin)
        yield from (self.framed(block) for block in self.stock_blocks())
        yield from (self.framed(self.comment(part)) for line in (*header, *self.relies_on()) for part in self.folded(line))
        yield from map(self.numbered, inside if place == "before" else [])
        yield from map(self.numbered, main) if self.numbers_blocks else main
        yield from map(self.numbered, self.ending())
        yield from map(self.numbered, inside if place == "after" else [])
        yield from (self.framed(block.format(**named)) for block in frame.end)
        for number, blocks in subs.items() if place == "files" else ():
            self.first_number()
            name = self.controller.subprograms.file.format(name=self.name, number=number)
            blocks.insert(len(self.controller.subprograms.begin), self.comment(f"{OF_PROGRAM} {self.name}"))
            self.files[name] = [self.numbered(block) for block in blocks]

    def stock_blocks(self) -> list[str]:
        """The stock for the graphics of the control, where the control has blocks for it."""
        if self.stock is None or not self.controller.program.stock:
            return []
        values = dict(zip(("x0", "y0", "z0", "x1", "y1", "z1"), self.lengths(self.stock.ravel()), strict=True))
        return [block.format(**values) for block in self.controller.program.stock]

    def sorted_blocks(self) -> tuple[Iterable[str], dict[int, list[str]]]:
        """Blocks of the main program up to its ending, and those of the subprograms by number, one for each operation."""
        first = next((str(c.args[0]) for c in self.program.commands.get(0, ()) if c.name == "SMOOTHING"), "")
        start = chain(self.start(), self.smoothing_blocks(first))
        if not self.subprograms:
            return chain(start, (block for block in self.body() if block != MARK)), {}
        spec, main, subs = self.controller.subprograms, list(start), dict[int, list[str]]()
        into = main
        for block in self.body():
            if block != MARK:
                into.append(block)
                continue
            named = self.named(number := 1001 + len(subs))
            self.taken.add(number)
            main.append(spec.call.format(**named))
            into = subs[number] = [text.format(**named) for text in spec.begin]
        for number, blocks in subs.items():
            blocks += [text.format(**self.named(number)) for text in spec.end]
        return main, subs

    @property
    def numbers_blocks(self) -> bool:
        """False where no block of the body gets a number: `numbered` then leaves all as they are."""
        return bool(self.controller.format.sequence_step)

    def first_number(self) -> None:
        """Begin to number blocks again."""
        self.number = 0

    def framed(self, block: str) -> str:
        """A block of the frame, or a comment in the header, as the file holds it."""
        return block

    def ending(self) -> list[str]:
        """The blocks that end every program, without those that switch off what is off already."""
        codes, program = self.controller.codes, self.controller.program
        off = {codes.spindle_stop} if self.turning is False else set()
        off |= {codes.coolant_off} if self.cooling is False else set()
        left = [code for code in self.coolant_off() if self.flowing and code != codes.coolant_off]
        return left + [kept for block in (*program.path_tolerance_off, *program.ending) if (kept := without_off(block, off))]

    def start(self) -> Iterator[str]:
        """Safe start: modes that the program uses off, then the preamble; what must not see a length waits for the block
        that goes home."""
        for mode in self.used_modes():
            yield from mode.start
            if self.goes_home(self.at):
                self.waiting += mode.lifted
            elif mode.lifted:
                yield from (self.without_length(), *mode.lifted)
        yield from self.controller.rollover.on if self.program.rolls else ()
        if (self.program.plane[self.program.code == 2] > 17).any():
            yield from self.controller.arcs.start
        for block in self.controller.program.preamble:
            yield from blocks_of(block.replace("{work_offset}", self.work_offset).replace("{units}", self.units))

    def relies_on(self) -> list[str]:
        """Settings of the control that the program needs, each once."""
        needed = list(self.offset_needs)
        needed += self.controller.inch.relies_on if self.controller.format.units == "inch" else ()
        needed += self.options(self.used_modes())
        letters, text = self.beyond_a_turn(), self.controller.program.relies_on_turns
        needed += [text.format(axes=" ".join(letters))] if letters and text else []
        for rule in ("shortest", "sign"):
            axes, text = [self.program.letters[j] for j, r in self.program.rolls.items() if r.rule == rule], \
                self.controller.rollover.needs.get(rule, "")
            needed += [text.format(axes=" ".join(axes))] if axes and text else []
        return list(dict.fromkeys(f"needs {text}" for text in needed))

    def beyond_a_turn(self) -> list[str]:
        """Rotary axes with words of a full turn or more, which a control may roll over."""
        p = self.program
        far = np.flatnonzero(((np.abs(p.words) >= FULL_TURN) & p.write & ~p.home[:, None]).any(axis=0)).tolist()
        return [p.letters[j] for j in far if p.letters[j] in p.turning and j not in p.rolls]

    def numbered(self, block: str) -> str:
        """The block with its number where the controller numbers blocks; the sign of the block switch stays in front."""
        if block.startswith(SKIP):
            return SKIP + self.numbered(block[1:])
        style = self.controller.format
        if block.startswith(NEXT):
            self.number = self.free(self.number - self.number % 100 + 100, 100)
            return _HUNDRED.sub(f"N{self.number}", block[1:], count=1)
        if not style.sequence_step or block.startswith(self.controller.comment.open) or _LABEL.match(block):
            return block
        self.number = self.free(self.number + style.sequence_step, style.sequence_step)
        return f"{style.sequence_prefix}{self.number}{self.space}{block}"

    def free(self, number: int, step: int) -> int:
        """The first of number, number + step, ... that no subprogram bears."""
        while number in self.taken:
            number += step
        return number

    def body(self) -> Iterator[str]:
        """Blocks between preamble and ending: stretches of plain motion at once, all else one by one."""
        p = self.program
        switch = np.flatnonzero(np.diff(p.skip)) + 1
        curves = set(np.flatnonzero((p.curve >= 0) | (p.spline >= 0)).tolist())
        stops = sorted({*p.commands, *(h.first for h in p.holes), *(h.last + 1 for h in p.holes), *switch.tolist(), *curves,
                        *(k + 1 for k in (0, *p.commands) if self.goes_home(k)), len(p)})
        holes = {h.first: h for h in p.holes}
        at = 0
        for stop in stops:
            if stop > at:
                yield from self.end_cycle()
                yield from self.blocks(at, stop) if not p.skip[at] else map(SKIP.__add__, self.blocks(at, stop))
                at = stop
                yield from self.waiting
                self.waiting = []
            for command in p.commands.get(stop, ()):
                yield from self.end_cycle()
                self.at = stop
                yield from self.command(command) if not command.skip else map(SKIP.__add__, self.command(command))
            if stop in holes:
                yield from self.hole(holes[stop])
                self.in_cycle = True
                at = holes[stop].last + 1
            elif stop in curves:
                yield from self.end_cycle()
                yield self.cubic(stop)
                at = stop + 1
        yield from self.end_cycle()

    def end_cycle(self) -> Iterator[str]:
        """The block that ends a canned cycle that is in force."""
        if self.in_cycle and self.controller.cycles.cancel:
            yield self.controller.cycles.cancel
        if self.in_cycle:
            self.in_cycle, self.motion, self.cycle_text = False, "", ""

    def axis_words(self, at: int, stop: int) -> list[str]:
        """The axis words of blocks at..stop; of the blocks behind them too, for the next time, where they are few."""
        first, texts = self.ahead
        if not first <= at <= stop <= first + len(texts):
            first, texts = at, self.words_of(at, min(max(stop, at + CHUNK), len(self.program)))
            self.ahead = first, texts
        return texts[at - first:stop - first]

    def words_of(self, at: int, stop: int) -> list[str]:
        """The axis words of blocks at..stop."""
        p = self.program
        columns = []
        for j, letter in enumerate(p.letters):
            rows = np.flatnonzero(p.write[at:stop, j])
            column = [""] * (stop - at)
            texts = self.rolled(j, at + rows) if j in p.rolls else [
                letter + text for text in self.number_text(self.stated(j, at + rows), int(p.decimals[j]))]
            for row, text in zip(rows.tolist(), texts, strict=True):
                column[row] = self.space + text
            columns.append(column)
        return ["".join(row) for row in zip(*columns, strict=True)]

    def rolled(self, axis: int, rows: Ints) -> list[str]:
        """The words of a modulo axis in blocks `rows`: inside one turn, with their direction where words state it."""
        p, rules, letter = self.program, self.controller.rollover, self.program.letters[axis]
        here, before, roll = p.words[rows, axis], p.before(axis)[rows], p.rolls[axis]
        values, back = roll.words(here, before)
        texts = self.number_text(values, int(p.decimals[axis]))
        if roll.rule == "sign":
            zero, = self.number_text(np.array([-FULL_TURN]), 0) if rules.zero_negative == "-360" else ["-0"]
            return [letter + (zero if b and v == 0.0 else text) for text, v, b in zip(texts, values, back, strict=True)]
        if not roll.stated:
            return [letter + text for text in texts]
        far = np.abs(here - before) > HALF
        return [(rules.shortest if not f else rules.negative if b else rules.positive).format(letter=letter, value=text)
                for text, f, b in zip(texts, far.tolist(), back.tolist(), strict=True)]

    @abstractmethod
    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""

    def cubic(self, block: int) -> str:
        """A block that runs a cubic."""
        raise ValueError(f"no text for the cubic of block {block}")

    @abstractmethod
    def hole(self, hole: Hole) -> Iterator[str]:
        """A canned cycle: in full where anything but the place of the hole changes, else the place alone."""

    # ---- commands ------------------------------------------------------------------------------------------

    def command(self, command: Command) -> Iterator[str]:
        """The blocks of one canonical command."""
        if command.name in self.fixed:
            if command.name == "STOP_SPINDLE_TURNING":
                self.turning = None if command.skip else False
            elif command.name in ("PROGRAM_STOP", "OPTIONAL_PROGRAM_STOP"):
                self.turning, self.cooling = self.turning and None, self.cooling and None
            yield self.fixed[command.name]
        elif command.name == "COOLANT_OFF" or command.name in COMMANDS:
            yield from self.coolant(command)
        elif command.name in ("ENTER_SECTION", "LEAVE_SECTION"):
            section = self.program.sections[int(command.args[0])]
            yield from self.enter(section) if command.name == "ENTER_SECTION" else self.leave(section)
        elif command.name.startswith("START_SPINDLE"):
            yield from self.spindle(command)
        elif command.name in (CLAMP, UNCLAMP):
            yield str(command.args[0])
        elif command.name == HOOK:
            yield self.hooked(command)
        elif command.name == "RESTATE":
            self.forget()
        elif command.name == "SET_ORIGIN_OFFSETS":
            yield from self.at_place(int(command.args[0]))
        elif command.name == "SMOOTHING":
            yield from self.other_smoothing(str(command.args[0]))
        elif command.name == "OPERATION_START":
            yield from self.operation(str(command.args[0]), len(command.args) > 1)
        elif command.name == "COMMENT":
            yield self.comment(str(command.args[0]))
        elif command.name == "INSERT":
            self.turning = self.cooling = None
            yield str(command.args[0])
        else:
            yield from self.numbered_command(command)

    def hooked(self, command: Command) -> str:
        """A block of the shop; modal codes are stated again behind it, since a macro may leave others."""
        text, number, name, operation = (str(arg) for arg in command.args)
        self.turning = self.cooling = None
        self.forget()
        values = {"tool_number": self.plain(max(float(number), 0.0)), "tool_name": plain_name(name),
                  "operation": plain_name(operation), "work_offset": self.offset_name}
        return filled(text, values, self.controller.format.line_length - NUMBER_ROOM)

    def operation(self, name: str, restart: bool) -> Iterator[str]:
        """The start of an operation: its blocks, and every modal code stated again behind them.

        With `restart` the program is taken up there, so the safe start, the work offset and the smoothing come again.
        """
        self.operations += 1
        yield MARK
        values = {"name": self.clean(name), "comment": self.comment(name), "number": 100 * self.operations}
        blocks = [block.format(**values) for block in self.controller.program.operation]
        blocks += [*self.start(), *self.smoothing_blocks(name)] if restart and self.operations > 1 else []
        if not blocks:
            return
        self.forget()
        stated = {word for block in blocks for word in block.split()}
        self.plane = 17 if self.controller.codes.planes["17"] in stated else 0
        self.mode = PER_MINUTE if self.controller.codes.per_minute in stated else -1
        self.length_off = self.controller.codes.length_cancel in stated or (self.length_off and not restart)
        numbers = self.controller.format.sequence_step and self.controller.format.sequence_prefix == "N"
        yield from (f"{NEXT}{block}" if numbers and _HUNDRED.match(block) else block for block in blocks)

    def coolant(self, command: Command) -> Iterator[str]:
        """One kind of coolant on, any other off before it; or all off. What the block switch may leave out is not known."""
        asked = next((name for name in COMMANDS if name == command.name), None)
        wanted = COMMANDS[asked] if asked else 0
        if not wanted or self.flowing & ~wanted:
            yield from self.coolant_off()
            self.flowing = self.flowing if command.skip else 0
        if asked:
            yield self.switching[asked][0]
        self.flowing |= wanted
        self.cooling = None if command.skip else bool(wanted)

    def coolant_off(self) -> list[str]:
        """The codes that end what may flow: those of kinds that have one of their own, and the one for all others."""
        own = {off: COMMANDS[name] for name, (_, off) in self.switching.items() if off}
        result = [off for off, bits in own.items() if self.flowing & bits]
        rest = self.cooling is None or not result or self.flowing & ~sum(own.values())
        return [*result, self.controller.codes.coolant_off] if rest else result

    def spindle(self, command: Command) -> Iterator[str]:
        """The spindle's start, with its speed where one is given."""
        self.turning = True
        codes, clockwise = self.controller.codes, command.name.endswith("_CLOCKWISE")
        code = codes.spindle_cw if clockwise else codes.spindle_ccw
        if not command.args:
            yield code
            return
        asked = float(command.args[0])
        speed = self.spindle_speed(asked)
        self.speed, self.rounded = speed if clockwise else -speed, speed / asked if asked > 0.0 else 1.0
        yield f"S{self.plain(speed)}{self.space}{code}"

    def numbered_command(self, command: Command) -> Iterator[str]:
        """Commands that carry a number."""
        codes, args = self.controller.codes, command.args
        value = self.plain(args[0]) if args else ""
        if command.name == "CHANGE_TOOL":
            yield from self.change_tool(value)
        elif command.name == "SELECT_TOOL":
            yield codes.tool_select.format(number=self.tool_said(value))
        elif command.name == "USE_TOOL_LENGTH_OFFSET":
            yield from self.use_length(value)
        elif command.name == "DWELL":
            seconds = max(round(float(args[0]), 3), 0.001)
            yield from blocks_of(codes.dwell.format(seconds=self.plain(seconds), milliseconds=round(seconds * 1000.0)))
        elif command.name.startswith("CUTTER_COMPENSATION"):
            code = codes.compensation_left if command.name.endswith("LEFT") else codes.compensation_right
            yield code.format(register=value) if value else code.split(" ")[0]
        else:
            raise ValueError(f"no text for the command {command.name}")

    def tool_said(self, number: str) -> str:
        """The number of a tool, or what stands in its place where the control knows it by name."""
        codes, name = self.controller.codes, self.controller.tools.names.get(int(float(number)))
        return codes.tool_by_name.format(name=name) if name and codes.tool_by_name else number

    def change_tool(self, number: str) -> Iterator[str]:
        """The tool change, with the length register off."""
        codes = self.controller.codes
        if self.length_offsets and codes.length_cancel and not self.length_off:
            yield self.without_length()
        yield from blocks_of(codes.tool_change.format(number=self.tool_said(number)))
        if self.controller.tools.length_automatic and not self.length_offsets and codes.length_cancel:
            yield self.without_length()
        self.motion, self.register = "", ""

    def use_length(self, register: str) -> Iterator[str]:
        """The length register at once, or with the next block that states Z."""
        self.register = register
        self.length_off = self.controller.tools.length_with_z
        if not self.length_off and self.length_offsets and self.controller.codes.length_offset:
            yield self.controller.codes.length_offset.format(register=register)
