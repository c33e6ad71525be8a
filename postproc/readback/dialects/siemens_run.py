"""The statements of a SINUMERIK program in running order: modes, planes, cycles, machine coordinates."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from operator import itemgetter

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.iso import New
from postproc.readback.dialects.siemens_cycles import CYCLES, drill_of
from postproc.readback.dialects.siemens_polynomials import Polynomials
from postproc.readback.text.canonical import (
    CALL,
    LAW,
    SMOOTH,
    SMOOTH_AXIS,
    SMOOTH_LEVEL,
    STATEMENT,
    DialectStatement,
    Drill,
    ProgramText,
    RotaryDirection,
    WordMeaning,
)
from postproc.readback.text.euler_angles import turned
from postproc.readback.text.modal import codes, fill, number_of
from postproc.readback.text.words import Words
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import MM_PER_INCH

LENGTH_AXIS = "$SC_TOOL_LENGTH_CONST"
"""SD42940: 17 keeps the tool length along Z in every plane, from the next D on (NC programming, tool length
and plane change); otherwise it turns with G18 and G19"""
ROUNDED, ROUNDED_RAPID = "[", "]"
"""words ADIS and ADISPOS: how far from the corner rounding may begin, at feed and at rapid"""
TURNING = (3.0, 4.0, 5.0)
_BY_DISTANCE = (641.0, 645.0)
_LEVELS = {"_ROUGH": 1.0, "_SEMIFIN": 2.0, "_FINISH": 3.0}
"""of CYCLE832, with _ORI before them too (Cycles 3.25)"""
_FIRST = itemgetter(0)
_SEQUENCE = {1: "X", 2: "Y", 3: "Z"}


class SiemensRun:
    """The statements of a program in running order."""

    def __init__(self, words: Words, text: ProgramText, line: Ints, file: str, found: list[Diagnostic], new: New,
                 axes: tuple[str, ...]) -> None:
        self.words, self.text, self.line, self.file, self.found, self.new = words, text, line, file, found, new
        self.axes, self.units = axes, codes(words, "G", (70, 71, 700, 710))
        self.length: list[tuple[int, float]] = []
        """blocks, and the register in force from there on: -1 none, inf that of a tool that no block has loaded"""
        self.kept: list[tuple[int, float]] = []
        self.states: list[tuple[int, float]] = []
        self.laws: list[WordMeaning] = []
        self.drills: list[Drill] = []
        self.taps: list[tuple[int, float, bool]] = []
        self.state: InterpolationMode = "axes"
        self.called, self.oriented = -1, False
        self.polynomials = Polynomials(words)

    def fault(self, code: str, b: int, message: str, hint: str) -> None:
        """An ERROR at a block."""
        self.found.append(error(code, message, file=self.file, lines=[int(self.line[b])], hint=hint))

    def unit(self, b: int) -> float:
        """mm of a unit of length at a block: 25.4 behind G70 and G700."""
        at = int(np.searchsorted(self.units[0], b, side="right")) - 1
        return MM_PER_INCH if at >= 0 and self.units[1][at] in (70, 700) else 1.0

    def rounding(self) -> None:
        """G60 stops at each corner, G9 at the end of its block; G64 and G641 to G645 run through them (NC Programming,
        continuous-path mode). G641 and G645 leave the path no further than ADIS, 0 where it is not stated; the tolerances of
        the others are machine data."""
        stated, distance = dict(zip(*(a.tolist() for a in self.words.pick(ROUNDED)), strict=True)), 0.0
        path = list(zip(*(a.tolist() for a in codes(self.words, "G", (9, 60, 64, 641, 642, 643, 644, 645))), strict=True))
        held = float("nan")
        for b in sorted({*(b for b, _ in path), *stated}):
            distance = stated.get(b, distance)
            codes_here = path[bisect_left(path, b, key=_FIRST):bisect_right(path, b, key=_FIRST)]
            for g in [g for _, g in codes_here] or [held]:
                if g == 9.0:
                    self.new.append((b, SMOOTH, 0.0))
                    self.new += [(b + 1, SMOOTH, self._allowed(b, held, distance))] if b < self.words.lines else []
                elif not np.isnan(g):
                    held = g
                    self.new.append((b, SMOOTH, self._allowed(b, g, distance)))

    def _allowed(self, b: int, code: float, distance: float) -> float:
        """mm that a code of the path mode may take; NaN for none."""
        if code in _BY_DISTANCE:
            return distance * self.unit(b)
        return 0.0 if code == 60.0 else code if np.isnan(code) else np.inf

    def statements(self) -> tuple[tuple[WordMeaning, ...], tuple[Drill, ...]]:
        """Laws and cycles, with the words that put them in force."""
        where, index = self.words.pick(STATEMENT)
        blocks: dict[int, list[DialectStatement]] = {}
        for b, k in zip(where.tolist(), index.tolist(), strict=True):
            blocks.setdefault(b, []).append(self.text.statements[int(k)])
        modal: list[tuple[int, int]] = []
        for b, all_here in sorted(blocks.items()):
            names = [s.name for s in all_here]
            wrong = self.polynomials.block(b, all_here, self.unit(b), self.new)
            if wrong:
                self.fault("gcode.curve", b, f"{wrong} is not executed", "write such a curve as lines or arcs")
            if "MCALL" in names:
                modal.append((b, -1))
            for s in all_here:
                self.one(b, s, modal, "MCALL" in names)
        for b, wrong in self.polynomials.control_points(blocks, self.words, self.axes, self.new):
            self.fault("gcode.curve", b, f"{wrong} is not executed", "state PL in each block, the same in all, PW and SD "
                       "as they are without them, or write such a curve as lines or arcs")
        self.modal_calls(modal)
        self.turned_behind_taps([b for b, _ in modal])
        self.turned_lengths()
        return tuple(self.laws), tuple(self.drills)

    def one(self, b: int, s: DialectStatement, modal: list[tuple[int, int]], is_modal: bool) -> None:
        """One statement of block b."""
        if s.name == "SUPA":
            self.machine_move(b)
        elif s.name == "TRAORI":
            self.enter(b, "tcp", WordMeaning("tcp", "TRAORI"))
        elif s.name == "TRAFOOF":
            self.enter(b, "axes", WordMeaning("axes", s.name))
        elif s.name == "CYCLE800":
            self.swivel(b, s)
        elif s.name == LENGTH_AXIS:
            self.kept.append((b, s.number(0)))
        elif s.name == "ORIAXES":
            self.oriented = True
        elif s.name == "CYCLE832":
            off = "_OFF" in s.args or s.number(0, 0.0) <= 0.0
            self.new.append((b, SMOOTH, float("inf") if off else s.number(0) * self.unit(b)))
            oriented = not any(isinstance(arg, str) and not arg.startswith("_ORI") for arg in s.args)
            self.new.append((b, SMOOTH_AXIS, s.number(2, float("inf")) if oriented else float("inf")))
            kind = next((arg.removeprefix("_ORI") for arg in s.args if isinstance(arg, str)), "")
            self.new.append((b, SMOOTH_LEVEL, float("nan") if off else _LEVELS.get(kind, float("nan"))))
        elif s.name in CYCLES:
            drill, why = drill_of(s, float(number_of(self.words, "S")[b]), self.unit(b))
            if drill is None:
                self.fault("gcode.cycle", b, f"{s.name} {why}", "as the post writes it")
                return
            self.drills.append(drill)
            if s.name == "CYCLE84" and s.number(6) in TURNING:
                self.taps.append((b, s.number(6), is_modal))
            if is_modal:
                modal[-1] = b, len(self.drills) - 1
            else:
                self.new.append((b, CALL, float(len(self.drills) - 1)))

    def turned_behind_taps(self, modal: list[int]) -> None:
        """SDAC of CYCLE84: how the spindle turns when the cycle is over, as M3, M4 or M5 (Programming Manual Cycles).

        modal: blocks that begin or end modal cycles.
        """
        stated, number = codes(self.words, "M", TURNING)
        for b, turning, is_modal in self.taps:
            over = next((k for k in modal if k > b), self.words.lines) if is_modal else b + 1
            before = number[stated <= b]
            if len(before) and before[-1] != turning and over <= self.words.lines and over not in stated:
                self.new.append((over, "M", turning))

    def enter(self, b: int, state: InterpolationMode, law: WordMeaning) -> None:
        """A law in force from block b on."""
        if state != "axes" and self.state != "axes":
            self.fault("gcode.mode", b, f"{law.code} while another mode is on",
                       "leave the mode that is on first")
        if state == "tcp" and self.turning_without_axes(b):
            self.fault("gcode.mode", b, "TRAORI with rotary words, but without ORIAXES",
                       "state ORIMKS ORIAXES: rotary axes linear")
        self.state = state
        self.states.append((b, float(state == "tcp")))
        self.new.append((b, LAW, float(len(self.laws))))
        self.laws.append(law)

    def turning_without_axes(self, b: int) -> bool:
        """True where rotary words follow block b and ORIAXES does not come before them."""
        rotary = np.isin(self.words.letter & 95, [ord(a) for a in self.axes if a in "ABC"]) & (self.words.line > b)
        first = int(self.words.line[rotary].min(initial=self.words.lines + 1))
        where, index = self.words.pick(STATEMENT)
        names = [self.text.statements[int(k)].name for k in index]
        stated = [int(w) for w, name in zip(where, names, strict=True) if name == "ORIAXES"]
        return first <= self.words.lines and not any(w <= first for w in stated)

    def machine_move(self, b: int) -> None:
        """SUPA: machine coordinates in this block; the tool length must be off."""
        self.new.append((b, "G", 53.0))
        last = bisect_right(self.length, b, key=_FIRST) - 1
        low, high = np.searchsorted(self.words.line, [b, b + 1])
        if last >= 0 and self.length[last][1] >= 0.0 and ord("Z") in self.words.letter[low:high]:
            self.fault("gcode.machine_position", b, "SUPA with a tool length in force",
                       "write D0 next to SUPA")

    def turned_lengths(self) -> None:
        """G18 and G19 turn the length of the tool in force out of Z, and under TRAORI its direction."""
        blocks, plane = codes(self.words, "G", (17, 18, 19))
        if not (plane > 17).any():
            return
        lines = self.words.lines
        turned_plane = fill(blocks, plane.astype(float), lines, 17.0) > 17.0
        at = np.array([b for b, _ in self.length], dtype=np.int64)
        in_force = np.array([float(value >= 0.0) for _, value in self.length])
        kept = fill(*_columns(self.kept), lines, 0.0)[at] == 17.0
        turns = fill(at, in_force * ~kept, lines, 0.0) > 0.0
        oriented = fill(*_columns(self.states), lines, 0.0) > 0.0
        for bad, what, hint in ((turned_plane & turns & ~oriented, "tool length", f"state {LENGTH_AXIS}=17 before D1"),
                                (turned_plane & oriented, "tool's direction", "arcs in G17 only under TRAORI")):
            if bad.any():
                self.fault("gcode.tool_length", int(bad.argmax()),
                           f"G18 or G19 turns the {what} out of Z", hint)

    def swivel(self, b: int, s: DialectStatement) -> None:
        """CYCLE800(_FR, _TC, _ST, _MODE, _X0, _Y0, _Z0, _A, _B, _C, _X1, _Y1, _Z1, _DIR, _FR_I, _DMODE)."""
        if not any(isinstance(a, float) for a in s.args):
            self.enter(b, "axes", WordMeaning("axes", s.name))
            return
        mode = int(s.number(3, 0.0))
        if s.number(0, 0.0) != 0.0 or s.number(2, 0.0) != 0.0 or mode >> 6:
            self.fault("gcode.mode", b, "CYCLE800 that retracts, adds to a plane, or turns otherwise than axis by axis",
                       "_FR 0, _ST 0, _MODE 27 or 57")
            return
        axes = [_SEQUENCE.get(mode >> shift & 3, "") for shift in (0, 2, 4)]
        if "" in axes:
            self.fault("gcode.mode", b, f"CYCLE800 with _MODE {mode}: no order of turns",
                       "_MODE 27: Z, then Y, then X; 57: X, then Y, then Z")
            return
        rotation = turned("".join(axes), [s.number(k, 0.0) for k in (7, 8, 9)])
        shift = np.array([s.number(k, 0.0) for k in (4, 5, 6)])
        shift = shift + rotation @ np.array([s.number(k, 0.0) for k in (10, 11, 12)])
        shift = shift * self.unit(b)
        direction = s.number(13, 0.0)
        if direction not in (-1.0, 0.0, 1.0):
            self.fault("gcode.mode", b, f"CYCLE800 with _DIR {direction:g}: no direction of the first rotary axis",
                       "_DIR 1 or -1")
            return
        choice: RotaryDirection = "+" if direction > 0.0 else "-" if direction < 0.0 else "nearest"
        self.enter(b, "tilted", WordMeaning("tilted", s.name, rotation, shift, choice))

    def modal_calls(self, modal: list[tuple[int, int]]) -> None:
        """Each block that moves calls the cycle of the MCALL in force."""
        if not modal:
            return
        held = fill(np.array([m[0] for m in modal]), np.array([float(m[1]) for m in modal]),
                    self.words.lines, -1.0)
        moves = np.unique(self.words.line[np.isin(self.words.letter & 95, [ord(a) for a in self.axes])])
        self.new += [(int(b), CALL, float(held[b])) for b in moves[held[moves] >= 0.0]]


def _columns(pairs: list[tuple[int, float]]) -> tuple[Ints, Floats]:
    """(blocks, values) of pairs."""
    return np.array([b for b, _ in pairs], dtype=np.int64), np.array([v for _, v in pairs], dtype=float)
