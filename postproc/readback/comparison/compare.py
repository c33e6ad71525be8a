"""The motion of a program against the CL file: deviation of tip and axis, kind of motion, feed, tool, spindle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.job.job import Job
from postproc.job.places import at_place
from postproc.path.model import FEED, TRAVERSE
from postproc.readback.alignment.align import EndPoses, Lost, aligned
from postproc.readback.alignment.split_as_written import split_as_written
from postproc.readback.comparison.approaches import leads_down
from postproc.readback.comparison.bound_search import DeviationBound
from postproc.readback.comparison.checks import (
    CHUNK,
    block_seconds,
    check_axis_smoothing,
    check_holes,
    check_kinds,
    check_links,
    check_low_rapids,
    check_smoothing,
    check_smoothing_levels,
    check_speeds,
    check_travel,
)
from postproc.readback.comparison.compensated import check_compensated
from postproc.readback.comparison.deviation_bound import deviation_bound
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.free_rotary import check_spins
from postproc.readback.comparison.length_margins import LengthMargin
from postproc.readback.comparison.reach_bounds import check_reach_bounds
from postproc.readback.comparison.rewinds import check_rewinds, rewinds
from postproc.readback.comparison.slow_moves import check_fed_rapids, check_slow
from postproc.readback.comparison.states import check_states
from postproc.readback.comparison.taps import check_taps
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import SAMPLES, BlockPoses, arc_sweeps
from postproc.readback.text.canonical import Canonical
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, as_slice, distinct, repeated, shared, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.rotations import angle_between, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind
from toolpaths.units import DEG


@dataclass(frozen=True)
@arrays(tip="E 3", axis="E 3", match="M", owner="E")
class Comparison:
    """Worst deviations (mm, rad), the CL line and program line of each, the poses and matching they rest on.

    Attributes:
        moves: those of the CL file, rapids split as the program splits them; `match` and `owner` count them without pecks
        worst_tip, worst_axis: the worst of the places that were looked at
        tip_bound, axis_bound: what no block exceeds anywhere, see `deviation_bound`; blocks without a bound
            count by the places that were looked at
        unbounded: how many blocks have no bound, which makes the program checked, not proved
        cuts, bounded_cuts: moves of the CL file at feed, and how many of them have a bound in every block
        executed: what was compared, the words of the program and their motion, so that nothing reads it again
    """

    moves: Moves
    worst_tip: float
    worst_axis: float
    worst_tip_line: tuple[int, int]
    worst_axis_line: tuple[int, int]
    tip: Floats
    axis: Floats
    match: Ints
    owner: Ints
    diagnostics: tuple[Diagnostic, ...]
    tip_bound: float
    axis_bound: float
    unbounded: int
    cuts: int
    bounded_cuts: int
    executed: tuple[Canonical, Motion]
    poses: BlockPoses
    planned: bool
    """the feeds of the program were planned"""
    lengths: tuple[LengthMargin, ...] = ()
    """how much tools may differ from their gauge lengths, where that is not taken up by a register alone"""

    def ends(self, rows: Ints) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) at the ends of blocks."""
        if np.isnan(self.tip[:1]).any():
            return self.poses.poses(self.executed[1], rows, 1.0)
        return self.tip[rows], self.axis[rows]

    def without_poses(self) -> Comparison:
        """The same with NaN in the place of tip and axis, which `ends` then works out."""
        unknown = repeated(np.full(3, np.nan), len(self.owner))
        return replace(self, tip=unknown, axis=unknown)


