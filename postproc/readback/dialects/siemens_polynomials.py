"""Polynomial interpolation of SINUMERIK: POLY, PO[X]=(end, a2, a3), X=PO(end, a2 ... a5), PL= (Job Planning, POLY), and
BSPLINE.

f(p) = a0 + a1 p + a2 p2 + ... for p from 0 to PL, 1 where a block does not state it; a0 is where the block before has ended,
a1 what leads to the end. Axes without coefficients go straight. G0 to G3 end it.

BSPLINE: blocks state control points of a cubic, which begins where the block before has ended and is tangential to the
control polygon at both ends (Programming Guide Advanced 04.00, p. 153; Job Planning 02/2011, p. 248): its end
knots are fourfold. Which step between nodes the PL of a block is of, no page says; where all are equal it is the same curve.
"""

from __future__ import annotations

import re

import numpy as np

from postproc.readback.dialects.iso import New
from postproc.readback.text.canonical import CURVE, STATEMENT, DialectStatement
from postproc.readback.text.modal import codes
from postproc.readback.text.words import Words
from toolpaths.arrays import Floats, Ints
from toolpaths.cl.spline_chords import DEGREE

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?"
_TERMS = re.compile(rf"(?<![A-Z0-9_$])(?:PO\s*\[\s*(?P<of>[A-Z]?)\s*\]\s*=\s*\((?P<terms>[^()]*)\)"
                    rf"|(?P<axis>[A-Z])\s*=\s*PO\s*\((?P<more>[^()]*)\)|(?P<word>PL|PW|SD)\s*=\s*(?P<range>{_NUMBER}))")
_MOTION = (0, 1, 2, 3)
NAMES = ("POLY", "PO", "PL", "BSPLINE", "PW", "SD")
_AMID = {"PL", "PW", "SD", "BSPLINE"}
"""functions that may stand with the points of a BSPLINE: others change what they mean, or part them"""
_STATED = {"PW": 1.0, "SD": 3.0}
"""weights and degree of a BSPLINE as they are where no block states them"""
MOST = 5
"""degree"""


def terms_apart(row: str, line: int, new: New, statements: list[DialectStatement]) -> str:
    """The block without its polynomials, which become statements, and words of their ends."""
    def cut(match: re.Match[str]) -> str:
        axis, text = match["of"] or match["axis"] or "", match["terms"] if match["terms"] is not None else match["more"]
        if match["range"] is not None:
            made = DialectStatement(match["word"], (_value(match["range"]),))
        else:
            made = DialectStatement("PO", (axis, *(_value(part.strip()) for part in text.split(","))))
            if axis and made.number(1) == made.number(1):
                new.append((line, axis, made.number(1)))
        new.append((line, STATEMENT, float(len(statements))))
        statements.append(made)
        return " "
    return _TERMS.sub(cut, row) if any(word in row for word in ("PO", "PL", "PW", "SD")) else row


def _value(text: str) -> float:
    """A number with or without EX; NaN for what is none."""
    return float(text.replace("EX", "e")) if re.fullmatch(_NUMBER, text) else float("nan")


