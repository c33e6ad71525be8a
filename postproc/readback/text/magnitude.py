"""Numbers that no control takes: refused where a program is read, before anything is computed with them."""

from __future__ import annotations

import numpy as np

from postproc.readback.text.canonical import SMOOTH, STATEMENT, Canonical, ProgramText
from toolpaths.arrays import distinct
from toolpaths.diagnostics import Diagnostic, error

LARGEST = 1e10
"""controls hold eight or nine digits"""


def too_large(text: ProgramText, file: str) -> list[Diagnostic]:
    """An error where a number of a word or statement has more than ten digits before its point."""
    words = text.words
    wrong = ~(np.abs(words.value) <= LARGEST)
    strange = [k for k, s in enumerate(text.statements)
               if any(isinstance(v, float) and abs(v) > LARGEST for v in (*s.args, *s.keys.values()))]
    if strange:
        wrong |= (words.letter == ord(STATEMENT)) & np.isin(words.value, strange)
    rows = np.flatnonzero(wrong)
    if not len(rows):
        return []
    lines = np.unique(words.line[rows])
    return [error("gcode.number", f"a number of more than {LARGEST:g}", file=file, lines=lines[:6].tolist(),
                  count=len(lines), hint="controls hold eight or nine digits: correct the number")]


def negative_smoothing(code: Canonical, file: str) -> list[Diagnostic]:
    """An error where a program asks for corners rounded by less than nothing."""
    blocks, value = code.words.pick(SMOOTH)
    lines = distinct(code.line[blocks[value < 0.0]])
    if not len(lines):
        return []
    return [error("gcode.smoothing", "a negative tolerance of the control's smoothing", file=file, lines=lines[:6].tolist(),
                  count=len(lines), hint="state 0 or more")]
