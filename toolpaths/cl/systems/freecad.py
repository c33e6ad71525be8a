"""G-code of FreeCAD's CAM (Path) workbench as statements: its own form, and what its posts for mills make of it.

Source: FreeCAD's documentation, wiki pages "CAM scripting" (The FreeCAD Internal G-code Format) and src/Mod/CAM/
GCode-description.md: mm always, X Y Z absolute unless G91, I J K from the last point, coordinates left out stay. Feeds are
mm/s in its own form (its unit of velocity); posts (src/Mod/CAM/Path/Post/scripts, header "(Exported by FreeCAD)") write
mm/min under G21 and in/min under G20. Rotary words A, B, C are positions of a machine, which the file does not describe:
refused.
"""

from __future__ import annotations

import math
import re

from toolpaths.cl.systems.as_statements import EXPORTED, AsStatements, signed
from toolpaths.cl.text.log import DiagnosticLog

_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)")
_WORD = re.compile(r"([A-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)", re.IGNORECASE)
_BEGIN = re.compile(r"begin operation:\s*(.*)", re.IGNORECASE)
_POST = re.compile(r"Post Processor:\s*(\S+)")
_MOTIONS = {0.0, 1.0, 2.0, 3.0, 73.0, 81.0, 82.0, 83.0}
_HOLES = {81.0: "DRILL", 82.0: "DRILL", 83.0: "DEEP", 73.0: "BRKCHP"}
_SILENT_G = frozenset({17.0, 40.0, 43.0, 49.0, 91.1, 94.0})
"""plane XY, no radius compensation, length of the tool, arcs from their start, feed per minute"""
_OFFSETS = frozenset(float(f"{n / 10:g}") for n in (*range(540, 600, 10), *range(591, 600)))
_M = {0.0: "STOP", 1.0: "OPSTOP", 2.0: "FINI", 30.0: "FINI", 5.0: "SPINDL/OFF", 7.0: "COOLNT/MIST", 8.0: "COOLNT/FLOOD",
      9.0: "COOLNT/OFF"}
_TURNING = frozenset("ABC")
_ALWAYS = frozenset("XYZFSTABC")
"""words that need no command in their line"""
_TAKEN = {2.0: "IJKP", 3.0: "IJKP", 81.0: "R", 82.0: "RP", 83.0: "RQP", 73.0: "RQP"}
"""words of a move in addition"""
_OF_POSTS = frozenset({("G", 20.0), ("G", 21.0), ("M", 2.0), ("M", 30.0)})
"""what its own form never holds"""


