"""Scaled and mirrored points of Fanuc and Haas: G51, G50, G51.1, G50.1, as they lie in the coordinates of the program.

Fanuc B-63682EN, 16 (scaling of each axis): G51 X Y Z P, or I, J, K by axis, about an absolute centre, until G50; negative
factors mirror; the unit of a factor without a decimal point is a parameter. Haas 96-8000, G51: a centre that is not stated
is where the axis stands; X, Y, Z, I, J, K and R are scaled. G51.1 X Y Z mirrors about those coordinates, G50.1 with an axis
ends it; mirroring one axis of the plane interchanges G2 and G3, G41 and G42, and no G28, G30, G52 to G59, G92 stands under
it (Siemens, ISO Milling 04.07, 3.2, which has Fanuc's form).
"""

from __future__ import annotations

from collections.abc import Sequence

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.frame import AXES, IN_PLANE
from postproc.readback.macros.plane_words import CENTRES, NOT_WITHIN, TIP, PlaneWords
from postproc.readback.macros.word_blocks import CYCLES, Blocks, Word

_NAMES = {51.0: "G51", 51.1: "G51.1"}
_OTHER = {2.0: 3.0, 3.0: 2.0, 41.0: 42.0, 42.0: 41.0}
_MOTION, _SIDES = (0.0, 1.0, 2.0, 3.0), (40.0, 41.0, 42.0)
_NEVER = frozenset((*NOT_WITHIN, 16.0, 68.0))


