"""Distances that a brochure prints next to travel: where the table's top lies by them, and whether the pivots do too."""

from __future__ import annotations

from collections.abc import Iterator

from machines.key_problem import KeyProblem
from machines.machine import Machine
from machines.sheet.model import DataSheet
from machines.sheet.quantity import WrongFigureError, read_quantity

ODD = "machine.plausible"
APART = (2.0, 0.01)
"""mm, and share of the travel, by which a distance and a travel may differ where brochures round"""
REACH = 500.0
"""mm between a tilting axis and the table's top, where the table's size is not stated"""
SIZES = (0.1, 3.0)
"""of a table, in travels of the slide that goes farthest across it"""
_LEVEL = 0.5


def distances(sheet: DataSheet) -> tuple[tuple[float, float] | None, float]:
    """(least, most) from the spindle's nose to the table's top and the table's size, mm; None and 0 where not stated.

    Raises:
        WrongFigureError: for a text that is no length.
    """
    between = sheet.table_top.spindle_to_table
    ends = sorted(read_quantity(text, "length") for text in between or ())
    size = read_quantity(sheet.table_top.size, "length") if sheet.table_top.size else 0.0
    if ends and ends[0] == ends[1]:
        raise WrongFigureError("spindle_to_table has two equal ends", 'write the least and the most, ["102 mm", "610 mm"]')
    return (ends[0], ends[1]) if ends else None, size


def against_distances(machine: Machine, sheet: DataSheet) -> Iterator[KeyProblem]:
    """What contradicts the distances of the sheet; paths are those of the sheet. Nothing where Z moves the table."""
    between, size = distances(sheet)
    lower, upper = machine.limits.lower, machine.limits.upper
    z = machine.axis_names.index("Z")
    if size:
        yield from _size(machine, size)
    if between is None:
        return
    near, far = between
    travel = float(upper[z] - lower[z])
    if abs(far - near - travel) > max(APART[0], APART[1] * travel):
        says = f"spindle to table goes from {near:g} to {far:g} mm, which is {far - near:g} mm, and Z travels {travel:g} mm"
        yield KeyProblem(ODD, ("table_top", "spindle_to_table"), says,
                         "see to the units of both, and that they are of one machine")
        return
    if "Z" in sheet.table_slides:
        return
    top, reach = float(upper[z]) - far, size / 2.0 or REACH
    for joint in machine.kinematics.chain:
        if joint.rotary and joint.name in sheet.table and abs(float(joint.direction[2])) < _LEVEL:
            above = float(joint.point[2]) - top
            if abs(above) > reach and joint.point[2] < upper[z]:
                says = (f"{joint.name} turns about a line {abs(above):g} mm {'above' if above > 0 else 'below'} the table's "
                        f"top, which lies {far:g} mm below the spindle; tables tilt about a line within {reach:g} mm of it")
                yield KeyProblem(ODD, ("pivots", "points"), says, "see to sign and unit of its Z: machine coordinates, mm, "
                                 "from Z = 0 down")


def _size(machine: Machine, size: float) -> Iterator[KeyProblem]:
    """A table is about as large as the travel across it."""
    across = [j for j, name in enumerate(machine.axis_names) if name in ("X", "Y")]
    longest = max(float(machine.limits.upper[j] - machine.limits.lower[j]) for j in across)
    if not SIZES[0] * longest <= size <= SIZES[1] * longest:
        yield KeyProblem(ODD, ("table_top", "size"), f"the table is {size:g} mm large, X and Y travel {longest:g} mm",
                         "see to its unit: mm or inches")