class FreeCadReader:
    """Carries out the commands of one file; None stands for a coordinate that nothing has stated yet."""

    def __init__(self, text: str, log: DiagnosticLog):
        self.out, self.log, self.text, self.line = AsStatements(), log, text, 0
        self.native = EXPORTED not in text[:4000]
        post = _POST.search(text[:4000])
        self.seconds = self.native or (post is not None and "linuxcnc" in post[1])
        self.at: list[float | None] = [None, None, None]
        self.motion, self.relative, self.initial, self.ended = -1.0, False, True, 0
        self.speed, self.sense, self.tool, self.sticky, self.cycle = 0.0, "", 0.0, dict[str, float](), ""
        self.level: float | None = None
        self.feed, self.stated = math.nan, math.nan

    def read(self) -> AsStatements:
        """All lines; an error in the log where one holds what is no command."""
        if self.native:
            self.out.add(0, "UNITS/MM")
        for number, raw in enumerate(self.text.split("\n"), 1):
            self.line = number
            self._say(raw)
            bare = _COMMENT.sub(" ", raw).strip()
            found = _WORD.findall(bare)
            words = [(letter.upper(), float(value)) for letter, value in found if letter.upper() != "N"]
            if _WORD.sub("", bare).strip(" %\t"):
                self.log.error("cl.text", f"no command: {bare[:60]!r}", number, "commands are G or M with words of a letter "
                               "and a number; write others as comments, and no / before lines")
            elif self.native and ("%" in bare or _OF_POSTS & set(words)):
                self.log.error("cl.units", f"{bare[:60]!r} in a file without the header {EXPORTED!r}: F may be per minute "
                               "or per second", number, "write that header as first line where a post made the file (F per "
                               "minute); else take out %, G20, G21, M2 and M30 (F in mm/s)")
            elif words and self.ended:
                self.log.error("cl.text", f"commands behind the end in line {self.ended}", number,
                               "take out the M2 or M30 before them, or what stands behind it")
            elif words:
                self._line(words)
        return self.out

    def _say(self, raw: str) -> None:
        for one, other in _COMMENT.findall(raw):
            text = (one or other).strip(" ()")
            begins = _BEGIN.match(text)
            self.out.say(self.line, "OPNAME" if begins else "REMARK", begins[1] if begins else text)

    def _line(self, words: list[tuple[str, float]]) -> None:
        values = {letter: value for letter, value in words if letter not in "GM"}
        codes = {letter: [code for a, code in words if a == letter] for letter in "GM"}
        if _TURNING & values.keys() and any(values.get(a) for a in _TURNING):
            self.log.error("cl.axis", "A, B or C turn the part on a machine that the file does not describe", self.line,
                           "export positions of the part, or APT from another system")
        self.tool = values.get("T", self.tool)
        if values.get("S", self.speed) != self.speed:
            self.speed = values["S"]
            if self.sense and not {3.0, 4.0, 5.0} & set(codes["M"]):
                self._turn(self.sense)
        for letter, code in words:
            if letter == "G":
                self._g(code, values)
            elif letter == "M":
                self._m(code)
        moves = not values.keys().isdisjoint("XYZIJ" if self.motion in (2.0, 3.0) else "XYZ")
        self._check(values, codes, moves, len(values) + len(codes["G"]) + len(codes["M"]) < len(words))
        if "F" in values:
            self.feed = math.nan if self.motion == 0.0 and (moves or 0.0 in codes["G"]) else values["F"]
        if moves:
            self._move(values)

    def _check(self, values: dict[str, float], codes: dict[str, list[float]], moves: bool, twice: bool) -> None:
        """A word that nothing of the line takes, one twice, or M next to a move is an error."""
        taken = _ALWAYS | set(_TAKEN.get(self.motion, "") if moves else "")
        taken |= set("H" if 43.0 in codes["G"] else "") | set("P" if 4.0 in codes["G"] else "")
        idle = sorted(values.keys() - taken)
        if idle or twice or (moves and codes["M"]):
            why = f"no command of the line takes {', '.join(idle)}" if idle else "a word stands twice, or M next to a move"
            self.log.error("cl.text", why, self.line, "write one command in each line, with its own words")

    def _g(self, code: float, values: dict[str, float]) -> None:
        if code in _MOTIONS:
            self.motion = code
            self.sticky = self.sticky if code in _HOLES else {}
        elif code in (90.0, 91.0):
            self.relative = code == 91.0
        elif code in (98.0, 99.0):
            self.initial = code == 98.0
        elif code == 80.0:
            self._no_cycle()
            self.motion, self.sticky = -1.0, {}
        elif code == 4.0 and self.seconds and "P" in values:
            self.out.add(self.line, f"DELAY/{signed(values['P'])}")
        elif code in _OFFSETS:
            self.out.add(self.line, f"ZERO/{code:g}")
        elif code in (20.0, 21.0):
            self.out.add(self.line, "UNITS/INCHES" if code == 20.0 else "UNITS/MM")
        elif code == 43.0 and values.get("H", self.tool) != self.tool:
            self.log.error("cl.length-register", f"length register H{values['H']:g} of T{self.tool:g}", self.line,
                           "let FreeCAD take the number of the tool, or name the register in the set-up")
        elif code not in _SILENT_G:
            self.out.add(self.line, f"G{code:g}/")

    def _turn(self, sense: str) -> None:
        self.sense = sense
        self.out.add(self.line, f"SPINDL/{signed(self.speed)},RPM,{sense}" if self.speed > 0.0 else f"SPINDL/{sense}")

    def _m(self, code: float) -> None:
        if code in (3.0, 4.0):
            self._turn("CLW" if code == 3.0 else "CCLW")
        elif code == 6.0:
            self.out.add(self.line, f"LOADTL/{self.tool:g}")
        else:
            self.sense = "" if code == 5.0 else self.sense
            self.ended = self.line if code in (2.0, 30.0) else 0
            self.out.add(self.line, _M.get(code, f"M{code:g}/"))

    def _no_cycle(self) -> None:
        if self.cycle:
            self.cycle, self.level = "", None
            self.out.add(self.line, "CYCLE/OFF")

    def _target(self, values: dict[str, float]) -> list[float | None]:
        found = []
        for letter, now in zip("XYZ", self.at, strict=True):
            value = values.get(letter)
            if self.relative and value is not None and now is None:
                self.log.error("cl.goto", f"G91 moves {letter} from where it is, and no position of it is known", self.line,
                               "begin with G90 G0 and X, Y, Z")
            found.append(now if value is None else value + (now or 0.0) if self.relative else value)
        return found

    def _move(self, values: dict[str, float]) -> None:
        if self.motion in _HOLES:
            self._hole(values)
            return
        self._no_cycle()
        start, end = self.at, self._target(values)
        self.at = end
        x, y, z = end
        if x is None or y is None or z is None:
            if self.motion != 0.0:
                self.log.error("cl.goto", "a move before X, Y and Z are known", self.line, "begin with G0 and X, Y, Z")
            return
        if self.motion == 0.0:
            self.out.add(self.line, "RAPID")
        else:
            self._state_feed()
        if self.motion in (2.0, 3.0):
            self._arc(start, (x, y, z), values)
        elif self.motion in (0.0, 1.0):
            self.out.point(self.line, (x, y, z))
        else:
            self.log.error("cl.unknown-motion", "coordinates without a command of motion", self.line,
                           "write G0 or G1 before them")

    def _state_feed(self) -> None:
        """The last F; F of a G0 is the speed of rapids and leaves none behind."""
        if math.isnan(self.feed):
            self.log.error("cl.feed", "a cut without F", self.line,
                           "write F with the first cut, and after a G0 that has one")
        elif self.feed != self.stated:
            self.stated = self.feed
            self.out.add(self.line, f"FEDRAT/{signed(self.feed)},{'MMPS' if self.native else 'PERMIN'}")

    def _arc(self, start: list[float | None], end: tuple[float, ...], values: dict[str, float]) -> None:
        x, y, z = start
        if x is None or y is None or z is None or not values.keys() & set("IJ") or values.get("K") or (
                values.get("P", 1.0) != 1.0):
            self.log.error("cl.circle", "an arc without a point before it, without I and J, with K, or of more turns (P)",
                           self.line, "arcs state their centre by I and J from where they begin, one for each turn")
            return
        centre = (x + values.get("I", 0.0), y + values.get("J", 0.0), z)
        self.out.arc(self.line, centre, (0.0, 0.0, 1.0 if self.motion == 3.0 else -1.0), end)

    def _hole(self, values: dict[str, float]) -> None:
        """A hole from the plane R to Z: R is taken as its top, so that depth and pecks count from where the feed begins."""
        if self.level is None:
            self.level = self.at[2]
        self.sticky.update({k: v for k, v in values.items() if k in "ZRQP"})
        held, f = self.sticky, self.feed
        x, y, _ = self._target({k: v for k, v in values.items() if k in "XY"})
        z, r = held.get("Z"), held.get("R")
        late = held.get("P") and self.motion != 81.0 and not self.seconds
        late = late or (self.motion in (83.0, 73.0) and not held.get("Q", 0.0) > 0.0)
        if x is None or y is None or z is None or r is None or math.isnan(f) or self.relative or late:
            self.log.error("cl.cycle-value", "a hole needs X, Y, Z, R and F in absolute coordinates, stated since the last "
                           "G80; G73 and G83 need Q, and a dwell is in seconds", self.line,
                           "let FreeCAD write the moves of the cycle, or state what is missing")
            return
        back = r if not self.initial or self.level is None else max(self.level, r)
        unit = "MMPS" if self.native else "PERMIN"
        words = [f"CYCLE/{_HOLES[self.motion]},FEDTO,{signed(r - z)},{unit},{signed(f)},RAPTO,0.0,RTRCTO,{signed(back - r)}"]
        words += [f"STEP,{signed(held['Q'])}"] if self.motion in (83.0, 73.0) and "Q" in held else []
        words += [f"DWELL,{signed(held['P'])}"] if held.get("P") and self.motion != 81.0 else []
        cycle = ",".join(words)
        if cycle != self.cycle:
            self.cycle = cycle
            self.out.add(self.line, cycle)
        self.out.point(self.line, (x, y, r))
        self.at = [x, y, back]
