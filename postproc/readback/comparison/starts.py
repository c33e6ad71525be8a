"""Where a program begins and ends: nobody knows where the tool stands when it is started, and it is left at home."""

from __future__ import annotations

import numpy as np

from postproc.control.rollover import off_home
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.tool_changes import AWAY, lifting
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import INCREMENTAL, LAW, Canonical, in_files
from postproc.readback.text.modal import codes
from postproc.readback.text.words import Words
from toolpaths.arrays import Floats, Ints, among, distinct
from toolpaths.diagnostics import Diagnostic


def check_start(code: Canonical, job: Job, faults: Faults) -> list[Diagnostic]:
    """The first motion lifts the tool in machine coordinates, and every axis is stated before the tool comes down.

    Where the control runs the kinematics for the whole program, or no axis lifts the tool by itself, the
    first motion states every axis.
    """
    words, names = code.words, job.machine.axis_names
    moves = _stated(words, names, True)
    if not len(moves):
        return []
    first, machine = int(moves[0]), codes(words, "G", (53,))[0]
    lift = [names[k] for k in lifting(job)]
    here = {a for a in names if first in _stated(words, (a,), False)}
    result = []
    coordinates = job.controller.codes.machine_coordinates
    if not job.control.tip_law and first not in machine:
        result.append(_error(code, faults, first, "the first motion is not in machine coordinates, and nobody knows where "
                             "the tool stands when the program is started",
                             f"lift the tool first: {coordinates} with {' '.join(lift)} at home"))
    elif not set(lift) <= here:
        lacks = ", ".join(a for a in lift if a not in here)
        result.append(_error(code, faults, first, f"the first motion leaves {lacks} where it stands, and nobody knows where "
                             "that is", f"lift the tool first: {' '.join(lift)} at home"))
    down = _comes_down(code, lift, machine, first)
    for a in names if not result else ():
        known = int(_stated(words, (a,), False).min(initial=words.lines + 1))
        if known > down or (known == down and a not in lift):
            result.append(_error(code, faults, down, f"the tool comes down, or a mode is entered, before {a} is stated: "
                                 "nobody knows where that axis stands", f"state {a}, absolutely, before this block"))
            break
    return result


def _comes_down(code: Canonical, lift: list[str], machine: Ints, first: int) -> int:
    """The first block behind `first` that moves a lifting axis in work coordinates, or switches a mode on."""
    words = code.words
    blocks = _stated(words, tuple(lift), True)
    at, law = words.pick(LAW)
    laws = at[np.array([one.name != "axes" for one in code.laws] + [False])[law.astype(np.int64)]]
    both = np.concatenate([blocks[~np.isin(blocks, machine)], laws])
    return int(both[both > first].min(initial=words.lines + 1))


def _stated(words: Words, names: tuple[str, ...], relative: bool) -> Ints:
    """Blocks with words of axes, absolute ones or relative ones too."""
    letters = [ord(a) + d for a in names for d in ((0, INCREMENTAL) if relative else (0,))]
    return distinct(words.line[among(words.letter, letters)])


def _error(code: Canonical, faults: Faults, block: int, message: str, hint: str) -> Diagnostic:
    line = int(in_files(code.line[block:block + 1], code.files)[0])
    return faults.error("verify.start", message, 0, line, 1, hint)


def check_end(motion: Motion, job: Job, home: Floats, faults: Faults) -> list[Diagnostic]:
    """The tool is lifted to home at the end; axes that stand elsewhere are a warning."""
    away = off_home(job.machine, job.control.rolls, motion.end[-1], home)
    axes, names = lifting(job), job.machine.axis_names
    bad = [int(j) for j in np.flatnonzero(~(away <= AWAY))]
    if job.corrects:
        return []
    lifted = [names[j] for j in bad if j in axes]
    if lifted:
        return [faults.error("verify.end", f"the program ends with {', '.join(lifted)} away from home", 0,
                             int(motion.line[-1]), 1, "the retract to home before the end is missing")]
    rest = ", ".join(names[j] for j in bad)
    return [faults.warning("verify.end", f"the program ends with {rest} away from home", 0, int(motion.line[-1]), 1,
                           "ignore this if it is intended")] if rest else []
