"""From reference moves to blocks in joints: runs solved, linked and linearised, with the time each block may take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.joint_path import nearest_solution, reachable_axes, solve
from postproc.linearise import family_turns, linearise
from postproc.links import Link, Pose, SafeSpace, plan_link
from postproc.moves import Moves
from postproc.word_arcs import PLANE_COLUMNS, WordArcs, word_arcs
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, has_errors, info
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

Progress = Callable[[str, int, int], None]
TRAVERSE, FEED, ARC = 0, 1, 2
AXIS_SHARE = 0.2
"""share of the axis tolerance that may go into moving an axis onto the set the machine can reach"""


@dataclass(frozen=True)
class Path:
    """Blocks in joints, K of them, and where the rows of Moves begin among them.

    Attributes:
        q (K, J): joints at the end of the block
        move (K,): row of Moves that the block serves
        u (K,): where on that row's curve it ends; NaN for linking blocks
        code (K,): TRAVERSE, FEED, ARC
        home (K,): True where the block is meant in machine coordinates
        seconds (K,): time it should take at the tip's feed; NaN for rapids, 0 for turns on the spot
        plane, ccw, center: of the ARC blocks (K rows); the centre is relative to the block's start
        state (K, J): axes that the block states; where it names none, it states those that change
        begin (M + 1,): the block before which the records without motion of a move act
        singular (M,): moves whose pose lies along a rotary axis; turns: moves that begin with a turn on the spot
        worst_tip, worst_axis: deviation left between points, mm and rad
    """

    q: Floats
    move: Ints
    u: Floats
    code: Array
    home: Bools
    seconds: Floats
    plane: Array
    ccw: Bools
    center: Floats
    state: Bools
    begin: Ints
    singular: Bools
    turns: Ints
    worst_tip: float
    worst_axis: float

    def __len__(self) -> int:
        return len(self.q)


class _Builder:
    """Collects the columns of a Path run by run."""

    def __init__(self, moves: Moves, joints: int) -> None:
        self.moves, self.joints = moves, joints
        self.columns: dict[str, list[Array]] = {k: [] for k in ("q", "move", "u", "code", "home", "seconds", "plane",
                                                                  "ccw", "center", "state")}
        self.begin = np.zeros(len(moves) + 1, dtype=np.int64)
        self.count = 0

    def add(self, q: Floats, move: Ints, u: Floats, code: Array, seconds: Floats, home: bool = False,
            plane: Array | None = None, ccw: Array | None = None, center: Floats | None = None,
            state: Array | None = None) -> None:
        n = len(q)
        self.count += n
        for name, value in (("q", q), ("move", move), ("u", u), ("code", code), ("seconds", seconds),
                            ("home", np.full(n, home)),
                            ("plane", np.full(n, 17, dtype=np.int8) if plane is None else plane),
                            ("ccw", np.zeros(n, dtype=bool) if ccw is None else ccw),
                            ("center", np.zeros((n, 3)) if center is None else center),
                            ("state", np.zeros((n, self.joints), dtype=bool) if state is None else state)):
            self.columns[name].append(value)

    def link(self, q: Floats, move: int, home: bool = False, state: Array | None = None) -> None:
        n = len(q)
        self.add(q, np.full(n, move), np.full(n, np.nan), np.full(n, TRAVERSE, dtype=np.int8), np.full(n, np.nan), home,
                 state=state)

    def joined(self, name: str) -> Array:
        return np.concatenate(self.columns[name]) if self.columns[name] else np.zeros(0)


def build_path(control: Control, kinematics: Callable[[int], Kinematics], moves: Moves, space: SafeSpace,
               home_rows: frozenset[int], tolerance: float, axis_tolerance: float, file: str = "",
               progress: Progress | None = None) -> tuple[Path | None, list[Diagnostic]]:
    """Blocks for all moves (in the table frame).

    Args:
        kinematics: the kinematics with the tool of that index of the Toolpath
        home_rows: linked rows of Moves whose link goes by home (tool change, GOHOME, first)
        tolerance, axis_tolerance: mm and rad that linearising may use
    """
    machine = control.machine
    out = _Builder(moves, len(machine.axis_names))
    singular = np.zeros(len(moves), dtype=bool)
    state: Pose | None = None
    kin = kinematics(int(moves.tool[0]))
    diagnostics: list[Diagnostic] = []
    worst, turns = np.zeros(2), [np.zeros(0, dtype=np.int64)]
    starts, reference = np.flatnonzero(moves.link), moves.curves()
    for first, last in zip(starts, [*starts[1:], len(moves)], strict=True):
        before, kin = kin, kinematics(int(moves.tool[first]))
        rows = np.arange(first, last)
        axis, moved = reachable_axes(kin, moves.axis[rows], AXIS_SHARE * axis_tolerance)
        diagnostics += _moved_axes(moves, rows, moved, file)
        found = solve(kin, moves.tip[rows], axis, machine.limits, machine.home if state is None else state.q)
        diagnostics += _unreachable(control, kin, moves, rows, axis, found.q, file)
        if has_errors(diagnostics):
            continue
        singular[rows] = found.singular
        target = Pose(moves.tip[first], axis[0], found.q[0])
        link = plan_link(control, before, kin, space, state, target, first in home_rows)
        _add_link(out, control, moves, int(first), link)
        if not link.clear:
            diagnostics.append(_no_way(moves, int(first), file))
        if len(rows) > 1:
            curves = reference.take(rows[1:])
            left, turned, broken = _add_run(out, control, kin, moves, rows[1:], _with_axes(curves, axis), found.q,
                                            tolerance, axis_tolerance - float(moved.max()))
            worst = np.maximum(worst, left)
            turns.append(turned)
            diagnostics += _broken(moves, broken, file)
        state = Pose(moves.tip[last - 1], axis[-1], found.q[-1])
        if progress:
            progress("joints", int(last), len(moves))
    if has_errors(diagnostics):
        return None, merged(diagnostics)
    if state is not None:
        _add_end(out, control, kin, space, state, len(moves) - 1)
    out.begin[len(moves)] = out.count
    columns = {k: out.joined(k) for k in out.columns}
    path = Path(**columns, begin=out.begin, singular=singular, turns=np.concatenate(turns),
                worst_tip=float(worst[0]), worst_axis=float(worst[1]))
    return path, merged(diagnostics)


def _with_axes(curves: Curves, axis: Floats) -> Curves:
    return Curves(curves.start, curves.end, axis[:-1], axis[1:], curves.is_arc, curves.center, curves.normal,
                  curves.sweep)


def _add_link(out: _Builder, control: Control, moves: Moves, row: int, link: Link) -> None:
    """Retract, home, then the records without motion, then index and the approach to the pose itself.

    A cutting move that is linked to (no RAPID before it) is approached at its feed.
    """
    out.link(link.retract, row)
    out.link(link.home, row, not control.tip_law, link.home_state)
    out.begin[row] = out.count
    out.link(link.index, row, False, link.index_state)
    if not len(link.approach):
        return
    cutting = moves.kind[row] != Kind.RAPID
    n = len(link.approach)
    out.link(link.approach, row)
    if cutting:
        ways = np.linalg.norm(np.diff(np.concatenate([link.index[-1:], link.approach]), axis=0), axis=1)
        out.columns["code"][-1] = np.full(n, FEED, dtype=np.int8)
        out.columns["seconds"][-1] = ways / moves.feed[row] if moves.feed[row] > 0.0 else \
            np.full(n, moves.seconds[row] / n)


def _add_run(out: _Builder, control: Control, kin: Kinematics, moves: Moves, rows: Ints, curves: Curves, q: Floats,
             tolerance: float, axis_tolerance: float) -> tuple[Floats, Ints, Ints]:
    """The blocks of a run after its first pose: (worst deviations (2,), rows with turns on the spot, broken rows)."""
    q0, q1 = q[:-1], q[1:].copy()
    where, begun = family_turns(kin, curves, q0, q1)
    start = q0.copy()
    start[where] = begun
    arcs = word_arcs(control, kin, curves, start, q1)
    arcs = replace(arcs, keep=arcs.keep & (np.linalg.norm(curves.start - curves.center, axis=1) <= control.arc_limit))
    main = linearise(control, kin, curves, start, q1, arcs.keep, tolerance, axis_tolerance)
    spot = _on_the_spot(curves, where)
    turning = linearise(control, kin, spot, q0[where], begun, np.zeros(len(where), dtype=bool), tolerance,
                        axis_tolerance)
    curve = np.concatenate([where[turning.curve], main.curve])
    u = np.concatenate([np.zeros(len(turning.curve)), main.u])
    joints = np.concatenate([turning.q, main.q])
    order = np.lexsort((np.concatenate([turning.u, main.u + 1.0]), curve))
    _emit(out, moves, rows, kin, curves, arcs, curve[order], u[order], joints[order])
    broken = np.union1d(rows[main.broken], rows[where[turning.broken]])
    return np.array([max(main.worst_tip, turning.worst_tip), max(main.worst_axis, turning.worst_axis)]), \
        rows[where], broken


def _on_the_spot(curves: Curves, where: Ints) -> Curves:
    c = curves.take(where)
    return Curves(c.start, c.start, c.axis0, c.axis0, np.zeros(len(where), dtype=bool), c.center, c.normal, c.sweep)


def _emit(out: _Builder, moves: Moves, rows: Ints, kin: Kinematics, curves: Curves, arcs: WordArcs, curve: Ints,
          u: Floats, q: Floats) -> None:
    """Blocks of a run in order, kept arcs cut into whole turns, with code and seconds."""
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
    turned = np.where(keep & ~first, np.concatenate([[0.0], u[:-1]]) * curves.sweep[curve], 0.0)
    center = _turned_centers(arcs, curve, turned)
    out.add(q, row, u, code, np.where(cutting, seconds, np.nan), False, arcs.plane[curve], arcs.ccw[curve], center)


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


def _add_end(out: _Builder, control: Control, kin: Kinematics, space: SafeSpace, state: Pose, row: int) -> None:
    link = plan_link(control, kin, kin, space, state, None, True)
    out.link(link.retract, row)
    out.link(link.home, row, not control.tip_law, link.home_state)


def merged(diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics of the same code and message as one, with the lines of all."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in diagnostics:
        groups.setdefault((d.severity, d.code, d.message, d.file, d.hint), []).append(d)
    result = []
    for group in groups.values():
        head = group[0]
        lines = tuple(n for d in group for n in d.lines)[:6]
        result.append(Diagnostic(head.severity, head.code, head.message, head.file, lines,
                                 sum(d.count for d in group), head.hint))
    return result


def _moved_axes(moves: Moves, rows: Ints, moved: Floats, file: str) -> list[Diagnostic]:
    if not bool((moved > 1e-6).any()):
        return []
    where = rows[moved > 1e-6]
    return [info("axis.moved", "tool axis moved onto the directions that the machine can take, within the axis "
                 "tolerance", file=file, lines=moves.line[where][:6].tolist(), count=len(where))]


def _unreachable(control: Control, kin: Kinematics, moves: Moves, rows: Ints, axis: Floats, q: Floats,
                 file: str) -> list[Diagnostic]:
    bad = np.flatnonzero(~np.isfinite(q).all(axis=1))
    if not len(bad):
        return []
    name = control.machine.name
    nearest = kin.nearest_axis(axis[bad])
    off = angle_between(nearest, axis[bad])
    worst = int(off.argmax())
    lines = moves.line[rows[bad]]
    if off[worst] > 1e-9:
        i, j, k = axis[bad][worst]
        hint = "turn the part in the set-up (part.x_axis, part.y_axis)" + (
            "" if any(kin.rotary) else f"; {name} has no rotary axis, so every operation needs its own set-up")
        return [error("reach.axis", f"{name} cannot take the tool axis ({i:.6f}, {j:.6f}, {k:.6f}): its nearest "
                      f"direction is {off[worst] / DEG:.4f} degrees away", file=file,
                      lines=[int(lines[worst]), *lines[:5].tolist()], count=len(bad), hint=hint)]
    x, y, z = moves.tip[rows[bad[0]]]
    return [error("reach.position", f"{name} cannot reach the tip position ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table "
                  "frame with that tool axis", file=file, lines=lines[:6].tolist(), count=len(bad),
                  hint="move the part in the set-up (part.origin)")]


def _no_way(moves: Moves, row: int, file: str) -> Diagnostic:
    return error("link.blocked", "no linking move stays above the safe planes", file=file, lines=[int(moves.line[row])],
                 hint="give clearance.centre and a larger clearance.distance in the set-up")


def _broken(moves: Moves, rows: Ints, file: str) -> list[Diagnostic]:
    if not len(rows):
        return []
    return [error("path.jump", "the rotary axes jump here: no points between keep the tool on its path", file=file,
                  lines=moves.line[rows][:6].tolist(), count=len(rows),
                  hint="retract before this point, or change the tool axis")]
