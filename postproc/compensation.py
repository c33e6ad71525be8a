"""Geometric errors of the machine corrected in the blocks of a path.

Every block end gets the joints at which the machine with errors has its tool where the nominal one would have it. What the
nominal control makes of those joints (axis positions, tip, tilted plane) is written. Blocks at one orientation (3+2, arcs,
cycles, lines at standing rotary axes) keep one, corrected as a whole. Points are added, and arcs resolved, only where the
motion between corrected ends would leave the nominal motion by more than the share of the tolerance that it gets. Home
positions are the machine's own and stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from machines.geometric_error.actual import Actual, carried_on, moving_sign
from machines.geometric_error.correction import correct
from machines.geometric_error.model import ErrorModel
from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.groups import groups
from postproc.modes import OutputModes
from postproc.moves import Moves
from postproc.path import ARC, FEED, TRAVERSE, Path
from postproc.word_arcs import PLANE_COLUMNS
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.units import DEG

SHARE = 0.1
"""of the tolerances: what the correction may be off between corrected points"""
LEAST = 0.2
"""of that, where the axis turns fast"""
LOOKS = (0.25, 0.5, 0.75)
"""where the motion between two corrected points is looked at"""
RAPIDS = 4.0
"""times that share for rapids of the CL file; linking moves only have to come to their ends"""
SHORTEST = 0.05
"""mm of tip way or degrees of a rotary axis: a block that short is not halved again"""
BISECTIONS = 14
"""to find where in a block an axis turns back"""
ROUNDS = 20
"""how often a block is halved at most; SHORTEST ends it before"""
MOMENT = 1e-3
"""of a block: how far back its direction at a place is looked at"""
ALONE = -1


@dataclass(frozen=True)
class Compensation:
    """What the correction did to the blocks that it corrects, mm and rad.

    Attributes:
        tip_before, axis_before: worst deviation of the machine with errors at nominal block ends
        tip_after, axis_after: worst deviation at corrected block ends: the residual
        residual_tip, residual_axis: (K, 3) at the ends of the blocks given, actual less wanted; 0 at home blocks
        added: points added; resolved: arcs that became lines
        partial: blocks near a pole, whose axis is corrected in part
        moved: (J,) largest correction of each joint
    """

    tip_before: float
    axis_before: float
    tip_after: float
    axis_after: float
    residual_tip: Floats
    residual_axis: Floats
    added: int
    resolved: int
    partial: int
    moved: Floats

    def lines(self) -> list[str]:
        """What happened, for header and summary."""
        arcsec = DEG / 3600.0
        return [f"geometric errors corrected: tip {1e3 * self.tip_before:.1f} um, axis {self.axis_before / arcsec:.1f} "
                f"arcsec before, {1e3 * self.tip_after:.2f} um and {self.axis_after / arcsec:.2f} arcsec left",
                f"{self.added} points added, {self.resolved} arcs resolved, {self.partial} blocks near a pole"]


@dataclass(frozen=True)
class _Corrected:
    """Corrected joints (K, J) and what `correct` said of them, for all blocks."""

    q: Floats
    before: Floats
    after: Floats
    residual: Floats
    partial: Bools
    unmeasured: Bools


def compensate(path: Path, moves: Moves, tools: Ints, kinematics: Callable[[int], Kinematics], model: ErrorModel,
               modes: OutputModes, tolerance: float, axis_tolerance: float, beyond: bool = False,
               file: str = "") -> tuple[Path | None, Compensation | None, list[Diagnostic]]:
    """The path with corrected joints, points added where they are needed; None where the model does not reach.

    Args:
        tools: (K,) index of the tool of each block
        kinematics: nominal, at the tip of the tool of an index
        tolerance, axis_tolerance: mm and rad of the whole conversion
        beyond: True corrects outside the measured range with the error at its end
    """
    work = _Work(path, tools, kinematics, model, axis_tolerance, beyond)
    found = work.ends()
    live = ~path.home
    diagnostics = _unmeasured(path, moves, modes.control, found.unmeasured & live[:, None], beyond, file)
    lost = live & ~np.isfinite(found.q).all(axis=1)
    if (diagnostics and not beyond) or lost.any():
        return None, None, diagnostics or [_lost(path, moves, lost, file)]
    corrected = _framed(replace(path, q=found.q), path, modes, work)
    corrected = replace(corrected, q=_kept_in_travel(corrected.q, path, modes.control))
    corrected, resolved = _arcs(corrected, path, work, SHARE * tolerance)
    corrected, added = _divided(corrected, path, work, SHARE * tolerance)
    (tip_before, axis_before), (tip_after, axis_after) = (x[live].max(axis=0, initial=0.0).tolist()
                                                          for x in (found.before, found.after))
    report = Compensation(
        tip_before, axis_before, tip_after, axis_after, residual_tip=found.residual[:, :3],
        residual_axis=found.residual[:, 3:], added=added, resolved=int(resolved.sum()),
        partial=int(found.partial[live].sum()), moved=np.abs(found.q - path.q).max(axis=0, initial=0.0))
    return corrected, report, [*diagnostics, *(info("compensation", line, file=file) for line in report.lines())]


class _Work:
    """What is needed throughout: the machine with errors by tool, groups of one orientation, ways of approach."""

    def __init__(self, path: Path, tools: Ints, kinematics: Callable[[int], Kinematics], model: ErrorModel,
                 axis_tolerance: float, beyond: bool) -> None:
        self.path, self.tools, self.kinematics = path, tools, kinematics
        self.axis_tolerance, self.beyond, self.model = axis_tolerance, beyond, model
        self.rotary = np.array(kinematics(int(tools[0])).rotary)
        self.group = one_orientation(path.q[:, self.rotary], tools, path.home)
        self._actual: dict[int, Actual] = {}

    def actual(self, tool: int) -> Actual:
        """The machine with errors at the tip of a tool."""
        if tool not in self._actual:
            self._actual[tool] = self.model.on(self.kinematics(tool))
        return self._actual[tool]

    @cached_property
    def way(self) -> Floats:
        """(K, J) sign of each joint's last motion at the ends of the blocks; on arcs that of their last moment."""
        q, block = self.path.q, np.arange(len(self.path))
        moved = np.zeros(q.shape)
        moved[1:] = moving_sign(np.diff(q, axis=0), self.rotary)
        arcs = block[self.path.code == ARC]
        moved[arcs] = self.moving(arcs, np.ones(len(arcs)))
        return carried_on(moved)

    def moving(self, block: Ints, t: Floats) -> Floats:
        """(N, J) sign of each joint's nominal motion at fraction t (N,) of blocks (N,); a moment after at their start."""
        before = np.clip(t - MOMENT, 0.0, 1.0 - MOMENT)
        return moving_sign(self.nominal(block, before + MOMENT) - self.nominal(block, before), self.rotary)

    def way_at(self, block: Ints, t: Floats) -> Floats:
        """(N, J) sign of each joint's last motion inside blocks; a joint that rests has the sign of the block before."""
        moving = self.moving(block, t)
        return np.asarray(np.where(moving != 0.0, moving, self.way[np.maximum(block - 1, 0)]))

    def nominal(self, block: Ints, t: Floats) -> Floats:
        """Nominal joints (N, J) at fraction t (N,) of blocks (N,), along the arc of those that are arcs."""
        path = self.path
        result = self.straight(path, path.q[block - 1], path.q[block], block, t)
        for rows in groups(path.frame[block], self.tools[block]):
            k = rows[path.code[block[rows]] == ARC]
            if len(k):
                control = path.frames[int(path.frame[block[k[0]]])].control
                kin = self.kinematics(int(self.tools[block[k[0]]]))
                start, end = (control.words(path.q[at], kin, 0.0) for at in (block[k] - 1, block[k]))
                arc = block[k]
                words = on_arc(path.plane[arc], path.ccw[arc], path.center[arc], start, end, t[k], control.xyz)
                result[k] = control.joints(words, kin, 0.0)
        return result

    def straight(self, path: Path, q0: Floats, q1: Floats, block: Ints, t: Floats) -> Floats:
        """Joints (N, J) at fraction t (N,) of straight blocks from q0 to q1 (N, J), under the law of each in `path`."""
        result = np.empty_like(q0)
        for k in groups(path.frame[block], self.tools[block]):
            control = path.frames[int(path.frame[block[k[0]]])].control
            result[k] = control.between(q0[k], q1[k], t[k], self.kinematics(int(self.tools[block[k[0]]])))[2]
        return result

    def ends(self) -> _Corrected:
        """All block ends; home blocks as they are."""
        n, joints = self.path.q.shape
        out = _Corrected(self.path.q.copy(), np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 6)), np.zeros(n, dtype=bool),
                         np.zeros((n, joints), dtype=bool))
        for k in groups(self.tools):
            rows = k[~self.path.home[k]]
            if not len(rows):
                continue
            tool = int(self.tools[k[0]])
            q = self.path.q[rows]
            tip, axis = self.kinematics(tool).forward(q)
            found = correct(self.actual(tool), q, tip, axis, group=self.group[rows], direction=self.way[rows],
                            axis_tolerance=self.axis_tolerance, beyond=self.beyond)
            out.q[rows] = self._exact_turns(found.q, rows)
            out.before[rows] = np.stack([found.tip_before, found.axis_before], axis=1)
            out.after[rows] = np.stack([found.tip_after, found.axis_after], axis=1)
            out.residual[rows] = np.concatenate([found.tip_residual, found.axis_residual], axis=1)
            out.partial[rows], out.unmeasured[rows] = found.partial, found.unmeasured
        return out

    def _exact_turns(self, q: Floats, rows: Ints) -> Floats:
        """The same joints, those of a group with the rotary axes of its first block to the last digit."""
        mine = self.group[rows]
        _, first, inverse = np.unique(np.where(mine >= 0, mine, -2 - np.arange(len(mine))), return_index=True,
                                      return_inverse=True)
        result = q.copy()
        result[:, self.rotary] = q[first[inverse]][:, self.rotary]
        return result

    def at(self, q: Floats, blocks: Ints, way: Floats, turns: Floats | None = None) -> Floats:
        """Corrected joints (N, J) of nominal q (N, J) inside blocks (N,); `turns` (N, R) fixes the rotary axes."""
        result = np.empty_like(q)
        for k in groups(self.tools[blocks]):
            tool = int(self.tools[blocks[k[0]]])
            tip, axis = self.kinematics(tool).forward(q[k])
            start = q[k].copy()
            if turns is not None:
                start[:, self.rotary] = turns[k]
            result[k] = correct(self.actual(tool), start, tip, axis, direction=way[k], turn=turns is None,
                                axis_tolerance=self.axis_tolerance, beyond=self.beyond).q
        return result

    def corrected(self, there: Floats, block: Ints, way: Floats, path: Path) -> Floats:
        """Corrected joints (N, J) of nominal ones inside blocks (N,) of the corrected `path`.

        Blocks at one orientation keep it.
        """
        ends = path.q[block - 1][:, self.rotary], path.q[block][:, self.rotary]
        held: Bools = np.all(ends[0] == ends[1], axis=1)
        q = np.empty_like(there)
        for rows, fixed in ((np.flatnonzero(held), True), (np.flatnonzero(~held), False)):
            if len(rows):
                q[rows] = self.at(there[rows], block[rows], way[rows], ends[1][rows] if fixed else None)
        return q

    def poses(self, q: Floats, blocks: Ints) -> tuple[Floats, Floats]:
        """Nominal (tip, axis), each (N, 3), of q (N, J) inside blocks (N,)."""
        tip, axis = np.empty((len(q), 3)), np.empty((len(q), 3))
        for k in groups(self.tools[blocks]):
            tip[k], axis[k] = self.kinematics(int(self.tools[blocks[k[0]]])).forward(q[k])
        return tip, axis

    def off(self, nominal: Floats, q: Floats, blocks: Ints, way: Floats) -> Floats:
        """Distance (N,) mm of the actual tip at q from the nominal one at `nominal` (N, J), inside blocks (N,)."""
        result = np.empty(len(q))
        for k in groups(self.tools[blocks]):
            tool = int(self.tools[blocks[k[0]]])
            actual, (tip, axis) = self.actual(tool), self.kinematics(tool).forward(nominal[k])
            w = actual.coordinates(q[k], np.concatenate([tip, axis], axis=1))
            result[k] = np.linalg.norm(actual.place(w, way[k])[0] - tip, axis=1)
        return result


