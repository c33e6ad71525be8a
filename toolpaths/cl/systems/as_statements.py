"""What a file of another form says, collected as statements of a CL file and the points between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpaths.cl.text.scan import Points
from toolpaths.cl.text.statements import Statement, StatementList, statement_of

UP = (0.0, 0.0, 1.0)
EXPORTED = "(Exported by FreeCAD)"
"""header of the files that FreeCAD writes"""


class AsStatements:
    """Statements and points in the order of the file; `line` is 1-based, of that file."""

    def __init__(self) -> None:
        self.program = StatementList()
        self._known: dict[str, Statement] = {}
        self._xyz: list[Sequence[float]] = []
        self._axis: list[Sequence[float]] = []
        self._line: list[int] = []

    def add(self, line: int, text: str) -> None:
        """A record as APT text, without comments and continuation."""
        if text not in self._known:
            self._known[text] = statement_of(text)
        self._keep(line, self._known[text])

    def say(self, line: int, word: str, body: str) -> None:
        """A record whose text is taken as it stands (PPRINT, REMARK, TPRINT, OPNAME)."""
        self._keep(line, Statement(word, body.strip()))

    def _keep(self, line: int, statement: Statement) -> None:
        self.program.statements.append(statement)
        self.program.lines.append(line)
        self.program.before.append(len(self._xyz))
        self.program.first.setdefault(statement, line)

    def point(self, line: int, xyz: Sequence[float], axis: Sequence[float] = UP) -> None:
        """A position of three numbers and its tool axis, as a GOTO of six."""
        self._xyz.append(tuple(xyz))
        self._axis.append(tuple(axis))
        self._line.append(line)

    def arc(self, line: int, centre: Sequence[float], normal: Sequence[float], end: Sequence[float],
            axis: Sequence[float] = UP) -> None:
        """An arc, right-hand about `normal`, that ends in `end`; the same end as its start is a whole turn."""
        self.add(line, f"CIRCLE/{numbers(centre)},{numbers(normal)}")
        self.point(line, end, axis)

    def points(self) -> Points:
        """All positions."""
        n = len(self._line)
        return Points(np.array(self._xyz, np.float64).reshape(n, 3), np.array(self._axis, np.float64).reshape(n, 3), None,
                      np.array(self._line, np.int64))


def numbers(values: Sequence[float]) -> str:
    """Numbers as a record has them, every digit kept."""
    return ",".join(signed(v) for v in values)


def signed(value: float) -> str:
    """A number whose exponent has its sign."""
    text = repr(float(value))
    mantissa, e, power = text.partition("e")
    return f"{mantissa}e+{power}" if e and power[0].isdigit() else text