def compare(code: Canonical, motion: Motion, job: Job, executed: BlockPoses, gcode: str = "",
            planned: bool = False) -> Comparison:
    """Every block on its stretch of the reference, every move done, in order, as the CL file has it, inside travel.

    Faults point into the CL file, or into the program where `gcode` names it. `planned`: its feeds were.
    """
    tolerance, axis_tolerance = job.options.tolerance, job.axis_tolerance
    tip, axis = _ends(motion, executed)
    sweep, faults = arc_sweeps(motion, executed.control), Faults(job.toolpath.file, gcode)
    grain = _grain(job)
    number = rewinds(motion, tip, axis, job.commanded.without_pecks().tip, executed.control.rotary,
                     (2.0 * tolerance, 2.0 * axis_tolerance))
    ends = EndPoses(tip, axis, sweep, np.asarray(number >= 0))
    job = job.with_moves(split_as_written(motion, executed, job, ends, grain))
    moves = job.moves.without_pecks()
    match, owner, lost = aligned(ends, moves, moves.link, tolerance, axis_tolerance, grain)
    allowed = tolerance, axis_tolerance
    diagnostics = [] if lost is None else [_not_reached(motion, moves, match, lost, (tip, axis), allowed, faults)]
    bound = bound_of_blocks(motion, executed, moves, owner, allowed, job.corrects, ends=(tip, axis))
    (worst_tip, tip_line), (worst_axis, axis_line) = _farthest(motion, executed, moves, tip, axis, match, owner, tolerance,
                                                               None if job.corrects else bound.whole)
    diagnostics += _beyond("tip", "mm", worst_tip, tolerance, tip_line, faults)
    diagnostics += _beyond("axis", "degrees", worst_axis / DEG, axis_tolerance / DEG, axis_line, faults)
    if not has_errors(diagnostics):
        diagnostics += _unproved(bound, allowed, moves, motion, owner, faults)
    if bound.unbounded and job.options.require_proof:
        diagnostics.append(faults.error("verify.no_bound", f"{bound.unbounded} of {len(motion)} blocks have no bound of "
                                        "their deviation, they are only checked at places", int(moves.line[0]),
                                        int(motion.line[0]), hint="leave --require-proof out, where checked is enough"))
    diagnostics += check_spins(motion, executed, moves, owner, tip, axis, axis_tolerance, faults)
    bent = job.setup.output.rapids_as_feed and executed.control.rapids == "dog-leg"
    diagnostics += check_kinds(motion, moves, owner, tip, bent, _taken_up(job, motion, tip), faults)
    down = leads_down(motion, moves, owner, tip)
    diagnostics += check_states(motion, job, moves, owner, down, faults)
    diagnostics += check_compensated(motion, job, faults)
    diagnostics += check_holes(motion, job, moves, tip, owner, faults)
    diagnostics += check_taps(motion, job, moves, owner, faults)
    seconds = block_seconds(motion, executed.control, job.controller.feed.arc_inverse == "radius")
    diagnostics += check_speeds(motion, moves, owner, match, seconds, tolerance, faults)
    if not planned:
        diagnostics += check_slow(motion, executed, job, moves, owner, match, tip, seconds, faults)
    diagnostics += check_fed_rapids(motion, executed, job, moves, owner, tip, seconds, down, faults)
    diagnostics += check_links(motion, executed, moves, owner, job.space, tolerance, faults)
    diagnostics += check_low_rapids(motion, executed, job, moves, owner, faults)
    diagnostics += check_rewinds(motion, executed, number, tip, axis, job.space, tolerance,
                                 grain[1] + _kept(job), faults)
    diagnostics += check_travel(motion, executed, moves, owner, faults, at_place(job.places, job.repeats, moves))
    diagnostics += check_reach_bounds(motion, executed, moves, owner, faults)
    diagnostics += check_smoothing(motion, job, moves, owner, faults)
    diagnostics += check_smoothing_levels(code, motion, job, moves, owner, faults)
    diagnostics += check_axis_smoothing(code, motion, job, moves, owner, faults)
    slack = job.toolpath.spline_slack
    return Comparison(job.moves, worst_tip + slack, worst_axis, tip_line, axis_line, tip, axis, match, owner,
                      tuple(diagnostics), max(bound.tip, worst_tip) + slack, max(bound.axis, worst_axis), bound.unbounded,
                      *_cuts(moves, owner, bound), (code, motion), executed, planned)


def _cuts(moves: Moves, owner: Ints, bound: DeviationBound) -> tuple[int, int]:
    """(moves at feed, those of them of which every block has a bound)."""
    cutting = (moves.kind != Kind.RAPID) & ~moves.link
    without = distinct(owner[bound.unbounded_rows])
    return int(cutting.sum()), int(cutting.sum() - cutting[without].sum())


def _grain(job: Job) -> tuple[float, float]:
    """mm and rad below which a move may have vanished in rounding; of cranks rounded angles move the tip."""
    kin, tip = job.machine.kinematics, max(1e-3, 1.5 * job.controller.grain)
    if any(turns and moves for turns, moves in zip(kin.rotary, kin.drives_tip, strict=True)):
        tip = max(tip, min(2.0 * job.rounding.tip, job.options.tolerance))
    return tip, max(1e-6, 1.5 * DEG * 10.0**-job.controller.format.rotary_decimals)


