"""Whether a program that is verified stays where the errors of the machine were measured."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.exchange.volume import measured
from postproc.job.job import Job
from postproc.path.model import TRAVERSE
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.actual import ARC_LOOKS, ActualBlockPoses
from postproc.readback.execution.execute import Motion
from toolpaths.diagnostics import Diagnostic

CORRECTED = 0.1
"""mm or rad by which a correction may leave the range"""


def check_measured(motion: Motion, executed: ActualBlockPoses, job: Job, faults: Faults) -> list[Diagnostic]:
    """A warning for each axis that cuts where its errors were not measured: there those at the end count.

    Conversions look at the nominal joints, before they correct anything.
    """
    rows, names, unit = np.flatnonzero(motion.code != TRAVERSE), job.machine.axis_names, job.control.unit
    beyond, low, high = (np.full((len(rows), len(names)), value) for value in (0.0, np.inf, -np.inf))
    for t in (0.0, *ARC_LOOKS):
        q, near = executed.joints(motion, rows, t), np.concatenate(executed.nominal(motion, rows, t), axis=1)
        for number in np.unique(motion.tool[rows]).tolist():
            k = np.flatnonzero(motion.tool[rows] == number)
            actual = executed.actual(number)
            beyond[k] += actual.outside(actual.coordinates(q[k], near[k]), CORRECTED)
        low, high = np.fmin(low, q), np.fmax(high, q)
    told, known = [], measured(executed.model)
    for j in np.flatnonzero(beyond.any(axis=0)).tolist():
        there = np.flatnonzero(beyond[:, j])
        span = " to ".join(f"{x * unit[j]:.7g}" for x in known.get(names[j], ()))
        told.append(faults.warning(
            "compensation.range", f"{names[j]} goes from {low[there, j].min() * unit[j]:.7g} to "
            f"{high[there, j].max() * unit[j]:.7g} where its errors were not measured" + (
                f": they were from {span}" if span else "") + "; the error at the end of the range was taken for the proof",
            0, int(motion.line[rows[there[0]]]), len(there)))
    return told
