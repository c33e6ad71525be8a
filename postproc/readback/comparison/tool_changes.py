"""Tool changes: where the machine stands, and that nothing turns or flows."""

from __future__ import annotations

import numpy as np

from postproc.control.rollover import off_home
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import LOADED, REGISTER, Canonical, in_files
from postproc.readback.text.modal import codes, fill
from postproc.reference.events import tool_loads
from toolpaths.arrays import Floats, Ints, distinct
from toolpaths.diagnostics import Diagnostic

AWAY = 0.01
"""mm or degrees next to home that rounding explains"""


def check_changes(code: Canonical, motion: Motion, job: Job, home: Floats,
                  faults: Faults) -> list[Diagnostic]:
    """Tools are changed at home (by the retract axis, where the machine has one), spindle stopped, coolant off.

    `home` (J,) in machine coordinates, mm and degrees. Spindle and coolant count with the words of the block itself.
    """
    changes = distinct(code.words.pick(LOADED)[0])
    if not len(changes):
        return []
    before = np.searchsorted(motion.block, changes) - 1
    place = np.where((before >= 0)[:, None], motion.end[np.maximum(before, 0)], motion.start)
    axes = lifting(job)
    away = off_home(job.machine, job.control.rolls, place, home)[:, axes]
    away = np.where(np.isfinite(away), away, np.inf)
    spindle, coolant = _on(code, (3, 4, 5), 5.0, changes), _on(code, (7, 8, 9), 9.0, changes)
    lines = in_files(code.line[changes], code.files)
    result, near = _others(code, job, faults), AWAY + correction(job, place, motion.tool[np.maximum(before, 0)])[:, axes]
    far = (away > near).any(axis=1)
    where = _distance(job, axes, away[int(far.argmax())]) if far.any() else ""
    for bad, what, hint in (
            (far, f"the tool is changed away from home{where}", "the retract to home before it is missing"),
            (spindle != 5.0, "the tool is changed while the spindle turns", "M5 before it"),
            (coolant != 9.0, "the tool is changed while coolant flows", "M9 before it")):
        if bad.any():
            result.append(faults.error("verify.tool_change", what, 0, int(lines[int(bad.argmax())]), int(bad.sum()), hint))
    return result


def correction(job: Job, place: Floats, tool: Ints) -> Floats:
    """(N, J) mm or degrees next to home that the correction of geometric errors explains.

    A retract as high as home is corrected, home itself is not. It is what the machine with errors needs at
    the places (N, J), its lost motion included.
    """
    if job.errors is None or not job.corrects:
        return np.zeros(place.shape)
    from machines.geometric_error.actual.correction import correct

    control, gauge, names = job.control, job.machine.kinematics, job.machine.axis_names
    bidirectional, result = job.errors.axes.bidirectional(names), np.zeros(place.shape)
    for number in np.unique(tool).tolist():
        k = np.flatnonzero((tool == number) & np.isfinite(place).all(axis=1))
        kin, words = job.kinematics_of(number), place[k] - control.work_offset
        q = control.joints(words, gauge, 0.0)
        found = correct(job.errors.on(kin), q, *kin.forward(q), beyond=True).q
        result[k] = np.abs(np.nan_to_num(control.words(found, gauge, 0.0) - words))
        result[k[:, None], bidirectional] += job.errors.axes.gaps(names, q, bidirectional) * control.unit[bidirectional]
    return result


def _others(code: Canonical, job: Job, faults: Faults) -> list[Diagnostic]:
    """The first tool, or length register, that is another than the CL file's next; taking one again is no change."""
    loads = tool_loads(job.toolpath)
    wanted = [("tool", LOADED, [(said.number, said.line) for said, _, _ in loads])]
    if job.control.length_on_z:
        wanted.append(("length register", REGISTER, [(register, said.line) for said, register, _ in loads]))
    result = []
    for what, letter, asked in wanted:
        blocks, values = code.words.pick(letter)
        order = np.argsort(blocks, kind="stable")
        blocks, values = blocks[order][values[order] >= 0.0], values[order][values[order] >= 0.0]
        new = np.flatnonzero(np.diff(values, prepend=-1.0) != 0.0)
        changes = [one for k, one in enumerate(asked) if k == 0 or asked[k - 1][0] != one[0]]
        wrong = next(((k, one) for k, one in zip(new.tolist(), changes, strict=False) if values[k] != one[0]), None)
        if wrong is not None:
            k, (number, line) = wrong
            block = int(in_files(code.line[blocks[k:k + 1]], code.files)[0])
            result.append(faults.error("verify.tool", f"{what} {values[k]:g} is taken, it should be {number}", line, block))
    return result


def lifting(job: Job) -> Ints:
    """Columns that have to be at home: the retract axis, or all of them."""
    lift = job.machine.retract_axis
    return np.array([lift] if lift >= 0 and not job.control.tip_law else range(len(job.machine.axis_names)))


def _distance(job: Job, axes: Ints, away: Floats) -> str:
    k = int(away.argmax())
    return f": {job.machine.axis_names[axes[k]]} is {away[k]:.3f} next to it"


def _on(code: Canonical, numbers: tuple[float, ...], off: float, blocks: Ints) -> Floats:
    """The M code of a group in force at each of the blocks; a change of tool itself switches nothing."""
    return fill(*codes(code.words, "M", numbers), code.words.lines, off)[blocks]