def _ends(motion: Motion, executed: BlockPoses) -> tuple[Floats, Floats]:
    """(tip, axis) (E, 3) at the ends of all blocks."""
    tip, axis = np.empty((len(motion), 3)), np.empty((len(motion), 3))
    for at in range(0, len(motion), CHUNK):
        rows = np.arange(at, min(at + CHUNK, len(motion)))
        tip[rows], axis[rows] = executed.poses(motion, rows, 1.0)
    return tip, shared(axis)


def _kept(job: Job) -> float:
    """rad: what the correction of geometric errors may turn the tool by between blocks, 0 without errors."""
    if job.errors is None:
        return 0.0
    from postproc.correction.compensation import SHARE

    return SHARE * job.axis_tolerance


def _taken_up(job: Job, motion: Motion, tip: Floats) -> Bools:
    """True (K,) for blocks that leave the tip, (K, 3), where it is although axes move: they take up lost
    motion, or the last decimal by which the level of a hole differs from that of the hole before.

    With errors, a rapid that a longer one follows, a feed that a longer feed follows, and a rapid between a
    longer one and a feed (the last part of the path to the plane of a hole) may move it by as much as a level
    in the air, to which the tool came as part of a hole, may be off by.
    """
    travel = np.linalg.norm(np.diff(tip, axis=0, prepend=np.inf), axis=1)
    if job.errors is None:
        return np.asarray(travel <= 2.0 * job.rounding.tip)
    from postproc.correction.compensation import SHARE
    from postproc.correction.cycles import IN_AIR

    still, air = (share * SHARE * job.options.tolerance + 2.0 * job.rounding.tip for share in (1.0, IN_AIR))
    rapid, feed, far = motion.code == TRAVERSE, motion.code == FEED, travel > air
    rapid_next, feed_next = (np.append((code & far)[1:], False) for code in (rapid, feed))
    ends = rapid & np.append(False, (rapid & far)[:-1]) & feed_next
    begins = (rapid & rapid_next) | (feed & feed_next)
    return np.asarray((travel <= still) | ((begins | ends) & ~far))


FIRST, SURELY = 64, 0.999
"""blocks of the largest bounds that are looked at first; share of the worst deviation, bounds below which cannot be it"""
WorstPlace = tuple[float, tuple[int, int]]
"""a deviation and where it is: CL line, program line"""


def _farthest(motion: Motion, executed: BlockPoses, moves: Moves, tip: Floats, axis: Floats, match: Ints, owner: Ints,
              tolerance: float, most: Floats | None) -> tuple[WorstPlace, WorstPlace]:
    """The worst deviations of tip and axis, between the points and at them.

    `most` (2, K): bounds of tip and axis of the blocks that run the moves, None where there are none. In long programs
    blocks whose bounds are below what others are off by are not looked at: none of them is the worst.
    """
    rows = np.flatnonzero(moves.run_by(owner))
    done = as_slice(np.flatnonzero(match >= 0))
    there = as_slice(match[done])
    visit = lengths(tip[there] - moves.tip[done])
    tilt = angle_between(axis[there], moves.axis[done])
    places = place_on_moves(motion, executed, rows, owner, moves)
    off = np.zeros((2, len(rows)))

    def look(k: Ints) -> None:
        off[:, k] = _deviations(motion, executed, moves, rows[k], owner, tolerance, (places[0][k], places[1][k]))
    if most is None or len(rows) <= CHUNK:
        look(np.arange(len(rows)))
    else:
        least = _known_limits(most, moves.arc[owner[rows]] >= 0, tolerance)
        first = np.unique(np.argpartition(-least, FIRST, axis=1)[:, :FIRST])
        look(first)
        worst = np.maximum(off[:, first].max(axis=1), [values.max(initial=0.0) for values in (visit, tilt)])
        look(np.setdiff1d(np.flatnonzero((least >= SURELY * worst[:, None]).any(axis=0)), first, assume_unique=True))
    tip_off, axis_off = off
    at = (owner[rows], np.arange(len(match))[done]), (rows, match[done])
    return _worst((tip_off, visit), *at, moves, motion), _worst((axis_off, tilt), *at, moves, motion)


def _known_limits(most: Floats, arc: Bools, tolerance: float) -> Floats:
    """(2, K) what deviations of blocks are below at all places: bounds `most` from a place of the line that is within the
    tolerance of the tip, among which `Curves.deviation` finds the best; nothing of arcs and of blocks farther off."""
    return np.where(arc | ~(most[0] < tolerance) | np.isnan(most[1]), np.inf, most)


