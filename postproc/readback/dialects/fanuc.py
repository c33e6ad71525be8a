"""Fanuc Series 30i, machining centre system, and what Haas shares with it.

Rules beyond RS274/NGC, from the user's manual B-64484EN (functions by their names there). Dwell: P in ms or X in s. Decimal
point programming: what a number without a point means is a parameter; it is refused. Canned cycles: over the hole first,
then to R; K repeats, P in ms. Subprogram call: M98 P L, M99. Tool center point control: G43.4 H, left by G49. Tilted working
plane command: G68.2 X Y Z I J K, Euler angles about Z, the new X, the new Z; G53.1 aligns the tool; left by G69. AI contour
control: G5.1 Q1, whose tolerance is a parameter. Reference position: G28. Inch and metric: G20 and
G21 stay in force over power off. G80 is of group 09, as the cycles are that it ends: it may stand next to G00, and the code
of group 01 holds behind it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import ClassVar, Literal

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.base import M_CODES, Reader
from postproc.readback.dialects.iso import IsoReader, New, motion_of
from postproc.readback.macros.execution import MacroLanguage
from postproc.readback.text.canonical import (
    LAW,
    OFFSET,
    REGISTER,
    SMOOTH,
    SMOOTH_LEVEL,
    Canonical,
    ProgramText,
    WordMeaning,
    offset_number,
)
from postproc.readback.text.euler_angles import turned
from postproc.readback.text.flow import Call, Structure
from postproc.readback.text.modal import CYCLES, GROUPS, Groups, codes, fill, number_of
from postproc.readback.text.words import Words, tokenise
from toolpaths.arrays import Bools, Ints, among
from toolpaths.diagnostics import Diagnostic, error

MILLISECONDS = 1e-3
_LAWS = (43.0, 43.4, 49.0, 53.1, 68.2, 69.0)

FanucState = Literal[InterpolationMode, "pending"]
"""pending: behind G68.2, before G53.1"""


class FanucReader(IsoReader):
    """G-code of the Fanuc kind."""

    groups: Groups = GROUPS | {
        "offset": (54, 55, 56, 57, 58, 59, 54.1), "length": (43, 43.4, 49), "path": (5.1, 61, 64), "tilt": (68.2, 69),
        "once": (4, 9, 28, 53, 53.1), "arc_distance": ()}
    m_codes = (*M_CODES, 29.0, 98.0, 99.0)
    letters = "GMFSTHDNIJKRPQLO"
    language: MacroLanguage | Literal[""] = "fanuc"
    rises_first = False
    home_in_planes = True
    stating = Reader.stating
    leaving: ClassVar[dict[InterpolationMode, tuple[str, ...]]] = {"tilted": ("G69",)}
    laws: ClassVar[tuple[float, ...]] = _LAWS
    tcp_code = 43.4
    extended_offset = 54.1
    last_offset = 300
    """of G54.1 P (B-64484EN: 48, or 300 as an option)"""
    repeats = "K"
    units_from = "the program before left them, also over power off"
    smoothing_hint = "G05.1 Q1 as the post writes it, or G61"

    def tokens(self, data: bytes, file: str) -> tuple[ProgramText, list[Diagnostic]]:
        """The words of one file, program numbers among them."""
        words, found = tokenise(data, file, self.comma_groups())
        return ProgramText(words), found

    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """Programs begin at O numbers and return at M99; M98 P runs one, L times."""
        words = text.words
        starts, numbers = words.pick("O")
        back, _ = codes(words, "M", (99,))
        ends = [*(starts[1:] - 1).tolist(), words.lines]
        spans = {f"O{int(n)}": (int(a), int(b)) for n, a, b in zip(numbers, starts, ends, strict=False)}
        main = (1, ends[0] if len(starts) else words.lines)
        own = file == self.main_file
        if not len(starts) and not own:
            spans = {PurePath(file).stem.upper(): main}
        found = [error("gcode.subprogram", "M99 in the main program starts it again", file=file, lines=[int(b)],
                       hint="write M30") for b in back if own and main[0] <= b <= main[1] and not self.local(words, int(b))]
        subprograms = {name: _returns(span, back) for name, span in spans.items() if not own or span[1] > main[1]}
        return Structure(main, {k: v for k, v in subprograms.items() if v[1]}, self.calls(words)), found

    def local(self, words: Words, back: int) -> bool:
        """True where an M99 ends a subprogram inside of the main program."""
        return False

    def stems(self, call: str) -> tuple[str, ...]:
        """O77 may be in O77, O0077, O00077 (Haas), 77, 0077."""
        number = int(call[1:]) if call[1:].isdigit() else -1
        return call, f"O{number:04d}", f"O{number:05d}", f"{number}", f"{number:04d}"

    def calls(self, words: Words) -> dict[int, Call]:
        """M98 P of four digits L, or P with the number of times before the last four."""
        result = {}
        for b in codes(words, "M", (98,))[0].tolist():
            stated = block(words, b)
            number, times = int(stated.get("P", -1.0)), int(stated.get("L", 1.0))
            if number > 9999 and "L" not in stated:
                number, times = number % 10000, number // 10000
            result[b] = Call(b, f"O{number}", times)
        return result

    def canonical(self, text: ProgramText, line: Ints, file: str) -> tuple[Canonical, list[Diagnostic]]:
        """Canonical words; laws in order."""
        self.held: list[WordMeaning] = []
        code, found = super().canonical(replace(text, words=behind_cycles(text.words)), line, file)
        return Canonical(code.words, line, tuple(self.held)), found

    def check(self, words: Words, file: str) -> list[Diagnostic]:
        """Codes and words, G80 and a code of motion in one block among them."""
        return super().check(behind_cycles(words), file)

    def numbers(self, words: Words, line: Ints, file: str) -> list[Diagnostic]:
        """Lengths without a decimal point, whose meaning is a parameter of the control; whole numbers with one."""
        if words.point is None:
            return []
        return self._bare(words, words.point, line, file) + self._pointed(words, words.point, line, file)

    def _pointed(self, words: Words, point: Bools, line: Ints, file: str) -> list[Diagnostic]:
        bad = point & np.isin(words.letter, [ord(a) for a in "STHD"])
        blocks = words.line[bad]
        if not len(blocks):
            return []
        letter = chr(words.letter[int(np.flatnonzero(bad)[0])])
        return [error("gcode.decimal_point", f"{letter} with a decimal point: the control stops there", file=file,
                      lines=line[blocks][:6].tolist(), count=len(blocks), hint="write a whole number")]

    def _bare(self, words: Words, point: Bools, line: Ints, file: str) -> list[Diagnostic]:
        meant = "".join(self.axes) + "IJKRQ"
        bare = ~point & (words.value != 0.0) & np.isin(words.letter,
                                                             [ord(a) for a in meant + meant.lower()])
        blocks = words.line[bare]
        if not len(blocks):
            return []
        k = int(np.flatnonzero(bare)[0])
        return [error("gcode.decimal_point", f"{chr(words.letter[k]).upper()}{words.value[k]:g} has no decimal point: "
                      f"{words.value[k]:g} or {words.value[k] * MILLISECONDS:g}, as a parameter of the control has it",
                      file=file, lines=line[blocks][:6].tolist(), count=len(blocks), hint="write the decimal point")]

    def arcs(self, words: Words, new: New, drop: Bools) -> Words:
        """Centres from the start; P and K of canned cycles as RS274/NGC has them."""
        words = super().arcs(words, [], drop)
        cycle = np.isin(motion_of(words), CYCLES)[words.line]
        letter, value = words.letter.copy(), words.value.copy()
        letter[cycle & (letter == ord(self.repeats))] = ord("L")
        rest = np.flatnonzero(cycle & (letter == ord("P")))
        value[rest] = [self.time(words, int(k)) for k in rest]
        return Words(letter, value, words.line, words.lines, words.point)

    dwell_hint = "G4 P500 (ms)"

    def time(self, words: Words, k: int) -> float:
        """s of a P word."""
        return float(words.value[k]) * MILLISECONDS

    def seconds(self, words: Words, low: int, high: int) -> float | None:
        """P in ms; X in s, in ms without a point."""
        for k in range(low, high):
            if words.letter[k] == ord("P"):
                return self.time(words, k)
            if words.letter[k] in (ord("X"), ord("U")):
                point = words.point is None or bool(words.point[k])
                return float(words.value[k]) * (1.0 if point else MILLISECONDS)
        return None

    def paths(self, words: Words, new: New) -> None:
        """G5.1 Q1: as much as the controller file says that its parameters allow; Q0, G61: none."""
        fixed = self.controller.kinematics.smoothing_fixed if self.controller is not None else None
        for b, c in zip(*codes(words, "G", (5.1, 61)), strict=True):
            on = c == 5.1 and block(words, int(b)).get("Q", 0.0) == 1.0
            new.append((int(b), SMOOTH, (float("inf") if fixed is None else fixed) if on else 0.0))
            new.append((int(b), SMOOTH_LEVEL, block(words, int(b)).get("R", 0.0) if on else float("nan")))

    def others(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
               found: list[Diagnostic]) -> None:
        """Laws, extended work offsets, the reference position, coolant through the tool."""
        for b in codes(words, "G", (self.extended_offset,))[0].tolist():
            number = block(words, b).get("P", 0.0)
            new.append((b, OFFSET, offset_number(f"G54.1 P{number:g}")))
            if number not in range(1, self.last_offset + 1):
                found.append(error("gcode.offset", f"G{self.extended_offset:g} P{number:g}: there is no such work offset",
                                   file=file, lines=[int(line[b])], hint=f"P1 to P{self.last_offset}"))
        laws = codes(words, "G", (5.1,))[0]
        level = np.isin(words.letter, [ord("Q"), ord("R")]) & np.isin(words.line, laws)
        if words.point is not None and (words.point & level).any():
            found.append(error("gcode.decimal_point", "Q or R of G05.1 with a decimal point: its page has whole numbers",
                               file=file, lines=line[words.line[words.point & level]][:6].tolist(),
                               hint="write a whole number"))
        for b in laws.tolist():
            self.contour_control(take(words, drop, b, "QR"), int(line[b]), file, found)
        self.modes(words, new, drop, line, file, found)
        self.reference(words, new, drop, line, file, found)
        self.machine_moves(words, line, file, found)
        self.taps(words, line, file, found)

    def contour_control(self, stated: dict[str, float], line: int, file: str,
                        found: list[Diagnostic]) -> None:
        """G5.1 Q1, with R1 to R10 where the control has that, or Q0."""
        if stated.get("Q") not in (0.0, 1.0) or stated.get("R", 1.0) not in range(1, 11):
            said = " ".join(f"{a}{v:g}" for a, v in stated.items()) or "nothing"
            found.append(error("gcode.smoothing", f"G05.1 with {said}", file=file, lines=[line],
                               hint="write G05.1 Q1, or G05.1 Q0"))

    def taps(self, words: Words, line: Ints, file: str, found: list[Diagnostic]) -> None:
        """G74 and G84 tap rigidly only behind M29 (B-63944EN-2, rigid tapping), which ends with the next code of motion."""
        if self.controller is None or not self.controller.codes.rigid_tap.startswith("M29"):
            return
        blocks, code = codes(words, "G", self.groups["motion"])
        rigid = codes(words, "M", (29,))[0]
        taps = np.flatnonzero(np.isin(code, (74, 84)))
        before = np.where(taps > 0, blocks[taps - 1], 0)
        again = (taps > 0) & np.isin(code[taps - 1], (74, 84))
        bare = ~again & (np.searchsorted(rigid, before, side="left") == np.searchsorted(rigid, blocks[taps], side="right"))
        if bare.any():
            found.append(error("gcode.rigid_tap", "tapping without M29: feed and spindle are not coupled", file=file,
                               lines=line[blocks[taps[bare]]][:6].tolist(), count=int(bare.sum()),
                               hint="write M29 S in the block before"))

    def modes(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
              found: list[Diagnostic]) -> None:
        """The laws, code by code in running order."""
        register = number_of(words, "H")
        state: FanucState = "axes"
        begun, length, lost = -1, -1.0, False
        for b, c in zip(*codes(words, "G", self.laws), strict=True):
            here, code = int(b), f"G{c:g}"
            wrong, remedy = self.wrong(float(c), state, length)
            if wrong:
                if not (lost and c == 53.1):  # follows from a G68.2 that was refused
                    found.append(error("gcode.mode", f"{code} {wrong}", file=file, lines=[int(line[here])], hint=remedy))
                lost = c == 68.2
                continue
            if c in (43, self.tcp_code):
                length = float(np.nan_to_num(register[here], nan=-1.0))
                new.append((here, REGISTER, length))
            if c == self.tcp_code:
                state = self.hold(new, here, WordMeaning("tcp", code), "tcp")
            elif c == 49:
                length = -1.0
                state = self.hold(new, here, WordMeaning("axes", code), "axes") if state == "tcp" else state
            elif c in (69, 255):
                state = self.hold(new, here, WordMeaning("axes", code), "axes")
            elif c == 254:
                state = self.hold(new, here, WordMeaning("tilted", code), "tilted")
            elif c == 68.2:
                plane, state, begun = self.plane(words, drop, here, line, file, found), "pending", here
            elif c == 53.1:
                state = self.hold(new, here, plane, "tilted")
                self.unmoved(words, begun, here, line, file, found)

    def wrong(self, code: float, state: FanucState, length: float) -> tuple[str, str]:
        """Why a law's code cannot stand here ("" where it can), and what to do."""
        if code == 53.1:
            return ("", "") if state == "pending" else (
                "without G68.2 before it", "write G68.2 X Y Z I J K in the block before")
        if length >= 0.0 and (code == 68.2 or (code == 69 and state == "tilted")):
            return "while a length offset is in force", "write G49 before it"
        if code in (68.2, 254, self.tcp_code) and state != "axes":
            return "while another mode is on", f"cancel that: write {'G49' if state == 'tcp' else 'G69 or G255'} before it"
        return ("between G68.2 and G53.1", "write G53.1 first") if state == "pending" and code != 69 else ("", "")

    def hold(self, new: New, b: int, law: WordMeaning, state: InterpolationMode) -> InterpolationMode:
        """The law in force from block b on."""
        new.append((b, LAW, float(len(self.held))))
        self.held.append(law)
        return state

    def plane(self, words: Words, drop: Bools, b: int, line: Ints, file: str,
              found: list[Diagnostic]) -> WordMeaning:
        """G68.2 X Y Z I J K: zero of the plane, Euler angles."""
        stated = take(words, drop, b, "XYZIJKPQR")
        if set(stated) & set("PQR"):
            found.append(error("gcode.mode", "G68.2 by other than Euler angles is not executed by this reader", file=file,
                               lines=[int(line[b])], hint="write G68.2 X Y Z I J K"))
        shift = np.array([stated.get(a, 0.0) for a in "XYZ"]) * self.units_at(words, b)
        return WordMeaning("tilted", "G68.2", turned("ZXZ", [stated.get(a, 0.0) for a in "IJK"]), shift)

    def unmoved(self, words: Words, first: int, last: int, line: Ints, file: str,
                found: list[Diagnostic]) -> None:
        """Nothing moves between the plane and the tool's alignment; G53.1 P picks another solution."""
        low, high = np.searchsorted(words.line, [first + 1, last + 1])
        bad = np.isin(words.letter[low:high], [ord(a) for a in (*self.axes, "P")]) & (words.value[low:high] != 0.0)
        if bad.any():
            found.append(error("gcode.mode", "motion or a choice of solution between G68.2 and G53.1 is not executed by "
                               "this reader", file=file, lines=[int(line[words.line[low:high][bad][0]])],
                               hint="write G53.1 alone, right behind G68.2"))

    def reference(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
                  found: list[Diagnostic]) -> None:
        """G91 G28 Z0.: rapidly to the reference position, which is the machine's home; through a point is refused."""
        blocks, mode = codes(words, "G", (90, 91))
        motions, motion = codes(words, "G", self.groups["motion"])
        for b in codes(words, "G", (28,))[0].tolist():
            at = int(np.searchsorted(blocks, b, side="right")) - 1
            stated = take(words, drop, b, "".join(self.axes))
            if at < 0 or mode[at] != 91 or any(stated.values()) or self.home is None:
                found.append(error("gcode.reference", "G28 through a point", file=file, lines=[int(line[b])],
                                   hint="write G91 G28 Z0."))
                continue
            new += [(b, "G", 53.0), (b, "G", 0.0)]
            unit = self.units_at(words, b)
            new += [(b, a, float(self.home[self.axes.index(a)]) / (1.0 if a in "ABC" else unit)) for a in stated]
            k = int(np.searchsorted(motions, b, side="right")) - 1
            if b + 1 not in motions and k >= 0 and b < words.lines:
                new.append((b + 1, "G", float(motion[k])))

    def machine_moves(self, words: Words, line: Ints, file: str, found: list[Diagnostic]) -> None:
        """G53 runs rapidly whatever the code of motion."""
        motion = motion_of(words)
        blocks = codes(words, "G", (53,))[0]
        bad = blocks[motion[blocks] != 0]
        if len(bad):
            found.append(error("gcode.machine_position", "G53 while G0 is not in force", file=file,
                               lines=line[bad][:6].tolist(), count=len(bad), hint="write G53 G0, in this order"))


