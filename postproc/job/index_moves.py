"""Linking moves that turn rotary axes between two cuts, and those of them from or to a tilted plane."""

from __future__ import annotations

import numpy as np

from postproc.control.modes import OutputModes
from postproc.reference.moves import Moves
from toolpaths.arrays import Ints, distinct
from toolpaths.rotations import angle_between

TURNS = 0.1
"""of the axis tolerance: moves that turn the tool by more are of no plane"""


def indexed(moves: Moves, axis_tolerance: float) -> list[int]:
    """The linked moves that begin with another tool axis, by more than `axis_tolerance` rad, than the move before has ended
    with."""
    rows = np.flatnonzero(moves.link)
    rows = rows[rows > 0]
    turned = angle_between(moves.axis[rows - 1], moves.axis[rows]) > axis_tolerance
    return [int(k) for k in rows[turned]]


def plane_changes(moves: Moves, operation: Ints, modes: OutputModes, axis_tolerance: float) -> list[int]:
    """Those of them whose run, or the run before, is written in a tilted plane; `operation` (M,) of each move."""
    run = np.cumsum(moves.link)
    turns = np.append(False, angle_between(moves.axis[:-1], moves.axis[1:]) > TURNS * axis_tolerance) & ~moves.link
    constant = np.bincount(run, turns, minlength=int(run[-1]) + 1)[run] == 0.0
    laws = {(int(k), c): modes.law(int(k), c) for k in distinct(operation) for c in (True, False)}
    plane = np.array([laws[int(k), bool(c)] == "tilted" for k, c in zip(operation, constant, strict=True)])
    return [k for k in indexed(moves, axis_tolerance) if plane[k - 1] or plane[k]]
