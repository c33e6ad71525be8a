"""The motion of a program against the CL file: deviation of tip and axis, kind of motion, feed, tool, spindle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.links import SafeSpace
from postproc.moves import Moves, Phase
from postproc.readback.align import align, unreached
from postproc.readback.execute import Motion
from postproc.word_arcs import PLANE_COLUMNS
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

SAMPLES = (0.2, 0.4, 0.6, 0.8, 1.0)
CHUNK = 50_000
"""blocks that are sampled at a time, so that memory does not grow with the samples"""
ALLOWED_SPEED = 1.02
"""share of the programmed feed above which a move counts as too fast (short blocks carry rounding)"""


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


@dataclass(frozen=True)
class Executed:
    """Gives the poses of a program's blocks: control, kinematics by tool number, gauge length by register."""

    control: Control
    kinematics: Callable[[int], Kinematics]
    lengths: dict[int, float]

    def poses(self, motion: Motion, rows: Ints, t: float) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of the blocks `rows` at fraction t."""
        position = positions(motion, self.control, rows, t)
        tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
        tool, register = motion.tool[rows], motion.register[rows]
        for number, h in {*zip(tool.tolist(), register.tolist(), strict=True)}:
            k = np.flatnonzero((tool == number) & (register == h))
            tip[k], axis[k] = self._pose(position[k], self.kinematics(number), self.lengths.get(h, 0.0) if h >= 0 else 0.0)
        return tip, axis

    def _pose(self, position: Floats, kin: Kinematics, offset: float) -> tuple[Floats, Floats]:
        if not self.control.tip_law:
            return kin.forward(position / self.control.unit)
        words = position - self.control.work_offset
        words[:, self.control.xyz[2]] -= offset
        held = self.control.machine.kinematics.with_tool(offset)
        return kin.forward(self.control.joints(words, held, offset))


def positions(motion: Motion, control: Control, rows: Ints, t: float) -> Floats:
    """Machine coordinates (K, J) of blocks at fraction t: straight, or on the arc in its plane."""
    end = motion.end[rows]
    before = np.where((rows == 0)[:, None], motion.start, motion.end[np.maximum(rows - 1, 0)])
    if t == 1.0:
        return end
    result = before + t * (end - before)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((motion.code[rows] == 2) & (motion.plane[rows] == plane))
        if len(k):
            a, b = int(control.xyz[i]), int(control.xyz[j])
            center = motion.center[rows[k]][:, (i, j)]
            first, last = before[k][:, (a, b)] - center, end[k][:, (a, b)] - center
            angle = np.arctan2(first[:, 1], first[:, 0]) + t * signed_sweep(first, last, motion.ccw[rows[k]])
            radius = (1.0 - t) * np.hypot(*first.T) + t * np.hypot(*last.T)
            result[k, a], result[k, b] = center[:, 0] + radius * np.cos(angle), center[:, 1] + radius * np.sin(angle)
    return result


def signed_sweep(first: Floats, last: Floats, ccw: Bools) -> Floats:
    """Sweep (K,) rad of arcs between radius vectors (K, 2), positive anti-clockwise; equal ends are a full turn."""
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    angle = np.mod(np.arctan2(cross, (first * last).sum(axis=1)), 2.0 * np.pi)
    same = (np.abs(first - last) < 1e-9).all(axis=1)
    forward = np.where(same, 2.0 * np.pi, angle)
    backward = np.where(same, -2.0 * np.pi, angle - 2.0 * np.pi)
    return np.where(ccw, forward, backward)


def arc_sweeps(motion: Motion, control: Control) -> Floats:
    """(E,) sweep of arc blocks, rad, positive; NaN for others."""
    result = np.full(len(motion), np.nan)
    before = np.concatenate([motion.start[None, :], motion.end[:-1]])
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((motion.code == 2) & (motion.plane == plane))
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            center = motion.center[k][:, (i, j)]
            result[k] = np.abs(signed_sweep(before[k][:, columns] - center, motion.end[k][:, columns] - center,
                                            motion.ccw[k]))
    return result


def compare(motion: Motion, moves: Moves, executed: Executed, space: SafeSpace, tolerance: float,
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
    diagnostics += _kinds(motion, moves, owner, file)
    diagnostics += _speeds(motion, executed.control, moves, curves, owner, match, file)
    diagnostics += _links(motion, executed, moves, owner, space, tolerance, file)
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
            d, e, _ = curve.deviation(tip, axis, np.minimum((first[part] + t) / blocks[part], 1.0))
            tip_off[part] = np.fmax(tip_off[part], np.nan_to_num(d, nan=np.inf))
            axis_off[part] = np.fmax(axis_off[part], np.nan_to_num(e, nan=np.inf))
    return tip_off, axis_off


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


def _kinds(motion: Motion, moves: Moves, owner: Ints, file: str) -> list[Diagnostic]:
    """Rapids where the CL file cuts, cuts where it moves rapidly; pecks may return rapidly above what is drilled."""
    rows = np.flatnonzero(owner < len(moves))
    m = owner[rows]
    cutting = (moves.kind[m] != Kind.RAPID) & ~moves.link[m]
    rapid = motion.code[rows] == 0
    wrong = (cutting & rapid & ~_above_drilled(motion, moves, rows, m)) | (~cutting & ~rapid & ~moves.link[m])
    diagnostics = []
    if wrong.any():
        first = rows[wrong][0]
        kind = "rapid motion where the CL file cuts" if cutting[wrong][0] else "feed motion where the CL file is rapid"
        diagnostics.append(error("verify.kind", f"{kind} (block line {int(motion.line[first])})", file=file,
                                 lines=np.unique(moves.line[m[wrong]])[:6].tolist(), count=int(wrong.sum())))
    bad = rows[motion.missing_feed[rows]]
    if len(bad):
        diagnostics.append(error("verify.feed_missing", f"no feed in force in block line {int(motion.line[bad[0]])}",
                                 file=file, lines=[int(moves.line[owner[bad[0]]])], count=len(bad)))
    return diagnostics


def _above_drilled(motion: Motion, moves: Moves, rows: Ints, m: Ints) -> Bools:
    """True for rapids of a peck: the hole has been drilled deeper before in the same move."""
    drill = moves.phase[m] == Phase.DRILL
    result = np.zeros(len(rows), dtype=bool)
    for k in np.flatnonzero(drill & (motion.code[rows] == 0)):
        same = (m[:k] == m[k]) & (motion.code[rows[:k]] > 0)
        result[k] = bool(same.any())
    return result


def _speeds(motion: Motion, control: Control, moves: Moves, curves: Curves, owner: Ints, match: Ints,
            file: str) -> list[Diagnostic]:
    """Moves that the F words run faster than programmed, over the whole move."""
    seconds = block_seconds(motion, control)
    cutting = (owner < len(moves)) & (motion.code > 0)
    total = np.bincount(owner[cutting], weights=seconds[cutting], minlength=len(moves) + 1)[:len(moves)]
    length = curves.length()
    asked = np.where(moves.seconds > 0.0, moves.seconds, length / moves.feed)
    slack = 0.002 / np.where(moves.feed > 0.0, moves.feed, np.inf)
    check = (moves.kind != Kind.RAPID) & ~moves.link & (match >= 0) & (total > 0.0)
    fast = np.flatnonzero(check & (total * ALLOWED_SPEED + slack < asked))
    if not len(fast):
        return []
    k = fast[int((asked[fast] / total[fast]).argmax())]
    return [error("verify.feed", f"block line {int(motion.line[match[k]])} runs at {asked[k] / total[k]:.3f} times the "
                  "programmed feed", file=file, lines=[int(moves.line[k])], count=len(fast))]


def block_seconds(motion: Motion, control: Control) -> Floats:
    """(E,) time of each cutting block at constant feed, s.

    Per minute the length is that of X, Y, Z where any of them moves, else of the rotary axes in degrees.
    """
    before = np.concatenate([motion.start[None, :], motion.end[:-1]])
    step = motion.end - before
    linear = np.linalg.norm(step[:, control.xyz[control.xyz >= 0]], axis=1)
    sweep = arc_sweeps(motion, control)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(np.isfinite(sweep) & (motion.plane == plane))
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            radius = np.linalg.norm(before[k][:, columns] - motion.center[k][:, (i, j)], axis=1)
            rise = step[k, int(control.xyz[3 - i - j])]
            linear[k] = np.hypot(radius * sweep[k], rise)
    turned = np.linalg.norm(step[:, control.rotary], axis=1) if len(control.rotary) else np.zeros(len(motion))
    length = np.where(linear > 0.0, linear, turned)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(motion.inverse, 60.0 / motion.feed, 60.0 * length / motion.feed))


def _links(motion: Motion, executed: Executed, moves: Moves, owner: Ints, space: SafeSpace, tolerance: float,
           file: str) -> list[Diagnostic]:
    """Linking blocks stay on the line of retract, above the path, or on the line of approach."""
    rows = np.flatnonzero((owner < len(moves)) & moves.link[np.minimum(owner, len(moves) - 1)])
    rows = rows[rows > 0]
    bad = np.zeros(len(rows), dtype=bool)
    m = owner[rows]
    for t in SAMPLES:
        tip, axis = executed.poses(motion, rows, t)
        low = ~space.clear(tip, axis, -tolerance)
        approach = _off_line(tip, moves.tip[m], moves.axis[m]) <= tolerance
        before = np.maximum(m - 1, 0)
        retract = (_off_line(tip, moves.tip[before], moves.axis[before]) <= tolerance) & (m > 0)
        bad |= low & ~approach & ~retract
    if not bad.any():
        return []
    k = int(np.flatnonzero(bad)[0])
    return [error("verify.link", f"the linking move in block line {int(motion.line[rows[k]])} comes too near to the part",
                  file=file, lines=[int(moves.line[m[k]])], count=int(bad.sum()))]


def _off_line(tip: Floats, end: Floats, axis: Floats) -> Floats:
    """Distance (K,) of tips from the half lines that leave `end` along `axis`."""
    offset = tip - end
    along = np.maximum(np.einsum("ni,ni->n", offset, axis), 0.0)
    return np.asarray(np.linalg.norm(offset - along[:, None] * axis, axis=1))
