"""The columns of a Path as they are collected: linking blocks, and the blocks of a run with its kept arcs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.control.modes import WordFrame
from postproc.control.word_arcs import PLANE_COLUMNS, WordArcs, word_arcs
from postproc.joints.joint_path import nearest_solution
from postproc.path.balanced import balanced
from postproc.path.linearise import family_turns, linearise
from postproc.path.model import ARC, FEED, TRAVERSE
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Bools, Floats, Ints, joined, repeated, taken
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.toolpath import Kind

LEG = 0.01, 1e-3
"""mm and rad that a rapid of a linking move may leave its line by before it is written as a feed move"""
PARTS, LINK, RUN = 8, 0, 7
"""places of a move's blocks: those of its link, by their parts, then its own"""
COLUMNS = ("q", "move", "u", "code", "home", "seconds", "plane", "ccw", "center", "state", "frame")


class PathBuilder:
    """Collects the columns of a Path run by run; `frames` are the word frames used so far."""

    def __init__(self, moves: Moves, joints: int) -> None:
        self.moves, self.joints = moves, joints
        self.columns: dict[str, list[Array]] = {k: [] for k in COLUMNS}
        self.places: list[Array] = []
        self.ended = 0
        """1 where what is added comes behind all moves"""
        self.begin = np.zeros(len(moves) + 1, dtype=np.int64)
        self.count = 0
        self.frames: dict[WordFrame, int] = {}

    def frame(self, frame: WordFrame) -> int:
        """The number of a frame."""
        return self.frames.setdefault(frame, len(self.frames))

    def add(self, frame: WordFrame, q: Floats, move: Ints, u: Floats, code: Array, seconds: Floats, home: bool = False,
            plane: Array | None = None, ccw: Array | None = None, center: Floats | None = None,
            state: Array | None = None, place: Array | None = None) -> None:
        """Blocks in `frame`; what is not given is that of straight blocks which name no axes.

        Blocks come in the order of their `place` (K,) at last, those of one place in the order in which they
        were added; without one it is that of their moves' links.
        """
        n = len(q)
        if not n:
            return
        self.count += n
        self.places.append(LINK + PARTS * (move + self.ended) if place is None else place)
        for name, value in (("q", q), ("move", move), ("u", u), ("code", code), ("seconds", seconds),
                            ("home", repeated(home, n)), ("frame", repeated(self.frame(frame), n)),
                            ("plane", repeated(np.int8(17), n) if plane is None else plane),
                            ("ccw", repeated(False, n) if ccw is None else ccw),
                            ("center", repeated(np.zeros(3), n) if center is None else center),
                            ("state", repeated(np.zeros(self.joints, dtype=bool), n) if state is None else state)):
            self.columns[name].append(value)

    def link(self, frame: WordFrame, q: Floats, move: int, home: bool = False, state: Array | None = None,
             code: Array | None = None, seconds: Floats | None = None) -> None:
        """Linking blocks that serve a row of Moves; rapids where no code is given."""
        n = len(q)
        self.add(frame, q, np.full(n, move), np.full(n, np.nan),
                 np.full(n, TRAVERSE, dtype=np.int8) if code is None else code,
                 np.full(n, np.nan) if seconds is None else seconds, home, state=state)

    def joined(self) -> dict[str, Array]:
        """The columns of all blocks, whose parts are forgotten; `begin` then counts them in their final order."""
        place = joined(self.places) if self.places else np.zeros(0, dtype=np.int64)
        order = None if (place[1:] >= place[:-1]).all() else np.argsort(place, kind="stable")
        result = {}
        for name in COLUMNS:
            parts = self.columns.pop(name)
            column = joined(parts) if parts else np.zeros(0)
            result[name] = column if order is None else taken(column, order)
        if order is not None:
            final = np.empty(len(order) + 1, dtype=np.int64)
            final[order], final[-1] = np.arange(len(order)), len(order)
            self.begin = final[self.begin]
        return result


