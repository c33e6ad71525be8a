"""Limits of axes as the machine file has them; clamps of rotary axes by the text of the program alone, against what the
executed blocks turn and cut."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from postproc.witness.evidence import Case, ExecutedBlocks, Finding
from postproc.witness.machine import turning
from postproc.witness.text import Array

_REMARK = re.compile(rb"\([^()\n]*\)|;[^\n]*|\"[^\"\n]*\"")
_STILL = 1e-8
"""rad"""
LIMITS = ("least", "greatest", "velocity", "acceleration", "jerk", "home")


def check_clamps(case: Case, executed: ExecutedBlocks, cut: Array) -> tuple[list[Finding], int]:
    """Axes that turn while their clamp is closed, or cut unclamped though they stand; how many blocks were compared.

    An axis may be free in a cut where another turns that shares a code with it.
    `cut` (E,): blocks of cuts. A block is held against the last code in the lines before its own.
    """
    last = int(executed.line.max(initial=0))
    if not case.clamps or (np.diff(executed.line) < 0).any() or case.program.count(b"\n") < last:
        return [], 0
    stated, lines = _codes(case.program, {code for pair in case.clamps.values() for code in pair})
    turns = {letter: _turned(executed, executed.letters.index(letter)) for letter in case.clamps}
    stretch = np.cumsum(np.append(True, cut[1:] != cut[:-1])[:len(cut)])
    found, count = list[Finding](), 0
    for letter, pair in case.clamps.items():
        own = np.isin(stated, [int(code[1:]) for code in pair])
        latest = np.searchsorted(lines[own], executed.line) - 1
        closed = np.append(stated[own] == int(pair[0][1:]), False)
        state = np.where(latest < 0, -1, closed[latest])
        turned, any_turned = turns[letter], np.any([turns[other] for other in _sharing(letter, case.clamps)], axis=0)
        bad = np.flatnonzero(turned & (state != 0))
        if len(bad):
            found.append(Finding("clamp", f"{letter} turns before its clamp is released", 0, int(executed.line[bad[0]]),
                                 len(bad)))
        loose = np.flatnonzero(cut & ~np.isin(stretch, stretch[any_turned & cut]) & (state != 1))
        if len(loose):
            found.append(Finding("clamp", f"{letter} stands in a cut and is not clamped", 0, int(executed.line[loose[0]]),
                                 len(loose)))
        count += int((turned | cut).sum())
    return found, count


def _codes(program: bytes, codes: set[str]) -> tuple[Array, Array]:
    """(N,) numbers of those M codes as the program states them, (N,) their lines; remarks and names state none."""
    text = _REMARK.sub(b"", program.upper())
    words = [one for one in re.finditer(rb"M0*(" + b"|".join(code[1:].encode() for code in codes) + rb")(?![\d.])", text)
             if not text[max(one.start() - 1, 0):one.start()].isalpha()]
    ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
    starts = np.array([one.start() for one in words], dtype=np.int64)
    return np.array([int(one[1]) for one in words], dtype=np.int64), np.searchsorted(ends, starts) + 1


def _turned(executed: ExecutedBlocks, j: int) -> Array:
    """(E,) blocks that turn joint j."""
    every = np.arange(len(executed))
    return np.asarray(np.abs(executed.joints(every)[:, j] - executed.before(every)[:, j]) > _STILL)


def _sharing(letter: str, clamps: dict[str, tuple[str, str]]) -> set[str]:
    """An axis and those that share a code with it, or with one that does."""
    result, codes = {letter}, set(clamps[letter])
    while more := {other for other, pair in clamps.items() if other not in result and codes & set(pair)}:
        result |= more
        codes |= {code for other in more for code in clamps[other]}
    return result



def limits_of(table: dict[str, Any], letters: tuple[str, ...]) -> tuple[Array, Array]:
    """(travel (J, 2), velocity at feed (J,)) in mm, rad, s; infinite where unlimited."""
    unit_of = np.where(turning(table, letters), math.pi / 180.0, 1.0)
    travel, speed = [], []
    for name in letters:
        axis = table.get("axes", {}).get(name, {})
        found = axis.get("travel", "unlimited")
        travel.append((-math.inf, math.inf) if isinstance(found, str) else found)
        speed.append(min(axis.get("velocity", math.inf), axis.get("cutting_velocity", math.inf)))
    return np.array(travel, np.float64) * unit_of[:, None], np.array(speed, np.float64) * unit_of


def other_limits(table: dict[str, Any], letters: tuple[str, ...], given: Array) -> list[str]:
    """The limits (J, 6) that are not those of the machine file, in words."""
    found = []
    units = np.where(turning(table, letters), math.pi / 180.0, 1.0)
    for name, scale, values in zip(letters, units.tolist(), given.tolist(), strict=True):
        axis = table.get("axes", {}).get(name, {})
        travel = (-math.inf, math.inf) if axis.get("travel") == "unlimited" else axis.get("travel") or (None, None)
        stated = [*travel, *(axis.get(key) for key in LIMITS[2:])]
        found += [f"the {what} of {name} is {value / scale:g} here, {own:g} in the machine file"
                  for what, own, value in zip(LIMITS, stated, values, strict=True)
                  if own is not None and not math.isclose(own * scale, value, rel_tol=1e-9, abs_tol=1e-9)]
    return found
