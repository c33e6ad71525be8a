"""Points of a plane that Fanuc and Haas take otherwise than as they lie: polar coordinates (G16), a turned system (G68).

Fanuc 16/18 operator's manual, 9.2 polar coordinate command: under G90 the first axis of the plane is the radius from the
zero of the program, the second the angle, under G91 the angle goes on from the last one, until G15. B-63534EN, coordinate
system rotation: G68 with the centre and R, degrees counter-clockwise, in the absolute coordinates of the program, until G69.
Both hold ends and centres of blocks in the plane. G50 and G50.1 that end nothing (`scaled_words.py`) say nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.frame import AXES, IN_PLANE
from postproc.readback.macros.word_blocks import Blocks, Word

CENTRES = "IJK"
_ENDS = (15.0, 50.0, 50.1)
NOT_WITHIN = (10.0, 20.0, 21.0, 28.0, 30.0, 31.0, 52.0, 53.0, 92.0, 43.4, 43.5, 234.0, 254.0, 68.2, 17.0, 18.0, 19.0, 54.0,
               55.0, 56.0, 57.0, 58.0, 59.0, 54.1, 154.0)
"""codes that state other coordinates: reference positions, work and local coordinate systems (refused by Fanuc as well)"""
_WITH_OTHERS = (17.0, 18.0, 19.0, 20.0, 21.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 54.1, 154.0)
"""of them, those that may stand in the block of G16 or G68 itself"""
_ROUND, TIP = (2.0, 3.0), (43.4, 43.5, 234.0)


class PlaneWords:
    """Words of blocks as they lie in the coordinates of the program.

    Attributes:
        polar: G16 is in force; radius, angle: stated last, degrees; turned: centre of G68 and its angle in rad, None for
            none; point: stated last under G68, by axis; left: axes that no absolute word has stated since G69
    """

    def __init__(self, blocks: Blocks, haas: bool) -> None:
        self.blocks, self.track, self.haas = blocks, blocks.track, haas
        self.left = set[str]()
        self.polar = False
        self.radius: float | None = None
        self.angle: float | None = None
        self.turned: tuple[float, float, float] | None = None
        self.point: dict[str, float] = {}

    def taken(self, words: Sequence[Word]) -> list[Word]:
        """A block's words, ends and centres in the coordinates of the program."""
        codes = {w.value for w in words if w.letter == "G"}
        self._checked(words, codes)
        plane = next((int(c) for c in codes if c in (17.0, 18.0, 19.0)), self.track.plane)
        axes = [AXES[k] for k in IN_PLANE[plane][:2]]
        absolute = 90.0 in codes or (self.track.absolute and 91.0 not in codes)
        if 68.0 in codes or 69.0 in codes:
            words = self._turn(words, axes, absolute, 68.0 in codes)
        if 16.0 in codes and self.turned is not None:
            raise MacroFault("gcode.mode", "G16 under G68 is not executed", "G69 before it")
        if codes & {15.0, 16.0}:
            self.polar, self.radius, self.angle = 16.0 in codes, None, None
        self.blocks.within = self.name_in_force
        words = [w for w in words if w.letter != "G" or w.value not in (*_ENDS, 16.0)]
        if not self.polar and self.turned is None:
            self._behind(words, axes, absolute)
            return words
        for code in sorted(codes):
            if code in NOT_WITHIN and not (code in _WITH_OTHERS and codes & {16.0, 68.0}):
                raise MacroFault("gcode.mode", f"G{code:g} under {self.name} is not executed", f"{self.end} before it")
        given = {w.letter: w.value for w in words}
        if 4.0 in codes or not any(a in given for a in (*axes, *CENTRES)):
            return words
        if self.polar:
            return self._from_polar(words, given, axes, absolute)
        return self._from_turned(words, given, axes, absolute)

    def _checked(self, words: Sequence[Word], codes: set[float]) -> None:
        """Words whose unit is not certain, which would be written on with a point, and codes that the control has not."""
        if self.haas and codes & {15.0, 16.0, 50.1}:
            raise MacroFault("gcode.unknown_code", f"G{min(codes & {15.0, 16.0, 50.1}):g} is no code of Haas",
                             "write the points by X and Y, without polar coordinates")
        if codes & {50.0, 50.1} and any(w.letter in (*AXES, *CENTRES) for w in words):
            raise MacroFault("gcode.mode", "G50 and G50.1 with axes that nothing scales or mirrors", "write them alone")
        letters = (*self.track.held.axes, "R", *(CENTRES if self.polar or self.turned is not None else ()))
        bare = next((w for w in words if w.letter in letters and w.text and "." not in w.text and w.value), None)
        repeats = bare is not None and bare.letter == "K" and self.track.motion not in _ROUND
        if bare is not None and 4.0 not in codes and not repeats:
            raise MacroFault("gcode.decimal_point", f"{bare.text} has no decimal point: its unit is a parameter of the "
                             "control", "write the decimal point")

    def _behind(self, words: Sequence[Word], axes: list[str], absolute: bool) -> None:
        """The first block behind G69 states its axes absolutely: Fanuc says of other ones that they move wrongly."""
        given = {w.letter for w in words} & self.left
        if given and not absolute:
            raise MacroFault("gcode.mode", "the first move behind G69 is under G91", f"state {axes[0]} and {axes[1]} under "
                             "G90 before it")
        self.left -= given

    @property
    def name_in_force(self) -> str:
        """The code in force, "" for none."""
        return self.name if self.polar or self.turned is not None else ""

    @property
    def name(self) -> str:
        """The code in force."""
        return "G16" if self.polar else "G68"

    @property
    def end(self) -> str:
        """The code that ends it."""
        return "G15" if self.polar else "G69"

    def _turn(self, words: Sequence[Word], axes: list[str], absolute: bool, on: bool) -> list[Word]:
        """G68 and G69."""
        if not on:
            ended, self.turned, self.point = self.turned is not None, None, {}
            self.left = set(axes) if ended else self.left
            return [w for w in words if (w.letter, w.value) != ("G", 69.0) or not ended]
        given = {w.letter: w.value for w in words}
        others = {*AXES, *CENTRES, *self.track.held.axes} & set(given) - set(axes)
        if self.turned is not None or self.polar or not absolute or not {*axes, "R"} <= set(given) or others:
            raise MacroFault("gcode.mode", "G68 is executed under G90, with both axes of its centre and R alone, in no "
                             "other G68 and not under G16", f"write G90 G68 {axes[0]} {axes[1]} R, and G69 behind it")
        if self.blocks.tilted or self.blocks.state.get(8) in TIP:
            raise MacroFault("gcode.mode", "G68 in a tilted plane or under tool centre point control is not executed",
                             "end them before it")
        self.turned, self.point = (given[axes[0]], given[axes[1]], math.radians(given["R"])), {}
        return [w for w in words if w.letter not in (*axes, "R") and (w.letter, w.value) != ("G", 68.0)]

    def _from_polar(self, words: Sequence[Word], given: dict[str, float], axes: list[str], absolute: bool) -> list[Word]:
        """Radius and angle as both coordinates."""
        first, second = axes
        if any(c in given for c in CENTRES) and self._round(words):
            raise MacroFault("gcode.mode", "a circle with I, J or K under G16", "state its radius with R, as Fanuc asks for")
        if not absolute and first in given:
            raise MacroFault("gcode.mode", f"{first} under G91 and G16 counts from where the axes stand: not executed",
                             f"state the radius under G90; G91 with {second} turns on")
        if not absolute and given.keys() & {"K", "L"}:
            raise MacroFault("gcode.mode", "repeats under G16 are not executed", "state each angle in a block of its own")
        self.radius = given.get(first, self.radius)
        if second in given:
            self.angle = given[second] if absolute else (self.angle or 0.0) + given[second]
        if self.radius is None or self.angle is None:
            raise MacroFault("gcode.mode", "the first block behind G16 states radius and angle",
                             f"state {first} and {second}")
        at = math.radians(self.angle)
        ends = {first: self.radius * math.cos(at), second: self.radius * math.sin(at)}
        return self._ended(words, ends, axes, absolute)

    def _from_turned(self, words: Sequence[Word], given: dict[str, float], axes: list[str], absolute: bool) -> list[Word]:
        """Ends and centres turned about the centre of G68."""
        assert self.turned is not None
        x, y, angle = self.turned
        cos, sin = math.cos(angle), math.sin(angle)
        if not absolute and any(a in given for a in axes):
            raise MacroFault("gcode.mode", "G91 under G68 is not executed", "state both axes under G90")
        self.point.update({a: given[a] for a in axes if a in given})
        ends = dict[str, float]()
        if any(a in given for a in axes):
            if len(self.point) < 2:
                raise MacroFault("gcode.mode", "the first block behind G68 states both axes of the plane",
                                 f"state {axes[0]} and {axes[1]}")
            u, v = self.point[axes[0]] - x, self.point[axes[1]] - y
            ends = {axes[0]: x + cos * u - sin * v, axes[1]: y + sin * u + cos * v}
        letters = [CENTRES[AXES.index(a)] for a in axes]
        if any(c in given for c in letters) and not self._round(words):
            raise MacroFault("gcode.mode", "I, J or K of a cycle under G68", "write the cycle without them, or without G68")
        if any(c in given for c in letters):
            u, v = (given.get(c, 0.0) for c in letters)
            ends |= {letters[0]: cos * u - sin * v, letters[1]: sin * u + cos * v}
        return self._ended(words, ends, [*axes, *letters], True)

    def _round(self, words: Sequence[Word]) -> bool:
        """True of a block that runs a circle."""
        return next((w.value for w in words if w.letter == "G" and (w.value < 4.0 or 73.0 <= w.value <= 89.0)),
                    self.track.motion) in _ROUND

    def _ended(self, words: Sequence[Word], ends: dict[str, float], letters: list[str], absolute: bool) -> list[Word]:
        """The block with other ends; under G91 from where the axes stand."""
        if not absolute:
            ends = {a: v - self.track.position(a) / self.track.scale(a) for a, v in ends.items()}
        made = [w for w in words if w.letter not in letters or w.letter not in ends]
        return [*made, *(Word(a, v) for a, v in ends.items())]
