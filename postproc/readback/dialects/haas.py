"""Haas mill (NGC): Fanuc's kind, with what the mill operator's manual (96-8210) has of its own.

P of a dwell is ms, or s with a point; L repeats a cycle; I, J, K of G73 and G83 are the first peck, what each
next one is less by, and the least; G154 P work offsets; M97 P runs a subprogram of the same program from its
N; G234 tool centre point control, left by G49; G254 dynamic work offset, left by G255: X, Y, Z stay along the
machine's axes while the offset follows the rotary tables; G187 P E, rounding of corners. Inch
and metric: setting 9; G20 and G21 only ask for it.
"""

from __future__ import annotations

from typing import ClassVar, Literal

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.base import M_CODES
from postproc.readback.dialects.fanuc import MILLISECONDS, FanucReader, block, take
from postproc.readback.dialects.iso import New
from postproc.readback.macros.execution import MacroLanguage
from postproc.readback.text.canonical import OFFSET, SMOOTH, SMOOTH_LEVEL, ProgramText, offset_number
from postproc.readback.text.flow import Call, Structure
from postproc.readback.text.modal import GROUPS, Groups, codes
from postproc.readback.text.words import Words
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, error

_AUXILIARY = tuple(g for g in range(110, 130) if g not in (112, 113))
"""other names of G154 P1 to P20 (Mill Operator's Manual NGC)"""
_LEVELS = (1.0, 2.0, 3.0)
"""P of G187: rough, medium, finish (Mill Operator's Manual NGC, G187)"""


class HaasReader(FanucReader):
    """G-code of Haas mills."""

    groups: Groups = GROUPS | {
        "offset": (54, 55, 56, 57, 58, 59, 154, *_AUXILIARY),
        "length": (43, 49, 234), "path": (61, 64, 187), "tilt": (254, 255),
        "once": (4, 9, 28, 53), "arc_distance": ()}
    m_codes = (*M_CODES, 97.0, 98.0, 99.0)
    letters = "GMFSTHDNIJKRPQLOE"
    language: MacroLanguage | Literal[""] = "haas"
    laws = (43.0, 49.0, 234.0, 254.0, 255.0)
    leaving: ClassVar[dict[InterpolationMode, tuple[str, ...]]] = {"tilted": ("G255",)}
    tcp_code = 234.0
    extended_offset = 154.0
    last_offset = 99
    arc_slack = 0.01
    """mm, assumed: the manual has no spiral"""
    repeats = "L"
    units_from = "setting 9 of the control has them"
    units_stay = True
    smoothing_hint = "G187 E as the post writes it, or G61"

    def offset_name(self, number: float) -> str:
        """Beyond G59 they are G154 P."""
        return super().offset_name(number).replace("G54.1", "G154")

    def time(self, words: Words, k: int) -> float:
        """s of a P word: ms, or s with a point."""
        point = words.point is not None and bool(words.point[k])
        return float(words.value[k]) * (1.0 if point else MILLISECONDS)

    def structure(self, text: ProgramText, file: str) -> tuple[Structure, list[Diagnostic]]:
        """Besides programs, what M97 runs: from its N to the next M99."""
        structure, found = super().structure(text, file)
        lines, numbers = text.words.pick("N")
        back, _ = codes(text.words, "M", (99,))
        for call in structure.calls.values():
            for line in lines[numbers == float(call.name[1:])][:1] if call.name.startswith("N") else []:
                last = back[back >= line]
                structure.subprograms[call.name] = (int(line), int(last[0]) if len(last) else text.words.lines)
        return structure, found

    def local(self, words: Words, back: int) -> bool:
        """M97 runs what stands behind the end, from an N to M99."""
        ends = codes(words, "M", (2, 30))[0]
        return bool(len(codes(words, "M", (97,))[0]) and len(ends) and ends.min() < back)

    def calls(self, words: Words) -> dict[int, Call]:
        """M98 P L, and M97 P L."""
        result = {}
        for b, m in zip(*codes(words, "M", (97, 98)), strict=True):
            stated = block(words, int(b))
            result[int(b)] = Call(int(b), f"{'N' if m == 97 else 'O'}{stated.get('P', -1.0):g}",
                                  int(stated.get("L", 1.0)))
        return result

    def paths(self, words: Words, new: New) -> None:
        """G187 P E: corners rounded by E mm; without words, or without E, as a setting of the control has it."""
        for b in codes(words, "G", (187,))[0].tolist():
            stated = block(words, b)
            new.append((b, SMOOTH, stated.get("E", 0.0) * self.units_at(words, b) or float("inf")))
            new.append((b, SMOOTH_LEVEL, stated.get("P", float("nan"))))
        for b in codes(words, "G", (61,))[0].tolist():
            new += [(b, SMOOTH, 0.0), (b, SMOOTH_LEVEL, float("nan"))]

    def others(self, words: Words, new: New, drop: Bools, line: Ints, file: str,
               found: list[Diagnostic]) -> None:
        """Besides what Fanuc has: G110 to G129 but for G112 and G113, the words of G187."""
        for b, g in zip(*codes(words, "G", _AUXILIARY), strict=True):
            new.append((int(b), OFFSET, offset_number(f"G154 P{g - 109:g}")))
        for b in codes(words, "G", (187,))[0].tolist():
            level = take(words, drop, b, "PE").get("P", 1.0)
            if level not in _LEVELS:
                found.append(error("gcode.smoothing", f"G187 P{level:g}: there is no such level", file=file,
                                   lines=[int(line[b])], hint="G187 P1, P2 or P3"))
        super().others(words, new, drop, line, file, found)


