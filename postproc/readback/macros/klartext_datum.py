"""Datum shifts, mirror images and rotations of Klartext: cycle 7 and TRANS DATUM, added to absolute coordinates of the
blocks behind them; cycles 8, 10 and 11.

HEIDENHAIN TNC 640, Cycle Programming (datum shift, cycle 7): 7.1 on state an axis each, absolute from the preset, or with I
from the shift in force; the axes that are not stated keep theirs; zeros cancel. Klartext Programming: TRANS DATUM AXIS
states them in one row, TRANS DATUM RESET cancels all. Datum tables are files of the control.

Cycle 8 (same manual, mirroring): 8.1 states the axes that are mirrored about the datum in force, without any it ends;
where one axis of the plane is mirrored circles and the side of the tool turn round. Here X and Y, in blocks of X, Y and Z.

Cycle 10 (same manual, rotation): 10.1 states the angle of the plane about the datum in force, from the axis X, with I from
the angle in force; 0 ends it. An axis that the first block behind it leaves out has no coordinate yet: it states both.

Cycle 11 (TNC 410 manual, scaling factor): SCL, up to 99.999999, times all coordinates and radii about the datum in force;
1 ends it. In the plane alone by a machine parameter of older controls (7410): here all axes, as without it. Cycles have
other sizes under it: none is executed there.
"""

from __future__ import annotations

import math
import re
from typing import Literal

from postproc.readback.macros.expressions import MacroFault, written


def _miscellaneous(numbers: str) -> str:
    """Pattern of M functions as the reader of blocks takes them: blanks and zeros before the number, none before M."""
    return rf"(?:(?<![A-Z])|(?<=FMAX))M[ \t]*0*(?:{numbers})(?!\d)"


