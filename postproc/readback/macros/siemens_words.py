"""Words, assignments, frames and calls of a row of a SINUMERIK program: figures in the place of expressions."""

from __future__ import annotations

import re
from collections.abc import Callable

from postproc.readback.macros.expressions import Cursor, MacroFault, written
from postproc.readback.macros.frame import AXES, IN_PLANE, CoordinateFrame, rotated, scaled, shifted
from postproc.readback.macros.held import Held
from postproc.readback.macros.siemens_expressions import (
    NAME,
    SiemensValue,
    axis_values,
    expression,
    indices,
    number,
    skip,
    split_values,
    take,
)
from postproc.readback.macros.siemens_patterns import PATTERNS, positions
from postproc.readback.macros.siemens_rows import RowDone
from postproc.readback.macros.siemens_turned import CENTRES, TurnedBlocks
from postproc.readback.macros.siemens_variables import SavedModes, SiemensNames, codes_back, take_code
from postproc.readback.macros.word_blocks import Blocks, coded

_WORD = re.compile(r"([A-Z])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?)(?![\d.]|[ \t]*=)")
_KEY = re.compile(r"(\$?[A-Z_$][A-Z0-9_$]*)")
_HOW = re.compile(r"(IC|AC|DC|ACP|ACN|CIC|CAC|CDC)[ \t]*\(")
_FRAMES = re.compile(r"A?(?:TRANS|ROTS?|SCALE|MIRROR)")
_LEVELS = {"CYCLE81": (0, 1, 3), "CYCLE82": (0, 1, 3), "CYCLE83": (0, 1, 3, 5), "CYCLE84": (0, 1, 3), "CYCLE840": (0, 1, 3),
           "CYCLE85": (0, 1, 3), "CYCLE86": (0, 1, 3)}
"""values of a cycle that are absolute levels"""
_WHOLE = frozenset("GMTDHLPN")
_NEVER = frozenset({"MCALL", "CALL", "EXTCALL"})


