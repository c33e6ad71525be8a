"""Mastercam NCI: pairs of lines, a code and its parameters, as statements.

Source: Mastercam 9.1 MP Post Reference Guide, volume 3, chapter 6 (codes, feeds -1 and -2, compensation, control flags),
and the reader of NCI files in NCCS NCL (ncilod.f, ncimot.f), which says what each parameter of the codes for tools, arcs,
five axes and holes is. Parameters are counted from 1 in messages and from 0 here.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from toolpaths.cl.systems.as_statements import AsStatements, numbers, signed
from toolpaths.cl.text.log import DiagnosticLog

_LEAST = {0: 5, 1: 5, 2: 8, 3: 8, 4: 1, 11: 7, 81: 17, 100: 11, 1000: 10, 1001: 10, 1002: 10, 1013: 3, 1014: 9, 1027: 12}
"""numbers that a code must have at least"""
_KINDS = {0: "DRILL", 1: "DEEP", 2: "BRKCHP", 3: "TAP", 4: "REAM", 5: "BORE"}
_DIGITS = 9
"""of a code, at most"""
_SIDES: dict[float, str] = {40: "OFF", 140: "OFF", 41: "LEFT", 42: "RIGHT"}
_COOLANT: dict[float, str] = {0: "OFF", 1: "FLOOD", 2: "MIST", 3: "THRU"}
_TEXTS = {1005: "PPRINT", 1006: "INSERT", 1007: "PPRINT", 1008: "PPRINT", 20001: "TPRINT"}
_PARAMETERS = 10_000
"""codes from here on repeat what was chosen in dialogs"""
_NEUTRAL = frozenset({1009, 1010, 1011, 1012, 1015, 1016, 1017, 1020, 1050})
_RAPID, _SAME = -2.0, -1.0
_COOLANT_DIGIT = 100_000
_SAME_PLACE = 1e-6
_UPRIGHT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class NciReader:
    """Carries out the codes of one file."""

    def __init__(self, log: DiagnosticLog):
        self.out, self.log = AsStatements(), log
        self.at: tuple[float, ...] = ()
        self.side, self.coolant, self.register = "OFF", "OFF", 0.0
        self.cycle, self.armed, self.drill = "", False, list[float]()
        self.name, self.operations, self.line = "", 0, 0

    def read(self, text: str) -> AsStatements:
        """All pairs of lines of `text`; an error in the log where one is none."""
        lines = text.rstrip().split("\n")
        for k in range(0, len(lines), 2):
            self.line = k + 1
            code, body = lines[k].strip(), lines[k + 1].strip() if k + 1 < len(lines) else ""
            if not (code.isascii() and code.isdigit() and len(code) <= _DIGITS):
                self.log.error("cl.text", f"no NCI code: {code[:60]!r}", self.line,
                               "codes stand alone in every other line; have Mastercam write the file again")
                break
            self._one(int(code), body)
            if int(code) == 1003:
                self._nothing_behind(lines, k + 2)
                break
        else:
            self.log.warning("cl.cut-off", "the file ends without code 1003: it may be cut off", len(lines),
                             "compare its last line with Mastercam, or have it written again")
        return self.out

    def _nothing_behind(self, lines: list[str], end: int) -> None:
        behind = next((n for n, line in enumerate(lines[end:], end + 1) if line.strip()), 0)
        if behind:
            self.log.error("cl.text", f"text behind code 1003, which ends the file in line {end - 1}", behind,
                           "write one NCI file for each program, or take the code 1003 out")

    def _one(self, code: int, body: str) -> None:
        if code in _TEXTS:
            self.out.say(self.line, _TEXTS[code], body.split(",")[0] if code == 20001 else body)
            self.name = body if code == 1008 else self.name
        elif code in _HANDLERS:
            values = self._values(code, body)
            if values is not None:
                _HANDLERS[code](self, code, values)
        elif code in _NEUTRAL or code >= _PARAMETERS:
            self.out.say(self.line, "REMARK", f"NCI {code}")
        else:
            self.out.add(self.line, f"NCI-{code}/")

    def _values(self, code: int, body: str) -> list[float] | None:
        try:
            values = [float(word) for word in body.split()]
        except ValueError:
            values = []
        if len(values) < _LEAST.get(code, 0) or not all(map(math.isfinite, values)):
            self.log.error("cl.form", f"code {code} takes {_LEAST.get(code, 0)} numbers or more, found {body[:60]!r}",
                           self.line, "have Mastercam write the file again")
            return None
        return values

    def _feed(self, feed: float, code: int) -> bool:
        """State the feed of a move; True where it is a rapid."""
        if code == 0 and feed not in (_RAPID, _SAME):
            self.log.error("cl.feed", f"code 0 is a rapid and its feed is {feed:g}", self.line,
                           "have Mastercam write code 1, or the feed -2")
        if code == 0 or feed == _RAPID:
            self.out.add(self.line, "RAPID")
            return True
        if feed != _SAME:
            self.out.add(self.line, f"FEDRAT/{signed(feed)},PERMIN")
        return False

    def _flags(self, flags: float) -> None:
        """Coolant by the sixth digit of the control flags, one more than its kind; the others mark ends of contours."""
        digit = int(flags) // _COOLANT_DIGIT % 10
        if digit:
            self._cool(digit - 1)

    def _cool(self, kind: float) -> None:
        word = _COOLANT.get(kind)
        if word is None:
            self.log.error("cl.form", f"coolant {kind:g} is none of {', '.join(map(str, _COOLANT))}", self.line,
                           "choose coolant off, flood, mist or through the tool in Mastercam")
        elif word != self.coolant:
            self.coolant = word
            self.out.add(self.line, f"COOLNT/{word}")

    def _compensate(self, code: float) -> None:
        """Cutter compensation by the control: 0 as it is, 40 and 140 off, 41 left, 42 right."""
        side = _SIDES.get(code, self.side)
        if code not in (0.0, *_SIDES):
            self.log.error("cl.form", f"compensation {code:g} is none of 0, 40, 41, 42, 140", self.line,
                           "have Mastercam write the file again, arcs in XY and compensation by these codes")
        elif side != self.side:
            self.side = side
            register = f",{self.register:g}" if side != "OFF" and self.register > 0.0 else ""
            self.out.add(self.line, f"CUTCOM/{side}{register}")

    def _no_cycle(self) -> None:
        if self.armed:
            self.armed, self.cycle = False, ""
            self.out.add(self.line, "CYCLE/OFF")

    def line_move(self, code: int, v: list[float]) -> None:
        """0, 1: compensation, x, y, z, feed, flags."""
        self._no_cycle()
        self._compensate(v[0])
        self._flags(v[5] if len(v) > 5 else 0.0)
        self._feed(v[4], code)
        self.at = tuple(v[1:4])
        self.out.point(self.line, self.at)

    def five_axes(self, code: int, v: list[float]) -> None:
        """11: tip, a point of the tool axis above it, feed, -, flags."""
        self._no_cycle()
        axis = np.array(v[3:6]) - v[:3]
        length = float(np.linalg.norm(axis))
        if not length > 0.0:
            self.log.error("cl.axis", "the tool axis of code 11 has no length", self.line,
                           "have Mastercam write the file again")
            return
        flags = v[8] if len(v) > 8 else 0.0
        if max(int(flags) // 100 % 10, int(flags) // 1000 % 10) > 1:
            self.log.error("cl.form", f"flags {flags:g}: cutter compensation of 5-axis moves is not carried out", self.line,
                           "have Mastercam compensate (compensation in the computer)")
        self._flags(flags)
        self._feed(v[6], code)
        self.at = tuple(v[:3])
        self.out.point(self.line, self.at, (axis / length).tolist())

    def arc(self, code: int, v: list[float]) -> None:
        """2, 3: plane and compensation, end x, y, centre x, y, end z, feed, flags, whole turn. The first two stand in
        either order: a plane is 0, 1 or 2, a compensation 0 or 40 and above."""
        self._no_cycle()
        plane, side = (v[1], v[0]) if v[0] >= 40.0 or v[1] in (1.0, 2.0) else (v[0], v[1])
        whole = len(self.at) == 3 and math.dist(self.at[:2], v[2:4]) < _SAME_PLACE
        if plane != 0.0 or (len(v) > 9 and whole != (v[9] != 0.0)):
            why = "its plane is not XY" if plane else "its end and its flag of a whole turn contradict each other"
            self.log.error("cl.circle", f"arc of code {code}: {why}", self.line,
                           "have Mastercam write lines in its place (filter, arcs in XY only)")
            return
        self._compensate(side)
        self._flags(v[8] if len(v) > 8 else 0.0)
        if self._feed(v[7], code):
            self.log.error("cl.arc-rapid", "an arc at the feed -2", self.line, "give the arc a feed in Mastercam")
        z = self.at[2] if self.at else v[6]
        end = (*(self.at[:2] if whole else v[2:4]), v[6])
        self.out.arc(self.line, (v[4], v[5], z), (0.0, 0.0, 1.0 if code == 3 else -1.0), end)
        self.at = end

    def dwell(self, code: int, v: list[float]) -> None:
        """4: seconds, spindle speed."""
        self.out.add(self.line, f"DELAY/{signed(v[0])}")
        if len(v) > 1:
            self._turn(v[1])

    def _turn(self, speed: float) -> None:
        """Spindle: clockwise where positive, off where 0."""
        sense = "CLW" if speed > 0.0 else "CCLW"
        self.out.add(self.line, f"SPINDL/{signed(abs(speed))},RPM,{sense}" if speed else "SPINDL/OFF")

    def hole(self, code: int, v: list[float]) -> None:
        """81: kind, bottom, dwell, feed, pecks, -, -, clearance, start and top as heights, -, a point over the bottom at the
        clearance, flags, turned over."""
        self.drill = list(v)
        self._drilled(v)

    def next_hole(self, code: int, v: list[float]) -> None:
        """100: -, bottom, clearance, start, dwell, feed, a point over the bottom, flags: as the code 81 before it."""
        if not self.drill:
            self.log.error("cl.cycle", "code 100 before any code 81", self.line, "have Mastercam write the file again")
            return
        d = self.drill
        self._drilled([d[0], *v[1:4], v[6], v[7], *d[6:10], v[4], v[5], *d[12:14], *v[8:11], *v[11:13]])

    def _drilled(self, v: list[float]) -> None:
        """A hole: its top is the height of the material, its depth is from there."""
        up = np.array(v[14:17]) - v[1:4]
        length = float(np.linalg.norm(up))
        clearance, start, top = v[10:13]
        depth = length + top - clearance
        kind = _KINDS.get(int(v[0]))
        if kind is None or (len(v) > 18 and v[18]) or not depth > 0.0 or start < top:
            why = (f"kind {v[0]:g} is not carried out" if kind is None else "its depth or start plane lies on the wrong side"
                   if not depth > 0.0 or start < top else "it is turned over")
            self.log.error("cl.cycle", f"hole: {why}", self.line,
                           "have Mastercam write the moves of this hole (long hand)")
            return
        self._flags(v[17] if len(v) > 17 else 0.0)
        words = [f"CYCLE/{kind},FEDTO,{signed(depth)},PERMIN,{signed(v[5])},RAPTO,{signed(start - top)},"
                 f"RTRCTO,{signed(max(clearance, start) - top)}"]
        words += [f"STEP,{numbers([p for p in v[6:8] if p > 0.0])}"] if kind in ("DEEP", "BRKCHP") and v[6] > 0.0 else []
        words += [f"DWELL,{signed(v[4])}"] if v[4] else []
        cycle = ",".join(words)
        if cycle != self.cycle:
            self.cycle, self.armed = cycle, True
            self.out.add(self.line, cycle)
        axis = up / length
        self.out.point(self.line, (np.array(v[1:4]) + depth * axis).tolist(), axis.tolist())
        self.at = tuple((np.array(v[14:17]) + max(start - clearance, 0.0) * axis).tolist())

    def tool(self, code: int, v: list[float]) -> None:
        """1000 to 1002: -, -, -, tool, radius register, length register, plane, spindle, feed, coolant; 1000: no change."""
        self._no_cycle()
        self.operations += 1
        self.out.say(self.line, "OPNAME", self.name or f"OP {self.operations}")
        self.name = ""
        if code != 1000:
            self.side = "OFF"
            self.out.add(self.line, f"LOADTL/{v[3]:g}" + (f",OSETNO,{v[5]:g}" if v[5] > 0.0 else ""))
        self.register = v[4]
        if v[7]:
            self._turn(v[7])
        self._cool(v[9])

    def cutter(self, code: int, v: list[float]) -> None:
        """1013: -, diameter, corner radius."""
        if v[1] > 0.0:
            self.out.add(self.line, f"CUTTER/{numbers(v[1:3])}")

    def frame(self, code: int, v: list[float]) -> None:
        """1014, 1027: tool plane, and work plane with its origin. Upright and at the origin, or it is refused."""
        self.out.say(self.line, "REMARK", f"NCI {code}")
        if max(abs(a - b) for a, b in zip(_UPRIGHT, v, strict=False)) > _SAME_PLACE or any(v[9:_LEAST[code]]):
            self.log.error("cl.frame", f"code {code}: a plane that is tilted, turned or away from the origin, and in which "
                           "sense it moves the points is not documented", self.line,
                           "write one NCI file for each plane as the top plane, or 5-axis moves (code 11)")

    def others(self, code: int, v: list[float]) -> None:
        """80 cycle off, 1003 end, 1004 compensation off, 200 and 201 threads of lathes."""
        if code == 80:
            self._no_cycle()
        elif code == 1004:
            self._compensate(40.0)
        else:
            self.out.add(self.line, "FINI" if code == 1003 else "APPLY/TURN")


_HANDLERS: dict[int, Callable[[NciReader, int, list[float]], None]] = {
    0: NciReader.line_move, 1: NciReader.line_move, 2: NciReader.arc, 3: NciReader.arc, 4: NciReader.dwell,
    11: NciReader.five_axes, 80: NciReader.others, 81: NciReader.hole, 100: NciReader.next_hole, 200: NciReader.others,
    201: NciReader.others, 1000: NciReader.tool, 1001: NciReader.tool, 1002: NciReader.tool, 1003: NciReader.others,
    1004: NciReader.others, 1013: NciReader.cutter, 1014: NciReader.frame, 1027: NciReader.frame}
