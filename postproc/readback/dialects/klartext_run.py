"""The statements of a Klartext program in running order: poles, circles, polar blocks, tools, cycles, laws."""

from __future__ import annotations

import math
import re

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.dialects.iso import New
from postproc.readback.dialects.klartext_cycles import FEED_PARTS, drill_of
from postproc.readback.dialects.klartext_splines import cubic_of
from postproc.readback.dialects.track import AxisPositions
from postproc.readback.text.canonical import (
    CALL,
    CURVE,
    LAW,
    LOADED,
    OFFSET,
    REGISTER,
    REST,
    SMOOTH,
    SMOOTH_AXIS,
    SMOOTH_LEVEL,
    STATEMENT,
    TURNS,
    Canonical,
    DialectStatement,
    Drill,
    ProgramText,
    RotaryDirection,
    WordMeaning,
    added,
)
from postproc.readback.text.euler_angles import turned
from postproc.readback.text.modal import GROUPS, codes, fill, number_of
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import MM_PER_INCH

PLANES = {frozenset("XY"): 17.0, frozenset("XZ"): 18.0, frozenset("YZ"): 19.0}
"""codes of the planes of circles by their axes; DR+ turns as G3 does there"""
_TCPM = {"F", "TCP", "AXIS", "POS", "PATHCTRL", "REFPNT", "TIP-TIP"}
_UNCOMPENSATED = {"PLANE SPATIAL", "PLANE RESET", "FUNCTION TCPM", "FUNCTION RESET TCPM", "M128", "M129"}
"""before these radius compensation is cancelled (iTNC 530 manual; TOOL CALL, cycles 19 and 32 too)"""
_PLANE = re.compile(r"(?: (?:TURN|MOVE)(?: (?:DIST|ABST)[-+]?[\d.]+)?(?: F\+?[\d.]+| F ?MAX)| STAY)(?: (?:SYM|SEQ)[-+])?"
                    r"(?: (?:TABLE|COORD) ROT)?")
"""what stands behind the angles of a plane: how the rotary axes come there is stated, and TURN and MOVE with their feed"""
_CHOICES: dict[str, RotaryDirection] = {"SYM+": "+", "SYM-": "-", "SEQ+": "+", "SEQ-": "-"}