def _not_reached(motion: Motion, moves: Moves, match: Ints, lost: Lost, ends: tuple[Floats, Floats],
                 allowed: tuple[float, float], faults: Faults) -> Diagnostic:
    """No block ends at a point; or the one that stands for it has its tip there, and not its axis."""
    x, y, z = point = moves.tip[lost.move]
    at, line = int(match[lost.move - 1]) if lost.move else 0, int(moves.line[lost.move])
    near = at + np.flatnonzero(lengths(ends[0][at:] - point) <= allowed[0]) if lost.block < 0 else np.array([lost.block])
    off, tilted = lengths(ends[0][near] - point), angle_between(ends[1][near], moves.axis[np.full(len(near), lost.move)])
    row = int(tilted.argmin()) if len(near) else -1
    if row >= 0 and tilted[row] > allowed[1] and off[row] <= allowed[0]:
        return faults.error("verify.axis", f"the program comes to the point ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table "
                            f"frame with a tool axis that is off by {tilted[row] / DEG:.6f} degrees, allowed "
                            f"{allowed[1] / DEG:g} degrees", line, int(motion.line[near[row]]), 1, "do not run this program")
    says, hint = f"the program never comes to the point ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table frame", "a block behind"
    if lost.block >= 0:
        says += f": this block, in its place, ends {off[0]:.6f} mm and {tilted[0] / DEG:.6f} degrees off"
        at, hint = lost.block, "a block at or before"
    return faults.error("verify.not_reached", says, line, int(motion.line[at]), 1, f"{hint} this line is missing "
                        "or wrong, or the program is not made from this CL file with this machine, set-up and tools")


def bound_of_blocks(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints, allowed: tuple[float, float],
                    corrects: bool, judge: bool = False, ends: tuple[Floats, Floats] | None = None) -> DeviationBound:
    """Bounds of every block of the moves that are no links.

    From hole to hole dog-legs that keep their height are looked at in height alone; so are all paths there where geometric
    errors are corrected: a control that drills the holes takes up lost motion on its path. `ends`: tips and axes (E, 3) at
    the ends of all blocks, where they are known.
    """
    rows = np.flatnonzero(moves.run_by(owner))
    begin, share = place_on_moves(motion, executed, rows, owner, moves)
    free = executed.bent(motion, rows) | corrects
    level = (moves.phase[owner[rows]] == Phase.POSITION) & (motion.code[rows] == 0) & free
    level[level] = keeps_level(moves.curves(owner[rows[level]]), allowed[0])
    some = as_slice(np.flatnonzero(~level))
    found = deviation_bound(motion, executed, moves, rows[some], owner[rows[some]], begin[some],
                            share[some], allowed, judge, ends)
    if level.any():
        whole = np.full((2, len(rows)), np.inf)
        whole[:, ~level] = found.whole
        found = replace(found, whole=whole)
    high = rows[level]
    corners = (0.0, 0.5, *executed.corners(motion, high).T) if len(high) else ()
    executed.look_ahead(motion, high, corners)
    for corner in corners:
        tip, _ = executed.poses(motion, high, corner)
        height = float(off_level(moves.curves(owner[high]), tip).max())
        found = replace(found, tip=max(found.tip, height))
    return found


def _unproved(bound: DeviationBound, allowed: tuple[float, float], moves: Moves, motion: Motion, owner: Ints,
              faults: Faults) -> list[Diagnostic]:
    """Errors where a bound is outside the tolerance although no place that was looked at is."""
    found = []
    for what, unit, scale, value, limit, row in (("tip", "mm", 1.0, bound.tip, allowed[0], bound.tip_row),
                                                 ("axis", "degrees", DEG, bound.axis, allowed[1], bound.axis_row)):
        if value > limit * (1.0 + 1e-9):
            found.append(faults.error(f"verify.{what}", f"the {what} may be off by {value / scale:.6f} {unit} between the "
                                      f"places that were looked at, allowed {limit / scale:g} {unit}",
                                      int(moves.line[owner[row]]), int(motion.line[row]), hint="do not run this program"))
    return found


def keeps_level(curve: Curves, tolerance: float) -> Bools:
    """(K,) whether curves end as high along the tool's axis as they begin."""
    return np.asarray(np.abs(((curve.end - curve.start) * curve.axis1).sum(axis=1)) <= tolerance)