def one_orientation(turns: Floats, tools: Ints, home: Bools) -> Ints:
    """(K,) number of the run of blocks at the same rotary joints (K, R) with the same tool; ALONE for single blocks."""
    same = (turns[1:] == turns[:-1]).all(axis=1) & (tools[1:] == tools[:-1]) & ~home[1:] & ~home[:-1]
    run = np.concatenate([[0], np.cumsum(~same)])
    count = np.bincount(run)
    result: Ints = np.where(count[run] > 1, run, ALONE)
    return result


def _kept_in_travel(q: Floats, path: Path, control: Control) -> Floats:
    """The joints (K, J), those of linking moves nominal where the nominal one is inside travel and the corrected one not.

    A linking move at the end of travel cuts nothing; a corrected cutting move beyond it is an error of `check_travel`.
    """
    limits = control.machine.limits
    nominal = (path.q >= limits.lower) & (path.q <= limits.upper)
    out = (q < limits.lower) | (q > limits.upper)
    result: Floats = np.where(np.isnan(path.u)[:, None] & nominal & out, path.q, q)
    return result


def _framed(path: Path, nominal: Path, modes: OutputModes, work: _Work) -> Path:
    """The path with the tilted planes that belong to its corrected rotary axes."""
    frames, frame, q = list(path.frames), path.frame.copy(), path.q.copy()
    tilted = np.array([f.control.law == "tilted" for f in frames])[path.frame]
    for run in np.unique(work.group[tilted & (work.group >= 0)]).tolist():
        k = np.flatnonzero((work.group == run) & tilted)
        whole = np.flatnonzero(work.group == run)
        new, at = modes.plane(work.kinematics(int(work.tools[k[0]])), path.q[k[0]])
        if new not in frames:
            frames.append(new)
        frame[k] = frames.index(new)
        q[whole] = work.at(nominal.q[whole], whole, work.way[whole], np.tile(at[work.rotary], (len(whole), 1)))
    return replace(path, q=q, frame=frame, frames=tuple(frames))


