"""Datum shifts of Klartext: cycle 7 and TRANS DATUM, added to absolute coordinates of the blocks behind them.

HEIDENHAIN TNC 640, Cycle Programming (datum shift, cycle 7): 7.1 on state an axis each, absolute from the preset, or with I
from the shift in force; the axes that are not stated keep theirs; zeros cancel. Klartext Programming: TRANS DATUM AXIS
states them in one row, TRANS DATUM RESET cancels all. Datum tables are files of the control.
"""

from __future__ import annotations

import re

from postproc.readback.macros.expressions import MacroFault, written

_CYCLE = re.compile(r"CYCL DEF 7\.(\d)[ \t]*(.*)")
_TRANS = re.compile(r"TRANS DATUM[ \t]+(AXIS|RESET|TABLE)\b[ \t]*(.*)")
_STATED = re.compile(r"(I?)([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_MOVES = re.compile(r"/?[ \t]*(?:L|C|CC|CR|CT|CP|LP|CYCL CALL POS)\b(?!YCL DEF)")
_ABSOLUTE = re.compile(r"(?<![A-Z0-9])([XYZABCUVW])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))")
_SURFACE = re.compile(r"(Q203[ \t]*=[ \t]*)([-+]?(?:\d+\.?\d*|\.\d+))")
_MACHINE = re.compile(r"(?<![A-Z0-9])M9[12](?!\d)")
_OTHER = re.compile(r"^(?:PLANE\b|FUNCTION TCPM|CYCL DEF (?:247|19)\b|CYCL DEF (?:10|8|11|26)\.|PATTERN DEF"
                    r"|CYCL DEF 22[01]\b)|(?<![A-Z0-9])M12[89](?!\d)")
_BEGUN = re.compile(r"^(?:PLANE (?!RESET)|FUNCTION TCPM)|(?<![A-Z0-9])M128(?!\d)")
_ENDED = re.compile(r"^(?:PLANE RESET|FUNCTION RESET TCPM)|(?<![A-Z0-9])M129(?!\d)")
_CALLS = re.compile(r"^CYCL CALL|(?<![A-Z0-9])M(?:99|89)(?!\d)")
_POLE = re.compile(r"/?[ \t]*CC\b")
_ABOUT = re.compile(r"/?[ \t]*(?:C|CP|LP)\b")


class DatumShift:
    """Shifts in force, by axis, in units of the program.

    Attributes:
        other: row that has put a plane or the tip in force, "" for none; surface, pole: shifts under which a cycle and a
            pole were stated, which count from where the datum is when they are used
    """

    def __init__(self) -> None:
        self.by: dict[str, float] = {}
        self.other = ""
        self.surface, self.pole = dict[str, float](), dict[str, float]()

    def stated(self, row: str) -> bool:
        """True of a row that states a shift, which is taken."""
        if m := _CYCLE.fullmatch(row):
            if m[1] != "0":
                self._take(m[2], row)
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

    def _take(self, body: str, row: str) -> None:
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
        if not now:
            return row
        if _OTHER.search(row):
            raise MacroFault("gcode.mode", f"{row[:40]} in coordinates that a datum shift has moved is not executed",
                             "cancel the shift before it (TRANS DATUM RESET), and state it again in the plane")
        if row.startswith("CYCL DEF"):
            return _SURFACE.sub(lambda m: m[1] + self._sum("Z", m[2]), row)
        if not _MOVES.match(row) or _MACHINE.search(row):
            return row
        return _ABSOLUTE.sub(lambda m: m[1] + self._sum(m[1], m[2]), row)

    def _sum(self, axis: str, value: str) -> str:
        text = written(float(value) + self.by.get(axis, 0.0), True)
        return text if text.startswith("-") else f"+{text}"
