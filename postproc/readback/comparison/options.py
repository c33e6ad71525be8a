"""Options of the control that the machine file says are not fitted: a program that uses one would stop with an alarm."""

from __future__ import annotations

import numpy as np

from machines.choices import BoughtOption
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import coordinates
from postproc.readback.text.canonical import CURVE, LAW, SMOOTH, Canonical, in_files
from postproc.readback.text.modal import codes
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic

RISES = 1e-6
"""mm of an arc that rises"""
M29 = (29.0,)


def check_options(code: Canonical, motion: Motion, job: Job, faults: Faults) -> list[Diagnostic]:
    """Modes, smoothing, rigid taps, helices of a program for a control that has them not, cubics for one that is not known
    to have them."""
    options = job.machine.options
    names = np.array([one.name for one in code.laws] + [""])
    at, law = code.words.pick(LAW)
    used: dict[BoughtOption, Ints] = {
        "tilted_planes": at[names[law.astype(np.int64)] == "tilted"],
        "tip_control": at[names[law.astype(np.int64)] == "tcp"],
        "smoothing": _smoothed(code) if not job.controller.program.exact_path else np.zeros(0, dtype=np.int64),
        "rigid_tapping": codes(code.words, "M", M29)[0] if job.controller.cycles.floating else np.zeros(0, dtype=np.int64)}
    lines = {name: in_files(code.line[blocks], code.files) for name, blocks in used.items() if len(blocks)}
    lines["splines"] = in_files(code.line[_unstated_curves(code, job)], code.files)
    helices = np.flatnonzero((motion.code == 2) & (np.abs(_rise(motion, job)) > RISES))
    if len(helices):
        lines["helical"] = motion.line[helices]
    return [faults.error("verify.option", f"the program uses an option that the control does not have by the machine "
                         f"file: {name} = false", 0, int(found[0]), len(found), "convert again, or state the option under "
                         "[control] of the machine file where it is fitted")
            for name, found in lines.items() if len(found) and (options.absent(name) or name == "splines")]


def _unstated_curves(code: Canonical, job: Job) -> Ints:
    """Blocks that run splines otherwise, by coefficients or by control points, than the machine file says that it can."""
    blocks, curve = code.words.pick(CURVE)
    options = job.machine.options
    if not options.confirmed("splines"):
        return blocks
    number = code.splines[curve.astype(np.int64)] if len(code.splines) else np.full(len(blocks), -1)
    return np.asarray(blocks[(number >= 0) != options.control_points])


def _smoothed(code: Canonical) -> Ints:
    """Blocks that switch the control's smoothing on."""
    blocks, value = code.words.pick(SMOOTH)
    return np.asarray(blocks[np.isfinite(value) & (value > 0.0)], dtype=np.int64)


def _rise(motion: Motion, job: Job) -> Floats:
    """(E,) mm that blocks move along the axis of their plane."""
    xyz = job.control.xyz
    if (xyz < 0).any() or not (motion.code == 2).any():
        return np.zeros(len(motion))
    every = np.arange(len(motion))
    before, end = coordinates(motion, every)
    third = xyz[np.clip(2 - (motion.plane - 17), 0, 2)]
    return np.asarray((end - before)[every, third])