class ScaledWords:
    """Words of blocks as they lie in the coordinates of the program.

    Attributes:
        factor, shift: of each axis: a coordinate p of the program lies at factor p + shift; in force: G51, G51.1 or ""
        motion, written: of the program, and of what was written on; side: of the program
    """

    def __init__(self, blocks: Blocks, plane: PlaneWords, haas: bool) -> None:
        self.blocks, self.plane, self.haas = blocks, plane, haas
        self.factor, self.shift = dict[str, float](), dict[str, float]()
        self.name = ""
        self.motion: float | None = None
        self.written: float | None = None
        self.side = 40.0

    def taken(self, words: Sequence[Word]) -> list[Word]:
        """A block's words, ends and centres in the coordinates of the program without scale and mirror."""
        codes = {w.value for w in words if w.letter == "G"}
        switch = codes & {51.0, 51.1} or (codes & {50.0, 50.1} if self.name else set[float]())
        self.motion = next((c for c in codes if c in _MOTION), self.motion)
        if switch:
            return self._switched(words, codes, min(switch))
        self.side = next((c for c in codes if c in _SIDES), self.side)
        if not self.name:
            return self._as_stated(list(words), codes)
        refused = min(codes & _NEVER, default=None)
        if refused is not None:
            raise MacroFault("gcode.mode", f"G{refused:g} under {self.name} is not executed", f"{self._end} before it")
        given = {w.letter for w in words}
        if 4.0 in codes or not given & {*AXES, *CENTRES, "R"}:
            return [self._swapped(w) for w in words]
        return self._as_stated([self._swapped(w) for w in self._placed(words, codes)], codes)

    @property
    def _end(self) -> str:
        return "G50" if self.name == "G51" else "G50.1 with its axes"

    @property
    def _mirrored(self) -> bool:
        """True where the plane in force is."""
        i, j, _ = IN_PLANE[self.blocks.track.plane]
        return self.factor.get(AXES[i], 1.0) * self.factor.get(AXES[j], 1.0) < 0.0

    def _switched(self, words: Sequence[Word], codes: set[float], code: float) -> list[Word]:
        """G51, G50, G51.1 and G50.1, each alone in its block."""
        allowed = {*AXES, *("PIJK" if code == 51.0 else ""), "N"}
        if codes - {code, 90.0} or {w.letter for w in words} - {*allowed, "G"}:
            raise MacroFault("gcode.mode", f"G{code:g} next to other words is not executed", "write it alone in its block")
        tip = self.blocks.state.get(8) in TIP
        if self.side != 40.0 or self.plane.name_in_force or self.blocks.tilted or tip:
            raise MacroFault("gcode.mode", f"G{code:g} under G41, G42, G16, G68, in a tilted plane or under tool centre "
                             "point control is not executed", "end them before it")
        if self.haas and code in (50.1, 51.1):
            raise MacroFault("gcode.unknown_code", f"G{code:g} is no code of Haas", "write the points as they are meant")
        given = {w.letter: w for w in words if w.letter != "G"}
        if code == 50.0 and given.keys() - {"N"}:
            raise MacroFault("gcode.mode", "G50 with axes is not executed", "write G50 alone")
        if code in (51.0, 51.1):
            self._on(given, code, codes)
        else:
            self._off(given, code)
        self.blocks.within = self.name
        return [w for w in words if w.letter == "G" and w.value == 90.0]

    def _on(self, given: dict[str, Word], code: float, codes: set[float]) -> None:
        """G51 and G51.1."""
        name, track = _NAMES[code], self.blocks.track
        if self.name not in ("", name if code == 51.1 else "") or not (track.absolute or 90.0 in codes):
            raise MacroFault("gcode.mode", f"{name} under {self.name or 'G91'} is not executed",
                             f"write {name} under G90, and under no other scale or mirror")
        bare = next((w for w in given.values() if w.letter != "N" and w.text and "." not in w.text
                     and (w.value or w.letter not in AXES)), None)
        if bare is not None:
            self._pointed(bare)
        factors = self._factors(given) if code == 51.0 else {a: -1.0 for a in AXES if a in given}
        if not factors or any(f == 0.0 for f in factors.values()):
            raise MacroFault("gcode.mode", f"{name} without {'a factor' if code == 51.0 else 'axes'}, or with one of 0",
                             "state P, or I, J, K" if code == 51.0 else "state X, Y or Z")
        for axis, factor in factors.items():
            centre = given[axis].value if axis in given else track.position(axis) / track.scale(axis)
            self.factor[axis], self.shift[axis] = factor, centre * (1.0 - factor)
        self.name, self.written = name, self.motion if self.written is None else self.written

    @staticmethod
    def _factors(given: dict[str, Word]) -> dict[str, float]:
        """By axis: P for all, or I, J and K."""
        if "P" in given:
            return {} if given.keys() & set(CENTRES) else dict.fromkeys(AXES, given["P"].value)
        return {a: given[c].value for a, c in zip(AXES, CENTRES, strict=True)} if given.keys() >= set(CENTRES) else {}

    def _off(self, given: dict[str, Word], code: float) -> None:
        """G50 and G50.1."""
        axes = [a for a in AXES if a in given]
        if (code == 50.0) != (self.name == "G51") or (code == 50.1 and not axes):
            how = "with" if axes else "without"
            raise MacroFault("gcode.mode", f"G{code:g} {how} axes under {self.name} is not executed", f"write {self._end}")
        for axis in axes or AXES:
            self.factor.pop(axis, None)
            self.shift.pop(axis, None)
        self.name = self.name if self.factor else ""

    def _placed(self, words: Sequence[Word], codes: set[float]) -> list[Word]:
        """Ends, centres and radius of a block that moves."""
        absolute = 90.0 in codes or (self.blocks.track.absolute and 91.0 not in codes)
        motion = self.motion
        cycle = next((c for c in codes if c in CYCLES), None)
        drills = cycle is not None or (not codes & {*_MOTION, 80.0} and self.blocks.track.motion in CYCLES)
        i, j, n = (AXES[k] for k in IN_PLANE[self.blocks.track.plane])
        sizes = [abs(self.factor.get(a, 1.0)) for a in (i, j)]
        if drills and (self.factor.get(n, 1.0) != 1.0 or any(w.letter in CENTRES for w in words)):
            raise MacroFault("gcode.mode", f"a cycle under {self.name} of its own axis is not executed",
                             "write the holes without it: the control does not scale all their depths")
        if not drills and motion in (2.0, 3.0) and sizes[0] != sizes[1]:
            raise MacroFault("gcode.mode", f"a circle under {self.name} of unequal factors is not executed",
                             "write it as lines, or one factor for both axes")
        made = list[Word]()
        for w in words:
            axis = w.letter if w.letter in AXES else AXES[CENTRES.index(w.letter)] if w.letter in CENTRES else ""
            if w.letter == "R" and not drills:
                made.append(Word("R", w.value * sizes[0]))
            elif axis not in self.factor or (drills and axis == n):
                made.append(w)
            else:
                self._pointed(w)
                made.append(Word(w.letter, self.factor[axis] * w.value + (
                    self.shift[axis] if absolute and w.letter in AXES else 0.0)))
        return made

    @staticmethod
    def _pointed(w: Word) -> None:
        if w.text and "." not in w.text and w.value:
            raise MacroFault("gcode.decimal_point", f"{w.text} has no decimal point: its unit is a parameter of the control",
                             "write the decimal point")

    def _swapped(self, w: Word) -> Word:
        return Word("G", _OTHER[w.value]) if w.letter == "G" and w.value in _OTHER and self._mirrored else w

    def _as_stated(self, words: list[Word], codes: set[float]) -> list[Word]:
        """With the motion in words where that of the program is another than the one written last."""
        stated = next((w.value for w in words if w.letter == "G" and w.value in _MOTION), None)
        if self.written is None or self.motion is None:
            return words
        wanted = _OTHER.get(self.motion, self.motion) if self._mirrored else self.motion
        moves = any(w.letter in (*AXES, *CENTRES) for w in words) and not codes & {4.0, 80.0, *CYCLES}
        drills = self.blocks.track.motion in CYCLES and stated is None
        if stated is None and moves and not drills and wanted != self.written:
            words, stated = [Word("G", wanted), *words], wanted
        self.written = stated if stated is not None else self.written
        return words