def behind_cycles(words: Words) -> Words:
    """Words whose G80 is the line or rapid in force: none next to another code of motion; where an arc or nothing is in
    force itself."""
    ends = (words.letter == ord("G")) & (words.value == 80.0)
    if not ends.any():
        return words
    blocks, code = codes(words, "G", (0, 1, 2, 3))
    before = fill(blocks, code, words.lines, np.nan)[words.line]
    straight = ends & among(before, (0.0, 1.0))
    return replace(words, value=np.where(straight, before, words.value)).take(~(ends & np.isin(words.line, blocks)))


def block(words: Words, b: int) -> dict[str, float]:
    """The words of a block by letter, the last of each."""
    low, high = np.searchsorted(words.line, [b, b + 1])
    return {chr(a): float(v) for a, v in zip(words.letter[low:high], words.value[low:high], strict=True)}


def take(words: Words, drop: Bools, b: int, letters: str) -> dict[str, float]:
    """Words of a block that belong to one of its codes: they are no others' any more."""
    low, high = np.searchsorted(words.line, [b, b + 1])
    mine = np.isin(words.letter[low:high], [ord(a) for a in letters])
    drop[low:high] |= mine
    return {chr(a): float(v) for a, v in zip(words.letter[low:high][mine], words.value[low:high][mine], strict=True)}


def _returns(span: tuple[int, int], back: Ints) -> tuple[int, int]:
    """A program's lines to its M99, (first, 0) where it has none."""
    inside = back[(back >= span[0]) & (back <= span[1])]
    return span[0], int(inside[0]) if len(inside) else 0


