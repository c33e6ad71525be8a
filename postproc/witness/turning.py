"""Modulo axes by the words of the program alone: which path each turns them, and how far, against the executed blocks."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np

from postproc.witness.evidence import Case, ExecutedBlocks, Finding
from postproc.witness.text import Array

_REMARK = re.compile(rb"(?<!DC)(?<!AC[PN])\([^()\n]*\)|;[^\n]*|\"[^\"\n]*\"")
_FULL, _NEAR = 360.0, 1e-4
"""degrees"""


def check_turning(case: Case, executed: ExecutedBlocks) -> tuple[list[Finding], int]:
    """Words that turn an axis otherwise than the executed blocks do; how many were compared."""
    text = _REMARK.sub(b"", case.program.upper())
    if not case.modulo or b"M127" in text or (np.diff(executed.line) < 0).any():
        return [], 0
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == 10)
    found, count = list[Finding](), 0
    for letter, rule in case.modulo.items():
        word = re.compile(rb"(?<![A-Z])" + letter.encode() + rb"(?:=(DC|ACP|ACN)\()?\s*([-+]?\d*\.?\d+)")
        words = [(m.start(), m[1], m[2]) for m in word.finditer(text)]
        if len(words) < 2:
            continue
        line = np.searchsorted(ends, [at for at, _, _ in words]) + 1
        value = np.array([number for _, _, number in words], dtype=np.float64)
        row = np.searchsorted(executed.line, line, side="right") - 1
        moved = np.degrees(np.diff(executed.joints(row)[:, executed.letters.index(letter)]))
        wanted = _steps(value, np.array([how or b"" for _, how, _ in words]), rule)
        known = (executed.line[row[1:]] == line[1:]) & (executed.line[row[:-1]] == line[:-1])
        bad = np.flatnonzero(known & (np.abs(moved - wanted) > _NEAR))
        count += int(known.sum())
        if len(bad):
            k = int(bad[0])
            found.append(Finding("turning", f"{letter} turns by {moved[k]:.4f} degrees as it is read back, by its word it "
                                 f"turns by {wanted[k]:.4f}", 0, int(line[k + 1]), len(bad)))
    return found, count


def _steps(value: Array, how: Array, rule: Literal["shortest", "sign"]) -> Array:
    """Degrees from word to word: the shorter path, or that of the sign, or the one that the word names."""
    place = np.abs(value) if rule == "sign" else value
    onward = np.round(np.mod(np.diff(place), _FULL), 7) % _FULL
    back = np.where(onward > 0.0, onward - _FULL, 0.0)
    nearer = np.where(onward < _FULL / 2.0, onward, back)
    if rule == "sign":
        return np.where(np.signbit(value[1:]), back, onward)
    return np.where(how[1:] == b"ACP", onward, np.where(how[1:] == b"ACN", back, nearer))
