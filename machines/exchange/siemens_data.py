"""Siemens machine data as text: `N36110 $MA_POS_LIMIT_PLUS[AX1]=400`, one assignment in a line.

Source: SINUMERIK 840D sl, Detailed Machine Data Description (parameter manual): numbers, identifiers, units.
"""

from __future__ import annotations

import re
from dataclasses import field

from machines.exchange.draft import Draft
from toolpaths.dataclass import dataclass

_ASSIGNMENT = re.compile(r"(?:N\d+\s+)?\$(?P<name>(?:M[ANC]|TC|S[CNA]|N[KT])_\w+)\s*(?:\[(?P<index>[^\]]*)\])?\s*"
                         r"=\s*(?P<value>[^;]*)", re.IGNORECASE)
_CHANNEL = re.compile(r"CHANDATA\s*\(\s*(\d+)\s*\)", re.IGNORECASE)
_NEXT = re.compile(r"(=[^;$]*?)\s+(?=\$)")
"""the end of one assignment before another in its line"""
_NUMBERS = re.compile(r"MC_TRAFO_TYPE_\d+|MC_TRAFO_AXES_IN_\d+|MC_TRAFO5_\w+|MC_AXCONF_MACHAX_USED|"
                      r"MN_SCALING_SYSTEM_IS_METRIC|MA_(?:POS_LIMIT|MAX_AX|ROT_IS_MODULO|IS_ROT_AX)\w*|"
                      r"TC_CARR(?!23$|3[456]$)\d+")
"""names that are read as numbers"""
_LOGICAL = {"TRUE": 1.0, "FALSE": 0.0}


@dataclass(frozen=True)
class MachineDatum:
    """One assignment; `index` as it is written, blanks left out."""

    name: str
    index: str
    value: str
    line: int

    @property
    def said(self) -> str:
        """As it stands there."""
        return f"${self.name}{f'[{self.index}]' if self.index else ''} = {self.value}"

    @property
    def number(self) -> float | None:
        """The value, None where it is no number; TRUE is 1, FALSE 0."""
        if self.value.upper() in _LOGICAL:
            return _LOGICAL[self.value.upper()]
        try:
            return float(self.value.strip("'\"").upper().replace("EX", "E"))
        except ValueError:
            return None

    @property
    def text(self) -> str:
        """The value without quotes."""
        return self.value.strip('"').strip()


@dataclass
class SiemensData:
    """The assignments of the first channel; of those that are made twice the last counts, as the control reads the file."""

    data: dict[tuple[str, str], MachineDatum] = field(default_factory=dict)

    def get(self, name: str, index: str = "") -> MachineDatum | None:
        """An assignment, None where there is none."""
        return self.data.get((name, index))

    def number(self, name: str, index: str, default: float) -> float:
        """Its number, or the default where it is not made."""
        found = self.get(name, index)
        return default if found is None or found.number is None else found.number

    def vector(self, name: str) -> tuple[list[float], MachineDatum | None]:
        """Elements 0 to 2, those left out 0; the first of them that is there."""
        found = [self.get(name, str(k)) for k in range(3)]
        return ([0.0 if one is None or one.number is None else one.number for one in found],
                next((one for one in found if one is not None), None))

    def of(self, name: str) -> list[MachineDatum]:
        """All elements of a name."""
        return [one for (other, _), one in self.data.items() if other == name]


def read_data(draft: Draft, text: str) -> SiemensData:
    """The assignments; what begins like one and is none, what is assigned twice, and what is no number, is said."""
    result, channel = SiemensData(), 1
    for line, raw in enumerate(text.splitlines(), 1):
        statement = raw.strip()
        if named := _CHANNEL.search(statement):
            channel = int(named[1])
        for part in _NEXT.sub("\\1\n", statement).split("\n"):
            if found := _ASSIGNMENT.match(part):
                _add(draft, result, MachineDatum(found["name"].upper(), "".join((found["index"] or "").split()).upper(),
                                                 found["value"].strip(), line), channel)
            elif part.startswith("$") or "$M" in part.split(";")[0]:
                draft.warning("import.line", f"not understood: {part[:60]}", line, "write $NAME[index] = value on one line")
    return result


def _add(draft: Draft, result: SiemensData, datum: MachineDatum, channel: int) -> None:
    """One assignment more, where it is of the first channel."""
    if channel != 1 and datum.name.startswith(("MC_", "SC_", "TC_")):
        return
    before = result.get(datum.name, datum.index)
    if before is not None and before.value != datum.value:
        draft.warning("import.contradiction", f"{before.said} in line {before.line} and {datum.value}: the last one "
                      "counts", datum.line, "take out the line that is not meant")
    if datum.number is None and _NUMBERS.fullmatch(datum.name):
        draft.error("import.number", f"{datum.said} is not a number", datum.line, "write a number")
    result.data[datum.name, datum.index] = datum
