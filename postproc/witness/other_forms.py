"""Files that are no APT text as records: Mastercam NCI, FreeCAD's G-code, STEP-NC of ISO 14649 (Part 21 text)."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from typing import Any

import numpy as np

from postproc.witness.text import Array, ClText, Saying, Word, without_carriage_returns

_DRILLED = {0: "DRILL", 1: "DEEP", 2: "BRKCHP", 3: "TAP", 4: "REAM", 5: "BORE"}
_COOLED = ("OFF", "FLOOD", "MIST", "THRU")
_WORDS = re.compile(r"([A-Z])[ \t]*([-+]?[\d.]+(?:E[-+]?\d+)?)")
_PLAIN = {0.0: ("STOP",), 1.0: ("OPSTOP",), 5.0: ("SPINDL", "OFF"), 7.0: ("COOLNT", "MIST"), 8.0: ("COOLNT", "FLOOD"),
          9.0: ("COOLNT", "OFF")}
_HOLES = (73.0, 81.0, 82.0, 83.0)
_INSTANCE = re.compile(r"#(\d+)\s*=\s*(\w+)\s*\((.*?)\)\s*;", re.DOTALL)
_TEXT, _COMMENT = re.compile(r"'(?:[^']|'')*'"), re.compile(r"/\*.*?\*/", re.DOTALL)
_ITEM = re.compile(r"[(),]|[^(),\s]+")
Leg = tuple[Array, Array | None, Array | None]
"""end, centre and right-hand normal of an arc"""


def other_text(data: bytes, asked: str | None) -> tuple[str, ClText] | None:
    """(name of the form, records with the lines of the file) where a file is no APT text, by what it holds or as asked."""
    text = without_carriage_returns(data).decode("utf-8", "replace")
    name = asked or _name(text)
    forms: dict[str, type[Saying]] = {"nci": Nci, "freecad": FreeCad, "step-nc": StepNc}
    if name not in forms:
        return None
    form = forms[name]()
    form.read(text)
    count = len(form.said)
    return name, ClText(np.zeros((0, 6)), np.zeros(0, np.int64), form.said, [0] * count, form.lines)


def _name(text: str) -> str:
    head = text[:20_000].lstrip()
    if head.startswith("ISO-10303-21"):
        return "step-nc" if "MACHINING_WORKINGSTEP" in text and "MACHINING_WORKPLAN" not in text else ""
    if "(EXPORTED BY FREECAD)" in head[:400].upper() and "GOTO" not in head:
        return "freecad"
    first = [line.split() for line in head.split("\n")[:3]]
    pairs = len(first) == 3 and all(len(first[k]) == 1 and first[k][0].isascii() and first[k][0].isdigit() for k in (0, 2))
    return "nci" if pairs and first[1] and not any("/" in word for word in first[1]) else ""


class Nci(Saying):
    """Pairs of lines: a code and its parameters."""

    on = cool = 0
    register = 0.0
    cycle: tuple[Word, ...] = ()
    last: tuple[float, ...] = (math.nan,) * 3

    def read(self, text: str) -> None:
        """All pairs."""
        lines = text.rstrip().split("\n")
        for n in range(0, len(lines) - 1, 2):
            self.line, code = n + 1, int(lines[n])
            if code in (0, 1, 2, 3, 11):
                self._move(code, [float(w) for w in lines[n + 1].split()])
            elif code in (81, 100):
                self._hole(code, [float(w) for w in lines[n + 1].split()])
            elif code in (1000, 1001, 1002):
                self._tool(code, [float(w) for w in lines[n + 1].split()])
            else:
                self._other(code, lines[n + 1].strip())

    def _off(self) -> None:
        if self.cycle:
            self.cycle = ()
            self.say("CYCLE", "OFF")

    def _move(self, code: int, v: list[float]) -> None:
        self._off()
        side = 0 if code == 11 else int(max(v[:2]) if code > 1 else v[0])
        on = {0: self.on, 41: 41, 42: 42}.get(side, 0)
        if on != self.on:
            self.on = on
            number: list[Word] = [self.register] if on and self.register > 0.0 else []
            self.say("CUTCOM", {0: "OFF", 41: "LEFT", 42: "RIGHT"}[on], *number)
        at = 5 if code < 2 else 8
        digit = int(v[at]) // 100_000 % 10 if len(v) > at else 0
        self._cool(digit - 1 if digit else self.cool)
        feed = v[{0: 4, 1: 4, 11: 6}.get(code, 7)]
        if code == 0 or feed == -2.0:
            self.say("RAPID")
        elif feed != -1.0:
            self.say("FEDRAT", feed, "PERMIN")
        up = np.subtract(v[3:6], v[:3]) if code == 11 else np.array([0.0, 0.0, 1.0])
        if code in (2, 3):
            self.say("CIRCLE", v[4], v[5], self.last[2], 0.0, 0.0, 2.0 * code - 5.0)
            whole = math.hypot(v[2] - self.last[0], v[3] - self.last[1]) < 1e-6
            self.last = (*(self.last[:2] if whole else v[2:4]), v[6])
        else:
            self.last = tuple(v[1:4] if code < 2 else v[:3])
        self.say("GOTO", *self.last, *map(float, up / math.sqrt(up @ up)))

    def _cool(self, kind: int) -> None:
        if kind != self.cool:
            self.cool = kind
            self.say("COOLNT", _COOLED[kind])

    def _turn(self, speed: float) -> None:
        self.say("SPINDL", *((abs(speed), "RPM", "CLW" if speed > 0.0 else "CCLW") if speed else ("OFF",)))

    def _hole(self, code: int, v: list[float]) -> None:
        if code == 81:
            self.drill = v
        d = self.drill
        bottom, above = np.array(v[1:4]), np.array(v[14:17] if code == 81 else v[8:11])
        high, start = v[10:12] if code == 81 else v[4:6]
        rest, feed = v[4:6] if code == 81 else v[6:8]
        up = (above - bottom) / np.linalg.norm(above - bottom)
        deep = float((above - bottom) @ up) - (high - d[12])
        words: tuple[Word, ...] = (_DRILLED[int(d[0])], "FEDTO", deep, "PERMIN", feed, "RAPTO", start - d[12], "RTRCTO",
                                   max(high, start) - d[12])
        words += ("STEP", *(p for p in d[6:8] if p > 0.0)) if d[0] in (1.0, 2.0) and d[6] > 0.0 else ()
        words += ("DWELL", rest) if rest else ()
        if words != self.cycle:
            self.cycle = words
            self.say("CYCLE", *words)
        self.say("GOTO", *map(float, bottom + deep * up), *map(float, up))
        self.last = tuple(map(float, above + max(start - high, 0.0) * up))

    def _tool(self, code: int, v: list[float]) -> None:
        self._off()
        self.register = v[4]
        if code > 1000:
            self.on = 0
            self.say("LOADTL", v[3], *(("OSETNO", v[5]) if v[5] > 0.0 else ()))
        if v[7]:
            self._turn(v[7])
        self._cool(int(v[9]))

    def _other(self, code: int, body: str) -> None:
        v = [float(w) for w in body.split()[:9 if code == 1014 else 12]] if code in (4, 1013, 1014, 1027) else []
        if code == 80:
            self._off()
        elif code == 4:
            self.say("DELAY", v[0])
            if len(v) > 1:
                self._turn(v[1])
        elif code == 1004 and self.on:
            self.on = 0
            self.say("CUTCOM", "OFF")
        elif code == 1013 and v[1] > 0.0:
            self.say("CUTTER", v[1], v[2])
        elif code in (1014, 1027) and np.abs(np.subtract(v, [*np.eye(3).flat, 0, 0, 0][:len(v)])).max() > 1e-6:
            self.say("MCS")
        elif code in (1006, 20001):
            self.text("INSERT" if code == 1006 else "TPRINT", body)


class FreeCad(Saying):
    """Blocks of G and M commands."""

    per = "PERMIN"
    motion, fed, given, level = 80.0, math.nan, math.nan, math.nan
    turns = 0.0
    steps, initial = False, True
    cycle: tuple[Word, ...] = ()

    def read(self, text: str) -> None:
        """All lines."""
        self.at, self.held = dict[str, float](), dict[str, float]()
        blocks = [re.sub(r"\([^()]*\)|;.*", " ", line).upper() for line in text.split("\n")]
        own = "(EXPORTED BY FREECAD)" not in text[:4000].upper()
        self.per = "MMPS" if own else "PERMIN"
        if own:
            self.say("UNITS", "MM")
        for self.line, block in enumerate(blocks, 1):
            words = [(letter, float(number)) for letter, number in _WORDS.findall(block)]
            said = {letter: number for letter, number in words if letter not in "GMN"}
            heads = [number for letter, number in words if letter == "G"]
            for number in heads:
                self._command(number, said)
            spoken = self.held.get("S", 0.0)
            self.held |= {a: b for a, b in said.items() if a in "ST" or (a in "ZRQP" and self.motion in _HOLES)}
            codes = [number for letter, number in words if letter == "M"]
            again = self.turns and said.get("S", spoken) != spoken and not set(codes) & {3.0, 4.0, 5.0}
            for number in (*([self.turns] if again else []), *codes):
                self._switch(number)
            moves = bool(said.keys() & set("XYZIJ" if self.motion in (2.0, 3.0) else "XYZ"))
            if "F" in said:
                self.fed = said["F"] if self.motion != 0.0 or not (moves or 0.0 in heads) else math.nan
            if self.cycle and (self.motion == 80.0 or (moves and self.motion not in _HOLES)):
                self.cycle, self.level = (), math.nan
                self.say("CYCLE", "OFF")
            if moves:
                (self._hole if self.motion in _HOLES else self._move)(said)

    def _command(self, number: float, said: dict[str, float]) -> None:
        if number in (0.0, 1.0, 2.0, 3.0, 80.0, *_HOLES):
            self.motion = number
            self.held = self.held if number in _HOLES else {a: b for a, b in self.held.items() if a in "ST"}
        elif number in (90.0, 91.0):
            self.steps = number == 91.0
        elif number in (98.0, 99.0):
            self.initial = number == 98.0
        elif number == 4.0:
            self.say("DELAY", said["P"])
        elif number in (20.0, 21.0) and self.per == "PERMIN":
            self.say("UNITS", "INCHES" if number == 20.0 else "MM")

    def _switch(self, number: float) -> None:
        self.turns = number if number in (3.0, 4.0) else 0.0 if number == 5.0 else self.turns
        if number in (3.0, 4.0):
            speed: tuple[Word, ...] = (self.held["S"], "RPM") if self.held.get("S") else ()
            self.say("SPINDL", *speed, "CLW" if number == 3.0 else "CCLW")
        elif number == 6.0:
            self.say("LOADTL", self.held.get("T", 0.0))
        elif number in _PLAIN:
            self.say(*_PLAIN[number])

    def _move(self, said: dict[str, float]) -> None:
        before = dict(self.at)
        self.at |= {a: said[a] + (before.get(a, math.nan) if self.steps else 0.0) for a in "XYZ" if a in said}
        if len(self.at) < 3:
            return
        if self.motion == 0.0:
            self.say("RAPID")
        else:
            if self.fed != self.given:
                self.given = self.fed
                self.say("FEDRAT", self.fed, self.per)
        if self.motion > 1.0:
            self.say("CIRCLE", before["X"] + said.get("I", 0.0), before["Y"] + said.get("J", 0.0), before["Z"], 0.0, 0.0,
                     2.0 * self.motion - 5.0)
        self.say("GOTO", self.at["X"], self.at["Y"], self.at["Z"], 0.0, 0.0, 1.0)

    def _hole(self, said: dict[str, float]) -> None:
        self.level = self.at["Z"] if math.isnan(self.level) else self.level
        self.at |= {a: said[a] for a in "XY" if a in said}
        top = self.held["R"]
        self.at["Z"] = max(self.level, top) if self.initial else top
        kind = {83.0: "DEEP", 73.0: "BRKCHP"}.get(self.motion, "DRILL")
        words: tuple[Word, ...] = (kind, "FEDTO", top - self.held["Z"], self.per, self.fed, "RAPTO", 0.0, "RTRCTO",
                                   self.at["Z"] - top)
        words += ("STEP", self.held["Q"]) if self.motion in (83.0, 73.0) and "Q" in self.held else ()
        words += ("DWELL", self.held["P"]) if self.held.get("P") and self.motion != 81.0 else ()
        if words != self.cycle:
            self.cycle = words
            self.say("CYCLE", *words)
        self.say("GOTO", self.at["X"], self.at["Y"], top, 0.0, 0.0, 1.0)


class StepNc(Saying):
    """The instances of a file, of which those that the workplan names are carried out."""

    def read(self, text: str) -> None:
        """The project's workplan."""
        self.texts: list[str] = []
        text = _TEXT.sub(self._kept, _COMMENT.sub(lambda m: "\n" * m[0].count("\n"), text))
        text = re.sub(r"#0+(?=\d)", "#", text)
        breaks = [m.start() for m in re.finditer("\n", text)]
        self.of = {f"#{m[1]}": (m[2].upper(), _nested(m[3]), bisect_left(breaks, m.start()) + 1)
                   for m in _INSTANCE.finditer(text)}
        self.at: Array | None = None
        self.axis, self.before = np.array([0.0, 0.0, 1.0]), dict[str, Any]()
        self.say("UNITS", "MM")
        self._plan(next((values[1] for name, values, _ in self.of.values() if name == "PROJECT"), ""))

    def _kept(self, found: re.Match[str]) -> str:
        """A text by its number, without brackets and commas, its lines kept."""
        self.texts.append(found[0][1:-1].replace("''", "'"))
        return f"'{len(self.texts) - 1}" + "\n" * found[0].count("\n")

    def _plan(self, plan: str) -> None:
        for one in self.of[plan][1][1]:
            name, values, self.line = self.of[one]
            if name == "WORKPLAN":
                self._plan(one)
            elif name == "MACHINING_WORKINGSTEP":
                self._step(values)
            elif name in ("PROGRAM_STOP", "OPTIONAL_STOP"):
                self.say("STOP" if name == "PROGRAM_STOP" else "OPSTOP")

    def _step(self, values: list[Any]) -> None:
        secure = self._numbers(self.of[self.of[values[1]][1][1]][1][1])[2]
        operation = self.of[values[3]][1]
        self._tool(operation[5])
        axis = np.array([0.0, 0.0, 1.0])
        if operation[1] != "$" and self.of[operation[1]][0] == "THREE_AXES_TILTED_TOOL":
            axis = self._numbers(self.of[operation[1]][1][0])
        over: float | None = float(secure)
        for path in self.of[operation[0]][1][0]:
            name, v, line = self.of[path]
            self._states(operation[7] if v[4] == "$" else v[4], operation[6] if v[3] == "$" else v[3])
            self.line = line
            if name == "FEEDSTOP":
                self.say("DELAY", float(v[5]))
            else:
                self._path(v, axis, over)
                over = None

    def _tool(self, tool: str) -> None:
        _, values, self.line = self.of[tool]
        if self.before.get("tool") != tool:
            self.before["tool"] = tool
            self.text("TPRINT", self.texts[int(values[0][1:])].replace(",", " "))
            size = self.of[self.of[values[1]][1][0]][1]
            self.say("CUTTER", float(size[0]), float(size[4]) if size[4] != "$" else 0.0)

    def _states(self, functions: str, technology: str) -> None:
        f, self.line = self.of[functions][1], self.of[functions][2]
        cooled = [word for word, k in (("FLOOD", 0), ("MIST", 2), ("THRU", 3)) if f[k] == ".T."]
        self._new("coolant", "COOLNT", *(cooled or ["OFF"]))
        t, self.line = self.of[technology][1], self.of[technology][2]
        self._new("feed", "FEDRAT", float(t[0]) * 1000.0, "MMPS")
        if t[3] != "$":
            turns = -60.0 * float(t[3])
            self._new("spindle", "SPINDL", *((abs(turns), "RPM", "CLW" if turns > 0.0 else "CCLW") if turns else ("OFF",)))

    def _new(self, what: str, *words: Any) -> None:
        if self.before.get(what) != words:
            self.before[what] = words
            self.say(*words)

    def _path(self, v: list[Any], axis: Array, over: float | None) -> None:
        legs = self._legs(v[6])
        axes = [axis] * len(legs) if v[7] == "$" else [leg[0] for leg in self._legs(v[7])]
        if v[5] == ".F.":
            legs, axes = _turned(legs), axes[::-1]
        start = legs[0][0]
        if over is not None:
            if self.at is not None:
                self._go((np.append(self.at[:2], max(over, self.at[2])), None, None), self.axis, True)
            for target in (np.append(start[:2], max(over, start[2])), start):
                self._go((target, None, None), axes[0], True)
        fast = v[1] == ".CONNECT." or ".RAPID." in (v[2] if isinstance(v[2], list) else [v[2]])
        for leg, tilt in zip(legs[1:], axes[1:], strict=True):
            self._go(leg, tilt, fast)

    def _go(self, leg: Leg, axis: Array, fast: bool) -> None:
        end, centre, normal = leg
        if fast:
            self.say("RAPID")
        if centre is not None and normal is not None:
            self.say("CIRCLE", *map(float, centre), *map(float, normal))
        self.say("GOTO", *map(float, end), *map(float, axis))
        self.at, self.axis = end, axis

    def _numbers(self, point: str) -> Array:
        return np.array([float(w) for w in self.of[point][1][1]])

    def _legs(self, curve: str) -> list[Leg]:
        name, v, _ = self.of[curve]
        if name == "POLYLINE":
            return [(self._numbers(p), None, None) for p in v[1]]
        if name == "COMPOSITE_CURVE":
            whole: list[Leg] = []
            for segment in v[1]:
                _, same, part = self.of[segment][1]
                legs = self._legs(part)
                legs = _turned(legs) if same == ".F." else legs
                whole += legs[1:] if whole else legs
            return whole
        first, last = (self._numbers(next((w for w in ends if w.startswith("#")), "")) for ends in v[2:4])
        basis, b, _ = self.of[v[1]]
        if basis == "LINE":
            return [(first, None, None), (last, None, None)]
        _, centre, z, _ = self.of[b[1]][1]
        normal = np.array([0.0, 0.0, 1.0]) if z == "$" else self._numbers(z)
        normal = normal / np.linalg.norm(normal) * (-1.0 if v[4] == ".F." else 1.0)
        return [(first, None, None), (last, self._numbers(centre), normal)]


def _turned(legs: list[Leg]) -> list[Leg]:
    """From the end back to the start."""
    ends = [leg[0] for leg in legs]
    return [(ends[-1], None, None)] + [(ends[k - 1], legs[k][1], None if (n := legs[k][2]) is None else -n)
                                       for k in range(len(legs) - 1, 0, -1)]


def _nested(text: str) -> list[Any]:
    """Lists within brackets; a value with its type as a list behind its name."""
    stack: list[list[Any]] = [[]]
    for word in _ITEM.findall(text):
        if word == "(":
            stack.append([])
        elif word == ")":
            inner = stack.pop()
            stack[-1].append(inner)
        elif word != ",":
            stack[-1].append(word)
    return stack[0]