_CYCLE = re.compile(r"CYCL DEF 7\.(\d)[ \t]*(.*)")
_MIRROR = re.compile(r"CYCL DEF 8\.(\d)[ \t]*(.*)")
_ROTATION = re.compile(r"CYCL DEF 10\.(\d)[ \t]*(.*)")
_SCALE = re.compile(r"CYCL DEF 11\.(\d)[ \t]*(.*)")
_FACTOR = re.compile(r"SCL[ \t]*\+?(\d+\.?\d*|\.\d+)")
_ANGLE = re.compile(r"(I?)ROT[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_PLANE = re.compile(r"(?<![A-Z0-9])(I?)([XY])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))[ \t]*")
_ALONG = re.compile(r"(?<![A-Z0-9])I([XYZUVW])([ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_RADIUS = re.compile(r"(?<![A-Z0-9])R([ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_ARC = re.compile(r"/?[ \t]*CR\b")
_TURNED = re.compile(r"DR([-+])|(?<![A-Z0-9])R([LR])(?![A-Z0-9])")
_SIDE = re.compile(r"(?<![A-Z0-9])R([LR0])(?![A-Z0-9])")
_UNMIRRORED = re.compile(r"^/?[ \t]*(?:LP|CP|CTP|CYCL CALL (?:POS|PAT)"
                         r"|CYCL DEF (?!20[0135679]\b|240\b|32\b|32\.|7\.|8\.|10\.)\d)")
_UNSCALED = re.compile(r"^/?[ \t]*(?:LP|CP|CTP|CYCL CALL|CYCL DEF (?!32\b|32\.|9\b|9\.)\d)|" + _miscellaneous("99|89"))
_TRANS = re.compile(r"TRANS DATUM[ \t]+(AXIS|RESET|TABLE)\b[ \t]*(.*)")
_STATED = re.compile(r"(I?)([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_MOVES = re.compile(r"/?[ \t]*(?:L|C|CC|CR|CT|CP|LP|CYCL CALL POS)\b(?!YCL DEF)")
_ABSOLUTE = re.compile(r"(?<![A-Z0-9])([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_SURFACE = re.compile(r"(Q203[ \t]*=[ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_MACHINE = re.compile(_miscellaneous("91|92"))
_OTHER = re.compile(r"^(?:PLANE\b|FUNCTION TCPM|CYCL DEF (?:247|19)\b|CYCL DEF 26\.|PATTERN DEF"
                    r"|CYCL DEF 22[01]\b)|" + _miscellaneous("128|129"))
_BEGUN = re.compile(r"^(?:PLANE (?!RESET)|FUNCTION TCPM)|" + _miscellaneous("128"))
_ENDED = re.compile(r"^(?:PLANE RESET|FUNCTION RESET TCPM)|" + _miscellaneous("129"))
_CALLS = re.compile(r"^CYCL CALL|" + _miscellaneous("99|89"))
_POLE = re.compile(r"/?[ \t]*CC\b")
_ABOUT = re.compile(r"/?[ \t]*(?:C|CP|LP)\b")


DatumCycle = Literal["", "cycle 8", "cycle 10", "cycle 11"]


class DatumShift:
    """Shifts in force, by axis, in units of the program.

    Attributes:
        mirrored: axes of cycle 8; angle: degrees of cycle 10; scale: factor of cycle 11
        side: L, R or 0, as the program states it
        at: X and Y of the program under cycle 10, empty before a block states them
        other: row that has put a plane or the tip in force, "" for none; surface, pole: shifts under which a cycle and a
            pole were stated, which count from where the datum is when they are used
    """

    def __init__(self) -> None:
        self.by: dict[str, float] = {}
        self.mirrored, self.side = "", "0"
        self.other = ""
        self.angle, self.scale, self.at = 0.0, 1.0, dict[str, float]()
        self.surface, self.pole = dict[str, float](), (dict[str, float](), 0.0, 1.0)

    @property
    def cycle(self) -> DatumCycle:
        """The one in force that changes coordinates beyond a shift, "" for none."""
        return "cycle 8" if self.mirrored else "cycle 10" if self.angle else "cycle 11" if self.scale != 1.0 else ""

    def stated(self, row: str) -> bool:
        """True of a row that states a shift, which is taken."""
        for form, taken in ((_CYCLE, self._take), (_MIRROR, self._mirror), (_ROTATION, self._rotate), (_SCALE, self._size)):
            if m := form.fullmatch(row):
                if m[1] != "0":
                    taken(m[2], row)
                elif any(map(str.isdigit, m[2])):
                    raise MacroFault("gcode.syntax", f"{row} is not read",
                                     "write each row of the cycle as a block of its own")
                return True
        if (m := _TRANS.fullmatch(row)) is None:
            return False
        if m[1] == "TABLE":
            raise MacroFault("gcode.data_setting", f"{row}: a datum table is a file of the control",
                             "state the shift by its axes: TRANS DATUM AXIS X+0 Y+0 Z+0")
        if m[1] == "RESET" and self.cycle in ("", "cycle 8"):
            self.by.clear()
        else:
            self._take(m[2], row)
        return True

    def _mirror(self, body: str, row: str) -> None:
        axes = body.split()
        if set(axes) - {"X", "Y"}:
            raise MacroFault("gcode.mode", f"{row} is not executed", "mirror X, Y or both")
        self._alone(row, "cycle 8")
        self.mirrored = "".join(sorted(set(axes)))

    def _rotate(self, body: str, row: str) -> None:
        if (m := _ANGLE.fullmatch(body.strip())) is None:
            raise MacroFault("gcode.syntax", f"{row} is not read", "state the angle in degrees: CYCL DEF 10.1 ROT+30")
        self._alone(row, "cycle 10")
        self.angle, self.at = float(m[2]) + (self.angle if m[1] else 0.0), {}

    def _size(self, body: str, row: str) -> None:
        if (m := _FACTOR.fullmatch(body.strip())) is None or not 0.0 < float(m[1]) < 100.0:
            raise MacroFault("gcode.syntax", f"{row} is not read", "state a factor above 0, below 100: CYCL DEF 11.1 SCL0.5")
        self._alone(row, "cycle 11")
        self.scale = float(m[1])

    def _alone(self, row: str, own: DatumCycle) -> None:
        """A cycle that turns or scales coordinates stands alone."""
        cycle = self.cycle if self.cycle != own else ""
        if under := self.other or cycle or ("R" + self.side if self.side != "0" else ""):
            raise MacroFault("gcode.mode", f"{row} under {under} is not executed",
                             "state it before any plane, under R0, without tool centre point control and any other cycle "
                             "that turns or scales coordinates")

    def _take(self, body: str, row: str) -> None:
        if cycle := self.cycle:
            raise MacroFault("gcode.mode", f"{row} under {cycle} is not executed", f"state the shift before {cycle}")
        given = _STATED.findall(body)
        if not given or _STATED.sub("", body).strip():
            raise MacroFault("gcode.data_setting" if "#" in body else "gcode.syntax", f"{row} is not read",
                             "state the shift by its axes: CYCL DEF 7.1 X+0")
        if self.other:
            raise MacroFault("gcode.mode", f"{row} under {self.other} is not executed", "state the shift before any plane, "
                             "and without tool centre point control")
        for more, axis, value in given:
            self.by[axis] = float(value) + (self.by.get(axis, 0.0) if more else 0.0)

    def shifted(self, row: str) -> str:
        """A row with its absolute coordinates as they lie from the preset."""
        now = {axis: by for axis, by in self.by.items() if by}
        if _CALLS.search(row) and now.get("Z") != self.surface.get("Z"):
            raise MacroFault("gcode.mode", "a cycle is called under another datum shift than it was defined under",
                             "define the cycle behind the shift")
        if _ABOUT.match(row) and (now, self.angle, self.scale) != self.pole:
            raise MacroFault("gcode.mode", "a pole that was stated under another datum shift, rotation or scale",
                             "state CC behind the shift")
        self.surface = now if row.startswith("CYCL DEF") else self.surface
        self.pole = (now, self.angle, self.scale) if _POLE.match(row) else self.pole
        if _ENDED.search(row):
            self.other = ""
        elif _BEGUN.search(row):
            self.other = row[:40]
        self.side = found[-1] if (found := _SIDE.findall(row)) and not row.startswith("CYCL") else self.side
        if not now and not self.cycle:
            return row
        if self.cycle and (_UNSCALED.search(row) if self.scale != 1.0 else _UNMIRRORED.match(row)):
            raise MacroFault("gcode.mode", f"{row[:40]} under {self.cycle} is not executed",
                             "write it by X and Y, or end it")
        if _OTHER.search(row):
            raise MacroFault("gcode.mode", f"{row[:40]} in coordinates that a datum shift has moved is not executed",
                             "cancel the shift before it (TRANS DATUM RESET), and state it again in the plane")
        if row.startswith("CYCL DEF"):
            return _SURFACE.sub(lambda m: m[1] + self._sum("Z", m[2]), row)
        if not _MOVES.match(row) or _MACHINE.search(row):
            self.at = {} if _PLANE.search(row) else self.at
            return row
        if len(self.mirrored) == 1:
            row = _TURNED.sub(lambda m: "DR" + "-+"[m[1] == "-"] if m[1] else "R" + "LR"[m[2] == "L"], row)
        if self.angle:
            row = self._turned(row)
        if _ARC.match(row):
            row = _RADIUS.sub(lambda m: f"R{m[1]}{self._signed(m[2], self.scale)}", row)
        row = _ALONG.sub(lambda m: f"I{m[1]}{m[2]}{self._signed(m[3], self._factor(m[1]))}", row)
        return _ABSOLUTE.sub(lambda m: m[1] + self._sum(m[1], m[2]), row)

    def _turned(self, row: str) -> str:
        """A row of motion with its X and Y as they lie without the rotation; a pole is no motion."""
        stated = {axis: float(value) + (self.at.get(axis, math.nan) if more else 0.0)
                  for more, axis, value in _PLANE.findall(row)}
        if not stated:
            return row
        pole = _POLE.match(row) is not None
        x, y = (stated.get(axis, math.nan if pole else self.at.get(axis, math.nan)) for axis in "XY")
        if math.isnan(x + y):
            raise MacroFault("gcode.mode", f"{row[:40]} under cycle 10: X and Y are not both known",
                             "state both axes of the plane in CC and in the first block behind cycle 10")
        if not pole:
            self.at = {"X": x, "Y": y}
        c, s = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        first = _PLANE.search(row)
        assert first is not None
        turned = f"X{self._signed('1', c * x - s * y)} Y{self._signed('1', s * x + c * y)} "
        return row[:first.start()] + turned + _PLANE.sub("", row[first.start():])

    def _sum(self, axis: str, value: str) -> str:
        return self._signed(value, self._factor(axis), self.by.get(axis, 0.0))

    def _factor(self, axis: str) -> float:
        return -1.0 if axis in self.mirrored else 1.0 if axis in "ABC" else self.scale

    @staticmethod
    def _signed(value: str, factor: float, shift: float = 0.0) -> str:
        text = written(factor * float(value) + shift, True)
        return text if text.startswith("-") else f"+{text}"
