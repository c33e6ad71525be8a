"""The largest deviation of a program's blocks from the CL file as a bound that holds everywhere, by branch and bound.

Between two places of a block the difference e of the executed pose and a pose of its curve bends by at most
M, so that it stays within M / 32 of the largest value at the begin, middle and end (interpolation error, see
`postproc.path.bound`). M comes from the law of the block by Taylor's theorem (`Kinematics.jets`); the values
themselves are poses of the reader. Blocks whose bound is above the worst that was seen anywhere are divided
until bound and worst meet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics import columns
from machines.kinematics.base import Kinematics
from machines.kinematics.columns import Columns
from machines.kinematics.taylor import TaylorAngle, TaylorVector, straight
from postproc.base.group_rows import groups
from postproc.control.word_arcs import PLANE_AXIS, PLANE_COLUMNS
from postproc.path.bound import MANY, SHORT, axis_reference, curve_parameter, tip_reference
from postproc.path.coarse_bound import coarse_bounds, highest
from postproc.path.model import ARC
from postproc.readback.comparison.actual_deviation_bound import CIRCLE, JOINTS, LINE, TIP, strays
from postproc.readback.comparison.bound_search import BoundSearch, DeviationBound, PieceBounds, Pieces
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, alike, coordinates, signed_sweep
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, distinct, taken, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, cross, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

HALVINGS = 26
"""at most, of one block"""
SAME = 1e-5
"""mm: what the law of a block and the reader may differ by in its middle"""
CHUNK = 20_000
_FEW, _AT_ONCE = 250, 8
"""few pieces cost what one does: so many parts of each instead of halves"""
_PATIENCE = 10
"""times that a block without a bound is divided before it is given up"""
_STANDS = 1e-12
_REACH = 0.9
"""of the tolerance: how far from the nearest point the axis may be compared"""


@dataclass(frozen=True)
@arrays(rows="K", owner="K", begin="K", share="K")
class _Ends:
    """What bounds need of blocks `rows`: where each begins and ends on its curve, by count (a guess for helices)."""

    rows: Ints
    owner: Ints
    begin: Floats
    share: Floats


def deviation_bound(motion: Motion, executed: BlockPoses, moves: Moves, rows: Ints, owner: Ints, begin: Floats,
                    share: Floats, allowed: tuple[float, float], judge: bool = False,
                    poses: tuple[Floats, Floats] | None = None) -> DeviationBound:
    """Bounds of the blocks `rows` (K,) from the curves of their moves `owner` (K,).

    `begin`, `share` (K,): where on its curve each begins and what part of it it is, by count; `allowed`: tolerances of tip
    (mm) and axis (rad); `judge`: see `BoundSearch`; `poses`: tips and axes (E, 3) at the ends of all blocks, where they are
    known: then closer bounds are found only of blocks whose cheap ones leave it open. Rapids that are dog-legs are bounded
    piece by piece between corners.
    """
    ends = _Ends(rows, owner, begin, share)
    worst, whole = BoundSearch(allowed, judge), _coarse(motion, executed, moves, ends, poses)
    known = np.asarray(~np.isfinite(whole).all(axis=0))
    if len(rows) and not known.all():
        known[highest(np.where(known, 0.0, whole))] = True
    for rest in (False, True):
        # Blocks whose cheap bound is below the worst that was seen are not the worst, nor would closer bounds say so.
        above = ~known & (whole > worst.seen[:, None]).any(axis=0) if rest else known
        looked = np.flatnonzero(above)
        whole[:, looked] = 0.0
        for at in range(0, len(looked), CHUNK):
            for pieces in _whole(motion, executed, ends, looked[at:at + CHUNK]):
                values = _values(motion, executed, moves, ends, pieces, allowed)
                worst.add(pieces, values)
                for most, bound in zip(whole, (values.tip, values.axis), strict=True):
                    np.maximum.at(most, pieces.k, bound)
    halvings = divided = 0
    while halvings < HALVINGS:
        if divided >= _PATIENCE:
            worst.give_up()
        if worst.judged:
            break
        pieces = worst.taken()
        if not len(pieces):
            break
        parts = _AT_ONCE if len(pieces) < _FEW else 2
        pieces, divided, halvings = pieces.divided(parts), divided + 1, halvings + parts.bit_length() - 1
        for at in range(0, len(pieces), CHUNK):
            part = pieces.take(slice(at, at + CHUNK))
            worst.add(part, _values(motion, executed, moves, ends, part, allowed))
    return replace(worst.result(rows), whole=whole)


def _coarse(motion: Motion, executed: BlockPoses, moves: Moves, ends: _Ends,
            poses: tuple[Floats, Floats] | None) -> Floats:
    """(2, K) cheap bounds of tip (mm) and axis (rad) of blocks straight in joints, or with standing axes, on the machine of
    their law (`postproc.path.coarse_bound`); infinite of others, and where it saves nothing."""
    result = np.full((2, len(ends.rows)), np.inf)
    if poses is None or len(ends.rows) < MANY or not motion.table.plain:
        return result
    for at in range(0, len(ends.rows), CHUNK):
        rows = ends.rows[at:at + CHUNK]
        law, before = _kinds(motion, executed, rows), np.maximum(rows - 1, 0)
        fits = ((law == JOINTS) | (law == LINE)) & ~executed.bent(motion, rows) & ~executed.off_law(motion, rows)
        fits &= (rows > 0) & (motion.tool[rows] == motion.tool[before]) & (motion.register[rows] == motion.register[before])
        for k, (tool,) in alike(motion.tool[rows]):
            k = np.arange(len(rows))[k][fits[k]]
            joints = executed.joints(motion, before[k], 1.0), executed.joints(motion, rows[k], 1.0)
            begin, end = ((poses[0][some], taken(poses[1], some)) for some in (before[k], rows[k]))
            curves = moves.curves(ends.owner[at + k])
            found = coarse_bounds(executed.kinematics(tool), curves, joints, begin, end, SHORT)
            if found is not None:
                result[:, at + k] = found
    return result


def _whole(motion: Motion, executed: BlockPoses, ends: _Ends, k: Ints) -> list[Pieces]:
    """Whole blocks; dog-legs cut at their corners."""
    bent = executed.bent(motion, ends.rows[k])
    pieces = [Pieces(k[~bent], np.zeros(int((~bent).sum())), np.ones(int((~bent).sum())))]
    legs = k[bent]
    if len(legs):
        cuts = np.sort(np.concatenate([np.zeros((len(legs), 1)), executed.corners(motion, ends.rows[legs]),
                                       np.ones((len(legs), 1))], axis=1), axis=1)
        a, b = cuts[:, :-1].ravel(), cuts[:, 1:].ravel()
        pieces.append(Pieces(np.repeat(legs, cuts.shape[1] - 1), a, b).take(b > a))
    return [p for p in pieces if len(p)]


def _values(motion: Motion, executed: BlockPoses, moves: Moves, ends: _Ends, pieces: Pieces,
            allowed: tuple[float, float]) -> PieceBounds:
    """Deviations and bounds of pieces: from the nearest points of the curves, where that is outside the
    tolerance from the places whose axis fits best among those whose tip is near enough, as `Curves.deviation` has it."""
    rows = ends.rows[pieces.k]
    curves = moves.curves(ends.owner[pieces.k])
    places = pieces.a, 0.5 * (pieces.a + pieces.b), pieces.b
    executed.look_ahead(motion, rows, places)
    poses = [executed.poses(motion, rows, t) for t in places]
    guess = [np.minimum(ends.begin[pieces.k] + t * ends.share[pieces.k], 1.0) for t in places]
    nearest = [curves.project(without_nan(tip), g) for (tip, _), g in zip(poses, guess, strict=True)]
    off = executed.off_law(motion, rows).any()
    lawful = [executed.lawful(motion, rows, t) for t in places] if off else poses
    law = _PieceMotion.of(motion, executed, rows, pieces, places, lawful)
    even = law.straight_tip & ~curves.is_arc
    found = _compared(curves, poses, nearest, law, even, even | (curves.length() <= SHORT))
    outside = np.isfinite(found.tip) & (_excess(found, allowed) > 1.0)
    if outside.any():
        k = np.flatnonzero(outside)
        some, there = curves.take(k), [(tip[k], axis[k]) for tip, axis in poses]
        fit = [_best_fit(some, *pose, u[k], _REACH * allowed[0]) for pose, u in zip(there, nearest, strict=True)]
        other = _compared(some, there, fit, law.take(k), np.zeros(len(k), dtype=bool),
                          np.zeros(len(k), dtype=bool))
        better = _excess(other, allowed) < _excess(found.take(k), allowed)
        found = found.replaced(k[better], other.take(better))
    return found


def _excess(values: PieceBounds, allowed: tuple[float, float]) -> Floats:
    """The larger bound over its tolerance."""
    return np.asarray(np.maximum(values.tip / allowed[0], values.axis / allowed[1]))


def _best_fit(curves: Curves, tip: Floats, axis: Floats, u: Floats, within: float) -> Floats:
    """The parameter whose axis is nearest, among those whose tip is `within` mm; `u`: that of the nearest point."""
    off = lengths(tip - curves.tip_at(u))
    reach = np.sqrt(np.maximum(within**2 - off**2, 0.0)) / np.maximum(curves.length(), _STANDS)
    return np.asarray(np.clip(np.clip(curves.turned(axis, u), u - reach, u + reach), 0.0, 1.0))


def _compared(curves: Curves, poses: list[tuple[Floats, Floats]], u: list[Floats], law: _PieceMotion, even: Bools,
              even_parameter: Bools) -> PieceBounds:
    """Deviations and bounds of N pieces from the poses of their curves at `u`, where they begin, in their
    middle, where they end; `even`: the difference of the tips is straight."""
    n = len(even)
    travel = curve_parameter(u[0], np.where(even_parameter, 0.5 * (u[0] + u[2]), u[1]), u[2])
    on = [curves.at(np.clip(v, 0.0, 1.0)) for v in (u[0], np.asarray(travel.value + np.zeros(n)), u[2])]
    tip_off = np.max([lengths(p[0] - c[0]) for p, c in zip(poses, on, strict=True)], axis=0)
    axis_off = np.max([lengths(p[1] - c[1]) for p, c in zip(poses, on, strict=True)], axis=0)
    turn = angle_between(curves.axis0, curves.axis1)
    differences = law.tip - tip_reference(curves, travel), law.axis - axis_reference(curves, travel, turn)
    bend = [np.where(law.known, _bend(jet) + np.zeros(n), np.inf) for jet in differences]
    # A straight tip next to a straight line: with both parameters even the difference is straight, so largest at an end.
    bend[0] = np.where(even & law.known, 0.0, bend[0])
    return PieceBounds(_known(tip_off), _angle(_known(axis_off)), _known(tip_off + bend[0] / 32.0 + law.strays[0]),
                   _angle(_known(axis_off + bend[1] / 32.0 + law.strays[1])))


def _known(values: Floats) -> Floats:
    """Infinity instead of NaN."""
    return np.where(np.isnan(values), np.inf, values)


def _bend(jet: TaylorVector) -> Floats | float:
    """M of the difference: what its second derivative nowhere exceeds."""
    return jet.bend()


def _angle(chord: Floats) -> Floats:
    """The angle between unit vectors `chord` apart; infinity stays."""
    return np.where(chord < 2.0, 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)),
                    np.where(np.isinf(chord), np.inf, np.pi))


@dataclass(frozen=True)
@arrays(known="N", straight_tip="N", strays="2 N")
class _PieceMotion:
    """Jets of N pieces by the law of their blocks: tip, axis; `known` where there are any; `straight_tip`
    where the tip is straight and even by the law itself; `strays` (2, N): what the machine may add to it, mm and rad."""

    tip: TaylorVector
    axis: TaylorVector
    known: Bools
    straight_tip: Bools
    strays: Floats

    @classmethod
    def of(cls, motion: Motion, executed: BlockPoses, rows: Ints, pieces: Pieces,
           places: tuple[Floats, Floats, Floats], poses: list[tuple[Floats, Floats]]) -> _PieceMotion:
        """By kind: arcs; tip straight and axis standing; straight in joints; tip straight and rotary joints even."""
        n = len(rows)
        third, value = np.zeros((2, n)), np.zeros((2, 3, 3, n))
        known, straight_tip = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        law = _kinds(motion, executed, rows)
        q0, q1 = (executed.joints(motion, rows, t) for t in (places[0], places[2]))
        for k in groups(motion.tool[rows]):
            kin = executed.kinematics(int(motion.tool[rows[k[0]]]))
            for kind in distinct(law[k]).tolist():
                some = k[law[k] == kind]
                made = _jets(kind, motion, executed, rows[some], pieces.take(some), kin, q0[some], q1[some],
                             [(tip[some], axis[some]) for tip, axis in poses])
                known[some] = made is not None
                straight_tip[some] = kind in (LINE, TIP)
                if made is None:
                    continue
                for i, jet in enumerate(made):
                    third[i, some] = jet.third
                    for d, part in enumerate((jet.value, jet.first, jet.second)):
                        for c in range(3):
                            value[i, d, c, some] = part[c]
        tip, axis = (TaylorVector(list(value[i, 0]), list(value[i, 1]), list(value[i, 2]), third[i]) for i in range(2))
        apart = lengths(value[0, 0].T - poses[1][0])
        off = np.stack(strays(motion, executed, rows, places, law, (poses[0][0], poses[2][0])))
        return cls(tip, axis, known & (apart <= SAME), straight_tip, off)

    def take(self, k: Ints) -> _PieceMotion:
        """Some of the pieces."""
        def some(part: Columns) -> list[Floats | float]:
            return [np.broadcast_to(x, self.known.shape)[k] for x in part]

        jets = [TaylorVector(some(jet.value), some(jet.first), some(jet.second),
                             np.broadcast_to(jet.third, self.known.shape)[k]) for jet in (self.tip, self.axis)]
        return _PieceMotion(jets[0], jets[1], self.known[k], self.straight_tip[k], self.strays[:, k])


def _kinds(motion: Motion, executed: BlockPoses, rows: Ints) -> Ints:
    """(N,) which law the blocks run under."""
    control = executed.control
    laws = [frame.law for frame in motion.frames]
    by_tip = np.array([law == "tcp" for law in laws])[motion.frame[rows]] | (control.base == "tcp")
    in_plane = np.array([law == "tilted" for law in laws])[motion.frame[rows]]
    before = np.where((rows == 0)[:, None], motion.start, motion.end[np.maximum(rows - 1, 0)])
    kin = control.machine.kinematics
    holding = np.array(kin.rotary) | np.array(kin.turns_tool)
    stands = (before[:, holding] == motion.end[rows][:, holding]).all(axis=1)
    kind = np.where(by_tip, TIP, JOINTS)
    kind = np.where(in_plane | (stands & (kin.straight_slides | (by_tip & (control.base != "tcp")))), LINE, kind)
    return np.where(motion.code[rows] == ARC, CIRCLE, kind)


def _jets(kind: int, motion: Motion, executed: BlockPoses, rows: Ints, pieces: Pieces, kin: Kinematics, q0: Floats,
          q1: Floats, poses: list[tuple[Floats, Floats]]) -> tuple[TaylorVector, TaylorVector] | None:
    """(tip, axis) of pieces of one kind; None where the kinematics gives no bound."""
    (tip0, axis0), _, (tip1, _) = poses
    if kind == CIRCLE:
        if not (kin.straight_slides or executed.control.base == "tcp"):
            return None
        return _circle_jets(motion, executed, rows, pieces, tip0, axis0)
    line = straight(list(tip0.T), list(tip1.T))
    if kind == LINE or (kind == TIP and not any(kin.turns_tool)):
        return line, TaylorVector(list(axis0.T))
    if not (kin.tip_jets_proved(executed.control.xyz) if kind == TIP else kin.jets_proved):
        return None
    return (line, kin.jets(q0, q1)[1]) if kind == TIP else kin.jets(q0, q1)


def _circle_jets(motion: Motion, executed: BlockPoses, rows: Ints, pieces: Pieces, tip0: Floats,
                 axis0: Floats) -> tuple[TaylorVector, TaylorVector] | None:
    """Arcs and helices: what the words say, seen from the table, where the slides keep lengths and angles."""
    begin, end = coordinates(motion, rows)
    xyz = executed.control.xyz
    start, stop = begin[:, xyz], end[:, xyz]
    centre, normal, sweep = np.array(start), np.zeros((len(rows), 3)), np.zeros(len(rows))
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(motion.plane[rows] == plane)
        if not len(k):
            continue
        centre[k, i], centre[k, j] = motion.center[rows[k], i], motion.center[rows[k], j]
        first, last = (np.stack([point[k, i] - centre[k, i], point[k, j] - centre[k, j]], axis=1)
                       for point in (start, stop))
        turn = signed_sweep(first, last, motion.ccw[rows[k]])
        normal[k, PLANE_AXIS[plane]], sweep[k] = np.sign(turn), np.abs(turn)
    n = len(rows)
    words = Curves(start, stop, axis0, axis0, np.ones(n, dtype=bool), centre, normal, sweep)
    points = [words.tip_at(pieces.a), words.tip_at(pieces.b), centre, centre + normal]
    seen = executed.at_coordinates(motion, np.tile(rows, 4), np.tile(begin, (4, 1)), np.concatenate(points))
    first, last, middle, up = seen.reshape(4, n, 3)
    n_table = up - middle
    reach = np.maximum(lengths(start - centre), 1.0)
    kept = np.abs(lengths(n_table) - 1.0) < 1e-9
    for point, image in ((points[0], first), (points[1], last)):
        kept &= np.abs(lengths(image - middle) - lengths(point - centre)) < 1e-9 * reach
        kept &= np.abs(((image - middle) * n_table).sum(axis=1) - ((point - centre) * normal).sum(axis=1)) < 1e-9 * reach
    kept &= lengths(first - tip0) <= SAME
    inside = np.einsum("ni,ni->n", first - middle, cross(n_table, last - middle))
    kept &= np.abs(inside - np.einsum("ni,ni->n", points[0] - centre, cross(normal, points[1] - centre))) < 1e-9 * reach**2
    part = Curves(first, last, axis0, axis0, np.ones(n, dtype=bool), middle, n_table,
                  sweep * (pieces.b - pieces.a))
    jet = tip_reference(part, TaylorAngle(np.full(n, 0.5), np.ones(n), np.zeros(n)))
    lost = np.where(kept, 0.0, np.inf)
    return TaylorVector(jet.value, jet.first, jet.second, jet.third + lost), TaylorVector(columns.of_rows(axis0))
