"""The pivots of a machine by the names that a control has for them, as numbers that an operator can compare."""

from __future__ import annotations

from machines.machine import Machine
from postproc.controllers.model import ControllerFile
from postproc.job.pivot_vectors import PivotVector, pivot_vectors


def pivot_words(machine: Machine, controller: ControllerFile) -> list[str]:
    """A line for each vector between rotary axes, in the control's unit of length; none for machines without."""
    vectors = pivot_vectors(machine)
    mixed = {"table", "tool_to_head"} <= {vector.kind for vector in vectors}
    return [line for line in (_line(controller, vector, mixed) for vector in vectors) if line]


def _line(controller: ControllerFile, vector: PivotVector, mixed: bool) -> str:
    """The vector by the control's names, those of machines with table and head where it is `mixed`; "" without one."""
    text = controller.pivots.named(vector.kind, mixed)
    x, y, z = (controller.lengths.plain(v + 0.0) for v in vector.value.round(9).tolist())
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
