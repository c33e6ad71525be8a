"""Clamps of rotary axes by the text of the program alone, against what the executed blocks turn and cut."""

from __future__ import annotations

import re

import numpy as np

from postproc.witness.evidence import Case, ExecutedBlocks, Finding
from postproc.witness.text import Array

_REMARK = re.compile(rb"\([^()\n]*\)|;[^\n]*|\"[^\"\n]*\"")
_STILL = 1e-8
"""rad"""


def check_clamps(case: Case, executed: ExecutedBlocks, cut: Array) -> tuple[list[Finding], int]:
    """Axes that turn while their clamp is closed, or cut unclamped though they stand; how many blocks were compared.

    `cut` (E,): blocks of cuts. A block is held against the last code in the lines before its own.
    """
    last = int(executed.line.max(initial=0))
    if not case.clamps or (np.diff(executed.line) < 0).any() or case.program.count(b"\n") < last:
        return [], 0
    lines = _REMARK.sub(b"", case.program.upper()).split(b"\n")
    found, count = list[Finding](), 0
    for letter, pair in case.clamps.items():
        closed, free = (re.compile(rb"(?<![A-Z])M0*" + code[1:].encode() + rb"(?![\d.])") for code in pair)
        held, last = np.full(len(lines) + 1, -1), -1
        for number, text in enumerate(lines, 1):
            held[number] = last
            last = 1 if closed.search(text) else 0 if free.search(text) else last
        j = executed.letters.index(letter)
        turned = np.abs(np.diff(np.append(executed.start[j], executed.joints[:, j]))) > _STILL
        state = held[executed.line]
        bad = np.flatnonzero(turned & (state != 0))
        if len(bad):
            found.append(Finding("clamp", f"{letter} turns before its clamp is released", 0, int(executed.line[bad[0]]),
                                 len(bad)))
        stretch = np.cumsum(np.append(True, cut[1:] != cut[:-1])[:len(cut)])
        turning = np.isin(stretch, stretch[turned & cut])
        ends = np.append(stretch[1:] != stretch[:-1], True)[:len(cut)]
        loose = np.flatnonzero(cut & ~turning & ends & (state != 1))
        if len(loose):
            found.append(Finding("clamp", f"{letter} stands in a cut and is not clamped", 0, int(executed.line[loose[0]]),
                                 len(loose)))
        count += int((turned | cut).sum())
    return found, count
