"""Datum shifts and mirror images of Klartext: cycle 7 and TRANS DATUM, added to absolute coordinates of the blocks behind
them; cycle 8.

HEIDENHAIN TNC 640, Cycle Programming (datum shift, cycle 7): 7.1 on state an axis each, absolute from the preset, or with I
from the shift in force; the axes that are not stated keep theirs; zeros cancel. Klartext Programming: TRANS DATUM AXIS
states them in one row, TRANS DATUM RESET cancels all. Datum tables are files of the control.

Cycle 8 (same manual, mirroring): 8.1 states the axes that are mirrored about the datum in force, without any it ends;
where one axis of the plane is mirrored circles and the side of the tool turn round. Here X and Y, in blocks of X, Y and Z.
"""

from __future__ import annotations

import re

from postproc.readback.macros.expressions import MacroFault, written

_CYCLE = re.compile(r"CYCL DEF 7\.(\d)[ \t]*(.*)")
_MIRROR = re.compile(r"CYCL DEF 8\.(\d)[ \t]*(.*)")
_ALONG = re.compile(r"(?<![A-Z0-9])I([XY])([ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_TURNED = re.compile(r"DR([-+])|(?<![A-Z0-9])R([LR])(?![A-Z0-9])")
_SIDE = re.compile(r"(?<![A-Z0-9])R([LR0])(?![A-Z0-9])")
_UNMIRRORED = re.compile(r"^/?[ \t]*(?:LP|CP|CTP|CYCL CALL (?:POS|PAT)"
                         r"|CYCL DEF (?!20[0135679]\b|240\b|32\b|32\.|7\.|8\.)\d)")
_TRANS = re.compile(r"TRANS DATUM[ \t]+(AXIS|RESET|TABLE)\b[ \t]*(.*)")
_STATED = re.compile(r"(I?)([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_MOVES = re.compile(r"/?[ \t]*(?:L|C|CC|CR|CT|CP|LP|CYCL CALL POS)\b(?!YCL DEF)")
_ABSOLUTE = re.compile(r"(?<![A-Z0-9])([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_SURFACE = re.compile(r"(Q203[ \t]*=[ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_MACHINE = re.compile(r"(?<![A-Z0-9])M9[12](?!\d)")
_OTHER = re.compile(r"^(?:PLANE\b|FUNCTION TCPM|CYCL DEF (?:247|19)\b|CYCL DEF (?:10|11|26)\.|PATTERN DEF"
                    r"|CYCL DEF 22[01]\b)|(?<![A-Z0-9])M12[89](?!\d)")
_BEGUN = re.compile(r"^(?:PLANE (?!RESET)|FUNCTION TCPM)|(?<![A-Z0-9])M128(?!\d)")
_ENDED = re.compile(r"^(?:PLANE RESET|FUNCTION RESET TCPM)|(?<![A-Z0-9])M129(?!\d)")
_CALLS = re.compile(r"^CYCL CALL|(?<![A-Z0-9])M(?:99|89)(?!\d)")
_POLE = re.compile(r"/?[ \t]*CC\b")
_ABOUT = re.compile(r"/?[ \t]*(?:C|CP|LP)\b")


class DatumShift:
    """Shifts in force, by axis, in units of the program.

    Attributes:
        mirrored: axes of cycle 8; side: L, R or 0, as the program states it
        other: row that has put a plane or the tip in force, "" for none; surface, pole: shifts under which a cycle and a
            pole were stated, which count from where the datum is when they are used
    """

    def __init__(self) -> None:
        self.by: dict[str, float] = {}
        self.mirrored, self.side = "", "0"
        self.other = ""
        self.surface, self.pole = dict[str, float](), dict[str, float]()

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
        if (m := _TRANS.fullmatch(row)) is None:
            return False
        if m[1] == "TABLE":
            raise MacroFault("gcode.data_setting", f"{row}: a datum table is a file of the control",
                             "state the shift by its axes: TRANS DATUM AXIS X+0 Y+0 Z+0")
        if m[1] == "RESET":
            self.by.clear()
        else:
            self._take(m[2], row)
        return True

    def _mirror(self, body: str, row: str) -> None:
        axes = body.split()
        if set(axes) - {"X", "Y"}:
            raise MacroFault("gcode.mode", f"{row} is not executed", "mirror X, Y or both")
        if self.other or self.side != "0":
            raise MacroFault("gcode.mode", f"{row} under {self.other or 'R' + self.side} is not executed",
                             "state it before any plane, under R0 and without tool centre point control")
        self.mirrored = "".join(sorted(set(axes)))

    def _take(self, body: str, row: str) -> None:
        if self.mirrored:
            raise MacroFault("gcode.mode", f"{row} under cycle 8 is not executed", "state the shift before cycle 8")
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
        if _ABOUT.match(row) and now != self.pole:
            raise MacroFault("gcode.mode", "a pole that was stated under another datum shift", "state CC behind the shift")
        self.surface = now if row.startswith("CYCL DEF") else self.surface
        self.pole = now if _POLE.match(row) else self.pole
        if _ENDED.search(row):
            self.other = ""
        elif _BEGUN.search(row):
            self.other = row[:40]
        self.side = found[-1] if (found := _SIDE.findall(row)) and not row.startswith("CYCL") else self.side
        if not now and not self.mirrored:
            return row
        if self.mirrored and _UNMIRRORED.match(row):
            raise MacroFault("gcode.mode", f"{row[:40]} under cycle 8 is not executed", "write it by X and Y, or end it")
        if _OTHER.search(row):
            raise MacroFault("gcode.mode", f"{row[:40]} in coordinates that a datum shift has moved is not executed",
                             "cancel the shift before it (TRANS DATUM RESET), and state it again in the plane")
        if row.startswith("CYCL DEF"):
            return _SURFACE.sub(lambda m: m[1] + self._sum("Z", m[2]), row)
        if not _MOVES.match(row) or _MACHINE.search(row):
            return row
        if len(self.mirrored) == 1:
            row = _TURNED.sub(lambda m: "DR" + "-+"[m[1] == "-"] if m[1] else "R" + "LR"[m[2] == "L"], row)
        row = _ALONG.sub(lambda m: f"I{m[1]}{m[2]}{self._signed(m[3], -1.0 if m[1] in self.mirrored else 1.0)}", row)
        return _ABSOLUTE.sub(lambda m: m[1] + self._sum(m[1], m[2]), row)

    def _sum(self, axis: str, value: str) -> str:
        return self._signed(value, -1.0 if axis in self.mirrored else 1.0, self.by.get(axis, 0.0))

    @staticmethod
    def _signed(value: str, factor: float, shift: float = 0.0) -> str:
        text = written(factor * float(value) + shift, True)
        return text if text.startswith("-") else f"+{text}"
