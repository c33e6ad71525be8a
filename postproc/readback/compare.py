"""The motion of a program against the CL file: deviation of tip and axis, kind of motion, feed, tool, spindle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.links import SafeSpace
from postproc.moves import Moves
from postproc.readback.align import align, unreached
from postproc.readback.checks import check_kinds, check_links, check_speeds, check_states
from postproc.readback.execute import Motion
from postproc.readback.poses import SAMPLES, Executed, arc_sweeps
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

CHUNK = 50_000
"""blocks that are sampled at a time, so that memory does not grow with the samples"""


@dataclass(frozen=True)
class Comparison:
    """Worst deviations (mm, rad) with the CL line and program line of each, and the poses and matching they rest on."""

    worst_tip: float
    worst_axis: float
    worst_tip_line: tuple[int, int]
    worst_axis_line: tuple[int, int]
    tip: Floats
    axis: Floats
    match: Ints
    owner: Ints
    diagnostics: tuple[Diagnostic, ...]


def compare(motion: Motion, toolpath: Toolpath, moves: Moves, executed: Executed, space: SafeSpace, tolerance: float,
            axis_tolerance: float, file: str) -> Comparison:
    """Every block on its stretch of the reference, every move done, in order, with the right kind of motion."""
    moves = moves.without_pecks()
    curves = moves.curves()
    tip, axis = executed.poses(motion, np.arange(len(motion)), 1.0)
    match, owner = align(tip, axis, arc_sweeps(motion, executed.control), curves, moves.link, tolerance, axis_tolerance)
    lost = unreached(match)
    diagnostics: list[Diagnostic] = []
    if lost >= 0:
        diagnostics.append(error("verify.not_reached", "the program never comes to this point", file=file,
                                 lines=[int(moves.line[lost])], hint="the program is not made from this CL file with "
                                 "this machine, set-up and tools, or a block is missing or wrong"))
    rows = np.flatnonzero((owner < len(moves)) & ~moves.link[np.minimum(owner, len(moves) - 1)])
    tip_off, axis_off = _deviations(motion, executed, curves, rows, owner, match)
    done = np.flatnonzero(match >= 0)
    visit = np.linalg.norm(tip[match[done]] - moves.tip[done], axis=1)
    tilt = angle_between(axis[match[done]], moves.axis[done])
    worst_tip, tip_line = _worst((tip_off, visit), (owner[rows], done), (rows, match[done]), moves, motion)
    worst_axis, axis_line = _worst((axis_off, tilt), (owner[rows], done), (rows, match[done]), moves, motion)
    diagnostics += _beyond(worst_tip, tolerance, tip_line, worst_axis, axis_tolerance, axis_line, file)
    diagnostics += check_kinds(motion, moves, owner, file)
    diagnostics += check_states(motion, toolpath, moves, owner, file)
    diagnostics += check_speeds(motion, executed.control, moves, curves, owner, match, file)
    diagnostics += check_links(motion, executed, moves, owner, space, tolerance, file)
    return Comparison(worst_tip, worst_axis, tip_line, axis_line, tip, axis, match, owner, tuple(diagnostics))


def _deviations(motion: Motion, executed: Executed, curves: Curves, rows: Ints, owner: Ints,
                match: Ints) -> tuple[Floats, Floats]:
    """Worst (tip, axis) deviation (K,) over samples of each block from the curve of its move."""
    tip_off, axis_off = np.zeros(len(rows)), np.zeros(len(rows))
    if not len(rows):
        return tip_off, axis_off
    first, blocks = _place(rows, owner)
    for at in range(0, len(rows), CHUNK):
        part = slice(at, at + CHUNK)
        curve = curves.take(owner[rows[part]])
        for t in SAMPLES:
            tip, axis = executed.poses(motion, rows[part], t)
            guess = _turned_so_far(curve, axis, np.minimum((first[part] + t) / blocks[part], 1.0))
            d, e, _ = curve.deviation(tip, axis, guess)
            tip_off[part] = np.fmax(tip_off[part], np.nan_to_num(d, nan=np.inf))
            axis_off[part] = np.fmax(axis_off[part], np.nan_to_num(e, nan=np.inf))
    return tip_off, axis_off


def _turned_so_far(curve: Curves, axis: Floats, guess: Floats) -> Floats:
    """Where on their great circle axes (K, 3) stand, for moves whose tip hardly moves; `guess` (K,) for others."""
    turn = angle_between(curve.axis0, curve.axis1)
    spot = (curve.length() <= 0.1) & (turn > 1e-6)
    across = np.cross(np.cross(curve.axis0, curve.axis1), curve.axis0) / np.sin(np.where(spot, turn, 1.0))[:, None]
    angle = np.arctan2((axis * across).sum(axis=1), (axis * curve.axis0).sum(axis=1))
    return np.where(spot, np.clip(angle / np.where(spot, turn, 1.0), 0.0, 1.0), guess)


def _place(rows: Ints, owner: Ints) -> tuple[Floats, Floats]:
    """(how many blocks of the same move stand before, how many there are in all) for each block (K,)."""
    groups, start, inverse, size = np.unique(owner[rows], return_index=True, return_inverse=True, return_counts=True)
    del groups
    return (np.arange(len(rows)) - start[inverse]).astype(np.float64), size[inverse].astype(np.float64)


def _worst(values: tuple[Floats, Floats], move: tuple[Ints, Ints], block: tuple[Ints, Ints], moves: Moves,
           motion: Motion) -> tuple[float, tuple[int, int]]:
    """(worst value, (CL line, program line)) of two sets of deviations."""
    value, m, b = np.concatenate(values), np.concatenate(move), np.concatenate(block)
    if not len(value):
        return 0.0, (0, 0)
    k = int(value.argmax())
    return float(value[k]), (int(moves.line[m[k]]), int(motion.line[b[k]]))


def _beyond(worst_tip: float, tolerance: float, tip_line: tuple[int, int], worst_axis: float, axis_tolerance: float,
            axis_line: tuple[int, int], file: str) -> list[Diagnostic]:
    result = []
    for what, worst, allowed, lines, unit in (
            ("tip", worst_tip, tolerance, tip_line, "mm"),
            ("axis", worst_axis / DEG, axis_tolerance / DEG, axis_line, "degrees")):
        if not worst <= allowed * (1.0 + 1e-9):
            result.append(error(f"verify.{what}", f"the {what} is off by {worst:.6f} {unit} in block line {lines[1]}, "
                                f"allowed {allowed:g} {unit}", file=file, lines=[lines[0]],
                                hint="do not run this program"))
    return result