def off_level(curve: Curves, tip: Floats) -> Floats:
    """How far (K,) mm tips are above or below the stretch between the ends of curves, along the tool's axis."""
    height, first, last = ((p * curve.axis1).sum(axis=1) for p in (tip, curve.start, curve.end))
    return np.asarray(np.maximum(np.maximum(np.minimum(first, last) - height, height - np.maximum(first, last)), 0.0))


def _deviations(motion: Motion, executed: BlockPoses, moves: Moves, rows: Ints, owner: Ints, within: float,
                places: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Worst (tip, axis) deviation (K,) over samples of each block from the curve of its move; `within` mm of its tip;
    `places`: see `place_on_moves`.

    Where rapids are dog-legs, those from hole to hole that keep their height do only that.
    """
    tip_off, axis_off = np.zeros(len(rows)), np.zeros(len(rows))
    if not len(rows):
        return tip_off, axis_off
    begin, share = places
    level = (moves.phase[owner[rows]] == Phase.POSITION) & executed.bent(motion, rows)
    level[level] = keeps_level(moves.curves(owner[rows[level]]), within)
    for at in range(0, len(rows), CHUNK):
        part = slice(at, at + CHUNK)
        here = rows[part]
        curve = moves.curves(owner[here])
        executed.look_ahead(motion, here, SAMPLES)
        for t in SAMPLES:
            tip, axis = executed.poses(motion, here, t)
            guess = np.minimum(begin[part] + t * share[part], 1.0)
            d, e, _ = curve.deviation(tip, axis, guess, within)
            d = np.where(level[part], off_level(curve, tip), d)
            tip_off[part] = np.fmax(tip_off[part], without_nan(d, np.inf))
            axis_off[part] = np.fmax(axis_off[part], without_nan(e, np.inf))
        for k, shares in executed.looks(motion, here):
            tip, axis = executed.poses(motion, here[k], shares)
            some = moves.curves(owner[here[k]])
            d, e, _ = some.deviation(tip, axis, np.minimum(begin[part][k] + shares * share[part][k], 1.0), within)
            d = np.where(level[part][k], off_level(some, tip), d)
            np.fmax.at(tip_off, at + k, np.nan_to_num(d, nan=np.inf))
            np.fmax.at(axis_off, at + k, np.nan_to_num(e, nan=np.inf))
    return tip_off, axis_off


def place_on_moves(motion: Motion, executed: BlockPoses, rows: Ints, owner: Ints,
           moves: Moves) -> tuple[Floats, Floats]:
    """Where on its move each block (K,) begins, and what part of it it is: by length along arcs, else by count."""
    length = np.ones(len(rows))
    on = np.flatnonzero(((moves.arc >= 0) & ~moves.link)[owner[rows]])
    if len(on):
        (begin, _), (end, _) = (executed.poses(motion, rows[on], t) for t in (0.0, 1.0))
        arc = moves.curves(owner[rows[on]])
        around = arc_sweeps(motion, executed.control)[rows[on]] * np.linalg.norm(arc.start - arc.center, axis=1)
        travel = np.where(np.isnan(around), np.linalg.norm(end - begin, axis=1), around)
        length[on] = np.maximum(np.nan_to_num(travel), 1e-9)
    new = np.diff(owner[rows], prepend=-1) != 0
    start, inverse = np.flatnonzero(new), np.cumsum(new) - 1
    total = np.cumsum(length)
    before = total - length
    whole = np.add.reduceat(length, start)[inverse]
    return (before - before[start][inverse]) / whole, length / whole


def _worst(values: tuple[Floats, Floats], move: tuple[Ints, Ints], block: tuple[Ints, Ints], moves: Moves,
           motion: Motion) -> tuple[float, tuple[int, int]]:
    """(worst value, (CL line, program line)) of two sets of deviations."""
    value, m, b = np.concatenate(values), np.concatenate(move), np.concatenate(block)
    if not len(value):
        return 0.0, (0, 0)
    k = int(value.argmax())
    return float(value[k]), (int(moves.line[m[k]]), int(motion.line[b[k]]))


def _beyond(what: str, unit: str, worst: float, allowed: float, lines: tuple[int, int],
            faults: Faults) -> list[Diagnostic]:
    if worst <= allowed * (1.0 + 1e-9):
        return []
    return [faults.error(f"verify.{what}", f"the {what} is off by {worst:.6f} {unit}, allowed {allowed:g} {unit}", *lines,
                         hint="do not run this program")]
