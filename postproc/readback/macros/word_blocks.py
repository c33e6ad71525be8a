"""Blocks of words as a program that is executed comes to them: written on plain, G10, G28, G30, G52 and G92 carried out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from postproc.readback.macros.expressions import MacroFault, rounded, written
from postproc.readback.macros.held import Held
from postproc.readback.macros.track import NO_LENGTH, Track
from postproc.readback.text.canonical import EXTENDED_OFFSETS
from toolpaths.diagnostics import Diagnostic, warning

_WHOLE = frozenset("GMTSHDNOLPF")
"""letters whose whole numbers are written without a point"""
CYCLES = (73, 74, 76, 81, 82, 83, 84, 85, 86, 87, 88, 89)
_MOTION = (0, 1, 2, 3, 33, 80, *CYCLES)
_OFFSETS = (54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3)
_LENGTHS = (43, 43.4, 43.5, 44, 234)
_TILTS = (68.2, 254)
_GROUPS = {1: (0, 1, 2, 3, 33), 2: (17, 18, 19), 3: (90, 91), 5: (93, 94, 95), 6: (20, 21), 7: (40, 41, 42),
           8: (43, 43.4, 43.5, 44, 49, 234), 9: (80, *CYCLES), 10: (98, 99), 14: (*_OFFSETS, 54.1, 154),
           15: (61, 61.1, 62, 63, 64)}
"""modal groups as the system variables #4001 on number them (B-64484EN)"""


class Word(NamedTuple):
    """A letter with its number; `text` as the program wrote it, "" for a number that was worked out."""

    letter: str
    value: float
    text: str = ""

    def written(self) -> str:
        """As it is written on."""
        return self.text or self.letter + written(self.value, self.letter in _WHOLE)


