"""Datum shifts, mirror images and rotations of Klartext: cycle 7 and TRANS DATUM, added to absolute coordinates of the
blocks behind them; cycles 8 and 10.

HEIDENHAIN TNC 640, Cycle Programming (datum shift, cycle 7): 7.1 on state an axis each, absolute from the preset, or with I
from the shift in force; the axes that are not stated keep theirs; zeros cancel. Klartext Programming: TRANS DATUM AXIS
states them in one row, TRANS DATUM RESET cancels all. Datum tables are files of the control.

Cycle 8 (same manual, mirroring): 8.1 states the axes that are mirrored about the datum in force, without any it ends;
where one axis of the plane is mirrored circles and the side of the tool turn round. Here X and Y, in blocks of X, Y and Z.

Cycle 10 (same manual, rotation): 10.1 states the angle of the plane about the datum in force, from the axis X, with I from
the angle in force; 0 ends it. An axis that the first block behind it leaves out has no coordinate yet: it states both.
"""

from __future__ import annotations

import math
import re

from postproc.readback.macros.expressions import MacroFault, written

_CYCLE = re.compile(r"CYCL DEF 7\.(\d)[ \t]*(.*)")
_MIRROR = re.compile(r"CYCL DEF 8\.(\d)[ \t]*(.*)")
_ROTATION = re.compile(r"CYCL DEF 10\.(\d)[ \t]*(.*)")
_ANGLE = re.compile(r"(I?)ROT[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_PLANE = re.compile(r"(?<![A-Z0-9])(I?)([XY])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))[ \t]*")
_ALONG = re.compile(r"(?<![A-Z0-9])I([XY])([ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_TURNED = re.compile(r"DR([-+])|(?<![A-Z0-9])R([LR])(?![A-Z0-9])")
_SIDE = re.compile(r"(?<![A-Z0-9])R([LR0])(?![A-Z0-9])")
_UNMIRRORED = re.compile(r"^/?[ \t]*(?:LP|CP|CTP|CYCL CALL (?:POS|PAT)"
                         r"|CYCL DEF (?!20[0135679]\b|240\b|32\b|32\.|7\.|8\.|10\.)\d)")
_TRANS = re.compile(r"TRANS DATUM[ \t]+(AXIS|RESET|TABLE)\b[ \t]*(.*)")
_STATED = re.compile(r"(I?)([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_MOVES = re.compile(r"/?[ \t]*(?:L|C|CC|CR|CT|CP|LP|CYCL CALL POS)\b(?!YCL DEF)")
_ABSOLUTE = re.compile(r"(?<![A-Z0-9])([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_SURFACE = re.compile(r"(Q203[ \t]*=[ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_MACHINE = re.compile(r"(?<![A-Z0-9])M9[12](?!\d)")
_OTHER = re.compile(r"^(?:PLANE\b|FUNCTION TCPM|CYCL DEF (?:247|19)\b|CYCL DEF (?:11|26)\.|PATTERN DEF"
                    r"|CYCL DEF 22[01]\b)|(?<![A-Z0-9])M12[89](?!\d)")
_BEGUN = re.compile(r"^(?:PLANE (?!RESET)|FUNCTION TCPM)|(?<![A-Z0-9])M128(?!\d)")
_ENDED = re.compile(r"^(?:PLANE RESET|FUNCTION RESET TCPM)|(?<![A-Z0-9])M129(?!\d)")
_CALLS = re.compile(r"^CYCL CALL|(?<![A-Z0-9])M(?:99|89)(?!\d)")
_POLE = re.compile(r"/?[ \t]*CC\b")
_ABOUT = re.compile(r"/?[ \t]*(?:C|CP|LP)\b")


class DatumShift:
    """Shifts in force, by axis, in units of the program.

    Attributes:
        mirrored: axes of cycle 8; angle: degrees of cycle 10; side: L, R or 0, as the program states it
        at: X and Y of the program under cycle 10, empty before a block states them
        other: row that has put a plane or the tip in force, "" for none; surface, pole: shifts under which a cycle and a
            pole were stated, which count from where the datum is when they are used
    """

    def __init__(self) -> None:
        self.by: dict[str, float] = {}
        self.mirrored, self.side = "", "0"
        self.other = ""
        self.angle, self.at = 0.0, dict[str, float]()
        self.surface, self.pole = dict[str, float](), (dict[str, float](), 0.0)

    def stated(self, row: str) -> bool:
        """True of a row that states a shift, which is taken."""
        if m := _CYCLE.fullmatch(row):
            if m[1] != "0":
                self._take(m[2], row)
            return True
        if m := _MIRROR.fullmatch(row):
            if m[1] != "0":
                self._mirror(m[2], row)
            return True
        if m := _ROTATION.fullmatch(row):
            if m[1] != "0":
                self._rotate(m[2], row)
            return True
        if (m := _TRANS.fullmatch(row)) is None:
            return False
        if m[1] == "TABLE":
            raise MacroFault("gcode.data_setting", f"{row}: a datum table is a file of the control",
                             "state the shift by its axes: TRANS DATUM AXIS X+0 Y+0 Z+0")
        if m[1] == "RESET" and not self.angle:
            self.by.clear()
        else:
            self._take(m[2], row)
        return True

    def _mirror(self, body: str, row: str) -> None:
        axes = body.split()
        if set(axes) - {"X", "Y"}:
            raise MacroFault("gcode.mode", f"{row} is not executed", "mirror X, Y or both")
        self._alone(row, "cycle 10" if self.angle else "")
        self.mirrored = "".join(sorted(set(axes)))

    def _rotate(self, body: str, row: str) -> None:
        if (m := _ANGLE.fullmatch(body.strip())) is None:
            raise MacroFault("gcode.syntax", f"{row} is not read", "state the angle in degrees: CYCL DEF 10.1 ROT+30")
        self._alone(row, "cycle 8" if self.mirrored else "")
        self.angle, self.at = float(m[2]) + (self.angle if m[1] else 0.0), {}

    def _alone(self, row: str, cycle: str) -> None:
        """A cycle that turns coordinates stands alone."""
        if under := self.other or cycle or ("R" + self.side if self.side != "0" else ""):
            raise MacroFault("gcode.mode", f"{row} under {under} is not executed",
                             "state it before any plane, under R0, without tool centre point control and any other cycle "
                             "that turns coordinates")

    def _take(self, body: str, row: str) -> None:
        if self.mirrored or self.angle:
            cycle = "cycle 8" if self.mirrored else "cycle 10"
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
        if _ABOUT.match(row) and (now, self.angle) != self.pole:
            raise MacroFault("gcode.mode", "a pole that was stated under another datum shift or rotation",
                             "state CC behind the shift")
        self.surface = now if row.startswith("CYCL DEF") else self.surface
        self.pole = (now, self.angle) if _POLE.match(row) else self.pole
        if _ENDED.search(row):
            self.other = ""
        elif _BEGUN.search(row):
            self.other = row[:40]
        self.side = found[-1] if (found := _SIDE.findall(row)) and not row.startswith("CYCL") else self.side
        if not now and not self.mirrored and not self.angle:
            return row
        if (self.mirrored or self.angle) and _UNMIRRORED.match(row):
            raise MacroFault("gcode.mode", f"{row[:40]} under {'cycle 8' if self.mirrored else 'cycle 10'} is not executed",
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
        row = _ALONG.sub(lambda m: f"I{m[1]}{m[2]}{self._signed(m[3], -1.0 if m[1] in self.mirrored else 1.0)}", row)
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
        return self._signed(value, -1.0 if axis in self.mirrored else 1.0, self.by.get(axis, 0.0))

    @staticmethod
    def _signed(value: str, factor: float, shift: float = 0.0) -> str:
        text = written(factor * float(value) + shift, True)
        return text if text.startswith("-") else f"+{text}"
