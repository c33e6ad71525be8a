"""Stops and rests of the CL file, which no position shows, in the program."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import Canonical, in_files
from postproc.readback.text.modal import codes
from postproc.reference.events import Spindle, numbers, spindle_after, stops_between, words
from postproc.reference.holes import Phase
from toolpaths.diagnostics import Diagnostic
from toolpaths.units import PER_MINUTE

_ROUNDING = 1e-3
"""s by which a written rest may be shorter"""
_STOPS = (("STOP", 0.0), ("OPSTOP", 1.0))


def check_stops(code: Canonical, motion: Motion, job: Job, faults: Faults) -> list[Diagnostic]:
    """As many stops (M0, M1) as the CL file has, with those that the set-up wants between tools, and no less
    time of rest."""
    result = []
    for word, number in _STOPS:
        lines = [event.line for event in job.toolpath.events if event.word == word]
        if word == "OPSTOP" and job.setup.output.stop_between_tools:
            lines = sorted([*lines, *(change.line for change in stops_between(job.toolpath))])
        blocks = codes(code.words, "M", (number,))[0]
        stated = len(blocks)
        if stated > len(lines):
            where = in_files(code.line[blocks], code.files)
            result.append(faults.warning("verify.stop", f"the program holds M{number:g} {stated} times, the CL file {word} "
                                         f"{len(lines)} times: a stop within a cut marks the part", 0, int(where[0]),
                                         stated - len(lines), "remove the stops that are not intended"))
        if stated < len(lines):
            result.append(faults.error("verify.stop", f"the program holds M{number:g} {stated} times, the CL file {word} "
                                       f"{len(lines)} times", lines[stated], int(motion.line[-1]), len(lines) - stated))
    rests = [*_delays(job), *_at_bottoms(job)]
    asked, found = sum(seconds for seconds, _ in rests), float(motion.dwell.sum())
    if found < asked - _ROUNDING * len(rests) - 1e-9:
        result.append(faults.error("verify.dwell", f"the program dwells for {found:.3f} s, the CL file for {asked:.3f} s",
                                   rests[0][1], int(motion.line[-1])))
    elif found > asked + max(0.01 * asked, _ROUNDING * (len(rests) + 1)):
        rest = int(motion.line[int(motion.dwell.argmax())])
        result.append(faults.warning("verify.rest", f"the program dwells for {found:.3f} s, the CL file for {asked:.3f} s",
                                     0, rest, hint="remove the dwell that is not intended"))
    return result


def _delays(job: Job) -> Iterator[tuple[float, int]]:
    """(s, line) of DELAY records, those in revolutions at the speed then in force."""
    spindle = Spindle()
    for event in job.toolpath.events:
        if event.word == "SPINDL":
            spindle = spindle_after(event, spindle)
        elif event.word == "DELAY" and numbers(event):
            per_second = spindle.rpm * PER_MINUTE if "REV" in words(event) else 1.0
            yield numbers(event)[0] / per_second, event.line


def _at_bottoms(job: Job) -> Iterator[tuple[float, int]]:
    """(s, line) of the rests of drilled holes."""
    moves = job.moves.without_pecks()
    for k in np.flatnonzero(moves.phase == Phase.DRILL).tolist():
        yield job.toolpath.cycles[int(moves.cycle[k])].dwell, int(moves.line[k])
