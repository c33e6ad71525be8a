"""Errors of rotary axes along and about x, y, z of the bed, as ISO 230-1 and ISO 230-7 have them.

With R(q) the turn of the tool's side of an axis, e_fixed = R e_moving for displacements and, to first order,
for turns, where the point that the turns act about lies on the axis. So a component in one frame is a sum of
three in the other, times the entries of R; its parameters are theirs.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual_map import part_side
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame
from machines.geometric_error.tables.curves import EVERYWHERE, Curve, Fourier, TableCurve
from machines.geometric_error.tables.names import DIRECTIONS, ErrorName
from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation
from toolpaths.shapes import arrays

NONE = 1e-12
"""an entry of a turn below this everywhere is 0"""
ON_LINE = 1e-6
"""mm that a reference point may lie next to its axis"""


@dataclass(frozen=True, eq=False)
@arrays(direction="3")
class RotatedCurve(Curve):
    """Sum of curves of one axis, each times an entry of the axis's turn.

    Attributes:
        parts: (entry (row, column) of the turn, component)
        direction: (3,) that the axis turns about
        back: True takes the turn in the other direction
    """

    parts: tuple[tuple[tuple[int, int], Component], ...]
    direction: Floats
    back: bool

    @property
    def curves(self) -> list[Curve]:
        """Of its components."""
        return [component.curve for _, component in self.parts]

    @property
    def detail(self) -> float:
        """See the base class: that of its curves, and a quarter of a turn."""
        return min(0.5 * np.pi, *(curve.detail for curve in self.curves))

    @property
    def most(self) -> float:
        """See the base class: entries of a turn are at most 1."""
        return sum(curve.most for curve in self.curves)

    @property
    def steepest(self) -> float:
        """See the base class: entries of a turn change by at most 1 per rad."""
        return sum(curve.steepest + curve.most for curve in self.curves)

    @property
    def apart(self) -> float:
        """See the base class."""
        return sum(curve.apart for curve in self.curves)

    @cached_property
    def values(self) -> Floats:  # type: ignore[override]  # nothing assigns it
        """(P,) of all its curves."""
        return np.concatenate([curve.values for curve in self.curves])

    @cached_property
    def range(self) -> tuple[float, float]:  # type: ignore[override]  # nothing assigns it
        """Where all its curves hold."""
        ends = [curve.range for curve in self.curves]
        return max(low for low, _ in ends), min(high for _, high in ends)

    @property
    def both(self) -> bool:
        """True where any has two approach directions."""
        return any(isinstance(curve, TableCurve) and curve.both for curve in self.curves)

    @cached_property
    def period(self) -> float:
        """A turn where all repeat after one; else 0."""
        whole = all(isinstance(c, TableCurve | Fourier) and abs(c.period - 2.0 * np.pi) < NONE for c in self.curves)
        return 2.0 * np.pi if whole and self.range == EVERYWHERE else 0.0

    def labels(self) -> list[str]:
        """Those of its curves."""
        return [label for curve in self.curves for label in curve.labels()]

    def basis(self, x: Floats, direction: Floats) -> Floats:
        """See the base class."""
        turn = rotation(self.direction, -x if self.back else x)
        return np.concatenate([turn[:, i, j, None] * component.curve.basis(x, direction)
                               for (i, j), component in self.parts], axis=1)


def bed_side(machine: Machine, letter: str) -> ErrorFrame:
    """The side of a rotary axis that the bed is on."""
    return "moving" if letter in part_side(machine.kinematics, machine.structure) else "fixed"


def in_bed_frame(model: ErrorModel, machine: Machine) -> tuple[list[Component], dict[str, ErrorFrame]]:
    """(components, frame by rotary axis): those of axes in another frame turned into that of the bed.

    Axes whose reference point lies off their line stay as they are.
    """
    frame = dict(model.axes.frame)
    components: list[Component] = []
    for letter in dict.fromkeys(c.name.axis for c in model.axes.components):
        mine = {c.name.part: c for c in model.axes.components if c.name.axis == letter}
        side = bed_side(machine, letter)
        if letter not in ROTARY or frame.get(letter, "fixed") == side or not on_line(model, machine, letter):
            components += mine.values()
            continue
        components += _turned(letter, mine, machine.kinematics.axis_line(letter)[0], back=side == "moving")
        frame[letter] = side
    return components, frame


def _turned(letter: str, mine: dict[int, Component], direction: Floats, back: bool) -> list[Component]:
    at = np.abs(rotation(direction, np.array([0.7, 2.1, -1.3])))
    zero, one = at.max(axis=0) < NONE, np.abs(at - 1.0).max(axis=0) < NONE
    found = []
    for part in range(len(DIRECTIONS)):
        group, i = 3 * (part // 3), part % 3
        parts = tuple(((i, j), mine[group + j]) for j in range(3) if group + j in mine and not zero[i, j])
        if parts:
            alone = len(parts) == 1 and one[parts[0][0]]
            found.append(parts[0][1] if alone else Component(ErrorName(part, False, letter),
                                                             RotatedCurve(parts, direction, back)))
    return found


def on_line(model: ErrorModel, machine: Machine, letter: str) -> bool:
    """True where the errors of a rotary axis act about a point of its own line."""
    reference = model.axes.reference.get(letter)
    if reference is None:
        return True
    direction, point = machine.kinematics.axis_line(letter)
    return float(np.linalg.norm(np.cross(reference - point, direction))) <= ON_LINE
