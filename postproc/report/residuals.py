"""The residual field of a conversion: what geometric errors do at each CL point, before and after their correction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from machines.geometric_error.actual.actual import approach
from machines.geometric_error.actual.model import uncertainty
from postproc.base.group_rows import groups
from postproc.pipeline.result import PostResult
from postproc.reference.holes import Phase
from postproc.verification.residual_errors import last_blocks, planned_moves
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

UM, ARCSEC = 1e-3, DEG / 3600.0
DIRECTION = 1e-9
"""mm or rad of a joint that count as motion"""


@dataclass(frozen=True)
@arrays(line="M", tip="M 3", axis="M 3", q="M J", before="M 6", after="M 6")
class Residuals:
    """What geometric errors do at M CL points (ends of cuts, bottoms of holes) of a written program, in the part frame.

    Attributes:
        line: (M,) of the CL file; tip, axis: (M, 3) wanted, mm
        q: (M, J) nominal joints, mm and rad
        before, after: (M, 6) tip and axis of the machine with errors less wanted ones, mm and 1: commanded
            nominal joints, and commanded the program as it was read back
        tip_bound, axis_bound: what may be left, mm and rad (see `after_formatting`)
    """

    line: Ints
    tip: Floats
    axis: Floats
    q: Floats
    before: Floats
    after: Floats
    tip_bound: float
    axis_bound: float
    title: str


def residuals(result: PostResult) -> Residuals | None:
    """The field of a conversion; None of one whose errors were not corrected here, or that is not proved."""
    found, job, nominal = result.after_formatting, result.job, result.nominal
    if (found is None or job is None or job.errors is None or nominal is None or result.moves is None
            or result.comparison is None):
        return None
    moves, move = planned_moves(job, result.moves, nominal), np.flatnonzero(result.moves.phase != Phase.PECK)[found.points]
    block, here = last_blocks(nominal, len(result.moves))[move], found.points
    q, travel = nominal.q[block], approach(_steady(nominal.q))[block]
    before = np.empty((len(q), 6))
    for k in groups(moves.tool[here]):
        kinematics = job.kinematics(int(moves.tool[here[k[0]]]))
        actual, wanted = job.errors.on(kinematics), np.concatenate(kinematics.forward(q[k]), axis=1)
        before[k] = np.concatenate(actual.aim(actual.coordinates(q[k], wanted), travel[k]), axis=1) - wanted
    there = result.comparison
    after = np.concatenate([there.tip[found.blocks] - moves.tip[here], there.axis[found.blocks] - moves.axis[here]], axis=1)
    part, name = job.placement.inverse(), result.toolpath.name or Path(result.toolpath.file).stem
    before, after = (np.concatenate([part.directions(x[:, :3]), part.directions(x[:, 3:])], axis=1) for x in (before, after))
    return Residuals(moves.line[here], part.points(moves.tip[here]), part.directions(moves.axis[here]), q, before, after,
                     found.tip_bound, found.axis_bound, f"{name} on {result.machine.name}, errors of {job.errors.name}")


def tip_uncertainty(result: PostResult, rows: Ints) -> Floats | None:
    """What is not known of the error at places of the field of a conversion, before as after correction.

    Args:
        rows: (K,) of `residuals`

    Returns:
        (K,) mm, one standard deviation of the tip in the direction in which it is greatest; None where the error model has
        no covariance, or there is no field.
    """
    found, job, nominal = result.after_formatting, result.job, result.nominal
    if (found is None or job is None or job.errors is None or job.errors.covariance is None or nominal is None
            or result.moves is None):
        return None
    moves, move = planned_moves(job, result.moves, nominal), np.flatnonzero(result.moves.phase != Phase.PECK)[found.points]
    block, tool = last_blocks(nominal, len(result.moves))[move[rows]], moves.tool[found.points[rows]]
    q, travel, worst = nominal.q[block], approach(_steady(nominal.q))[block], np.empty(len(rows))
    for k in groups(tool):
        kinematics = job.kinematics(int(tool[k[0]]))
        actual = job.errors.on(kinematics)
        wanted = np.concatenate(kinematics.forward(q[k]), axis=1)
        worst[k] = uncertainty(job.errors, actual, actual.coordinates(q[k], wanted), travel[k]).tip_worst
    return worst


def _steady(q: Floats) -> Floats:
    """Joints (N, J), steps that are numbers' own left out."""
    result: Floats = np.round(np.nan_to_num(q) / DIRECTION) * DIRECTION
    return result


def as_csv(found: Residuals, result: PostResult) -> str:
    """A table of the field, a row for each CL point; units in its header."""
    turns = np.array(result.machine.rotary)
    joints = [f"{letter} [{'deg' if turning else 'mm'}]" for letter, turning in
              zip(result.machine.axis_names, turns, strict=True)]
    parts = [f"d{x} [um]" for x in "xyz"] + [f"d{x} [arcsec]" for x in "ijk"]
    head = ["line", "x [mm]", "y [mm]", "z [mm]", "i", "j", "k", *joints, *(f"before {name}" for name in parts), *parts]
    units = np.repeat((UM, ARCSEC), 3)
    values = np.column_stack([found.line, found.tip, found.axis, found.q / np.where(turns, DEG, 1.0), found.before / units,
                              found.after / units]) + 0.0
    form = ",".join(["%d", *["%.6f"] * (6 + len(joints)), *["%.4f"] * 12])
    notes = [f"# {found.title}", "# x y z, i j k and differences (actual less wanted) along the axes of the part frame; "
             "joints nominal", "# before: nominal joints commanded; after: the program as it is read back"]
    return "\n".join([*notes, ",".join(head), *(form % tuple(row) for row in values.tolist()), ""])
