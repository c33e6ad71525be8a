"""What writers stand on: the state of the control, numbers and comments, modes and length registers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from textwrap import wrap

import numpy as np

from machines.kinematics.chain import ROTARY
from postproc.compile.canned import cycle_spec
from postproc.compile.program import PER_MINUTE, Hole, Program, Section
from postproc.controllers.cycles import CannedCycle
from postproc.controllers.model import ControllerFile
from postproc.controllers.output_modes import LengthState, Mode
from postproc.controllers.texts import CYCLE_LENGTHS, blocks_of
from postproc.job.smoothing import Smoothing
from postproc.path.model import ARC
from postproc.reference.coolant import CoolantCommand, switching
from postproc.reference.holes import ROUNDED
from postproc.writing.block_text import NumberStyle, WordColumn
from toolpaths.arrays import Floats, Ints
from toolpaths.toolpath import Cycle


class WriterState:
    """One program on its path to text; the state is what the controller holds while it reads.

    `law` is that of the words; `register` the length register of the tool in the spindle; `length_off` is
    True where the register is not in force and waits for the next block that states Z; `speed` is the
    spindle's as it is written (1/min,
    negative: anti-clockwise, 0 unknown), `rounded` its ratio to what was asked. `files` are the subprograms in files of
    their own, by name, once the program is written. `turning` and `cooling` say whether spindle and coolant
    run, None where nobody knows, `flowing` the kinds of coolant that may run (`postproc.reference.coolant`);
    `taken` are block numbers that subprograms have; `stock` (2, 3) least and greatest X, Y, Z of the stock;
    `levels`
    smoothing of operations by name, `level` the blocks of the one in force; `ahead` the axis words of a stretch of
    blocks, and the first of them; `at` the block that the command at hand stands before, `waiting` blocks of the safe start
    that stand behind it.
    """

    def __init__(self, controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], length_offsets: bool,
                 smoothing: float, places: Sequence[tuple[str, str]] = (("", "G54"),), axis_smoothing: float = 0.0,
                 name: str = "", subprograms: bool = False, stock: Floats | None = None,
                 levels: dict[str, Smoothing] | None = None) -> None:
        self.stock, self.levels, self.level = stock, levels or {}, list[str]()
        self.controller, self.program, self.cycles = controller, program, cycles
        self.length_offsets, self.smoothing, self.axis_smoothing = length_offsets, smoothing, axis_smoothing
        self.places = places
        needs = (controller.program.offset_needs(code) for _, code in places)
        self.offset_needs = list(dict.fromkeys(text for text in needs if text))
        self.offset_names = ", ".join(controller.program.offset_name(code) for _, code in places)
        self.at_place(0)
        self.name = "".join(c if c.isascii() and c.isalnum() else "_" for c in name).upper()[:24] or "PROGRAM"
        self.units = controller.units_word
        self.subprograms = subprograms and bool(controller.subprograms.call)
        self.files: dict[str, list[str]] = {}
        self.space = " " if controller.format.space else ""
        self.number = 0
        self.law, self.register, self.length_off, self.speed = program.sections[0].law, "", False, 0.0
        self.rounded = 1.0
        self.in_cycle, self.cycle_text, self.operations = False, "", 0
        self.falling = False
        self.plane, self.mode = 17, PER_MINUTE
        self.turning: bool | None = None
        self.cooling: bool | None = None
        self.flowing = 0
        self.taken: set[int] = set()
        self.ahead: tuple[int, list[str]] = (0, [])
        self.at, self.waiting = 0, list[str]()
        self.restate()

    def at_place(self, place: int) -> list[str]:
        """The name of a place and its work offset, which is in force from here on."""
        (name, code), program = self.places[place], self.controller.program
        self.work_offset, self.offset_name = program.offset_text(code), program.offset_name(code)
        return [self.comment(f"PLACE {name}"), *blocks_of(self.work_offset)]

    def named(self, number: int | str) -> dict[str, int | str]:
        """What the text of a frame or a subprogram may name."""
        return {"name": self.name, "number": number, "units": self.units}

    def options(self, modes: list[Mode]) -> list[str]:
        """What its modes need, and further options that the program needs, which the machine file does not confirm."""
        needed = [text.replace("{work_offset}", self.offset_names) for mode in modes
                  for text in (mode.option, *mode.relies_on) if text]
        p, rules = self.program, self.controller
        needed += [rules.tools.length_alone] if rules.tools.length_alone and self.length_alone() else []
        arcs = np.flatnonzero(p.code == ARC)
        third = [p.letters.index("ZYX"[plane - 17]) for plane in p.plane[arcs].tolist()]
        rising = p.words[arcs, third] != p.words[arcs - 1, third]
        taps = any(hole.key.startswith("TAP") for hole in p.holes)
        falling = any(len(set(self.cycles[hole.cycle].steps)) > 1 for hole in p.holes)
        others = ((rules.program.smoothing_option, True), (rules.arcs.helical_option, bool(rising.any())),
                  (rules.cycles.rigid_option, taps), (rules.cycles.falling_relies_on, falling),
                  (rules.splines.relies_on, bool((p.spline >= 0).any())))
        return needed + [text for text, used in others if text and used]

    def goes_home(self, block: int) -> bool:
        """True where a block goes home, and no switch at the control leaves it out."""
        p = self.program
        return block < len(p) and bool(p.home[block]) and not p.skip[block]

    def used_modes(self) -> list[Mode]:
        """The modes of the program's sections."""
        laws = {section.law for section in self.program.sections}
        modes = {"tcp": self.controller.modes.tcp, "tilted": self.controller.modes.tilted}
        return [mode for law, mode in modes.items() if mode is not None and law in laws]

    def length_alone(self) -> bool:
        """True where a length register changes in a block without a height: by modes, a start or a change away from home."""
        p, rules = self.program, self.controller.tools
        modes = [(section, mode) for section in p.sections if (mode := self.mode_of(section)) is not None]
        taken = any("{register}" in block for _, mode in modes for block in mode.enter)
        open_in = {section.first for old, section in pairwise(p.sections)
                   if old.law == "axes" and math.isnan(section.into) and self._takes_length(old.first, section.first)}
        alone = any(mode.length == "off" and (math.isnan(one.out) or one.first in open_in) for one, mode in modes)
        start = not self.goes_home(0) and any(mode.lifted for _, mode in modes)
        changes = [k for k, commands in p.commands.items() if any(c.name == "CHANGE_TOOL" for c in commands)]
        away = not rules.length_with_z or any(k == 0 or not self.goes_home(k - 1) for k in changes)
        return taken or alone or start or (self.length_offsets and away)

    def _takes_length(self, first: int, last: int) -> bool:
        """True where blocks of machine coordinates, `first` to before `last`, state Z behind the last one that goes home."""
        p = self.program
        behind = ~np.logical_or.accumulate((p.home & ~p.skip)[first:last][::-1])[::-1]
        return "Z" in p.letters and bool(p.write[first:last, p.letters.index("Z")][behind].any())

    def restate(self) -> None:
        """State motion code and feed with the next block."""
        self.motion, self.feed = "", ""

    def forget(self) -> None:
        """State every modal code again: nobody knows what came before."""
        self.restate()
        self.plane, self.mode = 0, -1

    def comment(self, text: str) -> str:
        """One comment block."""
        return f"{self.controller.comment.open}{self.clean(text)}{self.controller.comment.close}"

    def folded(self, text: str) -> list[str]:
        """A text in parts that a comment holds whole: a figure that is cut short is another one."""
        room = comment_room(self.controller)
        return [text] if len(text) <= room else wrap(text, room, break_on_hyphens=False)

    def clean(self, text: str) -> str:
        """The text without characters that a comment must not hold, cut to the line length."""
        return clean(self.controller, text)

    # ---- smoothing -----------------------------------------------------------------------------------------

    def smoothing_blocks(self, operation: str = "") -> list[str]:
        """Blocks that set the control's own smoothing, of an operation by its name, where something is left to it."""
        usual = Smoothing(self.smoothing, self.controller.program.path_tolerance)
        wanted = self.levels.get(operation, usual)
        self.level = self.smoothed(wanted.mm, wanted.blocks)
        return self.level

    def other_smoothing(self, operation: str) -> list[str]:
        """The same where an operation has another than is in force."""
        before = self.level
        after = self.smoothing_blocks(operation)
        return after if after != before else []

    def smoothed(self, mm: float, blocks: tuple[str, ...]) -> list[str]:
        """Blocks of a smoothing that may take so many mm."""
        if mm <= 0.0 and any("{" in block for block in blocks):
            return []
        values = {"tolerance": self.share(mm), "chain": "", "axis": self.plain(self.axis_smoothing)}
        return [block.format(**values) for block in blocks]

    # ---- codes ------------------------------------------------------------------------------------------------

    @cached_property
    def fixed(self) -> dict[str, str]:
        """The commands that are one code whatever they carry."""
        codes = self.controller.codes
        return {"STOP_SPINDLE_TURNING": codes.spindle_stop, "PROGRAM_STOP": codes.stop,
                "OPTIONAL_PROGRAM_STOP": codes.optional_stop,
                "CANCEL_TOOL_LENGTH_OFFSET": codes.length_cancel, "CUTTER_COMPENSATION_OFF": codes.compensation_off}

    @cached_property
    def switching(self) -> dict[CoolantCommand, tuple[str, str]]:
        """The controller's codes for each kind of coolant (`postproc.reference.coolant`)."""
        return switching(self.controller.codes)

    # ---- numbers -------------------------------------------------------------------------------------------

    def lengths(self, values: Floats) -> list[str]:
        """Lengths, mm, as text in the units of the program."""
        return self.number_text(values / self.controller.unit, self.controller.format.linear_decimals)

    def stated(self, axis: int, rows: Ints | int) -> Floats:
        """Words of an axis in blocks, in the units of the program."""
        values = self.program.words[np.atleast_1d(rows), axis]
        return values if self.program.letters[axis] in ROTARY else np.asarray(values / self.controller.unit)

    def share(self, length: float) -> str:
        """A length that the control's smoothing may take, mm, in the units of the program: in inches rounded down to its
        decimals, or finer where nothing would be left."""
        if self.controller.unit == 1.0:
            return self.plain(length)
        value = length / self.controller.unit
        for step in (10.0**self.controller.format.linear_decimals, SHARE):
            if (steps := math.floor(value * step + 1e-6)) > 0:
                return self.plain(steps / step)
        return self.plain(value)

    def columns(self, at: int, stop: int) -> list[WordColumn] | None:
        """The axis words of blocks at..stop as numbers; None where some are said otherwise."""
        p, rows, found = self.program, np.arange(at, stop), list[WordColumn]()
        for j, letter in enumerate(p.letters):
            values = self.stated(j, rows)
            if j in p.rolls:
                roll = p.rolls[j]
                if roll.rule == "sign" or roll.stated:
                    return None
                values = roll.words(values, p.before(j)[rows])[0]
            found.append(WordColumn(self.space + letter, values, p.write[at:stop, j], int(p.decimals[j])))
        return found

    @property
    def number_style(self) -> NumberStyle:
        """How `number_text` writes."""
        style = self.controller.format
        return NumberStyle(style.plus_sign, style.trim_zeros, style.decimal_point)

    def number_text(self, values: Floats, places: int) -> list[str]:
        """Numbers as text, rounded to `places`, -0 as 0; all at once, which is much faster than one by one."""
        style = self.controller.format
        sign = "+" if style.plus_sign else ""
        text = f"%{sign}.{places}f " * len(values) % tuple(values.tolist())
        if style.trim_zeros and places:
            text = _ZEROS.sub(" ", text)
            text = text if style.decimal_point else text.replace(". ", " ")
        elif style.decimal_point and not places:
            text = text.replace(" ", ". ")
        return _MINUS_ZERO.sub(f"{sign}0", text).split()

    def peck_of(self, cycle: Cycle, depth: float) -> float:
        """Depth of the first peck of a hole of `depth`, mm: the whole of it where the cycle names none. Pecks that divide it
        but for what rounding has made of it are rounded up, of pecks that fall the first is deeper by it: the control would
        drill a last one of that."""
        step, grain = min(cycle.steps[0], depth) if cycle.steps else depth, self.controller.grain
        next_step = min((*cycle.steps, step))
        first, least = (grain * round(mm / grain) for mm in (step, next_step))
        count = max(round((depth - step) / next_step), 0)
        rest = depth - first - count * least
        if rest <= 0.0 or depth - step - count * next_step >= ROUNDED:
            return step
        return first + math.ceil(rest / grain - 1e-6) * grain if next_step < step else math.ceil(
            depth / (count + 1) / grain - 1e-6) * grain

    def hole_feed(self, hole: Hole) -> float:
        """Feed of drilling down in a hole, as F states it; that of a tap keeps the pitch at the speed that is written."""
        return float(self.program.feed[hole.drill]) * (self.rounded if hole.key.startswith("TAP") else 1.0)

    def spindle_speed(self, asked: float) -> float:
        """The speed as S can state it, 1/min: more than 0 where it is asked for; decimals that are less than
        a part in ten thousand of it are left out, no spindle keeps them."""
        most = self.controller.format.speed_decimals
        places = min(most, max(SPEED_DIGITS - math.floor(math.log10(asked)), 0)) if asked > 0.0 else most
        return round(asked, places) or (10.0**-places if asked > 0.0 else 0.0)

    def cycle_of(self, hole: Hole) -> CannedCycle:
        """The controller's cycle for a hole."""
        spec = cycle_spec(self.controller, self.cycles[hole.cycle], hole.key)
        if spec is None:
            raise ValueError(f"the controller has no cycle {hole.key}, `holes_of` takes none without")
        return spec

    def cycle_values(self, hole: Hole) -> dict[str, float]:
        """The values that the text of a cycle may name (`CYCLE_VALUES`), lengths in the units of the program."""
        values = self._cycle_values(hole)
        return {name: value / self.controller.unit if name in CYCLE_LENGTHS else value for name, value in values.items()}

    def _cycle_values(self, hole: Hole) -> dict[str, float]:
        """The same in mm; the feed as F states it."""
        cycle, feed = self.cycles[hole.cycle], self.hole_feed(hole)
        surface = hole.plane_level - cycle.clearance
        depth = surface - hole.bottom
        step, least = self.peck_of(cycle, depth), min((*cycle.steps, depth))
        pitch = cycle.pitch or (feed * self.controller.feed_unit / abs(self.speed) if self.speed else 0.0)
        return {"retract": hole.retract, "surface": surface, "clearance": cycle.clearance, "bottom": hole.bottom,
                "depth": depth, "level": -depth, "step": step, "less": max(step - least, 0.0), "least": least,
                "breaks": float(math.ceil(depth / step)), "factor": -math.floor(1000.0 * least / step + 1e-6) / 1000.0,
                "relief": self.controller.cycles.peck_relief, "dwell": cycle.dwell, "feed": feed,
                "pitch": -pitch if hole.key == "TAP_LEFT" else pitch, "speed": abs(self.speed),
                "second": hole.retract - surface}

    @staticmethod
    def plain(value: float | str) -> str:
        """A number without an exponent or needless zeros."""
        return f"{float(value):.6f}".rstrip("0").rstrip(".")

    # ---- sections ------------------------------------------------------------------------------------------

    def mode_of(self, section: Section) -> Mode | None:
        """The controller's mode for the law of a section."""
        return getattr(self.controller.modes, section.law) if section.law != "axes" else None

    def enter(self, section: Section) -> Iterator[str]:
        """Blocks that switch the mode of a section on."""
        self.law = section.law
        mode = self.mode_of(section)
        if mode is None:
            return
        yield from self._length(mode.length, section.into)
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
        if holds:
            self.length_off = True
        else:
            yield from self._length(mode.length, section.out)
        for block in mode.leave:
            yield block.format(**self.section_values(section))
        self.restate()

    def _length(self, wanted: LengthState, height: float) -> Iterator[str]:
        """The length register off or on, where it is not; off in a block that states Z, the tool at `height` without it."""
        if wanted == "off" and self.register and not self.length_off:
            yield self.without_length(height)
        elif wanted == "on" and self.register and self.length_off:
            self.length_off = False
            yield self.controller.codes.length_offset.format(register=self.register)

    def without_length(self, height: float = math.nan) -> str:
        """The block that takes the length off, with the Z that makes it right however it moves; alone without one."""
        codes, self.length_off = self.controller.codes, True
        if math.isnan(height):
            return codes.length_cancel
        return self.space.join((codes.traverse, codes.length_cancel, f"Z{self.lengths(np.array([height]))[0]}"))

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