class KlartextRun:
    """One pass over the statements; what it puts in force goes into `new` words."""

    def __init__(self, text: ProgramText, line: Ints, file: str, axes: tuple[str, ...]) -> None:
        self.text, self.words, self.line, self.file, self.axes = text, text.words, line, file, axes
        self.new: New = []
        self.found: list[Diagnostic] = []
        self.laws: list[WordMeaning] = []
        self.drills: list[Drill] = []
        self.curves: list[Floats] = []
        self.pole: dict[str, float] = {}
        self.track = AxisPositions(text.words)
        self.state: InterpolationMode = "axes"
        self.cycle = -1
        self.speed = np.array(number_of(text.words, "S"))
        self.side = fill(*codes(text.words, "G", GROUPS["compensation"]), text.words.lines, 40.0)
        self.part = math.nan, math.nan
        self.waiting: tuple[int, float] | None = None
        self.inch = any(s.name == "BEGIN PGM" and s.args[1] == "INCH" for s in text.statements[:1])

    def fault(self, code: str, b: int, message: str, hint: str) -> None:
        """An ERROR at a block."""
        self.found.append(error(code, message, file=self.file, lines=[int(self.line[b])], hint=hint))

    def canonical(self) -> Canonical:
        """Canonical words of the whole program."""
        words = self.words
        where, index = words.pick(STATEMENT)
        events = [(int(b), 0, self.text.statements[int(k)]) for b, k in zip(where, index, strict=True)]
        events += [(int(b), 1, DialectStatement(f"M{int(m)}")) for b,
                   m in zip(*codes(words, "M", (91, 99, 128, 129)), strict=True)]
        for b, _, s in sorted(events, key=lambda e: e[:2]):
            self.in_order(b, s)
            self.one(b, s)
        self.in_order(words.lines, DialectStatement(""))
        both = {13.0: (3.0, 8.0), 14.0: (4.0, 8.0)}
        for b, m in zip(*codes(words, "M", (13, 14)), strict=True):
            self.new += [(int(b), "M", v) for v in both[float(m)]]
        drop = (words.letter == ord(STATEMENT)) | ((words.letter == ord("M")) & np.isin(words.value, (13, 14, 91, 99, 128,
                                                                                                129)))
        self.new += [(1, "G", 20.0)] if self.inch else []
        return Canonical(added(words, self.new, drop), self.line, tuple(self.laws), tuple(self.drills),
                         feed_parts=FEED_PARTS if self.inch else 1.0, curves=np.array(self.curves).reshape(-1, 3, 4))

    def one(self, b: int, s: DialectStatement) -> None:
        """One statement of block b."""
        steps = {"CC": self.centre, "C": self.circle, "CR": self.radius, "CP": self.polar_arc, "LP": self.polar_line,
                 "TOOL CALL": self.tool, "CYCL DEF": self.define, "CYCL CALL": self.call, "M99": self.call,
                 "CYCL CALL POS": self.call, "SPL": self.spline, "PLANE SPATIAL": self.plane, "FUNCTION TCPM": self.tcpm}
        if s.name in steps:
            steps[s.name](b, s)
        elif s.name == "M91":
            self.new.append((b, "G", 53.0))
            self.track.lost(b, "XYZ")
        elif s.name == "M128":
            self.enter(b, "tcp", WordMeaning("tcp", s.name))
        elif s.name in ("M129", "FUNCTION RESET TCPM"):
            self.enter(b, "axes" if self.state == "tcp" else self.state, WordMeaning("axes", s.name))
        elif s.name == "PLANE RESET":
            self.reset(b, s)
        elif s.name == "STOP":
            self.new.append((b, "M", 0.0))

    def in_order(self, b: int, s: DialectStatement) -> None:
        """Parts of cycles 9 and 32 stand one behind the other, and none of these while radius compensation is on."""
        number, part = (s.number(0), s.number(1)) if s.name == "CYCL DEF" else (math.nan, math.nan)
        if self.waiting is not None and ((number, part) != (self.waiting[1], 1.0) or self.between(self.waiting[0], b)):
            self.fault("gcode.cycle", self.waiting[0], f"CYCL DEF {self.waiting[1]:g}.0 without its part "
                       f"{self.waiting[1]:g}.1", f"CYCL DEF {self.waiting[1]:g}.1 in the next block")
        before, self.waiting = self.waiting, (b, number) if part == 0.0 else None
        last = self.part
        self.part = (number, part) if part == part else (math.nan, math.nan)
        if part > 0.0 and (before is None if part == 1.0 else last != (number, part - 1.0)):
            self.fault("gcode.cycle", b, f"CYCL DEF {number:g}.{part:g} without CYCL DEF {number:g}.{part - 1.0:g} before "
                       "it", f"CYCL DEF {number:g}.0 and its parts in order")
        shifts = s.name in _UNCOMPENSATED or (s.name == "TOOL CALL") or number == 32.0
        if shifts and self.side[b] != 40.0:
            name = f"CYCL DEF {number:g}" if number == 32.0 else s.name
            self.fault("gcode.compensation", b, f"{name} while radius compensation is on", "R0 before it")

    def between(self, first: int, last: int) -> bool:
        """True where words stand between two blocks."""
        low, high = np.searchsorted(self.words.line, [first + 1, last])
        return bool(high > low)

    # ---- contours ------------------------------------------------------------------------------------------

    def place(self, b: int, keys: dict[str, float]) -> dict[str, float] | None:
        """Coordinates in keys, those with I counted from the last position."""
        result = {}
        for key, value in keys.items():
            if key in self.axes:
                result[key] = value
            elif key[0] == "I" and key[1:] in self.axes:
                here = self.track.at(b, key[1:])
                if here is None:
                    self.fault("gcode.pole", b, f"{key} before {key[1:]} was stated in this mode",
                               "state it absolutely first")
                    return None
                result[key[1:]] = here + value
        return result

    def centre(self, b: int, s: DialectStatement) -> None:
        """CC: the pole; without coordinates the last position."""
        keys = s.keys or {"IX": 0.0, "IY": 0.0}
        pole = self.place(b, keys)
        if pole is None:
            return
        if len(pole) == 1:
            pole = {**{k: v for k, v in self.pole.items() if k in ("X", "Y")}, **pole}
        if frozenset(pole) not in PLANES:
            self.fault("gcode.pole", b, f"CC with {', '.join(pole) or 'nothing'}", "two of X, Y, Z")
            return
        self.pole = pole

    def circle(self, b: int, s: DialectStatement) -> None:
        """C: from where the tool is to X, Y about the pole, a full circle where both are one."""
        end = self.place(b, s.keys)
        if end is None or not self.about_pole(b, s):
            return
        if not set(end) <= set(self.pole):
            self.fault("gcode.arc", b, "C out of the plane of its CC", "CP with IZ for a helix")
            return
        self.states(b, end)

    def about_pole(self, b: int, s: DialectStatement) -> bool:
        """The codes of an arc about the pole."""
        sense = s.number(0, 0.0)
        if not self.pole or sense == 0.0:
            self.fault("gcode.pole", b, f"{s.name} without CC or DR", "CC before it, DR+ or DR- in it")
            return False
        self.new += [(b, "G", 3.0 if sense > 0.0 else 2.0), (b, "G", PLANES[frozenset(self.pole)])]
        self.new += [(b, {"X": "I", "Y": "J", "Z": "K"}[a], value) for a, value in self.pole.items()]
        return True

    def states(self, b: int, end: dict[str, float]) -> None:
        """Absolute words of block b that a statement works out."""
        for letter, value in end.items():
            self.new.append((b, letter, value))
            self.track.put(b, letter, value)

    def radius(self, b: int, s: DialectStatement) -> None:
        """CR: X, Y, R, DR."""
        end = self.place(b, {k: v for k, v in s.keys.items() if k != "R"})
        sense = s.number(0, 0.0)
        if end is None:
            return
        if "R" not in s.keys or sense == 0.0:
            self.fault("gcode.arc", b, "CR without R or DR", "R+ up to half a turn, R- for more; DR+ or DR-")
            return
        plane = PLANES.get(frozenset(end), 17.0)
        self.new += [(b, "G", 3.0 if sense > 0.0 else 2.0), (b, "G", plane), (b, "R", s.keys["R"])]
        self.states(b, end)

    def polar(self, b: int) -> tuple[float, float] | None:
        """(radius, angle in degrees) of the last position about a pole in X and Y."""
        here = self.track.at(b, "X"), self.track.at(b, "Y")
        if set(self.pole) != {"X", "Y"} or None in here:
            self.fault("gcode.pole", b, "polar coordinates without CC X Y, or before X and Y were stated in this mode",
                       "CC X Y, and an L with X and Y, before it")
            return None
        x, y = float(here[0] or 0.0) - self.pole["X"], float(here[1] or 0.0) - self.pole["Y"]
        return math.hypot(x, y), math.degrees(math.atan2(y, x))

    def polar_arc(self, b: int, s: DialectStatement) -> None:
        """CP: about the pole to PA, or by IPA, which may be more than a turn; Z besides makes a helix."""
        now, sense = self.polar(b), s.number(0, 0.0)
        rise = self.place(b, {k: v for k, v in s.keys.items() if k not in ("PA", "IPA")})
        if now is None or rise is None or not self.about_pole(b, s):
            return
        to_angle = sense * ((sense * (s.keys.get("PA", now[1]) - now[1])) % 360.0 or 360.0)
        angle = s.keys.get("IPA", to_angle)
        if angle * sense <= 0.0:
            self.fault("gcode.arc", b, f"CP IPA{angle:+g} against its DR", "the same sign in both")
            return
        turn = now[1] + angle
        self.states(b, {"X": self.pole["X"] + now[0] * math.cos(math.radians(turn)),
                        "Y": self.pole["Y"] + now[0] * math.sin(math.radians(turn)), **rise})
        self.new.append((b, TURNS, float(math.ceil(abs(angle) / 360.0 - 1e-9) - 1)))

    def polar_line(self, b: int, s: DialectStatement) -> None:
        """LP: straight to PR, PA."""
        now = self.polar(b) if {"IPR", "IPA"} & set(s.keys) or len({"PR", "PA"} & set(s.keys)) < 2 else (0.0, 0.0)
        rest = self.place(b, {k: v for k, v in s.keys.items() if k not in ("PR", "PA", "IPR", "IPA")})
        if set(self.pole) != {"X", "Y"}:
            self.fault("gcode.pole", b, "LP without CC X Y", "CC X Y before it")
            return
        if now is None or rest is None:
            return
        r = s.keys.get("PR", now[0] + s.keys.get("IPR", 0.0))
        angle = math.radians(s.keys.get("PA", now[1] + s.keys.get("IPA", 0.0)))
        self.states(b, {"X": self.pole["X"] + r * math.cos(angle), "Y": self.pole["Y"] + r * math.sin(angle), **rest})

    def spline(self, b: int, s: DialectStatement) -> None:
        """SPL: a cubic to its end; its begin must be where the tool stands."""
        unit = MM_PER_INCH if self.inch else 1.0
        curve, wrong = cubic_of({k: v * unit if len(k) == 3 or k in "XYZ" else v for k, v in s.keys.items()}, {
            a: None if (here := self.track.at(b, a)) is None else here * unit for a in "XYZ"})
        if wrong:
            self.fault("gcode.curve", b, f"SPL {wrong} is not executed", "state end, K3, K2 and K1 of each axis that moves")
            return
        self.new += [(b, "G", 1.0), (b, CURVE, float(len(self.curves))), *((b, k, s.keys[k]) for k in "FM" if k in s.keys)]
        self.curves.append(curve)
        self.states(b, {a: s.keys[a] for a in "XYZ" if a in s.keys})

    # ---- tools and cycles ----------------------------------------------------------------------------------

    def tool(self, b: int, s: DialectStatement) -> None:
        """TOOL CALL n Z S: the tool, its length and its speed; without n the speed alone."""
        number = s.number(0)
        if s.args[1] not in (None, "Z") or any(s.keys.get(k, 0.0) != 0.0 for k in ("DL", "DR", "DR2")):
            self.fault("gcode.tool", b, "TOOL CALL with another axis than Z, or with DL or DR",
                       "TOOL CALL n Z S")
        if "S" in s.keys:
            self.new.append((b, "S", s.keys["S"]))
            self.speed[b:] = s.keys["S"]
        if not math.isnan(number):
            self.new += [(b, LOADED, number), (b, REGISTER, number)]

    def define(self, b: int, s: DialectStatement) -> None:
        """CYCL DEF: what holds from here on, or a cycle to be called."""
        number, part = s.number(0), s.number(1)
        if number == 247.0:
            if "Q339" not in s.keys:
                self.fault("gcode.cycle", b, "CYCL DEF 247 lacks Q339", "Q339=+1 ;DATUM NUMBER")
            self.new.append((b, OFFSET, s.keys.get("Q339", math.nan)))
            self.track.lost(b, "XYZ")
        elif number == 9.0:
            seconds = re.search(r"([-+]?\d+\.?\d*)\s*$", str(s.args[2])) if part == 1.0 else None
            self.new += [(b, REST, float(seconds[1]))] if seconds else []
            if part == 1.0 and not seconds:
                self.fault("gcode.dwell", b, "CYCL DEF 9.1 lacks its time",
                           "CYCL DEF 9.1 DWELL 0.5 (seconds)")
        elif number == 32.0:
            unit, mode = MM_PER_INCH if self.inch else 1.0, s.keys.get("HSC-MODE", 0.0)
            if part == 2.0 and mode not in (0.0, 1.0):
                self.fault("gcode.smoothing", b, f"CYCL DEF 32.2 with HSC-MODE:{mode:g}", "HSC-MODE:0 finishing, 1 roughing")
            self.new += [(b, SMOOTH, s.keys.get("T", 0.0) * unit or math.inf)] if part == 1.0 else []
            self.new += [(b, SMOOTH_AXIS, s.keys.get("TA", math.inf) if part == 2.0 else math.inf)] if part else []
            self.new += [(b, SMOOTH_LEVEL, s.keys.get("HSC-MODE", math.nan) if part == 2.0 else math.nan)] if part else []
        else:
            drill, why = drill_of(int(number), s.keys, float(self.speed[b]), self.inch)
            if drill is None:
                self.fault("gcode.cycle", b, f"CYCL DEF {number:g} {why}",
                           "200, 201, 203, 205, 206, 207, 240, 247, 9 and 32 are executed")
                return
            self.drills.append(drill)
            self.cycle = len(self.drills) - 1

    def call(self, b: int, s: DialectStatement) -> None:
        """M99, CYCL CALL, CYCL CALL POS X Y Z+0 F: the cycle defined last."""
        if self.cycle < 0:
            self.fault("gcode.cycle", b, f"{s.name} without a cycle", "CYCL DEF before it")
            return
        rest = str(s.args[0]) if s.args else ""
        if s.name == "CYCL CALL POS":
            place = {a: float(v) for a, v in re.findall(r"([XYZ])\s*([-+]?\d*\.?\d+)", rest)}
            if place.pop("Z", 0.0) != 0.0:
                self.fault("gcode.cycle", b, "CYCL CALL POS with Z shifts the datum", "Z+0")
            fast = bool(re.search(r"F ?MAX", rest))
            feed = re.search(r"F\s*(\d+\.?\d*)", rest)
            self.new += [(b, "G", 0.0 if fast else 1.0), *([(b, "F", float(feed[1]))] if feed and not fast else [])]
            self.states(b, place)
        self.new += [(b, "M", float(m)) for m in re.findall(r"M(\d+)", rest)]
        self.new.append((b, CALL, float(self.cycle)))
        self.track.lost(b, "Z")

    # ---- laws ----------------------------------------------------------------------------------------------

    def enter(self, b: int, state: InterpolationMode, law: WordMeaning) -> None:
        """A law in force from block b on."""
        if state != "axes" and self.state != "axes" and law.name != "axes":
            self.fault("gcode.mode", b, f"{law.code} while another mode is on",
                       "leave the mode that is on first")
        if law.name == "axes" and state == "tilted":
            return
        if state != self.state:
            self.track.lost(b, "XYZ")
        self.state = state
        self.new.append((b, LAW, float(len(self.laws))))
        self.laws.append(law)

    def tcpm(self, b: int, s: DialectStatement) -> None:
        """FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS: F at the tip, rotary positions linear."""
        strange = set(s.args) - _TCPM
        if strange or s.args[:4] != ("F", "TCP", "AXIS", "POS") or s.args[4:6] != ("PATHCTRL", "AXIS"):
            self.fault("gcode.mode", b, "FUNCTION TCPM of another kind",
                       "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS")
        self.enter(b, "tcp", WordMeaning("tcp", s.name))

    def plane(self, b: int, s: DialectStatement) -> None:
        """PLANE SPATIAL SPA SPB SPC."""
        rest = "".join(f" {a}" for a in s.args if not re.fullmatch(r"SP[ABC][-+]?[\d.]+", str(a)))
        if not {"SPA", "SPB", "SPC"} <= set(s.keys) or not _PLANE.fullmatch(rest) \
                or any(s.keys.get(key, 0.0) != 0.0 for key in ("DIST", "ABST")):
            self.fault("gcode.mode", b, f"PLANE SPATIAL ...{rest or ' without TURN, MOVE or STAY'}",
                       "PLANE SPATIAL SPA SPB SPC, then TURN or MOVE with F or FMAX, or STAY, then SYM+ or SYM-, then "
                       "TABLE ROT or COORD ROT, DIST 0")
            return
        rotation = turned("XYZ", [s.keys[k] for k in ("SPA", "SPB", "SPC")], fixed=True)
        asked: RotaryDirection = next((_CHOICES[str(a)] for a in s.args if str(a) in _CHOICES), "nearest")
        self.enter(b, "tilted", WordMeaning("tilted", s.name, rotation, choice=asked))

    def reset(self, b: int, s: DialectStatement) -> None:
        """PLANE RESET STAY: the rotary axes stand."""
        if s.args != ("STAY",):
            self.fault("gcode.mode", b, "PLANE RESET that may move the rotary axes", "PLANE RESET STAY")
        self.enter(b, "tcp" if self.state == "tcp" else "axes", WordMeaning("axes", s.name))


