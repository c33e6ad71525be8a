"""Text of a Program for controllers that read ISO 6983: blocks of words, modal codes stated when they change."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from postproc.controllers.model import CannedCycle, ControllerFile
from postproc.program import INVERSE, Command, Hole, Program
from postproc.word_arcs import PLANE_AXIS
from toolpaths.arrays import Array, Bools, Floats
from toolpaths.toolpath import Cycle

_CHUNK = 20000


class IsoWriter:
    """Writes one program; the state is what the controller holds while it reads."""

    def __init__(self, controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], tools: bool,
                 smoothing: float, work_offset: str = "G54") -> None:
        self.controller, self.program, self.cycles = controller, program, cycles
        self.length_offsets, self.smoothing, self.work_offset = tools, smoothing, work_offset
        self.space = " " if controller.format.space else ""
        self.motion, self.plane, self.mode, self.feed = "", 17, 0, ""
        self.number = 0

    def lines(self, header: list[str]) -> Iterator[str]:
        """The blocks of the whole program, without line ends."""
        frame = self.controller.program
        yield from frame.begin
        yield from (self.comment(text) for text in header)
        for block in (*frame.preamble, *self.modes()):
            yield self.numbered(block.replace("{work_offset}", self.work_offset))
        yield from map(self.numbered, self.body())
        for block in frame.ending:
            yield self.numbered(block)
        yield from frame.end

    def modes(self) -> list[str]:
        """Blocks after the preamble that depend on the options."""
        return []

    def numbered(self, block: str) -> str:
        """The block with its N word where the controller numbers blocks."""
        if not self.controller.format.sequence_step or block.startswith(self.controller.comment.open):
            return block
        self.number += self.controller.format.sequence_step
        return f"N{self.number}{self.space}{block}"

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
                yield from self.blocks(at, stop)
                at = stop
            for command in p.commands.get(stop, ()):
                yield from self.command(command)
            if stop in holes:
                yield from self.hole(holes[stop])
                at = holes[stop].last + 1
        if self.motion == "cycle":
            yield self.controller.cycles.cancel

    def number_text(self, values: Floats, places: int) -> list[str]:
        """Numbers as text, rounded to `places`, -0 as 0."""
        texts = [f"{v:.{places}f}" for v in (values + 0.0).tolist()]
        style = self.controller.format
        if style.trim_zeros and places:
            texts = [t.rstrip("0").rstrip("." if not style.decimal_point else "\0") for t in texts]
            texts = ["0" if t == "-0" else "0." if t == "-0." else t for t in texts]
        return texts

    def word_columns(self, at: int, stop: int) -> list[list[str]]:
        """The axis words of blocks at..stop by letter, '' where a block does not state one."""
        p = self.program
        columns = []
        for j, letter in enumerate(p.letters):
            rows = np.flatnonzero(p.write[at:stop, j])
            column = [""] * (stop - at)
            texts = self.number_text(p.words[at + rows, j], int(p.decimals[j]))
            head = self.space + letter
            for row, text in zip(rows.tolist(), texts, strict=True):
                column[row] = head + text
            columns.append(column)
        return columns

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        if self.motion == "cycle":
            yield self.controller.cycles.cancel
            self.motion = ""
        for first in range(at, stop, _CHUNK):
            last = min(first + _CHUNK, stop)
            words = self.word_columns(first, last)
            heads = self.heads(first, last)
            feeds = self.feeds(first, last)
            arcs = self.arc_words(first, last)
            for head, axes, arc, feed in zip(heads, zip(*words, strict=True), arcs, feeds, strict=True):
                text = "".join((head, *axes, arc, feed))
                yield text[1:] if text.startswith(" ") else text

    def heads(self, first: int, last: int) -> list[str]:
        """Motion, plane and feed mode codes, '' where they stand already."""
        p, codes = self.program, self.controller.codes
        result = []
        names = (codes.traverse, codes.feed, codes.arc_cw, codes.arc_ccw)
        motion = np.where(p.code[first:last] == 2, 2 + p.ccw[first:last], p.code[first:last])
        for code, home, plane, mode in zip(motion.tolist(), p.home[first:last].tolist(),
                                           p.plane[first:last].tolist(), p.mode[first:last].tolist(), strict=True):
            words = []
            if code and mode != self.mode:
                words.append(codes.inverse_time if mode == INVERSE else codes.per_minute)
                self.mode = mode
                if self.controller.feed.cleared_by_mode_change:
                    self.feed = ""
            if code >= 2 and plane != self.plane:
                words.append(codes.planes[str(plane)])
                self.plane = plane
            if home:
                words.append(codes.machine_coordinates)
            if home or names[code] != self.motion:
                words.append(names[code])
                self.motion = names[code]
            result.append("".join(self.space + w for w in words))
        return result

    def feed_text(self, value: float) -> str:
        """The number of a feed word: the controller's decimals, more for feeds below 1."""
        places = self.controller.format.feed_decimals + (2 if value < 1.0 else 0)
        return self.number_text(np.array([value]), places)[0]

    def feeds(self, first: int, last: int) -> list[str]:
        """Feed words, '' where the feed stands already (each block of inverse time states it)."""
        p = self.program
        result = []
        every = self.controller.feed.word_every_inverse_block
        changes = self.mode_changes[first:last].tolist()
        for value, mode, cutting, changed in zip(p.feed[first:last].tolist(), p.mode[first:last].tolist(),
                                                 (p.code[first:last] > 0).tolist(), changes, strict=True):
            if not cutting:
                result.append("")
                continue
            text = self.feed_text(value)
            needed = text != self.feed or changed or (mode == INVERSE and every)
            self.feed = text
            result.append(f"{self.space}F{text}" if needed else "")
        return result

    @cached_property
    def mode_changes(self) -> Bools:
        """(K,) True where a cutting block follows one of another feed mode and so has to state its feed."""
        p = self.program
        cutting = np.flatnonzero(p.code > 0)
        changed = np.zeros(len(p), dtype=bool)
        modes: Array = p.mode[cutting]
        changed[cutting[1:][modes[1:] != modes[:-1]]] = self.controller.feed.cleared_by_mode_change
        return changed

    def arc_words(self, first: int, last: int) -> list[str]:
        """I, J, K of arc blocks, relative to the start: the two of the plane."""
        p = self.program
        result = [""] * (last - first)
        places = self.controller.format.linear_decimals
        for k in np.flatnonzero(p.code[first:last] == 2).tolist():
            third = PLANE_AXIS[int(p.plane[first + k])]
            texts = self.number_text(p.center[first + k], places)
            result[k] = "".join(f"{self.space}{'IJK'[i]}{texts[i]}" for i in range(3) if i != third)
        return result

    def command(self, command: Command) -> Iterator[str]:
        """The blocks of one canonical command."""
        if self.motion == "cycle":
            yield self.controller.cycles.cancel
            self.motion = ""
        codes, args = self.controller.codes, command.args
        fixed = {"STOP_SPINDLE_TURNING": codes.spindle_stop, "FLOOD_ON": codes.flood, "MIST_ON": codes.mist,
                 "THROUGH_ON": codes.through, "COOLANT_OFF": codes.coolant_off, "PROGRAM_STOP": codes.stop,
                 "OPTIONAL_PROGRAM_STOP": codes.optional_stop, "CUTTER_COMPENSATION_OFF": codes.compensation_off}
        if command.name in fixed:
            yield fixed[command.name]
        elif command.name.startswith("START_SPINDLE"):
            code = codes.spindle_cw if command.name.endswith("_CLOCKWISE") else codes.spindle_ccw
            yield f"S{self.plain(args[0])}{self.space}{code}" if args else code
        elif command.name == "COMMENT":
            yield self.comment(str(args[0]))
        elif command.name == "INSERT":
            yield str(args[0])
        else:
            yield from self.numbered_command(command)

    def numbered_command(self, command: Command) -> Iterator[str]:
        """Commands that carry a number."""
        codes, args = self.controller.codes, command.args
        value = self.plain(args[0]) if args else ""
        if command.name == "CHANGE_TOOL":
            if self.length_offsets:
                yield codes.length_cancel
            yield codes.tool_change.format(number=value)
            self.motion = ""
        elif command.name == "SELECT_TOOL":
            yield codes.tool_select.format(number=value)
        elif command.name == "USE_TOOL_LENGTH_OFFSET":
            if self.length_offsets:
                yield codes.length_offset.format(register=value)
        elif command.name == "DWELL":
            yield codes.dwell.format(seconds=value)
        elif command.name.startswith("CUTTER_COMPENSATION"):
            code = codes.compensation_left if command.name.endswith("LEFT") else codes.compensation_right
            yield code.format(register=value) if value else code.split(" ")[0]
        else:
            raise ValueError(f"no text for the command {command.name}")

    @staticmethod
    def plain(value: float | str) -> str:
        """A number without an exponent or needless zeros."""
        return f"{float(value):.6f}".rstrip("0").rstrip(".")

    def hole(self, hole: Hole) -> Iterator[str]:
        """A canned cycle: in full where anything but the place of the hole changes, else the place alone."""
        p, cycles = self.program, self.controller.cycles
        cycle = self.cycles[hole.cycle]
        spec = (cycles.with_dwell if cycle.dwell > 0.0 else cycles.table)[hole.key]
        at = self._place(hole)
        if self.mode == INVERSE:
            yield self.controller.codes.per_minute
            self.mode, self.feed = 0, ""
        if self.plane != 17:
            yield self.controller.codes.planes["17"]
            self.plane = 17
        drill = next(k for k in range(hole.first, hole.last + 1) if p.code[k] > 0)
        text = self._cycle_text(hole, cycle, spec, float(p.feed[drill]))
        place = "".join(f"{self.space}{letter}{value}" for letter, value in at)
        if self.motion == "cycle" and text == self.cycle_text:
            yield place.removeprefix(" ")
            return
        self.cycle_text, self.motion = text, "cycle"
        head, _, tail = text.partition("|")
        yield f"{head}{place}{tail}"

    cycle_text = ""

    def _place(self, hole: Hole) -> list[tuple[str, str]]:
        p = self.program
        result = []
        for j, letter in enumerate(p.letters):
            if letter in ("X", "Y"):
                result.append((letter, self.number_text(p.words[hole.first, j:j + 1] if hole.first == hole.last
                                                        else p.words[hole.last, j:j + 1], int(p.decimals[j]))[0]))
        return result

    def _cycle_text(self, hole: Hole, cycle: Cycle, spec: CannedCycle, feed: float) -> str:
        cycles, places = self.controller.cycles, self.controller.format.linear_decimals
        z, r = self.number_text(np.array([hole.bottom, hole.plane_level]), places)
        out = cycles.to_plane if abs(hole.retract - hole.plane_level) < 1e-9 else cycles.to_initial
        extra = ""
        if spec.peck:
            step = cycle.steps[0] if cycle.steps else cycle.depth + cycle.clearance
            extra += f"{self.space}{spec.peck}{self.number_text(np.array([step]), places)[0]}"
        if spec.dwell:
            extra += f"{self.space}{spec.dwell}{self.plain(cycle.dwell)}"
        self.feed = self.feed_text(feed)
        tail = f"{self.space}Z{z}{self.space}R{r}{extra}{self.space}F{self.feed}"
        return f"{out}{self.space}{spec.code}|{tail}"