def rapid_codes(control: Control, kin: Kinematics, q0: Floats, q1: Floats, tolerance: float,
                axis_tolerance: float, level: Bools | None = None) -> Array:
    """(K,) TRAVERSE where a rapid from q0 to q1 (K, J) stays on its straight line, else FEED (at the axes' limits).

    A dog-leg is piecewise straight in the joints; its corners are where an axis arrives. Rapids of `level` (K,) lead from
    hole to hole: where they keep the height along the tool axis it alone counts, as in the controls' own cycles.
    """
    own = np.abs(q1 - q0) / control.machine.limits.velocity
    total = own.max(axis=1, initial=0.0)
    leaves = np.zeros(len(q0), dtype=bool)
    if control.rapids == "dog-leg" and control.law != "tcp":
        rows = np.flatnonzero(((own > 0.0) & (own < total[:, None] * (1.0 - 1e-9))).any(axis=1))
        for j in range(q0.shape[1]) if len(rows) else ():
            t = own[rows, j] / total[rows]
            tip, axis, _ = control.between(q0[rows], q1[rows], t, kin, np.ones(len(rows), dtype=bool))
            begin, end = kin.forward(q0[rows])[0], kin.forward(q1[rows])[0]
            straight = kin.forward(q0[rows] + t[:, None] * (q1 - q0)[rows])[1]
            off = _off(tip, begin, end)
            if level is not None:
                flat = level[rows] & (np.abs(((end - begin) * straight).sum(axis=1)) <= tolerance)
                off = np.where(flat, np.abs(((tip - begin) * straight).sum(axis=1)), off)
            leaves[rows] |= (off > tolerance) | (angle_between(axis, straight) > axis_tolerance)
    return np.where(leaves, FEED, TRAVERSE).astype(np.int8)


def _off(tip: Floats, begin: Floats, end: Floats) -> Floats:
    """Distance (K,) of points from the straight lines between two points."""
    travel = end - begin
    square = np.maximum((travel**2).sum(axis=1), 1e-300)
    along = np.clip(((tip - begin) * travel).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(tip - begin - along[:, None] * travel, axis=1))


def add_run(out: PathBuilder, frame: WordFrame, kin: Kinematics, moves: Moves, rows: Ints, curves: Curves, q0: Floats,
            q1: Floats, tolerance: float, axis_tolerance: float, beside: bool = False) -> tuple[Floats, Ints, Ints]:
    """The blocks of moves `rows` (N,), of one or many runs, along curves (N) from joints q0 to q1 (N, J):
    (worst deviations (2,), rows with turns on the spot, broken rows); `beside`: cuts may end beside their curve."""
    control = frame.control
    where, begun = family_turns(kin, curves, q0, q1)
    start = q0.copy()
    start[where] = begun
    arcs = word_arcs(control, kin, curves, start, q1)
    arcs = replace(arcs, keep=arcs.keep & (np.linalg.norm(curves.start - curves.center, axis=1) <= control.arc_limit))
    main = linearise(control, kin, curves, start, q1, arcs.keep, tolerance, axis_tolerance)
    if not len(where):
        main = balanced(control, kin, curves, start, q1, moves.kind[rows] != Kind.RAPID, tolerance, axis_tolerance,
                        main) if beside else main
        _emit(out, frame, moves, rows, kin, curves, arcs, main.curve, main.u, main.q, q0, tolerance,
              axis_tolerance)
        return np.array([main.worst_tip, main.worst_axis]), rows[where], rows[main.broken]
    spot = _on_the_spot(curves, where)
    turning = linearise(control, kin, spot, q0[where], begun, np.zeros(len(where), dtype=bool), tolerance,
                        axis_tolerance)
    curve = np.concatenate([where[turning.curve], main.curve])
    u = np.concatenate([np.zeros(len(turning.curve)), main.u])
    joints = np.concatenate([turning.q, main.q])
    order = np.lexsort((np.concatenate([turning.u, main.u + 1.0]), curve))
    _emit(out, frame, moves, rows, kin, curves, arcs, curve[order], u[order], joints[order], q0, tolerance,
          axis_tolerance)
    broken = np.union1d(rows[main.broken], rows[where[turning.broken]])
    return np.array([max(main.worst_tip, turning.worst_tip), max(main.worst_axis, turning.worst_axis)]), \
        rows[where], broken


