"""Blocks of a SINUMERIK program in a frame that turns, scales or mirrors: their words in the work offset.

Ends and centres are taken over exactly; circles only where they stay circles of the plane in force (the control refuses
SCALE of unequal factors for them), with G2 and G3, G41 and G42 changed where the plane is mirrored, as the control does by
itself.
"""

from __future__ import annotations

import math
import re

from postproc.readback.macros.expressions import MacroFault, written
from postproc.readback.macros.frame import AXES, IN_PLANE, CoordinateFrame
from postproc.readback.macros.track import Track

CENTRES = "IJK"
_CODE = re.compile(r"G0*(\d+)")
_OTHER = {2: 3, 3: 2, 41: 42, 42: 41}
_MOTION, _SIDES = (0, 1, 2, 3), (40, 41, 42)
_HINT = "write the blocks in the coordinates of the work offset, or CYCLE800"


class TurnedBlocks:
    """What a frame does to blocks: `frame` in force, `motion` and `side` as the program has them.

    Attributes:
        ends, centres: mm of the block that is read, in the coordinates of the frame
        written: motion that was written last, None where it is that of the program
        oriented: TRAORI is on
    """

    def __init__(self, track: Track) -> None:
        self.track, self.frame = track, CoordinateFrame()
        self.ends: dict[str, float] = {}
        self.centres: dict[str, tuple[float, bool]] = {}
        self.radius: float | None = None
        self.motion: int | None = None
        self.written: int | None = None
        self.side = 40
        self.oriented = False

    @property
    def on(self) -> bool:
        """True where the frame does more than shift."""
        return self.frame.turned

    def take(self, frame: CoordinateFrame) -> None:
        """Another frame in force."""
        if self.side != 40 and math.copysign(1.0, self._size(frame)) != math.copysign(1.0, self._size(self.frame)):
            raise MacroFault("gcode.frame_turned", f"MIRROR while G{self.side} holds is not executed",
                             "write G40 before it, and G41 or G42 again behind it")
        if frame.turned and not self.on and self.written is None:
            self.written = self.motion
        self.frame = frame
        self.track.frame = frame if frame.turned else None
        for axis, value in zip(AXES, frame.shift, strict=True):
            self.track.local.pop(axis, None)
            if value and not frame.turned:
                self.track.local[axis] = value
        self.track.shifted |= any(frame.shift)

    def _size(self, frame: CoordinateFrame) -> float:
        size = frame.flat(self.track.plane)
        return 1.0 if math.isnan(size) else size

    def codes(self, code: int) -> None:
        """A G code of the program."""
        if code in _MOTION:
            self.motion = code
        elif code in _SIDES:
            self.side = code
        elif code in (17, 18, 19):
            self.track.plane = code

    def end(self, axis: str, value: float, absolute: bool) -> None:
        """An axis word: mm in the coordinates of the frame."""
        self.ends[axis] = value if absolute else self.track.position(axis) + value

    def centre(self, letter: str, value: float, absolute: bool) -> None:
        """I, J or K: mm."""
        self.centres[letter] = (value, absolute)

    def row(self, out: list[str]) -> list[str]:
        """The words of a block in the work offset, behind those that no frame touches."""
        if not self.on and self.written is None:
            return out
        ends, centres, radius, self.ends, self.centres, self.radius = self.ends, self.centres, self.radius, {}, {}, None
        size = self.frame.flat(self.track.plane)
        if self.on and (self.oriented or any(w.startswith("CYCLE800(") for w in out)):
            raise MacroFault("gcode.frame_turned", "a frame that turns, scales or mirrors next to TRAORI or before CYCLE800 "
                             "is not executed", "write ROT alone before it, to cancel the frame")
        goes = bool(ends or centres)
        self._judge(size, out, goes)
        made = [self._changed(w, size) for w in out]
        if (goes or not self.on) and self.motion is not None and not any(
                (m := _CODE.fullmatch(w)) and int(m[1]) in _MOTION for w in out):
            code = self._swapped(self.motion, size)
            made = [*([f"G{code}"] if code != self.written else []), *made]
        self.written = next((int(m[1]) for w in made if (m := _CODE.fullmatch(w)) and int(m[1]) in _MOTION), self.written)
        if not self.on and self.written == self.motion:
            self.written = None
        start = {a: self.track.at[a] for a in AXES if a in self.track.at}
        moved = self._ends(ends)
        return [*made, *moved, *self._centres(centres, start), *self._radius(radius, size)]

    def drills(self, frame: CoordinateFrame) -> bool:
        """True where holes of the plane in force keep direction and depth in a frame."""
        return frame.keeps(IN_PLANE[self.track.plane][2])

    def _swapped(self, code: int, size: float) -> int:
        return _OTHER.get(code, code) if size < 0.0 else code

    def _changed(self, word: str, size: float) -> str:
        m = _CODE.fullmatch(word)
        return f"G{self._swapped(int(m[1]), size)}" if m and int(m[1]) in _OTHER else word

    def _judge(self, size: float, out: list[str], moves: bool) -> None:
        """What the control, or plain words, cannot do in such a frame."""
        if not self.on:
            return
        if math.isnan(size) and ((self.motion in (2, 3) and moves) or self.side != 40):
            raise MacroFault("gcode.frame_turned", "a circle, or G41 and G42, in a frame that turns the plane, or scales "
                             "its axes unequally", _HINT)
        drills = any(re.match(r"CYCLE8\d", w) for w in out)
        if drills and not self.drills(self.frame):
            raise MacroFault("gcode.frame_turned", "a drilling cycle in a frame that turns or scales the tool's axis", _HINT)

    def _ends(self, ends: dict[str, float]) -> list[str]:
        """Axis words of the work offset: those that a stated coordinate decides."""
        made, at = list[str](), dict[str, float]()
        known = {a: ends.get(a) for a in AXES}
        for i, axis in enumerate(AXES):
            inputs = self.frame.needed(i)
            if axis not in self.track.at or not any(AXES[j] in ends for j in inputs):
                continue
            values = [0.0, 0.0, 0.0]
            for j in inputs:
                here = known[AXES[j]]
                values[j] = self.track.position(AXES[j]) if here is None else here
            a, b, c = values
            at[axis] = self.frame.vector((a, b, c))[i] + self.frame.shift[i]
        for axis, value in at.items():
            self.track.at[axis] = value
            made.append(f"{axis}=AC({written(value / self.track.unit)})")
        return made

    def _centres(self, centres: dict[str, tuple[float, bool]], start: dict[str, float | None]) -> list[str]:
        """I, J, K from the begin of the block."""
        if not centres or self.motion not in (2, 3):
            return []
        values, back = [0.0, 0.0, 0.0], self.frame.inverse()
        for letter, (value, absolute) in centres.items():
            k = CENTRES.index(letter)
            here = 0.0
            for j in range(3):
                at = start.get(AXES[j])
                if absolute and back[k][j] and at is None:
                    raise MacroFault("gcode.position_unknown", f"where {AXES[j]} stands here is not known",
                                     f"state {AXES[j]} before this block")
                here += back[k][j] * ((at or 0.0) - self.frame.shift[j])
            values[k] = value - here if absolute else value
        a, b, c = values
        made = self.frame.vector((a, b, c))
        return [f"{letter}{written(v / self.track.unit)}" for letter, v in zip(CENTRES, made, strict=True) if v]

    def _radius(self, radius: float | None, size: float) -> list[str]:
        return [] if radius is None else [f"CR={written(radius * abs(size) / self.track.unit)}"]