SHARE = 1e6
"""steps in an inch that a share of the tolerance is rounded down to where the control's decimals leave nothing"""
SPEED_DIGITS = 3
"""decimals of a speed from 1 to 10; one less each time that it is ten times as great"""
_SWITCH = re.compile(r"M\d+")
_ZEROS = re.compile(r"0+ ")
_MINUS_ZERO = re.compile(r"-0(?=\.?0* )")


NUMBER_ROOM = 12
"""characters that a block number may take"""


def comment_room(controller: ControllerFile) -> int:
    """Characters that a comment block holds, a block number before it counted."""
    style = controller.comment
    return controller.format.line_length - len(style.open) - len(style.close) - NUMBER_ROOM


def clean(controller: ControllerFile, text: str) -> str:
    """A comment's text without characters that it must not hold, cut to the line length."""
    forbidden = controller.comment.forbidden
    return "".join(" " if c in forbidden or not 32 <= ord(c) < 127 else c for c in text[:comment_room(controller)])


def plain_name(text: str) -> str:
    """A name as any block can hold it: letters, digits, blanks and - . _ alone."""
    return "".join(c if c.isascii() and (c.isalnum() or c in " -._") else "_" for c in text.strip())


def without_off(block: str, off: set[str]) -> str:
    """A block of the ending without what is off already, where it holds nothing but M codes."""
    words = block.split()
    if not all(_SWITCH.fullmatch(word) for word in words):
        return block
    return " ".join(word for word in words if word not in off)
