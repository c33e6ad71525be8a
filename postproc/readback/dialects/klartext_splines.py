"""SPL blocks of TNC controls: cubics of a parameter t from 1 to 0 (iTNC 530, 60642x, 12.7).

X(t) = K3X t3 + K2X t2 + K1X t + X, so that a block begins at the sum of all four and ends at X.
"""

from __future__ import annotations

import re

import numpy as np

from postproc.readback.text.canonical import DialectStatement
from toolpaths.arrays import Floats

APART = 0.001
"""mm that the begin of a spline may be from where the block before has ended: beyond it the control stops"""
ROUNDING = 1e-9
_WORD = re.compile(r"\s*(K[321][A-Z]|[XYZABCUVWFM])\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:\s?E[-+]?\d+)?)\s*")


def spline_statement(body: str) -> DialectStatement | None:
    """The words of an SPL block; None where it holds anything else."""
    at, keys, last = len("SPL"), dict[str, float](), ""
    order = {"3": "", "2": "3", "1": "2"}
    while at < len(body):
        match = _WORD.match(body, at)
        if match is None or match[1] in keys:
            return None
        word = match[1]
        if len(word) == 3 and order[word[1]] and last != f"K{order[word[1]]}{word[2]}":
            return None  # K3, K2, K1 of an axis stand in this order
        keys[word], last, at = float(match[2].replace(" ", "")), word, match.end()
    return DialectStatement("SPL", (), keys)


def cubic_of(keys: dict[str, float], begin: dict[str, float | None]) -> tuple[Floats, str]:
    """((3, 4) coefficients of a parameter from 0 to 1 in the program's units, what is wrong, "" for nothing)."""
    curve, ends = np.zeros((3, 4)), [key for key in keys if len(key) == 1 and key not in "FM"]
    if not ends or not set(ends) <= set("XYZ") or len(keys) - len(set(keys) & set("FM")) != 4 * len(ends):
        return curve, "with another axis than X, Y, Z, or without K3, K2, K1 of each"
    for axis in ends:
        if any(f"K{n}{axis}" not in keys for n in (3, 2, 1)):
            return curve, f"without K3, K2, K1 of {axis}"
        cubic, square, linear = (keys[f"K{n}{axis}"] for n in (3, 2, 1))
        here = begin[axis]
        if here is None:
            return curve, f"before {axis} was stated in this mode"
        starts = cubic + square + linear + keys[axis]
        if abs(starts - here) > APART + ROUNDING:
            return curve, (f"that begins at {axis}{starts:.4f}, more than 0.001 mm from where the block before has ended, "
                           f"{axis}{here:.4f},")
        curve["XYZ".index(axis), :2] = 3.0 * cubic + square, -cubic
    return curve, ""
