"""What is left of geometric errors at the points of the CL file, in the program as it is read back."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from postproc.base.group_rows import groups
from postproc.correction.compensation import ErrorCorrection
from postproc.correction.runs import RowRuns
from postproc.correction.written_deviation import AfterFormatting
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.readback.comparison.compare import Comparison
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

LOOKS = 500
"""blocks at which lost motion is weighed"""
SLACK = 1e-6, 1e-9
"""mm and rad beyond a bound that are numbers' own: errors change by as much over a last decimal"""


class CorrectedConversion(Protocol):
    """What is looked at of a conversion."""

    @property
    def job(self) -> Job | None:
        """The reference."""

    @property
    def moves(self) -> Moves | None:
        """That are written."""

    @property
    def path(self) -> JointPath | None:
        """Corrected."""

    @property
    def nominal(self) -> JointPath | None:
        """Before correction."""

    @property
    def compensation(self) -> ErrorCorrection | None:
        """What was corrected."""

    @property
    def comparison(self) -> Comparison | None:
        """What the program does."""


def after_formatting(result: CorrectedConversion) -> AfterFormatting | None:
    """The deviations of a conversion that corrects geometric errors; None of one that does not or that is not proved.

    CL points are where the tool cuts to: ends of feed moves and arcs, bottoms of holes; as the path before correction has
    them, which --smooth may have moved and whose axis may have been led past a singular direction. The bound
    adds what the correction itself leaves (near poles, and where a machine cannot turn the tool), half a last
    decimal in every word (`rounding_bound`), and for joints that lose motion a whole one: rounded words may
    turn one back by that much, within its play.
    """
    found, comparison, job = result.compensation, result.comparison, result.job
    path, nominal = result.path, result.nominal
    if found is None or comparison is None or job is None or result.moves is None or path is None or nominal is None:
        return None
    moves = planned_moves(job, result.moves, nominal)
    tip_play, axis_play = _play(job, path)
    bounds = found.tip_after + job.rounding.tip + tip_play, found.axis_after + job.rounding.axis + axis_play
    block = _nearest(comparison, moves, (bounds[0] + SLACK[0], bounds[1] + SLACK[1]))
    points = np.flatnonzero(_cl_points(moves) & (block >= 0))
    tip = np.linalg.norm(comparison.tip[block[points]] - moves.tip[points], axis=1)
    axis = angle_between(comparison.axis[block[points]], moves.axis[points])
    return AfterFormatting(tip, axis, points, block[points], *bounds)


def planned_moves(job: Job, moves: Moves, path: JointPath) -> Moves:
    """The moves without pecks, ending at tip and axis (M, 3) of the path before correction."""
    block = last_blocks(path, len(moves))
    move, tip, axis = np.flatnonzero(block >= 0), np.array(moves.tip), np.array(moves.axis)
    for k in groups(moves.tool[move]):
        tip[move[k]], axis[move[k]] = job.kinematics(int(moves.tool[move[k[0]]])).forward(path.q[block[move[k]]])
    return replace(moves, tip=tip, axis=axis).without_pecks()


def last_blocks(path: JointPath, moves: int) -> Ints:
    """(M,) the block of a path that ends each of its moves; -1 where none does."""
    rows, result = np.flatnonzero((path.u == 1.0) & ~path.home), np.full(moves, -1)
    np.maximum.at(result, path.move[rows], rows)
    return result


def beyond_bound(found: AfterFormatting | None, job: Job) -> list[Diagnostic]:
    """A warning where points of the CL file are farther off than `after_formatting` counts on."""
    if found is None:
        return []
    tip, axis = found.tip - found.tip_bound, found.axis - found.axis_bound
    off = np.flatnonzero((tip > SLACK[0]) | (axis > SLACK[1]))
    if not len(off):
        return []
    arcsec = DEG / 3600.0
    k = int(off[np.argmax(np.maximum(tip / SLACK[0], axis / SLACK[1])[off])])
    lines = job.moves.without_pecks().line[found.points]
    rest = np.setdiff1d(lines[off], lines[k]).tolist()
    return [warning("geometric_errors.bound", f"errors corrected, {len(off)} of {len(lines)} CL points are farther off than "
                    f"the bound: tip {1e3 * found.tip[k]:.2f} um of {1e3 * found.tip_bound:.2f} um, axis "
                    f"{found.axis[k] / arcsec:.2f} arcsec of {found.axis_bound / arcsec:.2f} arcsec at the worst of them",
                    file=job.toolpath.file, lines=[int(lines[k]), *rest[:5]], count=len(off),
                    hint=("an axis turns back by less than it loses; " if job.bidirectional else "")
                    + "more decimals in the controller's [format] help")]


def _play(job: Job, path: JointPath) -> tuple[float, float]:
    """(mm, rad) that a last decimal of the words of joints with lost motion comes to, at up to LOOKS blocks."""
    joints = job.bidirectional
    rows = np.flatnonzero(~path.home)
    if not joints or not len(rows):
        return 0.0, 0.0
    q = path.q[rows[np.unique(np.linspace(0, len(rows) - 1, LOOKS).astype(np.int64))]]
    step = (job.grid.grain / job.control.unit)[joints]
    worst = [0.0, 0.0]
    for number in {tool.number for tool in job.toolpath.tools}:
        rates = job.kinematics_of(number).jacobian(q)[:, :, joints]
        for k, part in enumerate((rates[:, :3], rates[:, 3:])):
            worst[k] = max(worst[k], float((np.linalg.norm(part, axis=1) @ step).max()))
    return worst[0], worst[1]


def _cl_points(moves: Moves) -> Bools:
    return np.asarray((moves.kind != Kind.RAPID) & ((moves.hole < 0) | (moves.phase == Phase.DRILL)))


def _nearest(comparison: Comparison, moves: Moves, bounds: tuple[float, float]) -> Ints:
    """(M,) the block that ends nearest to each move's end, by `bounds` mm and rad; -1 where the move has none.

    Those that come into question: its own, and all from the end of the move before to that of the move after: a point where
    lost motion is taken up, or one within the tolerance of the end, may have passed for the end.
    """
    own, done = np.flatnonzero(comparison.owner < len(moves)), np.flatnonzero(comparison.match >= 0)
    at = comparison.match[done]
    other = np.concatenate([[0], at, [len(comparison.tip)]])
    first = other[np.searchsorted(at, at)]
    count = np.maximum(other[np.searchsorted(at, at, side="right") + 1] - first, 0)
    near = RowRuns(first, count)
    block, owner = np.concatenate([own, near.rows, at]), np.concatenate([comparison.owner[own], done[near.of_rows], done])
    tip_off = np.linalg.norm(comparison.tip[block] - moves.tip[owner], axis=1)
    axis_off = angle_between(comparison.axis[block], moves.axis[owner])
    order = np.lexsort((np.maximum(tip_off / bounds[0], axis_off / bounds[1]), owner))
    best = order[np.diff(owner[order], prepend=-1) > 0]
    result = np.full(len(moves), -1)
    result[owner[best]] = block[best]
    return result
