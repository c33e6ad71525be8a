"""The pivots that a proof stands on, as numbers that an operator can compare with the control's, for its header."""

from __future__ import annotations

from postproc.compile.program import Program
from postproc.job.job import Job
from postproc.job.pivot_vectors import PivotVector, pivot_vectors


def pivot_lines(job: Job, program: Program) -> list[str]:
    """A line for each vector between rotary axes; none for machines without."""
    vectors = pivot_vectors(job.machine)
    if not vectors:
        return []
    by_control = job.control.base == "tcp" or any(section.law != "axes" for section in program.sections)
    said = "the control must hold" if by_control else "the words are made for"
    mixed = {"table", "tool_to_head"} <= {vector.kind for vector in vectors}
    lines = [line for line in (_line(job, vector, mixed) for vector in vectors) if line]
    return [f"pivots that {said}, in machine coordinates, all axes at 0, anywhere along each axis:", *lines]


def _line(job: Job, vector: PivotVector, mixed: bool) -> str:
    """The vector by the control's names, those of machines with table and head where it is `mixed`; "" without one."""
    text = job.controller.pivots.named(vector.kind, mixed)
    x, y, z = (job.controller.lengths.plain(v + 0.0) for v in vector.value.round(9).tolist())
    said = text.format(x=x, y=y, z=z)
    return f"{_between(vector)}: {said}" if said else ""


def _between(vector: PivotVector) -> str:
    """From where to where, in words."""
    if vector.kind == "table":
        return f"from zero to {vector.end}"
    if vector.kind == "tool_to_head":
        return f"from the gauge point to {vector.end}"
    if vector.kind in ("closing_table", "closing_head"):
        return "closing"
    return f"from {vector.origin} to {vector.end}"