# ---- arcs ----------------------------------------------------------------------------------------------------------

def _arcs(path: Path, nominal: Path, work: _Work, allowed: float) -> tuple[Path, Bools]:
    """The path with arcs through their corrected ends, and which of them leave the nominal arc by more than `allowed`."""
    resolved, center = np.zeros(len(path), dtype=bool), path.center.copy()
    arcs = np.flatnonzero(path.code == ARC)
    for rows in groups(path.frame[arcs], work.tools[arcs]):
        k = arcs[rows]
        kin = work.kinematics(int(work.tools[k[0]]))
        old, new = (p.frames[int(p.frame[k[0]])].control for p in (nominal, path))
        n0, n1, c0, c1 = (control.words(p.q[at], kin, 0.0) for control, p in ((old, nominal), (new, path))
                          for at in (k - 1, k))
        xyz = new.xyz
        center[k] = _new_centers(path, k, n0[:, xyz], n1[:, xyz], c0[:, xyz], c1[:, xyz])
        for t in LOOKS:
            share = np.full(len(k), t)
            got = new.joints(on_arc(path.plane[k], path.ccw[k], center[k], c0, c1, share, xyz), kin, 0.0)
            resolved[k] |= ~(work.off(work.nominal(k, share), got, k, work.way_at(k, share)) <= allowed)
    return replace(path, center=center, code=np.where(resolved, FEED, path.code).astype(path.code.dtype)), resolved