class Polynomials:
    """The polynomials of a program in running order: where POLY is in force, and the coefficients of each block."""

    def __init__(self, words: Words) -> None:
        self.ended = codes(words, "G", _MOTION)[0]
        self.parting = _parting(words)
        self.begun = -1
        self.curves: list[Floats] = []
        self.splines: list[int] = []
        self.polygons: list[int] = []
        """blocks in which BSPLINE stands"""

    def stacked(self) -> Floats:
        """(C, 3, 4) coefficients."""
        return np.array(self.curves).reshape(-1, 3, MOST - 1)

    def block(self, b: int, here: list[DialectStatement], unit: float, new: New) -> str:
        """Words of block b, `unit` mm in a unit of length; what is wrong with it, "" for nothing."""
        for name in {s.name for s in here} & {"POLY", "BSPLINE"}:
            if b in self.ended:
                return f"{name} next to another code of motion"
            self.begun = b if name == "POLY" else -1
            self.polygons += [b] if name == "BSPLINE" else []
            new.append((b, "G", 1.0))
        terms = [s for s in here if s.name == "PO"]
        if not terms:
            return ""
        if self.begun < 0 or np.searchsorted(self.ended, self.begun) < np.searchsorted(self.ended, b, side="right"):
            return "PO without POLY in force"
        lengths = [s.number(0) for s in here if s.name == "PL"]
        length = lengths[0] if lengths else 1.0
        axes = [str(s.args[0]) for s in terms]
        if "" in axes:
            return "a denominator polynomial, PO[]"
        if not set(axes) <= set("XYZ") or len(set(axes)) < len(axes):
            return "PO of another axis than X, Y, Z, or of one twice"
        if len(lengths) > 1:
            return "PL twice"
        curve = np.zeros((3, MOST - 1))
        for s in terms:
            values = [v for v in s.args[1:] if isinstance(v, float)]
            if len(values) > MOST or any(v != v for v in values) or not length > 0.0:
                return "PO with other values than its end and up to four coefficients, or PL that is not above 0"
            curve["XYZ".index(str(s.args[0])), :len(values) - 1] = values[1:]
        new.append((b, CURVE, float(len(self.curves))))
        self.curves.append(curve * length ** np.arange(2.0, MOST + 1.0) * unit)
        self.splines.append(-1)
        return ""

    def control_points(self, blocks: dict[int, list[DialectStatement]], words: Words, axes: tuple[str, ...],
                       new: New) -> list[tuple[int, str]]:
        """Words of the control points of each BSPLINE, of the statements of blocks by their number; what is wrong, with its
        block. It ends with the next code of motion; blocks without axes are none of its points."""
        moving = np.unique(words.line[np.isin(words.letter & 95, [ord(a) for a in axes])])
        others = [b for b, here in blocks.items() if any(s.name == "POLY" for s in here)]
        stops = np.sort([*self.ended, *self.polygons, *others, words.lines + 1])
        other = min((b for b, here in blocks.items() for s in here
                     if s.name in _STATED and s.number(0) != _STATED[s.name]), default=words.lines + 1)
        wrong = []
        for number, begin in enumerate(self.polygons):
            end = int(stops[np.searchsorted(stops, begin, side="right")])
            rows = moving[(moving >= begin) & (moving < end)].tolist()
            parted = rows and bool(((self.parting > rows[0]) & (self.parting <= rows[-1])).any())
            amid = [s for b in range(rows[0] + 1, rows[-1] + 1) for s in blocks.get(b, ())] if rows else []
            if why := _refused(other < end, [blocks.get(b, []) for b in rows], end in self.polygons) or (
                    "another function, G code, T, D or stop amid the points of BSPLINE"
                    if parted or any(s.name not in _AMID for s in amid) else ""):
                wrong.append((begin, why))
                continue
            new += [(b, CURVE, float(len(self.curves) + n)) for n, b in enumerate(rows)]
            self.curves += [np.zeros((3, MOST - 1))] * len(rows)
            self.splines += [number] * len(rows)
        return wrong


def _parting(words: Words) -> Ints:
    """Blocks with what may not stand amid points of a BSPLINE: other places, tools, units, waits or stops."""
    line, value = words.pick("G")
    return np.sort(np.concatenate([line[(value != 90) & (value != 91)], words.pick("T")[0], words.pick("D")[0],
                                   codes(words, "M", (0, 1))[0]]))


def _refused(other: bool, points: list[list[DialectStatement]], again: bool) -> str:
    """Why a BSPLINE is not executed, by `other` weights or degrees and the blocks of its points, "" for nothing."""
    if other:
        return "BSPLINE with PW other than 1, or SD other than 3"
    lengths = [[s.number(0) for s in here if s.name == "PL"] for here in points]
    if any(len(one) != 1 for one in lengths) or len({one[0] for one in lengths}) != 1 or not lengths[0][0] > 0.0:
        return "BSPLINE without the same PL in all its blocks: which step between nodes each is of no page says"
    if len(points) < DEGREE:
        return f"BSPLINE with {len(points)} control points behind the first"
    return "BSPLINE behind BSPLINE, which may go on or begin again," if again else ""