class SiemensWords:
    """Words of rows; `runnable` says which names are those of subprograms."""

    def __init__(self, blocks: Blocks, held: Held, runnable: Callable[[str], bool]) -> None:
        self.blocks, self.held, self.runnable = blocks, held, runnable
        self.track = blocks.track
        self.state: dict[str, float] = {}
        self.names = SiemensNames(self.track, self.state)
        self.turned = TurnedBlocks(self.track)
        self.patterns: dict[str, int] = {}
        self.drilled_level: float | None = None
        self.modal_subprogram = ""
        self.codes: dict[str, int] = {}
        self.unknown_tools: dict[str, int] = {}
        self.iso_units: dict[int, int] = {}
        self.line = 0

    def row(self, head: str, c: Cursor, line: int) -> RowDone:
        """One row obeyed, and written on."""
        done, self.line = RowDone(), line
        if _FRAMES.fullmatch(head):
            self._frame(head, c)
            return done
        out: list[str] = []
        calls: list[tuple[str, str]] = []
        machine = bool(re.search(r"(?<![A-Z0-9_])(?:SUPA|G53|G153)(?![A-Z0-9_.])", c.text))
        self._modes(c.text)
        while True:
            skip(c)
            if c.done:
                break
            self._piece(c, out, calls, machine, done)
        times = 1
        if calls:
            counted = [w for w in out if w.startswith("P") and w[1:2].isdigit()]
            times = round(float(counted[-1][1:])) if counted else 1
            out = [w for w in out if w not in counted]
            if "MCALL" in out:
                out.remove("MCALL")
                done.modal = calls[-1]
                self.modal_subprogram = calls[-1][0]
            else:
                done.call = (*calls[-1], times)
        elif out == ["MCALL"]:
            done.modal = ("", "")
            self.drilled_level, self.modal_subprogram = None, ""
        elif "MCALL" in out:
            self.drilled_level = self._level()
        out = self._framed(out, machine)
        if machine and out:
            out = ["SUPA", *(w for w in out if w not in ("SUPA", "G53", "G153"))]
        if out:
            self.blocks.write(" ".join(out), line)
        return done

    def _framed(self, out: list[str], machine: bool) -> list[str]:
        """The words of a row in the work offset; where modes with other coordinates begin, the position is not known."""
        if any(w == "TRAORI" or w.startswith("TRAORI(") for w in out):
            self.turned.oriented = True
        elif "TRAFOOF" in out:
            self.turned.oriented = False
        if not machine or self.turned.side != 40:
            out = self.turned.row(out)
        if any(w.startswith(("TRAORI", "TRAFOOF", "CYCLE800(")) for w in out):
            self.track.at.update(dict.fromkeys(a for a in AXES if a in self.track.at))
        return out

    def _modes(self, body: str) -> None:
        """What G codes of a row change before its words are read."""
        for m in re.finditer(r"(?<![A-Z0-9_])G[ \t]*0*(\d+)(?![A-Z0-9_.])", body):
            code = int(m[1])
            self.turned.codes(code)
            take_code(self.codes, code)
            if code in (70, 71, 700, 710, 20, 21):
                self.track.unit = 25.4 if code in (70, 700, 20) else 1.0
                self.iso_units |= {} if code > 21 else {code: self.line}
            elif code in (90, 91):
                self.track.absolute = code == 90
            elif code in (54, 55, 56, 57, 500, *range(505, 600)):
                self.track.take_offset(float(code))

    def _piece(self, c: Cursor, out: list[str], calls: list[tuple[str, str]], machine: bool, done: RowDone) -> None:
        """The next word, assignment, function or call."""
        if c.text.startswith('"', c.at):
            end = c.text.find('"', c.at + 1)
            if end < 0 or not out or out[-1] not in ("CALL", "EXTCALL"):
                raise c.fault("not a block of words")
            calls.append((c.text[c.at + 1:end].upper(), ""))
            out.pop()
            c.at = end + 1
            return
        word = _WORD.match(c.text, c.at)
        if word:
            c.at = word.end()
            self._word(word[1], float(word[2].replace("EX", "e")), word, out, calls, machine, done)
            return
        key = _KEY.match(c.text, c.at)
        if key is None:
            raise c.fault("not a block of words")
        c.at = key.end()
        if _FRAMES.fullmatch(key[1]):
            raise c.fault(f"{key[1]} next to other words: a frame stands in a block of its own")
        index: tuple[SiemensValue, ...] = tuple(indices(c, self.names)) if take(c, "[") else ()
        if not c.text.startswith("==", c.at) and take(c, "="):
            self._assigned(key[1], index, c, out, machine, done)
        elif take(c, "("):
            self._function(key[1], c, out, calls)
        elif self.runnable(key[1]) and key[1] not in _NEVER:
            calls.append((key[1], ""))
        elif index or len(key[1]) == 1:
            raise c.fault("not a block of words")
        else:
            out.append(key[1])
            done.back |= key[1] == "RET"

    def _word(self, letter: str, value: float, word: re.Match[str], out: list[str], calls: list[tuple[str, str]],
              machine: bool,
              done: RowDone) -> None:
        if letter == "L":
            calls.append((f"L{word[2]}", ""))
            return
        if letter == "M" and value in (2.0, 30.0):
            done.ended = True
        if letter == "M" and value == 17.0:
            done.back = True
            return
        self.state[letter] = value
        if self._kept(letter, value, None, machine, done):
            return
        if letter in self.held.axes:
            done.moved = True
            went = self._go(letter, value, machine)
            out.append(letter + (written(went) if went != value else word[2]))
        elif letter == "G" and value in (20.0, 21.0):
            out.append("G70" if value == 20.0 else "G71")
        else:
            self._length(letter)
            out.append(f"{letter}{word[2]}")

    def _kept(self, key: str, value: float, how: str | None, machine: bool, done: RowDone) -> bool:
        """True for ends, centres and radii of circles that a frame changes: they are written at the end of the row."""
        turned, track = self.turned, self.track
        if not turned.on or machine:
            return False
        if key in AXES and key in self.held.axes:
            if how not in (None, "AC", "IC"):
                raise MacroFault("gcode.frame_turned", f"{key}={how}(...) in a frame that turns, scales or mirrors",
                                 "AC() or IC(): DC, ACP and ACN are for rotary axes, CAC, CIC and CDC coded positions")
            done.moved = True
            turned.end(key, value * track.unit, track.absolute if how is None else how == "AC")
        elif key in CENTRES:
            turned.centre(key, value * track.unit, how == "AC")
        elif key == "CR":
            turned.radius = value * track.unit
        else:
            return False
        return True

    def _length(self, letter: str) -> None:
        """Tools and edges change the length: Z is known again behind its next word."""
        if letter in "TD":
            self.track.at["Z"] = None

    def _go(self, axis: str, value: float, machine: bool) -> float:
        if machine:
            self.track.go_machine(axis, value * self.track.scale(axis))
            return value
        return self.track.go(axis, value)

    def _assigned(self, key: str, index: tuple[SiemensValue, ...], c: Cursor, out: list[str], machine: bool,
                  done: RowDone) -> None:
        """NAME=..., R1=..., X=..., X=IC(...), T="..."."""
        if self.names.known(key):
            if not self.names.put_list(c, key, index):
                self.names.put(key, index, expression(c, self.names))
            return
        if index:
            raise MacroFault("gcode.variable", f"{key}[...] is set, and no DEF declares it",
                             f"declare it: DEF REAL {key}[...]")
        skip(c)
        how = _HOW.match(c.text, c.at)
        if how:
            c.at = how.end()
            value = number(expression(c, self.names))
            if not take(c, ")"):
                raise c.fault("')' is missing")
            if self._kept(key, value, how[1], machine, done):
                return
            out.append(f"{key}={how[1]}({written(self._how(key, how[1], value, machine, done))})")
            return
        held = expression(c, self.names)
        if (len(key) == 1 or key == "CR") and not isinstance(held, str) and self._kept(key, held, None, machine, done):
            return
        if key == "T" and isinstance(held, str):
            out.append(f"T{self._tool(held)}")
            self._length(key)
        elif len(key) == 1:
            value = coded(key, number(held))
            if key in self.held.axes:
                done.moved = True
                value = self._go(key, value, machine)
            self.state[key] = value
            self._length(key)
            out.append(key + written(value, key in _WHOLE))
        elif key.startswith("$"):
            out.append(f"{key}={written(number(held), True)}")
        else:
            out.append(f"{key}={written(number(held))}")

    def _how(self, key: str, how: str, value: float, machine: bool, done: RowDone) -> float:
        """The number of IC(), AC() and their like."""
        if key in CENTRES and how == "AC":
            axis = AXES[CENTRES.index(key)]
            return value + self.track.shift(axis) / self.track.scale(axis)
        if key not in self.held.axes:
            return value
        done.moved = True
        before, self.track.absolute = self.track.absolute, how != "IC"
        value = self._go(key, value, machine)
        self.track.absolute = before
        return value

    def _tool(self, name: str) -> int:
        """The number of a tool that is called by its name."""
        named = {known.upper(): n for n, known in self.held.tools.items()}
        if name.strip().isdigit():
            return int(name)
        if name.upper() in named:
            return named[name.upper()]
        self.unknown_tools.setdefault(name, self.line)
        return 30_000 + list(self.unknown_tools).index(name)

    def _function(self, name: str, c: Cursor, out: list[str], calls: list[tuple[str, str]]) -> None:
        """NAME(...): a subprogram, or a cycle with its values written out."""
        start, depth, inside = c.at, 1, False
        while depth and c.at < len(c.text):
            sign = c.text[c.at]
            inside ^= sign == '"'
            depth += 0 if inside else (sign == "(") - (sign == ")")
            c.at += 1
        if depth:
            raise c.fault("')' is missing")
        given = c.text[start:c.at - 1]
        if name in PATTERNS and not self.runnable(name):
            self._pattern(name, given, out)
        elif name not in _LEVELS and self.runnable(name):
            calls.append((name, given))
        elif name != "MSG":
            out.append(f"{name}({','.join(self._values(name, given))})")

    def _values(self, name: str, given: str) -> list[str]:
        """Values of a cycle, levels in the coordinates of the set-up's work offset."""
        made = []
        for k, part in enumerate(split_values(given)):
            part = part.strip()
            bare = NAME.fullmatch(part)
            if not part or (bare and not self.names.known(part)):
                made.append(part)
                continue
            c = Cursor(part)
            value = expression(c, self.names)
            skip(c)
            if not c.done:
                raise c.fault("a value of a call is not read")
            if isinstance(value, str):
                made.append(f'"{value}"')
                continue
            shift = self._level() / self.track.unit if k in _LEVELS.get(name, ()) else 0.0
            if name == "CYCLE800" and any(self.track.shift(a) for a in self.held.axes):
                raise MacroFault("gcode.mode", "CYCLE800 in coordinates that TRANS has shifted is not executed",
                                 "write TRANS alone before it, and state the origin in CYCLE800")
            made.append(written(value + shift, True))
        return made

    def _frame(self, head: str, c: Cursor) -> None:
        """TRANS, ROT, SCALE, MIRROR start from the work offset, ATRANS, AROT, ASCALE, AMIRROR go on."""
        given = axis_values(c, self.names)
        kind = head.removeprefix("A") if head != "A" else head
        if kind == "ROTS" and given:
            raise MacroFault("gcode.frame_turned", f"{head} with solid angles is not executed", "ROT with X, Y, Z or RPL")
        if "RPL" in given and kind == "ROT":
            given["XYZ"[{17: 2, 18: 1, 19: 0}[self.track.plane]]] = given.pop("RPL")
        allowed = self.held.axes if kind == "TRANS" else tuple(AXES)
        for axis in given:
            if axis not in allowed:
                raise MacroFault("gcode.unknown_word", f"{head} {axis}: the machine has no such axis" if kind == "TRANS" else
                                 f"{head} {axis}: not an axis of the frame", f"its axes are {', '.join(allowed)}")
        if kind == "SCALE" and any(v <= 0.0 for v in given.values()):
            raise MacroFault("gcode.frame_turned", f"{head} with a factor of 0 or below", "a factor above 0; MIRROR mirrors")
        self._take_frame(kind, given, not head.startswith("A"))

    def _take_frame(self, kind: str, given: dict[str, float], fresh: bool) -> None:
        """A frame in force, with what TRANS says of rotary axes."""
        made = {"TRANS": shifted, "SCALE": scaled}.get(kind, rotated)
        mm = {a: v * (self.track.scale(a) if kind == "TRANS" else 1.0) for a, v in given.items()}
        frame = scaled(dict.fromkeys(mm, -1.0)) if kind == "MIRROR" else made(mm)
        if fresh:
            self.track.local.clear()
        for axis in mm if kind == "TRANS" else ():
            if axis not in AXES:
                self.track.local[axis] += mm[axis]
                self.track.shifted = True
        self._in_force(frame if fresh else self.turned.frame.before(frame))

    def _in_force(self, frame: CoordinateFrame) -> None:
        """Another frame; a drilling cycle under MCALL keeps its axis and level."""
        if not frame.square:
            raise MacroFault("gcode.frame_turned", "a rotation behind SCALE of unequal factors is not executed: the axes of "
                             "the frame are no longer square to one another", "rotate first, then scale")
        self.turned.take(frame)
        moves = self._level() != self.drilled_level or not self.turned.drills(self.turned.frame)
        if self.drilled_level is not None and moves:
            raise MacroFault("gcode.frame_turned", "a frame moves or turns the tool's axis while MCALL holds a cycle",
                             "write MCALL alone before it, and call the cycle again behind it")

    def saved(self) -> SavedModes:
        """What SAVE keeps."""
        return SavedModes(dict(self.codes), self.turned.frame, dict(self.track.local))

    def give_back(self, saved: SavedModes, line: int) -> None:
        """The caller's frame and codes in force again."""
        self.track.local.clear()
        self.track.local.update(saved.local)
        self._in_force(saved.frame)
        if codes := codes_back(saved, self.codes):
            self.row("", Cursor(codes), line)

    def _level(self) -> float:
        """mm by which levels of cycles lie higher in the work offset."""
        normal = IN_PLANE[self.track.plane][2]
        return self.turned.frame.shift[normal] if self.turned.on else self.track.shift(AXES[normal])

    def _pattern(self, name: str, given: str, out: list[str]) -> None:
        """A block for each place of a pattern; the code of motion holds on behind it."""
        if self.modal_subprogram:
            raise MacroFault("gcode.cycle", f"{name} while MCALL names the program {self.modal_subprogram} is not executed",
                             "state the places one by one, in blocks under MCALL")
        values = [self._value(part) for part in split_values(given)]
        first, second, _ = (AXES[k] for k in IN_PLANE[self.track.plane])
        try:
            here = self.track.position(first) / self.track.unit, self.track.position(second) / self.track.unit
        except MacroFault:
            here = None
        self.patterns.setdefault(name, self.line)
        motion = self.turned.motion
        for x, y in positions(name, values, here):
            self.blocks.count(self.line)
            self.row("", Cursor(f"G0 {first}=AC({written(x)}) {second}=AC({written(y)})"), self.line)
        if motion is not None:
            out.append(f"G{motion}")
            self.turned.motion = motion

    def _value(self, part: str) -> float | str | None:
        """A value of a pattern; None where nothing stands."""
        if not part.strip():
            return None
        c = Cursor(part)
        value = expression(c, self.names)
        skip(c)
        if not c.done:
            raise c.fault("a value of a call is not read")
        return value
