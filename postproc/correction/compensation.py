"""Geometric errors of the machine corrected in the blocks of a path.

Every block end gets the joints at which the machine with errors has its tool where the nominal one would have
it. What the nominal control makes of those joints (machine coordinates, tip, tilted plane) is written. Blocks at
one orientation (3+2, arcs, cycles, lines at standing rotary axes) keep one, corrected as a whole. Points are
added, and arcs split into lines, only where the motion between corrected ends would leave the nominal motion
by more than the share of the tolerance that it gets. Home positions are the machine's own and stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.exchange.volume import measured
from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.modes import OutputModes
from postproc.correction.arcs import fitted_arcs
from postproc.correction.backlash_words import Writing, settled
from postproc.correction.cycles import whole_holes
from postproc.correction.error_context import CorrectedEnds, ErrorContext
from postproc.correction.error_sampling import looks_between
from postproc.correction.points import between, divided
from postproc.correction.reversals import Divided, arcs_cut, inserted, starts_of
from postproc.path.model import JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, error, has_errors
from toolpaths.shapes import arrays
from toolpaths.units import DEG

UNCERTAINTY_DIGITS = 500
"""blocks at which the uncertainty of the correction is computed"""
SHARE = 0.1
"""of the tolerances: what the correction may be off between corrected points"""
MOVED = 2
"""how often points are put between ends: words may take ends farther by other approach directions, and blocks
begin by those then"""
ROOM = 1.1
"""by how much wider a tolerance of the axis is advised than what is left of it: rounding and points between take some"""
SETTLED = 5
"""how often the approach directions of the axes are looked for: a correction by new approach directions may
turn other axes back"""


@dataclass(frozen=True)
@arrays(moved="J", owner="L", part="L", apart="A")
class ErrorCorrection:
    """What the correction did to the blocks that it corrects, mm and rad.

    Attributes:
        tip_before, axis_before: worst deviation of the machine with errors at nominal ends of blocks of CL
            moves, and in long ones wherever errors may turn
        tip_after, axis_after: worst deviation at their corrected ends: the residual
        added: points added; resolved: arcs that became lines
        partial: blocks near a pole, whose axis is corrected in part
        moved: (J,) largest correction of each joint
        apart: (K,) True for blocks that no canned cycle may stand for: each has its own correction
        owner, part: block of the nominal path that each block is of, and part of its time
        uncertainty_tip, uncertainty_axis: largest standard deviation that the model's covariance gives; None
            where it has none
    """

    tip_before: float
    axis_before: float
    tip_after: float
    axis_after: float
    added: int
    resolved: int
    partial: int
    moved: Floats
    owner: Ints
    part: Floats
    apart: Bools
    uncertainty_tip: float | None = None
    uncertainty_axis: float | None = None

    def lines(self) -> list[str]:
        """What happened, for header and summary."""
        arcsec = DEG / 3600.0
        return [f"geometric errors corrected: tip {1e3 * self.tip_before:.1f} um, axis {self.axis_before / arcsec:.1f} "
                f"arcsec before, {1e3 * self.tip_after:.2f} um and {self.axis_after / arcsec:.2f} arcsec left",
                f"{self.added} points added, {self.resolved} arcs split into lines, {self.partial} near a singularity",
                *([] if self.uncertainty_tip is None or self.uncertainty_axis is None else
                  [f"uncertainty of the correction (one standard deviation): tip {1e3 * self.uncertainty_tip:.2f} um, axis "
                   f"{self.uncertainty_axis / arcsec:.2f} arcsec"])]


def compensate(path: JointPath, moves: Moves, tools: Ints, kinematics: Callable[[int], Kinematics], model: ErrorModel,
               modes: OutputModes, tolerance: float, axis_tolerance: float, writing: Writing, always: Bools,
               beyond: bool = False, file: str = "") -> tuple[JointPath | None, ErrorCorrection | None, list[Diagnostic]]:
    """The path with corrected joints, points added where they are needed; None where the model does not reach.

    Args:
        tools: (K,) index of the tool of each block
        kinematics: nominal, at the tip of the tool of an index
        tolerance, axis_tolerance: mm and rad of the whole conversion
        writing: how a path is written
        always: (C,) cycles that stay canned cycles: single moves do not replace them
        beyond: True corrects outside the measured range with the error at its end, as linking moves are anyway
    """
    allowed, before_cut = SHARE * tolerance, len(path)

    def work_on(path: JointPath, owner: Ints, mean: bool = False) -> ErrorContext:
        return ErrorContext(path, tools[owner], kinematics, model, axis_tolerance, beyond, SHARE, mean)

    work = work_on(path, np.arange(len(path)))
    cut = arcs_cut(path, work)
    if work.bidirectional:
        cut = _points_by_mean(cut, moves, modes, work_on(cut.path, cut.owner, mean=True), allowed, always)
    path, work = cut.path, work_on(cut.path, cut.owner)
    corrected, found = _at_ends(path, moves, modes, work, allowed, always)
    for k in range(SETTLED if work.bidirectional else 0):
        before = work.approach
        work.take_approaches(corrected, writing.words(corrected), drift=k == 0)
        if np.array_equal(work.approach, before):
            break
        corrected, found = _at_ends(path, moves, modes, work, allowed, always)
    live = ~path.home
    reached = work.reached()
    unmeasured, diagnostics = found.unmeasured | work.unmeasured(*reached), []
    for where, severity in ((live & np.isfinite(path.u), Severity.WARNING if beyond else Severity.ERROR),
                            (live & np.isnan(path.u), Severity.INFO)):
        diagnostics += _unmeasured(path, moves, modes.control, unmeasured & where[:, None], reached, measured(model),
                                   severity, file)
    lost = live & ~np.isfinite(found.q).all(axis=1)
    if has_errors(diagnostics) or lost.any():
        return None, None, diagnostics or [_lost(path, moves, lost, file)]
    tilted = np.where(live & np.isfinite(path.u), found.after[:, 1], 0.0)
    if (tilted > axis_tolerance).any():
        return None, None, [*diagnostics, _tilted(path, moves, tilted, float(found.before[:, 0][tilted > 0.0].max()),
                                                  axis_tolerance, file)]
    whole, written, resolved, axis_left = _written_out(corrected, path, work, writing, allowed)
    corrected, apart = written, work.whole[whole.owner] < 0
    whole = replace(whole, path=corrected).of(cut)
    done = live & np.isfinite(path.u)
    before, after = (x[done].max(axis=0, initial=0.0) for x in (found.before, found.after))
    tip_before, axis_before = np.maximum(before, _before_inside(path, work, done)).tolist()
    tip_after, axis_after = after.tolist()
    uncertainty_tip, uncertainty_axis = _uncertainty(path, live, work, model)
    report = ErrorCorrection(
        tip_before, axis_before, tip_after, max(axis_after, axis_left),
        added=len(corrected) - before_cut, resolved=int(resolved.sum()),
        partial=int(found.partial[live].sum()), moved=np.abs(found.q - path.q).max(axis=0, initial=0.0),
        owner=whole.owner, part=whole.part, apart=apart, uncertainty_tip=uncertainty_tip, uncertainty_axis=uncertainty_axis)
    return corrected, report, diagnostics


def _written_out(corrected: JointPath, path: JointPath, work: ErrorContext, writing: Writing,
                 allowed: float) -> tuple[Divided, JointPath, Bools, float]:
    """The blocks with points between them, their path in words that stand where they should, arcs that became
    lines, and rad left of the axis; again where words take ends farther."""
    again = MOVED
    while True:
        starts = starts_of(corrected, path, work, allowed)
        fitted, resolved = fitted_arcs(corrected, path, work, starts.q, allowed, float(writing.grain.min()))
        whole = divided(fitted, work, starts, allowed)
        written, axis_left, approaches = settled(whole, work, writing, allowed)
        ends = np.flatnonzero(np.append(whole.owner[1:] != whole.owner[:-1], True))
        far = np.flatnonzero(np.abs(written.q[ends] - fitted.q).max(axis=1, initial=0.0) > allowed)
        again -= 1
        if not (again and len(far)):
            return whole, written, resolved, axis_left
        q = corrected.q.copy()
        q[far] = written.q[ends[far]]
        corrected = replace(corrected, q=q)
        work.approach[far[:, None], work.bidirectional] = approaches[ends[far]]
        del starts, fitted, whole, written, approaches  # not to be held next to the next


def _before_inside(path: JointPath, work: ErrorContext, where: Bools) -> Floats:
    """(2,) worst deviations, mm and rad, of nominal joints inside the long blocks that are `where` (K,)."""
    block, worst = np.flatnonzero(where & (np.arange(len(path)) > 0)), np.zeros(2)
    for k, t in looks_between(work.changes(path.q[block - 1], path.q[block])):
        rows = block[k]
        q = work.nominal(rows, t)
        off = work.residual(q, q, rows, work.approach_at(rows, t)).reshape(-1, 2, 3)
        worst = np.fmax(worst, np.fmax.reduce(np.linalg.norm(off, axis=2)))
    return worst


def _points_by_mean(cut: Divided, moves: Moves, modes: OutputModes, work: ErrorContext, allowed: float,
                    always: Bools) -> Divided:
    """The nominal path with the points that the correction by mean approach directions needs, so that the
    approach directions are those of all points."""
    corrected, _ = _at_ends(cut.path, moves, modes, work, allowed, always)
    starts = starts_of(corrected, cut.path, work, allowed)
    block, share, _ = between(corrected, work, starts, allowed)
    return inserted(cut.path, block, share, work.nominal(block, share)).of(cut)


def _at_ends(path: JointPath, moves: Moves, modes: OutputModes, work: ErrorContext, allowed: float,
             always: Bools) -> tuple[JointPath, CorrectedEnds]:
    """The path with its block ends corrected by the approach directions of `work`, holes as a whole; and what
    the correction said."""
    found = _turned_in_travel(work.ends(), path, modes.control, work)
    corrected = framed(replace(path, q=found.q), path, modes, work)
    corrected = replace(corrected, q=unstated(kept_in_travel(corrected.q, path, modes.control), path))
    corrected, work.whole = whole_holes(corrected, path, moves, work, allowed, always)
    return corrected, found


def _turned_in_travel(found: CorrectedEnds, path: JointPath, control: Control,
                      work: ErrorContext) -> CorrectedEnds:
    """The ends with no rotary joint beyond travel that the nominal one keeps: it stands at the end of travel,
    and what the axis is then off by is residual."""
    limits = control.machine.limits
    inside = np.clip(found.q, limits.lower, limits.upper)
    inside = np.where((path.q >= limits.lower) & (path.q <= limits.upper), inside, found.q)
    rows = np.flatnonzero((inside != found.q)[:, work.turning].any(axis=1) & ~path.home)
    if not len(rows):
        return found
    q, after = found.q.copy(), found.after.copy()
    q[rows] = work.at(path.q[rows], rows, work.approach[rows], inside[rows][:, work.turning])
    left = work.residual(path.q[rows], q[rows], rows, work.approach[rows])
    after[rows] = np.linalg.norm(left.reshape(-1, 2, 3), axis=2)
    return replace(found, q=q, after=after)


def kept_in_travel(q: Floats, path: JointPath, control: Control) -> Floats:
    """The joints (K, J), those of linking moves nominal where the nominal one is inside travel and the corrected one not.

    A linking move at the end of travel cuts nothing; a corrected cutting move beyond it is an error of `check_travel`.
    """
    limits = control.machine.limits
    nominal = (path.q >= limits.lower) & (path.q <= limits.upper)
    out = (q < limits.lower) | (q > limits.upper)
    result: Floats = np.where(np.isnan(path.u)[:, None] & nominal & out, path.q, q)
    return result


def unstated(q: Floats, path: JointPath) -> Floats:
    """The joints (K, J), those that a block does not state being those of the block before.

    Blocks that name their axes (after tool changes and home) write no others: the correction of an axis that
    the block after the next moves no more is written where it is stated.
    """
    result = q.copy()
    law = np.array([f.control.law == "axes" for f in path.frames])[path.frame]
    rows = np.flatnonzero(path.state.any(axis=1) & law & (np.arange(len(path)) > 0))
    for k in rows[::-1].tolist():
        if not (path.home[k] or path.home[k - 1]):
            kept = ~path.state[k] & (path.q[k] == path.q[k - 1])
            result[k - 1, kept] = result[k, kept]
    for k in rows.tolist():
        result[k] = np.where(path.state[k], result[k], result[k - 1])
    return result


def framed(path: JointPath, nominal: JointPath, modes: OutputModes, work: ErrorContext) -> JointPath:
    """The path with the tilted planes that belong to its corrected rotary axes."""
    frames, frame, q = list(path.frames), path.frame.copy(), path.q.copy()
    tilted = np.array([f.control.law == "tilted" for f in frames])[path.frame]
    for run in np.unique(work.group[tilted & (work.group >= 0)]).tolist():
        k = np.flatnonzero((work.group == run) & tilted)
        whole = np.flatnonzero(work.group == run)
        if not np.isfinite(path.q[k[0]]).all():  # out of reach, reported by the caller
            continue
        place = path.frames[int(frame[k[0]])].control.place
        new, at = modes.at(place).plane(work.kinematics(int(work.tools[k[0]])), path.q[k[0]])
        if new not in frames:
            frames.append(new)
        frame[k] = frames.index(new)
        q[whole] = work.at(nominal.q[whole], whole, work.approach[whole],
                           np.tile(at[work.turning], (len(whole), 1)))
    return replace(path, q=q, frame=frame, frames=tuple(frames))


def _uncertainty(path: JointPath, live: Bools, work: ErrorContext,
                 model: ErrorModel) -> tuple[float | None, float | None]:
    """Largest standard deviations at up to Uncertainties blocks spread over the path."""
    if model.covariance is None or not live.any():
        return None, None
    rows = np.flatnonzero(live)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, UNCERTAINTY_DIGITS).astype(np.int64))]
    tip, axis = 0.0, 0.0
    for k in groups(work.tools[rows]):
        tool = int(work.tools[rows[k[0]]])
        actual, q = work.actual(tool), path.q[rows[k]]
        w = actual.coordinates(q, np.concatenate(work.kinematics(tool).forward(q), axis=1))
        found = uncertainty(model, actual, w, work.approach[rows[k]])
        tip, axis = max(tip, float(found.tip_worst.max())), max(axis, float(found.axis.max()))
    return tip, axis


# ---- what cannot be done -----------------------------------------------------------------------------------

def _unmeasured(path: JointPath, moves: Moves, control: Control, where: Bools, reached: tuple[Floats, Floats],
                known: dict[str, tuple[float, float]], severity: Severity, file: str) -> list[Diagnostic]:
    """One of each axis that goes where its errors were not measured, `where` (K, J), from and to `reached`
    (K, J); `known`: what was measured of it. Those that are no errors get the error at the end of the range:
    linking moves are INFO."""
    noted, linking = [], " in linking moves" if severity == Severity.INFO else ""
    for j in np.flatnonzero(where.any(axis=0)).tolist():
        rows = np.flatnonzero(where[:, j])
        low, high = reached[0][rows, j].min() * control.unit[j], reached[1][rows, j].max() * control.unit[j]
        lines, name = np.unique(moves.line[path.move[rows]])[:6].tolist(), control.machine.axis_names[j]
        span = " to ".join(f"{x * control.unit[j]:.7g}" for x in known.get(name, ()))
        text = f"{name} goes from {low:.7g} to {high:.7g}{linking} where its errors were not measured" + (
            f": they were from {span}" if span else "")
        if severity != Severity.ERROR:
            noted.append(Diagnostic(severity, "compensation.range", text + "; the error at the end of the range is taken",
                                    file=file, lines=tuple(lines), count=len(rows)))
            continue
        turn = "write repeats = 360 where a whole turn was measured, " if control.machine.rotary[j] else ""
        noted.append(error("compensation.range", text, file=file, lines=lines, count=len(rows),
                           hint=f"{turn}measure farther, move the part, or take --error-model-beyond"))
    return noted


def _tilted(path: JointPath, moves: Moves, tilted: Floats, tip: float, allowed: float, file: str) -> Diagnostic:
    """The error of an axis (K,) rad off at block ends that no joint turns back; `tip`: mm that the correction takes up."""
    off, worst = np.flatnonzero(tilted > allowed), float(tilted.max()) / DEG
    lines = np.unique(moves.line[path.move[off]])
    grain = 10.0 ** (np.floor(np.log10(worst)) - 1.0)
    enough = np.ceil(ROOM * worst / grain) * grain
    return error("compensation.axis", f"the errors turn the tool axis by {worst:.4f} degrees that no axis of this machine "
                 f"turns back, allowed {allowed / DEG:g} degrees; the tip, {1e3 * tip:.1f} um off, is corrected", file=file,
                 lines=lines[:6].tolist(), count=len(off), hint=f"--axis-tolerance {enough:.10g} where the part allows it, "
                 "or correct the machine itself")


def _lost(path: JointPath, moves: Moves, lost: Bools, file: str) -> Diagnostic:
    lines = np.unique(moves.line[path.move[lost]])
    return error("compensation.reach", "the machine cannot go where the correction puts it", file=file,
                 lines=lines[:6].tolist(), count=int(lost.sum()), hint="move the part in the set-up (part.origin)")