def _new_centers(path: Path, k: Ints, n0: Floats, n1: Floats, c0: Floats, c1: Floats) -> Floats:
    """Centres (N, 3) relative to the corrected start: as the ends have moved, then at the same distance from both."""
    result = path.center[k] + 0.5 * (c1 - n1 - (c0 - n0))
    for plane, (i, j) in PLANE_COLUMNS.items():
        rows = np.flatnonzero(path.plane[k] == plane)
        chord = (c1 - c0)[rows][:, (i, j)]
        length = np.linalg.norm(chord, axis=1)
        open_ = length > 1e-6
        along = chord / np.where(open_, length, 1.0)[:, None]
        off = 0.5 * length - np.sum(result[rows][:, (i, j)] * along, axis=1)
        result[rows[:, None], [i, j]] += np.where(open_, off, 0.0)[:, None] * along
    return result


def on_arc(plane: Ints, ccw: Bools, center: Floats, start: Floats, end: Floats, t: Floats, xyz: Ints) -> Floats:
    """Words (N, J) at fraction t (N,) of arc blocks from `start` to `end` (N, J); the third axis rises evenly."""
    result = start + t[:, None] * (end - start)
    for number, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(plane == number)
        a, b = int(xyz[i]), int(xyz[j])
        middle = start[k][:, (a, b)] + center[k][:, (i, j)]
        first, last = start[k][:, (a, b)] - middle, end[k][:, (a, b)] - middle
        sense = np.where(ccw[k], 1.0, -1.0)
        swept = np.mod(sense * (np.arctan2(last[:, 1], last[:, 0]) - np.arctan2(first[:, 1], first[:, 0])), 2.0 * np.pi)
        swept = np.where(swept < 1e-9, 2.0 * np.pi, swept) * sense * t[k]
        cos, sin = np.cos(swept), np.sin(swept)
        result[k, a] = middle[:, 0] + cos * first[:, 0] - sin * first[:, 1]
        result[k, b] = middle[:, 1] + sin * first[:, 0] + cos * first[:, 1]
    return result