class Blocks:
    """Plain rows, with the line of each, and what the codes in them have changed.

    Attributes:
        rows, lines: the text that is written on, lines counted through all files; state: modal code by group, and the
            number stated last of each other letter
        within: G16, G68, G51 or G51.1, where one is in force
        linuxcnc: G52, G92 and G10 as LinuxCNC has them, not Fanuc
    """

    def __init__(self, held: Held, linuxcnc: bool, file: str) -> None:
        self.held, self.linuxcnc, self.file = held, linuxcnc, file
        self.track = Track(held)
        self.rows: list[str] = []
        self.lines: list[int] = []
        self.state: dict[int | str, float] = {}
        self.tilted = False
        self.within = ""
        self.second: list[int] = []
        self.skips: list[int] = []
        self.compared: dict[int, str] = {}
        self.tool = 0.0
        self.drill_plane: float | None = None
        self.first: float | None = None
        self.executed = 0

    def count(self, line: int) -> None:
        """One more block is executed; a program without an end is refused."""
        self.track.line = line
        self.executed += 1
        if self.executed > self.held.most:
            raise MacroFault("gcode.endless", f"more than {self.held.most} blocks are executed: the program has no end",
                             "look for a loop whose condition never fails; a longer program: --max-blocks with a larger "
                             "number")

    def write(self, row: str, line: int) -> None:
        """A row of the plain program."""
        self.rows.append(row)
        self.lines.append(line)

    def block(self, words: Sequence[Word], line: int) -> bool:
        """One block obeyed; True where it moves an axis."""
        codes = [w.value for w in words if w.letter == "G"]
        self._modes(words, codes)
        if self.linuxcnc and 43 in codes and not any(w.letter == "H" for w in words):
            words = [*words, Word("H", self.tool)]
        if 31 in codes and not self.linuxcnc:
            return self._skip(words, line)
        for code in codes:
            if code == 10:
                return self._data(words, line)
            if code in (52, 92, 92.1, 92.2, 92.3):
                return self._zero(words, code, line)
            if code in (28, 30):
                return self._reference(words, code, line)
        moved = 4 not in codes and any(w.letter in self.held.axes for w in words)
        made = self._moved(words, codes) if moved else list(words)
        if made:
            self.write("".join(w.written() for w in made), line)
        return moved

    def _modes(self, words: Sequence[Word], codes: list[float]) -> None:
        """What the codes of a block put in force before it moves."""
        track = self.track
        stated = {w.letter: w.value for w in words}
        for code in codes:
            self.state.update({group: code for group, known in _GROUPS.items() if code in known})
            if code in (20, 21):
                track.unit = 25.4 if code == 20 else 1.0
            elif code in (90, 91):
                track.absolute = code == 90
            elif code in (17, 18, 19):
                track.plane = int(code)
            elif code in (98, 99):
                track.level = int(code)
            elif code in _MOTION:
                track.motion = code
            elif code in _OFFSETS:
                track.take_offset(code)
            elif code in (54.1, 154):
                track.take_offset(EXTENDED_OFFSETS + stated.get("P", 0.0))
            elif code in _LENGTHS:
                other = self.tool if self.linuxcnc else self.state.get("H", 0.0)
                track.take_length(int(stated.get("H", other)))
            elif code == 49:
                track.take_length(NO_LENGTH)
        self.tilted = (self.tilted or any(c in _TILTS for c in codes)) and not any(c in (69, 255) for c in codes)
        self.state.update({a: v for a, v in stated.items() if a in "DFHSTB"})
        if any(w.letter == "M" and w.value == 6 for w in words):
            self.tool = self.state.get("T", 0.0)

    def _moved(self, words: Sequence[Word], codes: list[float]) -> list[Word]:
        """The axis words of a block obeyed."""
        track, tool = self.track, "XYZ"[{17: 2, 18: 1, 19: 0}[self.track.plane]]
        if self.tilted and any(track.shift(a) for a in self.held.axes):
            raise MacroFault("gcode.mode", "a tilted plane in coordinates that G10, G52 or G92 has shifted is not executed",
                             "cancel the shift before it, and state the origin of the plane instead")
        if 53 in codes:
            for w in words:
                if w.letter in self.held.axes:
                    track.go_machine(w.letter, w.value * track.scale(w.letter))
            return list(words)
        cycle = track.motion in CYCLES
        made, before = [], track.at.get(tool)
        for w in words:
            if w.letter in self.held.axes or (cycle and w.letter == "R"):
                axis = w.letter if w.letter != "R" else tool
                value = track.go(axis, w.value)
                made.append(w if value == w.value else Word(w.letter, value))
            else:
                made.append(w)
        if cycle:
            self._after_cycle(words, tool, before)
        return made

    def _after_cycle(self, words: Sequence[Word], tool: str, before: float | None) -> None:
        """A canned cycle leaves its axis at R, or where it was before the first."""
        level = next((w.value for w in words if w.letter == "R"), None)
        if level is not None and self.track.absolute:
            self.drill_plane = level * self.track.scale(tool) + self.track.shift(tool)
            self.first = before
        if not self.track.absolute or self.drill_plane is None:
            self.track.at[tool] = None
        elif self.track.level == 99:
            self.track.at[tool] = self.drill_plane
        else:
            self.track.at[tool] = None if self.first is None else max(self.first, self.drill_plane)

    def _data(self, words: Sequence[Word], line: int) -> bool:
        """G10: work offsets and lengths."""
        stated = {w.letter: w.value for w in words if w.letter not in "GM"}
        kind, p, track = stated.get("L"), int(stated.get("P", 0.0)), self.track
        given = {a: stated[a] for a in self.held.axes if a in stated}
        if kind == 2 and "R" not in stated:
            register = self._register(p)
            for axis, value in given.items():
                track.set_work(register, axis, value * track.scale(axis), not track.absolute and not self.linuxcnc)
        elif kind == 20 and not self.linuxcnc:
            for axis, value in given.items():
                track.set_work(EXTENDED_OFFSETS + p, axis, value * track.scale(axis), not track.absolute)
        elif kind == 20 and "R" not in stated:
            register = self._register(p)
            for axis, value in given.items():
                track.set_position(register, axis, value * track.scale(axis))
        elif kind == 1 and self.linuxcnc and set(stated) <= {"L", "P", "Z"}:
            track.set_length(p, stated.get("Z", 0.0) * track.unit)
        elif kind in (1, 10, 11) and not self.linuxcnc and "R" in stated:
            track.set_length(p, stated["R"] * track.unit, kind == 11 or not track.absolute)
        else:
            raise MacroFault("gcode.data_setting", f"G10 with L{kind:g} is not executed" if kind is not None else
                             "G10 without L is not executed", "allowed are L2, L20 without R, and lengths: L1 Z (LinuxCNC), "
                             "L10 and L11 with R (Fanuc, Haas)")
        self._rest(words, frozenset({"L", "P", "R", *self.held.axes}), (10,), line)
        return False

    def _register(self, p: int) -> float:
        """The work offset of a P word: 1 is G54, 0 that in force."""
        if p == 0 and self.linuxcnc and self.track.register is not None:
            return self.track.register
        if not 1 <= p <= (9 if self.linuxcnc else 6):
            raise MacroFault("gcode.data_setting", f"G10 L2 with P{p}", "P1 is G54, P2 is G55 and so on")
        return _OFFSETS[p - 1]

    def _rest(self, words: Sequence[Word], letters: frozenset[str], codes: tuple[float, ...], line: int) -> None:
        """What of a block is left behind words that were carried out."""
        left = [w for w in words if w.letter not in letters and not (w.letter == "G" and w.value in codes)]
        if left:
            self.write("".join(w.written() for w in left), line)

    def _zero(self, words: Sequence[Word], code: float, line: int) -> bool:
        """G52 and G92: LinuxCNC keeps one offset for both, Fanuc one for each."""
        track = self.track
        given = {w.letter: w.value * track.scale(w.letter) for w in words if w.letter in self.held.axes}
        if code in (92.1, 92.2):
            track.zero.clear()
        elif code == 92.3:
            raise MacroFault("gcode.data_setting", "G92.3 takes an offset that the control has kept",
                             "state G92 with its words")
        for axis, value in given.items():
            track.shifted = True
            if code == 92:
                track.zero[axis] += track.position(axis) - value
                track.zero[axis] += track.local.pop(axis, 0.0)
            elif self.linuxcnc:
                track.zero[axis] = value
            else:
                track.local[axis] = value
        self._rest(words, frozenset(self.held.axes), (code,), line)
        return False

    def _reference(self, words: Sequence[Word], code: float, line: int) -> bool:
        """G28, G30: over the point that the words state to the machine's home."""
        track, home = self.track, self.held.home
        given = [w for w in words if w.letter in self.held.axes]
        if home is None or (not given and not self.linuxcnc):
            raise MacroFault("gcode.reference", f"G{code:g} without axis words" if home is not None
                             else f"G{code:g} without a home",
                             "write G91 G28 Z0.")
        if code == 30:
            self.second.append(line)
        letters = [w.letter for w in given] or list(self.held.axes)
        self._rest(words, frozenset({"P", *self.held.axes}), (code, 0, 1, 2, 3), line)
        if any(w.value for w in given) or (given and (track.absolute or self.linuxcnc)):
            made = "".join(Word(w.letter, track.go(w.letter, w.value)).written() for w in given)
            self.write(f"G0{made}", line)
        targets = {a: float(home[self.held.axes.index(a)]) for a in letters}
        self.write("G90G53G0" + "".join(a + written(v / track.scale(a)) for a, v in targets.items()), line)
        for axis, value in targets.items():
            track.go_machine(axis, value)
        back = ("" if track.absolute else "G91") + (f"G{track.motion:g}" if track.motion in (0, 1, 2, 3) else "")
        if back:
            self.write(back, line)
        return True

    def _skip(self, words: Sequence[Word], line: int) -> bool:
        """G31: a feed move to its end, for this block alone."""
        track = self.track
        before, track.motion = track.motion, 1.0
        self.skips.append(line)
        made = [Word("G", 1.0) if (w.letter, w.value) == ("G", 31.0) else w for w in words if w.letter not in "PL"]
        self.write("".join(w.written() for w in self._moved(made, [w.value for w in made if w.letter == "G"])), line)
        track.motion = before
        if before in (0, 2, 3):
            self.write(f"G{before:g}", line)
        return True

    def judged(self) -> list[Diagnostic]:
        """What is taken to be so, though the control may have it otherwise."""
        found = [warning("gcode.offset_unstated", f"the program reads the work offset {_named(register)}, which the set-up "
                         "does not state: that of the set-up's own register counts", file=self.file, lines=[line],
                         hint="a set-up with [[places]] that states it, or G10 L2 in the program before")
                 for register, line in self.track.taken.items()]
        found += [warning("gcode.comparison", f"two numbers that are one but for rounding are compared: {what}: which of "
                          "them is the larger one depends on the digits that the control computes with", file=self.file,
                          lines=[line], hint="compare with a margin, or round both before")
                  for line, what in list(self.compared.items())[:6]]
        if self.skips:
            found.append(warning("gcode.skip", "G31 runs to its end here, as a feed move: where the signal stops it only "
                                 "the control knows", file=self.file, lines=self.skips[:6], count=len(self.skips),
                                 hint="write G1 where no signal is meant"))
        if self.second:
            found.append(warning("gcode.second_reference", "G30: the second reference position is a parameter of the "
                                 "control, the home of the machine file is taken for it", file=self.file,
                                 lines=self.second[:6], count=len(self.second),
                                 hint="write G28 where that is meant, or G53 with the position"))
        return found


def _named(register: float) -> str:
    """The code of a work offset."""
    return f"G{register:g}" if register < EXTENDED_OFFSETS else f"P{register - EXTENDED_OFFSETS:g}"


def coded(letter: str, value: float) -> float:
    """The number of a word that was worked out: codes to a tenth, tools and registers whole."""
    if letter == "G":
        return rounded(value * 10.0) / 10.0
    if letter in "MTSHDNOL":
        if abs(value - rounded(value)) > 1e-4:
            raise MacroFault("gcode.expression", f"{letter} with {value:g}", "it takes a whole number")
        return rounded(value)
    return value
