"""Arcs with which cutter compensation begins or ends in a program that is read back, and those out of its plane."""

from __future__ import annotations

import numpy as np

from postproc.control.control import Control
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from toolpaths.diagnostics import Diagnostic

STILL = 1e-7
"""mm in the plane below which a block moves along Z alone"""
OFF = 40


def check_compensated(motion: Motion, job: Job, faults: Faults) -> list[Diagnostic]:
    """Arcs under G41 and G42, or behind G40, where the controller cannot run them (`postproc.writing.compensated`)."""
    rules, arc = job.controller.cutter_compensation, motion.code == 2
    changes = np.flatnonzero(np.diff(motion.compensation, prepend=np.int8(OFF)))
    if not len(changes):
        return []
    leads = np.array([_lead(motion, job.control, int(k)) for k in changes])
    leads = np.unique(leads[leads < len(motion)])
    leads, ends = leads[arc[leads]], motion.compensation[leads[arc[leads]]] == OFF
    across = np.flatnonzero(arc & (motion.compensation != OFF) & (motion.plane != 17))
    noted = ((leads[~ends & ~np.bool_(rules.begins_on_arc)], "cutter compensation begins on an arc, which this controller "
              "cannot"),
             (leads[ends & ~np.bool_(rules.ends_on_arc)],
              "cutter compensation ends on an arc, which this controller cannot"),
             (across, "an arc out of the XY plane while cutter compensation is on"))
    return [faults.error("verify.cutcom_arc", said, 0, int(motion.line[rows[0]]), len(rows),
                         hint="a straight move must lead to the contour and away from it" if rows is not across else
                         "G40 before it") for rows, said in noted if len(rows)]


def _lead(motion: Motion, control: Control, row: int) -> int:
    """The first row from `row` on that moves in the plane of the words; the number of rows where none does."""
    while row < len(motion) and motion.code[row] != 2 and not _planar(motion, control, row):
        row += 1
    return row


def _planar(motion: Motion, control: Control, row: int) -> bool:
    """True where a straight block moves X or Y of its words."""
    before = motion.end[row - 1] if row else motion.start
    frame = motion.frames[int(motion.frame[row])]
    plane = [int(j) for j in control.xyz[:2] if j >= 0]
    words = frame.coordinates(np.stack([before, motion.end[row]]))[:, plane]
    return bool((np.abs(words[1] - words[0]) > STILL).any())
