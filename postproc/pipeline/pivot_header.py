"""The pivots that a proof stands on, for the header of its program."""

from __future__ import annotations

from postproc.compile.program import Program
from postproc.job.job import Job
from postproc.job.pivot_vectors import pivot_vectors
from postproc.job.pivot_words import pivot_words


def pivot_lines(job: Job, program: Program) -> list[str]:
    """A heading and a line for each vector between rotary axes; none for machines without."""
    if not pivot_vectors(job.machine):
        return []
    by_control = job.control.base == "tcp" or any(section.law != "axes" for section in program.sections)
    said = "the control must hold" if by_control else "the words are made for"
    return [f"pivots that {said}, in machine coordinates, all axes at 0, anywhere along each axis:",
            *pivot_words(job.machine, job.controller)]