# ---- points between ------------------------------------------------------------------------------------------------

def _divided(path: Path, nominal: Path, work: _Work, allowed: float) -> tuple[Path, int]:
    """The path with its blocks halved until their motion is near enough to the nominal one (`allowed` mm, see `_bound`).

    Where an axis turns back, what it loses by that is taken up on the spot at the start of the block.
    """
    cl_rapid = (path.code == TRAVERSE) & np.isfinite(path.u)
    block = np.flatnonzero(((path.code == FEED) | cl_rapid) & ~path.home & (np.arange(len(path)) > 0))
    block = block[~path.home[block - 1]]
    pieces, found = _taken_up(path, nominal, work, block, allowed)
    for _ in range(ROUNDS):
        pieces = pieces.rows(_off(pieces, path, work) > _bound(pieces, path, work, allowed))
        if not len(pieces.block):
            break
        middle = 0.5 * (pieces.t0 + pieces.t1)
        there = work.nominal(pieces.block, middle)
        q = work.corrected(there, pieces.block, work.way_at(pieces.block, middle), path)
        found.append((pieces.block, middle, q))
        pieces = pieces.halved(middle, q)
        pieces = pieces.rows(_long(pieces, work))
    where, share, joints = (np.concatenate(column) for column in zip(*found, strict=True))
    return (_inserted(path, where, share, joints) if len(where) else path), len(where)


