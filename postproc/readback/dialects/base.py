"""What every dialect does: text to words, words to blocks in running order, blocks to canonical words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import ClassVar, Literal

import numpy as np

from machines.choices import Stop
from machines.machine import ClampCodes
from postproc.control.control import InterpolationMode
from postproc.control.rollover import Rollover
from postproc.controllers.model import ControllerFile, Stops
from postproc.readback.macros.execution import MacroLanguage, executed, in_source, needed
from postproc.readback.macros.held import Held, most_now
from postproc.readback.text.canonical import (
    COOLANT,
    EXTENDED_OFFSETS,
    LOADED,
    SMOOTH_LEVEL,
    STANDS,
    Canonical,
    ProgramText,
    added,
    offset_number,
    placed,
)
from postproc.readback.text.clamps import clamp_numbers, two_meanings
from postproc.readback.text.flow import Structure, expand
from postproc.readback.text.magnitude import negative_smoothing, too_large
from postproc.readback.text.modal import GROUPS, Groups, check_codes, check_end, codes, drop_passive
from postproc.readback.text.not_executed import named
from postproc.readback.text.rollover import unrolled
from postproc.readback.text.tool_names import numbered_tools
from postproc.readback.text.words import Words
from postproc.reference.coolant import ALL, switched_by
from toolpaths.arrays import Floats, Ints, among, distinct
from toolpaths.diagnostics import Diagnostic, has_errors, warning

ParsedProgram = tuple[ProgramText, Structure]
UNITS_UNSTATED = "gcode.units_unstated"
ASSUMED = frozenset({"gcode.second_reference", "gcode.tool_name", "gcode.offset_unstated", "gcode.comparison", "gcode.skip",
                     "gcode.iso_units"})
"""what is taken to be so where a program is timed, and refused where it is verified"""
STOPS = (0.0, 1.0)
"""M codes of stops"""
M_CODES = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 30.0)


class Reader(ABC):
    """Reads the programs of one dialect; the numbers of its codes are data of the class.

    Attributes:
        groups: G codes that it executes, by group; m_codes; letters: words that are no axes
        rises_first: canned cycles as RS274/NGC has them, see `Offsets`
        arc_slack: mm by which the radius may differ between the ends of an arc
        sides, smoothing_hint: what the control calls cutter compensation and its own smoothing
        neutral: statements that change nothing of what is read back
        statements: first words of those that it knows
        units_codes, units_from: what states mm or inches, and what says them where nothing does
        units_stay: that is a setting of the control, which no program changes
        stating: by group, the words that state it; a block that relies on one that nothing states is an error in `verify`
        leaving: by law, the codes that switch it off; modes_named: what the control calls it
        home_in_planes: machine coordinates are what they say in a tilted plane that the program before has left on too
        lost_by: codes of laws with which the work offset may be lost: it is stated again before the next move in it
        stop: what M0 and M1 switch off, by the controller file or by that of the machine (`[control] stop`)
        changes: what a tool change switches off
        clamps: codes of the clamps that programs work, by axis
        language: of macros, "" for none
        rolls: modulo axes by joint; turn_codes: M126 and M127 say which path they take
    """

    groups: Groups = GROUPS
    m_codes: tuple[float, ...] = M_CODES
    letters = "GMFSTHDNIJKRPQLO"
    language: MacroLanguage | Literal[""] = ""
    rises_first = False
    turn_codes = False
    home_in_planes = False
    arc_slack = float("inf")
    sides: ClassVar[dict[int, str]] = {40: "off (G40)", 41: "left (G41)", 42: "right (G42)"}
    alone = "{}"
    """a program of given blocks"""
    smoothing_hint = "G64 P Q as the post writes it, or G61"
    neutral: ClassVar[frozenset[str]] = frozenset()
    statements: ClassVar[frozenset[str]] = frozenset()
    units_codes = "G20 or G21"
    units_from = "the program before left them"
    units_stay = False
    stating: ClassVar[dict[str, str]] = {
        "motion": "G0 or G1", "plane": "G17, G18 or G19", "distance": "G90 or G91", "feed_mode": "G93, G94 or G95",
        "compensation": "G40", "length": "G49, or G43 with H", "level": "G98 or G99",
        "offset": "the work offset (G54 ...)"}
    leaving: ClassVar[dict[InterpolationMode, tuple[str, ...]]] = {}
    lost_by: ClassVar[frozenset[str]] = frozenset()
    modes_named: ClassVar[dict[InterpolationMode, str]] = {"tcp": "the tool-centre-point mode",
                                                               "tilted": "the tilted plane"}

    def __init__(self, axes: tuple[str, ...], controller: ControllerFile | None = None, home: Floats | None = None,
                 stop: Stop | Literal[""] = "", rolls: dict[int, Rollover] | None = None,
                 clamps: Mapping[str, ClampCodes] | None = None) -> None:
        self.clamps = clamps or {}
        self.axes, self.controller, self.home, self.rolls = axes, controller, home, rolls or {}
        stops = controller.stops if controller is not None else Stops()
        self.stop, self.changes = stop or stops.switch_off, stops.tool_change
        self.main_file = ""
        self.passive = controller.program.passive if controller is not None else ()
        self.work: Callable[[float], Floats] | None = None
        self.lengths: dict[int, float] = {}
        self.stated: frozenset[float] | None = None
        self.switches = switched_by(controller.codes if controller is not None else None)
        """(bits on, bits off) by M number, see `postproc.reference.coolant`"""

    @abstractmethod
    def tokens(self, data: bytes, file: str) -> tuple[ProgramText, list[Diagnostic]]:
        """The words of one file."""

    @abstractmethod
    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """Its programs, and what they call."""

    @abstractmethod
    def canonical(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words of blocks that stand in running order."""

    def offset_of(self, text: str) -> float:
        """The number of a work offset as the controller writes it."""
        return offset_number(text)

    def offset_name(self, number: float) -> str:
        """What the control calls the work offset of a number."""
        return f"G{number:g}" if number < EXTENDED_OFFSETS else f"G54.1 P{number - EXTENDED_OFFSETS:g}"

    def behind_end(self, structure: Structure) -> tuple[tuple[int, int], ...]:
        """Lines that may stand behind the end of the program: those of subprograms."""
        return tuple(structure.subprograms.values())

    def check(self, words: Words, file: str) -> list[Diagnostic]:
        """Codes and words that cannot be executed, as errors."""
        own = (*self.m_codes, *self.switches)
        found = check_codes(words, self.groups, (*own, *clamp_numbers(self.clamps)), self.letters,
                            self.axes, file)
        return [*found, *two_meanings(self.clamps, own, file)]

    def in_macros(self, data: bytes) -> bool:
        """True where a file has variables, loops or calls that only their execution explains."""
        return self.language != "" and needed(data, self.language, self.passive)

    def read(self, data: bytes | str, file: str = "", others: Mapping[str, bytes] | None = None,
             ) -> tuple[Canonical | None, list[Diagnostic]]:
        """A program, with the files of its subprograms by name, as canonical words; None where it cannot be read."""
        code, found = self._read(data, file, others)
        return code, named(found, as_bytes(data), self.language, file) if has_errors(found) else found

    def _read(self, data: bytes | str, file: str, others: Mapping[str, bytes] | None,
              ) -> tuple[Canonical | None, list[Diagnostic]]:
        self.main_file = file
        if self.in_macros(as_bytes(data)):
            return self.executed(as_bytes(data), file, others or {})
        found: list[Diagnostic] = []
        programs: dict[str, ParsedProgram] = {}
        waiting: dict[str, bytes | str] = {file: data}
        others = others or {}
        stems = {PurePath(name).stem.upper(): name for name in others}
        while waiting:
            name = next(iter(waiting))
            if programs and self.in_macros(as_bytes(waiting[name])):
                return self.executed(as_bytes(data), file, others)
            numbered, more = self.numbered(as_bytes(waiting.pop(name)), name)
            found += more
            read, more = self.program(numbered, name) if not has_errors(more) else (None, [])
            found += more
            if read is None:
                return None, found
            programs[name] = read
            wanted = {stems[s] for call in programs[name][1].calls.values() for s in self.stems(call.name) if s in stems}
            waiting |= {n: others[n] for n in sorted(wanted - set(programs) - set(waiting))}
        texts, structures = zip(*programs.values(), strict=True)
        text, line, more = expand(list(texts), list(structures), file, most_now())
        before = np.cumsum([0, *(t.words.lines for t in texts)]).tolist()
        files = tuple(zip(programs, before, strict=False)) if len(programs) > 1 else ()
        if has_errors(more):
            return None, [*found, *more]
        code, last = self.judged(text, line, file)
        return replace(code, files=files), [*found, *more, *placed(last, files)]

    def smoothing_level(self, blocks: tuple[str, ...]) -> float:
        """The level that blocks of the controller file set the control's own smoothing to, NaN for none."""
        text = "\n".join(blocks).format(tolerance="1", chain="1", axis="1") + "\n"
        code, _ = self.read(self.alone.format(text))
        stated = np.zeros(0) if code is None else code.words.pick(SMOOTH_LEVEL)[1]
        return float(stated[-1]) if len(stated) else float("nan")

    def executed(self, data: bytes, file: str, others: Mapping[str, bytes]) -> tuple[Canonical | None, list[Diagnostic]]:
        """A program in macro language, as the plain blocks that it comes to."""
        assert self.language
        held = Held(self.axes, self.home, self.work, self.lengths,
                    self.controller.tools.names if self.controller is not None else {}, self.passive, most_now(),
                    self.stated)
        program, found = executed(data, file, others, self.language, held, self.numbered)
        if program is None:
            return None, found
        read, more = self.program(program.text, file)
        found += in_source(more, program)
        if read is None or has_errors(more):
            return None, found
        code, last = self.judged(read[0], program.line, file)
        return replace(code, files=program.files), [*found, *placed(last, program.files)]

    def given(self, work: Callable[[float], Floats], lengths: dict[int, float], stated: frozenset[float]) -> None:
        """What the control holds by the set-up: work offsets (J,) by register, tool lengths by register, mm; registers that
        the set-up states."""
        self.work, self.lengths, self.stated = work, lengths, stated

    def judged(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words of blocks in running order, their units and smoothing looked at."""
        code, last = self.translated(text, line, file)
        return code, [*self.units(code, file), *negative_smoothing(code, file), *last]

    def numbered(self, data: bytes, file: str) -> tuple[bytes, list[Diagnostic]]:
        """The program with numbers in the place of the names of tools, where the control knows names."""
        if self.controller is None or not self.controller.codes.tool_by_name:
            return data, []
        return numbered_tools(data, self.controller.tools.names, file)

    def translated(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words of blocks in running order, with what turns and flows behind stops."""
        code, found = self.canonical(text, line, file)
        words, more = unrolled(code.words, line, self.axes, self.rolls, self.home, self.turn_codes, file)
        kept = self.controller is not None and self.controller.feed.kept_by_units
        words = added(words, [*self.stopped(words), *self.cooled(words)])
        return replace(code, words=words, feed_kept=kept), [*found, *more]

    def stopped(self, words: Words) -> list[tuple[int, str, float]]:
        """(block, letter, value) of the blocks before which the control itself has stopped the spindle."""
        return [] if self.stop == "nothing" else [(b, STANDS, 1.0) for b in _behind_stops(words)]

    def cooled(self, words: Words) -> list[tuple[int, str, float]]:
        """The same of what flows from each block on that switches coolant, in the order of the codes: a
        tool change acts before the codes of its block, a stop behind them."""
        blocks, numbers = codes(words, "M", tuple(self.switches))
        events = [(int(b), 1, *self.switches[float(m)]) for b, m in zip(blocks, numbers, strict=True)]
        if self.changes == "spindle and coolant":
            events += [(int(b), 0, 0, ALL) for b in distinct(words.pick(LOADED)[0])]
        if self.stop == "spindle and coolant":
            events += [(b, 0, 0, ALL) for b in _behind_stops(words)]
        new, flowing = [], 0
        for block, _, on, off in sorted(events, key=lambda e: e[:2]):
            flowing = flowing & ~off | on
            new.append((block, COOLANT, float(flowing)))
        return new

    def units(self, code: Canonical, file: str) -> list[Diagnostic]:
        """Axis words before any code says whether they are mm."""
        words = code.words
        stated = codes(words, "G", GROUPS["units"])[0].min(initial=words.lines + 1)
        letters = [ord(a) for axis in self.axes for a in (axis, axis.lower())]
        blocks = distinct(words.line[among(words.letter, letters) & (words.line < stated)])
        return [self.unstated(file, int(code.line[blocks[0]]), len(blocks))] if len(blocks) else []

    def unstated(self, file: str, line: int, count: int = 1) -> Diagnostic:
        """Words that are read as mm though nothing says so; `verify` makes an error of it where the state is left over."""
        return warning(UNITS_UNSTATED, f"axis words before any {self.units_codes}, read as mm: mm or inches as "
                       f"{self.units_from}", file=file, lines=[line], count=count,
                       hint=f"state {self.units_codes} before the first of them")

    def program(self, data: bytes, name: str) -> tuple[ParsedProgram | None, list[Diagnostic]]:
        """Words and programs of one file; None where its text cannot be read."""
        text, found = self.tokens(data, name)
        del data
        found += too_large(text, name)
        if has_errors(found):
            return None, found
        if self.controller is not None:
            text = ProgramText(drop_passive(text.words, self.controller.program.passive), text.statements)
        structure, more = self.structure(text, name)
        found += [*more, *self.check(text.words, name)]
        if name == self.main_file:
            found += check_end(text.words, name, self.behind_end(structure))
            structure.main = _to_end(text.words, structure.main)
        return (text, structure), found

    def stems(self, call: str) -> tuple[str, ...]:
        """Names that the file of a subprogram may have, in capitals, without their ending."""
        return (call,)


def as_bytes(text: bytes | str) -> bytes:
    """The bytes of a text."""
    return text if isinstance(text, bytes) else text.encode()


def _to_end(words: Words, main: tuple[int, int]) -> tuple[int, int]:
    """The lines of a main program to its first M2 or M30."""
    ends, _ = codes(words, "M", (2, 30))
    ends = ends[ends >= main[0]]
    return main if not len(ends) or int(words.line[-1]) == int(ends[0]) else (main[0], min(main[1], int(ends[0])))


def _behind_stops(words: Words) -> list[int]:
    """The blocks that follow a stop."""
    return [int(b) + 1 for b in distinct(codes(words, "M", STOPS)[0]) if b < words.lines]


def whole(text: ProgramText) -> Structure:
    """A file that is one program without subprograms."""
    return Structure((1, text.words.lines))