def _on_the_spot(curves: Curves, where: Ints) -> Curves:
    c = curves.take(where)
    return Curves(c.start, c.start, c.axis0, c.axis0, np.zeros(len(where), dtype=bool), c.center,
                  c.normal, c.sweep)


def _emit(out: PathBuilder, frame: WordFrame, moves: Moves, rows: Ints, kin: Kinematics, curves: Curves, arcs: WordArcs,
          curve: Ints, u: Floats, q: Floats, q0: Floats, tolerance: float, axis_tolerance: float) -> None:
    """Blocks in order, kept arcs cut into whole turns, with code and seconds; curves begin at joints q0 (N, J)."""
    if ((arcs.parts > 1) & arcs.keep)[curve].any():
        curve, u, q = _cut_turns(kin, curves, arcs, curve, u, q)
    row = rows[curve]
    first = np.ones(len(curve), dtype=bool)
    first[1:] = curve[1:] != curve[:-1]
    out.begin[rows] = out.count + np.flatnonzero(first)
    share = u - np.where(first, 0.0, np.concatenate([[0.0], u[:-1]]))
    length = curves.length()[curve]
    feed, inverse = moves.feed[row], moves.seconds[row]
    seconds = np.where(inverse > 0.0, inverse * share, length * share / feed)
    cutting = moves.kind[row] != Kind.RAPID
    keep = arcs.keep[curve]
    code = np.where(keep, ARC, np.where(cutting, FEED, TRAVERSE)).astype(np.int8)
    rapid = code == TRAVERSE
    level = moves.phase[row] == Phase.POSITION
    before = np.concatenate([q0[:1], q[:-1]])
    before[first] = q0[curve[first]]
    code[rapid] = rapid_codes(frame.control, kin, before[rapid], q[rapid], tolerance, axis_tolerance,
                              level[rapid])
    seconds = np.where(cutting, seconds, np.where(code == TRAVERSE, np.nan, 0.0))
    turned = np.where(keep & ~first, np.concatenate([[0.0], u[:-1]]) * curves.sweep[curve], 0.0)
    center = _turned_centers(arcs, curve, turned) if keep.any() else repeated(np.zeros(3), len(curve))
    out.add(frame, q, row, u, code, seconds, False, taken(arcs.plane, curve), taken(arcs.ccw, curve), center,
            place=RUN + PARTS * row)


def _turned_centers(arcs: WordArcs, curve: Ints, angle: Floats) -> Floats:
    """Centres relative to the block's own start, which has gone `angle` (K,) round from the start of the arc."""
    center = arcs.center[curve]
    signed = np.where(arcs.ccw[curve], angle, -angle)
    c, s = np.cos(signed), np.sin(signed)
    result = center.copy()
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((arcs.plane[curve] == plane) & (angle != 0.0))
        result[k, i] = c[k] * center[k, i] - s[k] * center[k, j]
        result[k, j] = s[k] * center[k, i] + c[k] * center[k, j]
    return result


def _cut_turns(kin: Kinematics, curves: Curves, arcs: WordArcs, curve: Ints, u: Floats,
               q: Floats) -> tuple[Ints, Floats, Floats]:
    parts = np.where(arcs.keep, arcs.parts, 1)[curve]
    piece = np.repeat(np.arange(len(curve)), parts)
    k = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.where(parts[piece] == 1, u[piece], (k + 1) / parts[piece])
    joints = q[piece].copy()
    inner = np.flatnonzero(k + 1 < parts[piece])
    tip, axis = curves.take(curve[piece[inner]]).at(share[inner])
    joints[inner] = nearest_solution(kin, tip, axis, q[piece[inner]])
    return curve[piece], share, joints
