"""A modal executor of RS274/NGC in plain Python, one block after the other; nothing of the code under test is used."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

SWITCHES = {3: 1, 4: -1, 5: 0}
"""sense of the spindle by M code"""


@dataclass
class Step:
    """One elementary motion: line, kind ("rapid", "feed", "arc"), end (J,) machine mm/deg, dense points (K, J)."""

    line: int
    kind: str
    end: np.ndarray
    points: np.ndarray
    feed: float
    inverse: bool
    tool: int
    register: int
    spindle: int
    coolant: bool
    level: float = math.nan


@dataclass
class Peer:
    """The state of a control as its manual says it (sections 3.5, 3.5.16, 3.7); X, Y, Z in mm, rotary axes in degrees."""

    letters: tuple[str, ...]
    work: np.ndarray
    lengths: dict[int, float]
    home: np.ndarray
    on_z: bool = True
    steps: list[Step] = field(default_factory=list)
    plane: int = 17
    motion: int = -1
    inverse: bool = False
    feed: float = math.nan
    scale: float = 1.0
    tool: int = 0
    picked: int = 0
    register: int = -1
    spindle: int = 0
    coolant: bool = False
    level: int = 98
    initial: float = math.nan
    cycling: bool = False
    sticky: dict[str, float] = field(default_factory=dict)

    def run(self, text: str, dense: int = 20) -> list[Step]:
        """The steps of a program."""
        self.at, self.z, self.dense = self.home.astype(float).copy(), self.letters.index("Z"), dense
        for number, raw in enumerate(text.splitlines(), 1):
            block = re.sub(r"\([^()]*\)|;.*", "", raw).strip().upper()
            if block and not block.startswith("%"):
                self.block(number, block)
        return self.steps

    def block(self, number: int, text: str) -> None:
        """One block: codes, then switches, then motion."""
        found = re.findall(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))", text)
        assert "".join(a + b for a, b in found) == re.sub(r"\s", "", text), f"line {number}: {text!r}"
        words = {a: float(v) for a, v in found if a not in "GMN"}
        assert len(words) == sum(a not in "GMN" for a, _ in found), f"line {number}: a word twice"
        once, motion = 0, -1
        for g in (float(v) for a, v in found if a == "G"):
            if g in (4, 53):
                once = int(g)
            elif g in (0, 1, 2, 3, 73, 80, 81, 82, 83, 84, 85, 89):
                assert motion < 0, f"line {number}: two motions"
                motion = int(g)
            else:
                self.code(number, g, words)
        self.switch([int(v) for a, v in found if a == "M"], words)
        if motion >= 0:
            self.take(motion)
        self.feed = words.get("F", self.feed)
        if once != 4 and any(k in words for k in (*self.letters, "I", "J", "K")):
            self.move(number, words, once == 53)

    def code(self, number: int, g: float, words: dict[str, float]) -> None:
        """A code that moves nothing."""
        if g in (17, 18, 19):
            self.plane = int(g)
        elif g in (93, 94):
            self.feed = math.nan if self.inverse != (g == 93) else self.feed
            self.inverse = g == 93
        elif g in (20, 21):
            self.scale = 25.4 if g == 20 else 1.0
        elif g in (98, 99):
            self.level = int(g)
        elif g in (43, 49):
            self.register = int(words["H"]) if g == 43 else -1
        else:
            assert g in (40, 54, 64, 90, 91.1), f"line {number}: G{g:g}"

    def switch(self, codes: list[int], words: dict[str, float]) -> None:
        """Tool, spindle and coolant."""
        self.picked = int(words.get("T", self.picked))
        for m in codes:
            self.tool = self.picked if m == 6 else self.tool
            self.spindle = SWITCHES.get(m, self.spindle)
            self.coolant = {7: True, 8: True, 9: False}.get(m, self.coolant)

    def take(self, motion: int) -> None:
        """A code of motion: another one forgets the words of a cycle, G0 to G3 and G80 end it."""
        self.sticky = {} if motion != self.motion else self.sticky
        self.cycling = self.cycling and 73 <= motion != 80
        self.motion = motion

    def move(self, number: int, words: dict[str, float], machine: bool) -> None:
        """Axis words under the code of motion in force."""
        assert self.motion not in (-1, 80), f"line {number}: axis words without a motion code"
        shift = self.work.copy()
        if self.on_z and self.register >= 0:
            shift[self.z] += self.lengths.get(self.register, 0.0)
        target = self.at.copy()
        for j, a in enumerate(self.letters):
            if a in words:
                target[j] = words[a] * (self.scale if a in "XYZ" else 1.0) + (0.0 if machine else shift[j])
        if self.inverse and self.motion in (1, 2, 3):
            assert "F" in words, f"line {number}: no F with inverse time"
        if self.motion >= 73:
            assert not self.inverse, f"line {number}: a cycle under inverse time"
            self.drill(number, target, words, shift[self.z])
            return
        kind = {0: "rapid", 1: "feed"}.get(self.motion, "arc")
        t = np.linspace(0.0, 1.0, self.dense + 1)[1:, None]
        self.step(number, kind, target, self.arc(target, words) if kind == "arc" else self.at + t * (target - self.at))

    def step(self, number: int, kind: str, target: np.ndarray, points: np.ndarray,
             level: float = math.nan) -> None:
        """One motion with the state that it is run in."""
        self.steps.append(Step(number, kind, target, points, self.feed, self.inverse, self.tool, self.register, self.spindle,
                               self.coolant, level))
        self.at = target

    def arc(self, target: np.ndarray, words: dict[str, float]) -> np.ndarray:
        """Dense points of an arc; the radius may differ between the ends by what rounding explains."""
        names = {17: "XY", 18: "ZX", 19: "YZ"}[self.plane]
        pair = [self.letters.index(a) for a in names]
        offset = np.array([words.get({"X": "I", "Y": "J", "Z": "K"}[a], 0.0) for a in names])
        center = self.at[pair] + self.scale * offset
        p, q = self.at[pair] - center, target[pair] - center
        assert abs(np.hypot(*p) - np.hypot(*q)) < 0.002, "radius differs between start and end"
        begin, end = math.atan2(p[1], p[0]), math.atan2(q[1], q[0])
        ccw = self.motion == 3
        turn = (end - begin) % (2 * math.pi) if ccw else -((begin - end) % (2 * math.pi))
        if abs(turn) < 1e-12:
            turn = 2 * math.pi if ccw else -2 * math.pi
        t = np.linspace(0.0, 1.0, 4 * self.dense + 1)[1:]
        points = self.at + t[:, None] * (target - self.at)
        radius = np.hypot(*p) * (1 - t) + np.hypot(*q) * t
        points[:, pair[0]] = center[0] + radius * np.cos(begin + t * turn)
        points[:, pair[1]] = center[1] + radius * np.sin(begin + t * turn)
        return points

    def drill(self, number: int, target: np.ndarray, words: dict[str, float], shift: float) -> None:
        """A canned cycle, leg by leg."""
        if not self.cycling:
            self.initial, self.sticky = self.at[self.z], {}
        legs = []
        self.sticky |= {k: words[k] for k in "ZRQP" if k in words}
        bottom, plane = self.sticky["Z"] * self.scale + shift, self.sticky["R"] * self.scale + shift
        if self.at[self.z] < plane and not self.cycling:
            legs.append(("rapid", self.at, plane))
        self.cycling = True
        legs += [("rapid", target, max(self.at[self.z], plane)), *((k, target, h) for k, h in self.heights(plane, bottom))]
        for kind, base, height in legs:
            point = base.copy()
            point[self.z] = height
            if not (point == self.at).all():
                t = np.linspace(0.0, 1.0, 11)[1:, None]
                self.step(number, kind, point, self.at + t * (point - self.at), bottom)

    def heights(self, plane: float, bottom: float) -> list[tuple[str, float]]:
        """The heights of a cycle over its hole.

        LinuxCNC rises to R where it stands at the first hole of a sequence only; later ones it goes to aslant.
        """
        result = [("rapid", plane)]
        if self.motion in (73, 83):
            assert self.sticky["Q"] > 0
            depth = plane - self.sticky["Q"] * self.scale
            while depth > bottom + 1e-9:
                result.append(("feed", depth))
                result += [("rapid", plane)] if self.motion == 83 else []
                result.append(("rapid", depth + 0.254))
                depth -= self.sticky["Q"] * self.scale
        result.append(("feed", bottom))
        result += [("feed", plane)] if self.motion in (84, 85, 89) else []
        return [*result, ("rapid", max(self.initial, plane) if self.level == 98 else plane)]
