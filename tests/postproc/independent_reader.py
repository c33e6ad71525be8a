"""Programs of every control read a second time, as far as tests of geometric errors need it: where every block ends.

Words by patterns, state by the controls' manuals; joints of tip coordinates through the second implementation
of the nominal machine. Nothing of the code under test is used. One work offset, mm, tools by their gauge lengths.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from tests.machines.independent_machine import Machine

WORD = re.compile(r"([A-Z])([-+]?\d*\.?\d+)")
ROTARY = "ABC"


@dataclass(frozen=True)
class End:
    """Where a block ends: joints (J,) mm and rad, tool length, whether it cuts, its text."""

    q: np.ndarray
    tool: float
    cuts: bool
    text: str


@dataclass
class Reading:
    """The state of a control: `law` "axes", "tcp" or "tilted" says what words mean."""

    machine: Machine
    lengths: dict[int, float]
    law: str = "axes"
    tool: int = 0
    offset: float = 0.0
    plane: np.ndarray = field(default_factory=lambda: np.eye(3))
    motion: int = 0
    level: str = "initial"
    picked: int = 0
    centre: np.ndarray = field(default_factory=lambda: np.zeros(2))
    tips: dict[str, float] = field(default_factory=dict)
    """X Y Z as they were stated, in a law of the tip"""
    sticky: dict[str, float] = field(default_factory=dict)
    ends: list[End] = field(default_factory=list)

    def __post_init__(self) -> None:
        home = {k: self.machine.toml["axes"][k]["home"] for k in self.machine.letters}
        self.joint: dict[str, float] = {k: float(v) for k, v in home.items()}

    # ---- what all controls share ---------------------------------------------------------------------------

    def enter(self, law: str, plane: np.ndarray | None = None) -> None:
        self.law, self.plane, self.tips = law, np.eye(3) if plane is None else plane, {}

    def move(self, words: dict[str, float], cuts: bool, text: str) -> None:
        """One block of axis words, mm and degrees, under the law in force."""
        for letter, value in words.items():
            if self.law == "axes" or letter in ROTARY:
                assert self.law != "tilted", f"a rotary word in a tilted plane: {text}"
                self.joint[letter] = value + (self.offset if letter == "Z" else 0.0)
            else:
                self.tips[letter] = value
        if self.law != "axes":
            assert self.tips.keys() >= set("XYZ"), f"the first block in a mode leaves out a word: {text}"
            self.joint.update(self.slides())
        self.ends.append(End(self.vector(), self.lengths.get(self.tool, 0.0), cuts, text))

    def machine_move(self, words: dict[str, float], text: str) -> None:
        """G53, SUPA, M91."""
        self.joint.update(words)
        self.ends.append(End(self.vector(), self.lengths.get(self.tool, 0.0), False, text))

    def vector(self) -> np.ndarray:
        return np.array([math.radians(self.joint[k]) if k in ROTARY else self.joint[k] for k in self.machine.letters])

    def slides(self) -> dict[str, float]:
        """X Y Z of the nominal machine that bring its tip to the words, the rotary axes where they stand."""
        wanted = self.plane @ [self.tips[k] for k in "XYZ"]
        still = self.vector()
        still[:3] = 0.0
        length = self.lengths[self.tool]
        zero = self.machine.pose(still, length)[0]
        columns = [self.machine.pose(still + np.eye(len(still))[k], length)[0] - zero for k in range(3)]
        found = np.linalg.solve(np.column_stack(columns), wanted - zero)
        return dict(zip("XYZ", found.tolist(), strict=True))

    def now(self, letter: str) -> float:
        """The word that the letter stands at."""
        return self.tips[letter] if self.law != "axes" else self.joint[letter] - (self.offset if letter == "Z" else 0.0)

    def drill(self, words: dict[str, float], bottom: float, back: float, text: str) -> None:
        """To the hole, down, back."""
        self.move(words, False, text)
        self.move({"Z": bottom}, True, text)
        self.move({"Z": back}, False, text)

    # ---- dialects ------------------------------------------------------------------------------------------

    def iso(self, text: str) -> list[End]:
        """LinuxCNC, Fanuc, Haas."""
        for raw in text.splitlines():
            block = re.sub(r"\(.*?\)|;.*|^[%/O].*", "", raw).strip()
            found = WORD.findall(re.sub(r"^N\d+", "", block).replace(" ", ""))
            codes = [float(v) for k, v in found if k == "G"]
            words = {k: float(v) for k, v in found if k not in "GMN"}
            self.tool = int(words["T"]) if ("M", "6") in found else self.tool
            self.iso_codes(codes, words)
            axes = {k: v for k, v in words.items() if k in self.machine.letters}
            if not axes or 68.2 in codes or 4 in codes:
                continue
            if 53 in codes:
                self.machine_move(axes, raw)
            elif self.motion in (81, 82, 83, 73, 85):
                self.sticky |= {k: words[k] for k in "ZR" if k in words}
                self.drill({k: v for k, v in axes.items() if k != "Z"}, self.sticky["Z"],
                           self.sticky[self.level], raw)
            else:
                self.move(axes, self.motion > 0, raw)
        return self.ends

    def iso_codes(self, codes: list[float], words: dict[str, float]) -> None:
        for g in codes:
            if g in (0, 1, 2, 3, 80):
                self.motion = int(g)
            elif g in (81, 82, 83, 73, 85):
                if self.motion <= 80:
                    self.sticky = {"initial": self.now("Z")}
                self.motion = int(g)
            elif g in (98, 99):
                self.level = "initial" if g == 98 else "R"
            elif g in (43, 43.4):
                self.offset = self.lengths[int(words["H"])]
                if g == 43.4:
                    self.enter("tcp")
            elif g == 49:
                self.offset = 0.0
                if self.law == "tcp":
                    self.enter("axes")
            elif g == 68.2:
                self.enter("tilted", Rotation.from_euler("ZXZ", [words[k] for k in "IJK"], degrees=True).as_matrix())
            elif g == 234:
                self.enter("tcp")
            elif g == 254:
                self.enter("tilted", self.turned_part())
                tip = self.machine.pose(self.vector(), self.lengths[self.tool])[0]
                self.tips = dict(zip("XYZ", (self.plane.T @ tip).tolist(), strict=True))  # words go on from where it stands
            elif g in (69, 255):
                self.enter("axes")

    def turned_part(self) -> np.ndarray:
        """Haas G254: words along the slides, the part's point turned with the tables."""
        still = self.vector()
        still[:3] = 0.0
        zero = self.machine.pose(still, 0.0)[0]
        return np.column_stack([self.machine.pose(still + np.eye(len(still))[k], 0.0)[0] - zero for k in range(3)])

    def siemens(self, text: str) -> list[End]:
        deep: tuple[float, float] | None = None
        for raw in text.splitlines():
            block = re.sub(r";.*", "", re.sub(r"^N\d+ ?", "", raw)).strip()
            call = re.match(r"(MCALL )?(CYCLE8\w+)\((.*)\)", block)
            if call is not None and call[2] == "CYCLE800":
                given = call[3].split(",")
                self.enter("axes")
                if given != [""]:
                    assert given[3] == "27" and set(given[4:7]) == {"0"} == set(given[10:13])  # 01 10 11: Z, Y, X
                    turns = [float(v) for v in given[7:10]]
                    self.enter("tilted", Rotation.from_euler("ZYX", turns, degrees=True).as_matrix())
            elif call is not None and call[1]:
                deep = float(call[3].split(",")[3]), float(call[3].split(",")[0])
            elif block == "MCALL":
                deep = None
            elif block in ("TRAORI", "TRAFOOF"):
                self.enter("tcp" if block == "TRAORI" else "axes")
            elif call is None:
                self.siemens_block(block, deep, raw)
        return self.ends

    def siemens_block(self, block: str, deep: tuple[float, float] | None, raw: str) -> None:
        found = WORD.findall(re.sub(r"ORI\w+|SUPA|=", "", block).replace(" ", ""))
        axes = {k: float(v) for k, v in found if k in self.machine.letters}
        for letter, value in found:
            if letter == "G" and value in ("0", "1", "2", "3"):
                self.motion = int(value)
            elif letter == "D":
                self.offset = self.lengths[self.tool] if value == "1" else 0.0
            elif letter == "T":
                self.picked = int(value)
            elif (letter, value) == ("M", "6"):
                self.tool = self.picked
        if not axes or re.search(r"\bG4\b", block):
            return
        if "SUPA" in block:
            self.machine_move(axes, raw)
        elif deep is not None:
            self.drill(axes, *deep, raw)
        else:
            self.move(axes, self.motion > 0, raw)

    def heidenhain(self, text: str) -> list[End]:
        q: dict[str, float] = {}
        joined = re.sub(r"\s*;[^\n]*~\n", " ", re.sub(r"~\n", " ", re.sub(r";[^\n~]*~", "~", text)))
        for raw in joined.splitlines():
            block = re.sub(r";.*", "", re.sub(r"^\d+ ", "", raw)).strip()
            if block.startswith("CYCL DEF 200"):
                q = {k: float(v) for k, v in re.findall(r"(Q\d+)=([-+\d.]+)", block)}
            elif block.startswith("TOOL CALL"):
                self.tool = int(block.split()[2])
                self.offset = self.lengths[self.tool]
            elif block.startswith("PLANE SPATIAL"):
                angles = [float(v) for v in re.findall(r"SP[ABC]([-+\d.]+)", block)]
                self.enter("tilted", Rotation.from_euler("xyz", angles, degrees=True).as_matrix())
            elif block.startswith("PLANE RESET") or block == "FUNCTION RESET TCPM":
                self.enter("axes")
            elif block.startswith("FUNCTION TCPM"):
                self.enter("tcp")
            elif re.match(r"(L|C|CC|CP) ", block):
                self.klartext_move(block, q, raw)
        return self.ends

    def klartext_move(self, block: str, q: dict[str, float], raw: str) -> None:
        axes = {k: float(v) for k, v in re.findall(r"(?<![A-Z])([XYZABC])([-+]\d*\.?\d+)", block)}
        if block.startswith("CC"):
            self.centre = np.array([axes.get("X", self.centre[0]), axes.get("Y", self.centre[1])])
        elif block.startswith("CP"):
            given = dict(re.findall(r"(IPA|IZ)([-+][\d.]+)", block))
            turn, rise = math.radians(float(given["IPA"])), float(given.get("IZ", 0.0))
            assert turn != 0.0 and (turn > 0.0) == ("DR+" in block)
            from_centre = np.array([self.now("X"), self.now("Y")]) - self.centre
            c, s = math.cos(turn), math.sin(turn)
            end = self.centre + np.array([[c, -s], [s, c]]) @ from_centre
            self.move({"X": end[0], "Y": end[1], "Z": self.now("Z") + rise}, True, raw)
        elif "M91" in block:
            self.machine_move(axes, raw)
        elif "M99" in block:
            top = q["Q203"]
            self.drill(axes, top + q["Q201"], top + q["Q204"], raw)
        else:
            self.move(axes, "FMAX" not in block, raw)


def read(text: str, controller: str, machine: Machine, lengths: dict[int, float]) -> list[End]:
    """The ends of all blocks."""
    reading = Reading(machine, lengths)
    dialect = {"siemens-840d": reading.siemens, "heidenhain-tnc640": reading.heidenhain}.get(controller, reading.iso)
    return dialect(text)
