"""FN 18: system data of a TNC that follow from the program and the set-up; the others are refused.

HEIDENHAIN TNC7 and TNC 640, list of FN 18 functions; lengths are in mm whatever the program's units are.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from postproc.readback.macros.expressions import Cursor, MacroFault
from postproc.readback.macros.held import Held

_DATA = re.compile(r"SYSREAD[ \t]+(Q[LR]?\d+)[ \t]*=[ \t]*ID[ \t]*(\d+)"
                   r"(?:[ \t]*N[RO]\.?[ \t]*(\d+))?(?:[ \t]*IDX[ \t]*(.+))?")
_TOOL = re.compile(r"TOOL CALL[ \t]+(\d+)(?![\d.])")
_SPEED = re.compile(r"[ \t]S[ \t]*(\d+\.?\d*)")
_TOOL_AXIS = re.compile(r"TOOL CALL[ \t]+\S+[ \t]+([XYZ])\b")


class SystemData:
    """What the program has stated: tool, tool axis, speed; `units`: MM or INCH."""

    def __init__(self, held: Held) -> None:
        self.held = held
        self.units = ""
        self.tool: int | None = None
        self.axis = ""
        self.speed: float | None = None

    def called(self, row: str) -> None:
        """A TOOL CALL, with figures in the place of parameters."""
        if m := _TOOL.match(row):
            self.tool, self.axis = int(m[1]), (a[1] if (a := _TOOL_AXIS.match(row)) else self.axis)
        if m := _SPEED.search(row):
            self.speed = float(m[1])

    def read(self, text: str, value: Callable[[str], float]) -> tuple[str, float]:
        """(parameter, its value) of SYSREAD Q1 = ID50 NR1 IDX5."""
        m = _DATA.fullmatch(text.strip())
        if m is None:
            raise Cursor(text).fault("FN 18 that is not read")
        group, number = int(m[2]), int(m[3] or 0)
        index = value(m[4]) if m[4] else None
        made = self._value(group, number, index)
        if made is None:
            raise MacroFault("gcode.variable", f"FN 18 with ID{group} NR{number} is not read: what it holds is not in the "
                             "program, nor in the set-up", "put the figure that the control would find there in its place, "
                             "in a copy of the program")
        return m[1], made

    def _value(self, group: int, number: int, index: float | None) -> float | None:
        if (group, number, index) == (10, 8, 1.0) and self.units:
            return float(self.units == "INCH")
        if group == 50 and number == 1:
            tool = self.tool if index is None else round(index)
            return self.held.lengths.get(tool) if tool is not None else None
        if index is not None:
            return None
        if (group, number) in ((20, 1), (60, 1)):
            return None if self.tool is None else float(self.tool)
        if (group, number) in ((20, 3), (60, 2)):
            return float("XYZ".index(self.axis)) if self.axis else None
        return self.speed if (group, number) in ((20, 4), (60, 3)) else None
