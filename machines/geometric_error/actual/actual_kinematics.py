"""The machine with errors as a `Kinematics`, so that the read-back can move it."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel
from machines.kinematics.base import Kinematics, as_points
from machines.kinematics.frames import spin_about
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class ActualKinematics(Kinematics):
    """`nominal` with the errors of `model`; tables with two approach directions count by their mean.

    Poses are exact, rates are those of the nominal machine (they differ by the size of the errors), `inverse` is the
    corrected one: tip exactly, axis as far as the machine can.
    """

    nominal: Kinematics
    model: ErrorModel

    @property
    def axis_names(self) -> tuple[str, ...]:  # type: ignore[override]  # nothing assigns it
        """Of the nominal machine."""
        return self.nominal.axis_names

    @property
    def rotary(self) -> tuple[bool, ...]:  # type: ignore[override]  # nothing assigns it
        """Of the nominal machine."""
        return self.nominal.rotary

    @property
    def tool_length(self) -> float:  # type: ignore[override]  # nothing assigns it
        """mm"""
        return self.nominal.tool_length

    @property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """Of the nominal machine."""
        return self.nominal.branches

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """Of the nominal machine."""
        return self.nominal.turns_tool

    @property
    def actual(self) -> Actual:
        """The machine with errors."""
        return self.model.on(self.nominal)

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Corrected joints (B, N, J) next to each nominal branch."""
        actual = self.actual
        unit = axis / np.linalg.norm(axis, axis=1, keepdims=True)
        return np.stack([correct(actual, q, tip, unit).q for q in self.nominal.inverse(tip, axis, spin, near)])

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip, axis) of the machine with errors."""
        tip, axis, _ = self.pose(q, near)
        return tip, axis

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, spin) of the machine with errors."""
        actual = self.actual
        tip, axis, side = actual.place(actual.coordinates(as_points(q, self.joints, "q"), near))
        return tip, axis, spin_about(axis, side)

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """Of the nominal machine."""
        return self.nominal.jacobian(q, near)

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """Of the nominal machine."""
        return self.nominal.twist_jacobian(q, near)

    def singular(self, q: Floats) -> Bools:
        """Of the nominal machine."""
        return self.nominal.singular(q)

    def made_with_tool(self, length: float) -> Self:
        """See the base class."""
        return replace(self, nominal=self.nominal.with_tool(length))

    def nearest_axis(self, axis: Floats) -> Floats:
        """Of the nominal machine."""
        return self.nominal.nearest_axis(axis)