@dataclass(frozen=True)
class _Pieces:
    """Parts t0..t1 (N,) of blocks (N,) with the corrected joints (N, J) at their ends."""

    block: Ints
    t0: Floats
    t1: Floats
    q0: Floats
    q1: Floats

    def rows(self, keep: Bools) -> _Pieces:
        """Some of them."""
        return _Pieces(self.block[keep], self.t0[keep], self.t1[keep], self.q0[keep], self.q1[keep])

    def halved(self, middle: Floats, q: Floats) -> _Pieces:
        """Both halves of each, the joints in the middle being q."""
        return _Pieces(np.tile(self.block, 2), np.concatenate([self.t0, middle]), np.concatenate([middle, self.t1]),
                       np.concatenate([self.q0, q]), np.concatenate([q, self.q1]))


def _taken_up(path: Path, nominal: Path, work: _Work, block: Ints,
              allowed: float) -> tuple[_Pieces, list[tuple[Ints, Floats, Floats]]]:
    """The blocks as pieces, cut where an axis turns back, and the points that take up what it loses by that.

    At a block's start that is one point, inside a block two at one place: corrected by the old way and by the new one.
    """
    zero = np.zeros(len(block))
    cutting = path.code[block] == FEED
    back = np.flatnonzero(cutting & np.any(work.way_at(block, zero) * work.way[block - 1] < 0.0, axis=1))
    q = work.corrected(nominal.q[block[back] - 1], block[back], work.way_at(block[back], zero[back]), path)
    jump = np.abs(q - path.q[block[back] - 1]).max(axis=1, initial=0.0) > allowed
    start = path.q[block - 1]
    start[back[jump]] = q[jump]
    turning, at = _reversals(work, block[cutting])
    there = work.nominal(turning, at)
    old, new = (work.corrected(there, turning, work.way_at(turning, t), path)
                for t in (at, np.minimum(at + 2.0 * MOMENT, 1.0)))
    cut = np.abs(new - old).max(axis=1, initial=0.0) > allowed
    turning, at, old, new = turning[cut], at[cut], old[cut], new[cut]
    begins, ends = np.lexsort((np.concatenate([zero, at]), np.concatenate([block, turning]))), \
        np.lexsort((np.concatenate([zero + 1.0, at]), np.concatenate([block, turning])))
    owner = np.concatenate([block, turning])
    pieces = _Pieces(owner[begins], np.concatenate([zero, at])[begins], np.concatenate([zero + 1.0, at])[ends],
                     np.concatenate([start, new])[begins], np.concatenate([path.q[block], old])[ends])
    return pieces, [(block[back[jump]], zero[back[jump]], q[jump]), (turning, at, old), (turning, at, new)]


def _reversals(work: _Work, block: Ints) -> tuple[Ints, Floats]:
    """(block, fraction) of the places inside blocks where a joint turns back, by bisection of its direction."""
    where, at = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    first, last = work.moving(block, np.zeros(len(block))), work.moving(block, np.ones(len(block)))
    for j in range(first.shape[1]):
        rows = block[first[:, j] * last[:, j] < 0.0]
        sign = first[first[:, j] * last[:, j] < 0.0, j]
        low, high = np.zeros(len(rows)), np.ones(len(rows))
        for _ in range(BISECTIONS if len(rows) else 0):
            middle = 0.5 * (low + high)
            still = work.moving(rows, middle)[:, j] == sign
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        where.append(rows)
        at.append(low)
    return np.concatenate(where), np.concatenate(at)


def _off(pieces: _Pieces, path: Path, work: _Work) -> Floats:
    """(N,) mm, largest distance from the nominal motion at LOOKS."""
    worst = np.zeros(len(pieces.block))
    for look in LOOKS:
        t = np.full(len(worst), look)
        at = pieces.t0 + t * (pieces.t1 - pieces.t0)
        got = work.straight(path, pieces.q0, pieces.q1, pieces.block, t)
        worst = np.maximum(worst, work.off(work.nominal(pieces.block, at), got, pieces.block,
                                           work.way_at(pieces.block, at)))
    return worst


