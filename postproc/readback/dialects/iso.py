"""Plain G-code: NIST RS274/NGC as LinuxCNC and generic ISO 6983 controls read it, and what Fanuc and Haas build on."""

from __future__ import annotations

from typing import Literal

import numpy as np

from postproc.readback.dialects.base import Reader, whole
from postproc.readback.macros.execution import MacroLanguage
from postproc.readback.text.canonical import (
    INCREMENTAL,
    LOADED,
    OFFSET,
    REGISTER,
    REST,
    SMOOTH,
    SMOOTH_LEVEL,
    TURNS,
    Canonical,
    ProgramText,
    added,
)
from postproc.readback.text.flow import Structure
from postproc.readback.text.modal import CYCLES, GROUPS, codes, columns, fill, number_of
from postproc.readback.text.words import Words, comma_words, tokenise
from toolpaths.arrays import Bools, Floats, Ints, among
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import MM_PER_INCH

New = list[tuple[int, str, float]]
"""words to add: block, letter, value"""
_OWN_LEVELS = 1000
"""from here on levels that the controller file knows by their words without an R, beyond the R and P of controls"""


class IsoReader(Reader):
    """Letters and numbers; rests in seconds (P), registers by H."""

    language: MacroLanguage | Literal[""] = "linuxcnc"
    rises_first = True
    stating = Reader.stating | {"arc_distance": "G91.1 or G90.1"}
    units_from = "the program before left them, or as its start-up code and the INI file have them"

    _stated: tuple[Words, Ints, Floats] | None = None
    """words, and their blocks and codes of units"""

    def tokens(self, data: bytes, file: str) -> tuple[ProgramText, list[Diagnostic]]:
        """The words of one file; O numbers name it and do nothing."""
        words, found = tokenise(data, file, self.comma_groups())
        return ProgramText(words.take(words.letter != ord("O"))), found

    def comma_groups(self) -> tuple[str, ...]:
        """Words of the control's smoothing that hold a comma."""
        return () if self.controller is None else tuple(text for text in self.controller.known_smoothing if "," in text)

    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """One program."""
        return whole(text), []

    def canonical(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words."""
        words, found = text.words, list[Diagnostic]()
        words, new = self.own_smoothing(words)
        drop = np.zeros(len(words.letter), dtype=bool)
        self.tools(words, new, line, file, found)
        self.rests(words, new, drop, line, file, found)
        self.paths(words, new)
        self.levels(words, new)
        self.radii(words, new)
        blocks, value = codes(words, "G", self.groups["offset"])
        new += [(int(b), OFFSET, float(v)) for b, v in zip(blocks, value, strict=True)]
        self.others(words, new, drop, line, file, found)
        words = self.arcs(relative_words(words, self.axes), new, drop)
        found += self.numbers(words.take(~drop), line, file)
        self._stated = None  # its words would stay with it
        return Canonical(added(words, new, drop), line), found

    def own_smoothing(self, words: Words) -> tuple[Words, New]:
        """Words without those of the control's smoothing that the controller file knows by what they may take, and that."""
        known = self.controller.known_smoothing if self.controller is not None else {}
        new, drop = list[tuple[int, str, float]](), np.zeros(len(words.letter), dtype=bool)
        for number, (text, mm) in enumerate(known.items(), _OWN_LEVELS):
            stated = [(ord(letter), value) for letter, value in comma_words(text)]
            level = next((value for letter, value in stated if letter == ord("R")), float(number))
            for k in np.flatnonzero((words.letter == stated[0][0]) & (words.value == stated[0][1])).tolist():
                rows = slice(k, k + len(stated))
                here = list(zip(words.letter[rows].tolist(), words.value[rows].tolist(), strict=True))
                if here == stated and words.line[k] == words.line[k + len(stated) - 1]:
                    drop[rows] = True
                    new += [(int(words.line[k]), SMOOTH, mm), (int(words.line[k]), SMOOTH_LEVEL, level)]
        return words.take(~drop) if new else words, new

    def check(self, words: Words, file: str) -> list[Diagnostic]:
        """Codes and words but for those that set the control's smoothing."""
        return super().check(self.own_smoothing(words)[0], file)

    def tools(self, words: Words, new: New, line: Ints, file: str, found: list[Diagnostic]) -> None:
        """Tools that M6 loads, and length registers by G43 H and G49."""
        tool, register = number_of(words, "T"), number_of(words, "H")
        change, _ = codes(words, "M", (6,))
        named = change[tool[change] >= 0]
        new += [(b, LOADED, number) for b, number in zip(named.tolist(), tool[named].tolist(), strict=True)]
        lost = change[~(tool[change] >= 0)]
        if len(lost):
            found.append(error("gcode.tool", "M6 without a tool number", file=file, lines=line[lost][:6].tolist(),
                               count=len(lost), hint="state T with its number in the block, or before it"))
        blocks, code = codes(words, "G", (43, 49))
        put = np.where(code == 43, np.nan_to_num(register[blocks], nan=-1.0), -1.0)
        new += [(b, REGISTER, h) for b, h in zip(blocks.tolist(), put.tolist(), strict=True)]

    def rests(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
              found: list[Diagnostic]) -> None:
        """G4: its word is no axis word, and counts as seconds."""
        for b in codes(words, "G", (4,))[0].tolist():
            low, high = np.searchsorted(words.line, [b, b + 1])
            drop[low:high] |= among(words.letter[low:high], [ord(a) for a in ("P", "X", "U")])
            seconds = self.seconds(words, low, high)
            if seconds is None:
                found.append(error("gcode.dwell", "G4 lacks P", file=file, lines=[int(line[b])],
                                   hint="state the time: " + self.dwell_hint))
            else:
                new.append((b, REST, seconds))

    dwell_hint = "G4 P0.5 (seconds)"

    def seconds(self, words: Words, low: int, high: int) -> float | None:
        """s of the dwell whose words are low..high; None where it states none."""
        here = np.flatnonzero(words.letter[low:high] == ord("P"))
        return float(words.value[low + here[0]]) if len(here) else None

    def paths(self, words: Words, new: New) -> None:
        """G61 none; G64 P blends within P and merges short lines within Q (P where it is not stated); P0 is no limit."""
        blocks, code = codes(words, "G", (61, 61.1, 64))
        for b, c in zip(blocks.tolist(), code.tolist(), strict=True):
            low, high = np.searchsorted(words.line, [b, b + 1])
            stated = {chr(a): float(v) for a, v in zip(words.letter[low:high], words.value[low:high], strict=True)}
            value = 0.0 if c != 64 else float("inf")
            if c == 64 and stated.get("P", 0.0) > 0.0 and stated.get("Q", 0.0) >= 0.0:
                value = stated["P"] + stated.get("Q", stated["P"])
            new.append((b, SMOOTH, value * self.units_at(words, b)))

    def units_at(self, words: Words, b: int) -> float:
        """mm of a unit of length at a block: 25.4 behind G20."""
        if self._stated is None or self._stated[0] is not words:
            self._stated = words, *codes(words, "G", (20, 21))
        _, blocks, code = self._stated
        at = int(np.searchsorted(blocks, b, side="right")) - 1
        return MM_PER_INCH if at >= 0 and code[at] == 20 else 1.0

    def levels(self, words: Words, new: New) -> None:
        """A fresh LinuxCNC's cycles return to R until G98 is stated (measured on 2.9; later it keeps the mode
        of the program before)."""
        cycles = codes(words, "G", CYCLES)[0]
        if self.controller is None or not self.controller.cycles.plane_at_start or not len(cycles):
            return
        stated = codes(words, "G", GROUPS["level"])[0]
        if not (stated <= cycles[0]).any():
            new.append((int(cycles[0]), "G", 99.0))

    def radii(self, words: Words, new: New) -> None:
        """Where D is not modal, G41 and G42 without it, or with D0, take the radius of the tool in the
        spindle (LinuxCNC, G-code reference)."""
        blocks, _ = codes(words, "G", (41, 42))
        if self.controller is None or self.controller.cutter_compensation.modal_register or not len(blocks):
            return
        change = codes(words, "M", (6,))[0]
        tool = fill(change, number_of(words, "T")[change], words.lines, np.nan)
        stated = columns(words, "D")[blocks, 0]
        new += [(b, "D", float(tool[b])) for b in blocks[~(stated > 0.0)].tolist() if tool[b] >= 0]

    def others(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
               found: list[Diagnostic]) -> None:
        """What a dialect has besides."""

    def numbers(self, words: Words, line: Ints, file: str) -> list[Diagnostic]:
        """Faults of the numbers of the words that are left."""
        return []

    def arcs(self, words: Words, new: New, drop: Bools) -> Words:
        """I, J, K count from the start unless G90.1 holds; P of an arc is the number of its turns."""
        motion = motion_of(words)
        absolute = fill(*codes(words, "G", (90.1, 91.1)), words.lines, 91.1) == 90.1
        center = among(words.letter, [ord(c) for c in "IJK"]) & ~among(motion, CYCLES)[words.line]
        letter = words.letter.copy()
        letter[center & ~absolute[words.line]] += INCREMENTAL
        turns = among(motion, (2, 3))[words.line] & (words.letter == ord("P"))
        new += [(int(b), TURNS, float(v) - 1.0) for b, v in zip(words.line[turns], words.value[turns], strict=True)]
        return Words(letter, words.value, words.line, words.lines, words.point)


def motion_of(words: Words) -> Floats:
    """(B + 1,) code of motion in force."""
    return fill(*codes(words, "G", GROUPS["motion"]), words.lines, 1.0)


def relative_words(words: Words, axes: tuple[str, ...]) -> Words:
    """Words with axis words, and R of cycles, in small letters where G91 holds."""
    blocks, code = codes(words, "G", (90, 91))
    if not (code == 91).any():
        return words
    relative = fill(blocks, code, words.lines, 90.0) == 91
    machine = np.zeros(words.lines + 1, dtype=bool)
    machine[codes(words, "G", (53,))[0]] = True
    cycle = among(motion_of(words), CYCLES)
    axis = among(words.letter, [ord(a) for a in axes]) | (cycle[words.line] & (words.letter == ord("R")))
    letter = words.letter.copy()
    letter[axis & (relative & ~machine)[words.line]] += INCREMENTAL
    return Words(letter, words.value, words.line, words.lines, words.point)