def _bound(pieces: _Pieces, path: Path, work: _Work, allowed: float) -> Floats:
    """(N,) mm: less where the axis turns so fast that the tip's being late would cost more than its share of the axis
    tolerance; rapids have RAPIDS times as much."""
    ends = [np.concatenate(work.poses(work.nominal(pieces.block, t), pieces.block), axis=1) for t in (pieces.t0, pieces.t1)]
    way, turn = (np.linalg.norm((ends[1] - ends[0])[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
    late = SHARE * work.axis_tolerance * way / np.where(turn > 0.0, turn, 1.0)
    cutting = np.where(turn > 0.0, np.clip(late, LEAST * allowed, allowed), allowed)
    result: Floats = np.where(path.code[pieces.block] == FEED, cutting, RAPIDS * allowed)
    return result


def _long(pieces: _Pieces, work: _Work) -> Bools:
    """True (N,) for pieces that are worth halving."""
    step = np.abs(work.nominal(pieces.block, pieces.t1) - work.nominal(pieces.block, pieces.t0))
    result: Bools = (step / np.where(work.rotary, DEG, 1.0)).max(axis=1) > SHORTEST
    return result


def _inserted(path: Path, block: Ints, t: Floats, q: Floats) -> Path:
    """The path with points (M, J) at fractions t (M,) of blocks (M,): columns, times and beginnings carried along."""
    n = len(path)
    owner = np.concatenate([block, np.arange(n)])
    share = np.concatenate([t, np.ones(n)])
    order = np.lexsort((share, owner))
    owner, share = owner[order], share[order]
    columns = {name: getattr(path, name)[owner] for name in ("move", "code", "home", "plane", "ccw", "center", "state",
                                                             "frame")}
    first = np.concatenate([[True], owner[1:] != owner[:-1]])
    before = np.where(first, 0.0, np.concatenate([[0.0], share[:-1]]))
    begins = np.concatenate([[0.0], path.u[:-1]])
    fresh = np.concatenate([[True], path.move[1:] != path.move[:-1]]) | ~(begins < path.u)
    begins = np.where(fresh, 0.0, begins)
    u = begins[owner] + share * (path.u - begins)[owner]
    begin = np.searchsorted(owner, path.begin, side="left")
    return replace(path, q=np.concatenate([q, path.q])[order], u=np.where(share == 1.0, path.u[owner], u),
                   seconds=path.seconds[owner] * (share - before), begin=begin.astype(np.int64), **columns)


# ---- what cannot be done ----------------------------------------------------------------------------------------------

def _unmeasured(path: Path, moves: Moves, control: Control, where: Bools, beyond: bool, file: str) -> list[Diagnostic]:
    rows = np.flatnonzero(where.any(axis=1))
    if not len(rows):
        return []
    j = int(np.flatnonzero(where[rows].any(axis=0))[0])
    name, value = control.machine.axis_names[j], path.q[where[:, j], j] * control.unit[j]
    lines = np.unique(moves.line[path.move[rows]])
    text = f"{name} goes from {value.min():.3f} to {value.max():.3f} where its errors were not measured"
    if beyond:
        return [info("compensation.range", text + "; the error at the end of the range is taken", file=file,
                     lines=lines[:6].tolist(), count=len(rows))]
    return [error("compensation.range", text, file=file, lines=lines[:6].tolist(), count=len(rows),
                  hint="measure farther, move the part, or take --error-model-beyond")]


def _lost(path: Path, moves: Moves, lost: Bools, file: str) -> Diagnostic:
    lines = np.unique(moves.line[path.move[lost]])
    return error("compensation.reach", "the machine cannot go where the correction puts it", file=file,
                 lines=lines[:6].tolist(), count=int(lost.sum()), hint="move the part in the set-up (part.origin)")
