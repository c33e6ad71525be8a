"""The error model of a machine: its parameters, what is known of their uncertainty, and the machine that they make."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Literal, Self

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.actual_legs import ActualLegs
from machines.geometric_error.actual.actual_map import ActualByMap
from machines.geometric_error.actual.actual_rods import ActualDelta, ActualTilting, rods_of
from machines.geometric_error.actual.actual_serial import ActualSerial
from machines.geometric_error.actual.actual_series import ActualSeries
from machines.geometric_error.actual.leg_frame import leg_frame
from machines.geometric_error.actual.rods import RodErrors, gives_rods, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.tables.curves import least_apart
from machines.geometric_error.tables.lattice import ErrorMap
from machines.kinematics.base import Kinematics
from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.kinematics.rod_platform import RodPlatform
from machines.kinematics.serial import Serial
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CorrectedBy = Literal["post", "control"]
BLOCK = 2048
"""points at a time where a matrix per point and parameter is needed"""


@dataclass(frozen=True, eq=False)
@arrays(covariance="#names #names")
class ErrorModel:
    """Errors of one machine. Zero parameters give exactly the nominal machine.

    Attributes:
        axes: errors of axes and spindle
        rods: dimensions of a parallel machine, where it is one
        map: error map; then `axes` and `rods` are empty
        covariance: (P, P) of `values`, mm and rad; None where nothing is known
        corrected_by: who corrects, the post-processor or the control; never both
        name, machine: of the file, and the machine it was made for ("" any)
        large: True where errors above 1 mm or 0.5 degrees are meant, which else are refused when files are read
    """

    axes: SerialErrors = field(default_factory=SerialErrors)
    rods: RodErrors | None = None
    map: ErrorMap | None = None
    covariance: Floats | None = None
    corrected_by: CorrectedBy = "post"
    name: str = ""
    machine: str = ""
    large: bool = False

    @property
    def names(self) -> list[str]:
        """P parameters, in the order that `Actual.sensitivity` has them."""
        if self.map is not None:
            return self.map.names
        return ([] if self.rods is None else self.rods.names) + self.axes.names

    @property
    def values(self) -> Floats:
        """(P,) mm and rad"""
        if self.map is not None:
            return self.map.values
        return np.concatenate([[] if self.rods is None else self.rods.values, self.axes.values])

    def with_values(self, values: Floats) -> Self:
        """The same model with other parameters (P,); the covariance stays."""
        if self.map is not None:
            return replace(self, map=self.map.with_values(values))
        if self.rods is None:
            return replace(self, axes=self.axes.with_values(values))
        split = len(self.rods.values)
        return replace(self, rods=self.rods.with_values(values[:split]),
                       axes=self.axes.with_values(values[split:]))

    def zero(self) -> Self:
        """The same parameters, all 0."""
        return self.with_values(np.zeros(len(self.names)))

    def detail(self, names: tuple[str, ...]) -> Floats:
        """(J,) mm or rad that the axes `names` may go between two looks, so that no error is overlooked."""
        result = np.full(len(names), np.inf)
        for component in self.axes.components:
            j = names.index(component.name.axis)
            result[j] = min(result[j], component.curve.detail)
        for letter, (nodes, _) in () if self.map is None else zip(self.map.letters, self.map.closed(),
                                                                  strict=True):
            mine = [j for j, name in enumerate(names) if name == letter or (letter in "xyz" and name not in "ABC")]
            result[mine] = np.minimum(result[mine], least_apart(nodes))
        return result

    def on(self, kinematics: Kinematics) -> Actual:
        """The machine with these errors, at the tip of the kinematics' tool.

        Raises:
            ValueError: where the model is not one for this kind of machine; the message says why.
        """
        _check_axes(kinematics, self.axes)
        nominal = kinematics.with_errors(Forms(self.axes, self.rods))
        if self.map is None:
            return nominal
        unknown = [x for x in self.map.letters if x not in (*kinematics.axis_names, "x", "y", "z")]
        if unknown:
            raise ValueError(f"the map's coordinate {unknown[0]!r} is not an axis of this machine; it has "
                             f"{', '.join(kinematics.axis_names)}, and x y z of the point that is displaced")
        return ActualByMap(nominal, self.map)


@dataclass(frozen=True)
class Forms:
    """The forms of `ErrorForms` with the errors of a model."""

    axes: SerialErrors
    rods: RodErrors | None

    def chain(self, kinematics: Serial) -> Actual:
        """See `ErrorForms`."""
        if self.rods is not None:
            raise ValueError("the model has dimensions of legs, this machine has none")
        return ActualSerial(kinematics, self.axes)

    def translating_rods(self, kinematics: OnLegs) -> Actual:
        """See `ErrorForms`."""
        return ActualDelta(self._rods_of(rods_of(kinematics)), self.axes, kinematics=kinematics)

    def tilting_rods(self, kinematics: LegsWithAxis) -> Actual:
        """See `ErrorForms`."""
        rods = self._legs_of(kinematics.on_legs) if kinematics.on_rods is None else self._rods_of(kinematics.on_rods)
        return ActualTilting(rods, self.axes, kinematics=kinematics)

    def legs(self, kinematics: OnLegs) -> Actual:
        """See `ErrorForms`."""
        return ActualLegs(kinematics, self._legs_of(kinematics), self.axes)

    def in_series(self, kinematics: LegsInSeries) -> Actual:
        """See `ErrorForms`."""
        return ActualSeries(kinematics, self._legs_of(kinematics.on_legs), self.axes)

    def _legs_of(self, kinematics: OnLegs) -> RodErrors:
        zero = leg_frame(kinematics).zero
        rods = zero if self.rods is None else self.rods
        _same_rods(rods, zero.legs, zero.rods)
        return rods

    def _rods_of(self, platform: RodPlatform) -> RodErrors:
        rods, slides = self.rods, platform.axis_names[: len(platform.legs.points)]
        none = (1.0,) * len(slides)  # no errors: any will do
        pairs = () if gives_rods(platform) else none if rods is None else rods.pairs
        own = rod_names(rod_frame(platform, pairs), slides)
        rods = RodErrors.none(slides, own, pairs) if rods is None else rods
        _same_rods(rods, slides, own)
        return rods


def _same_rods(rods: RodErrors, legs: tuple[str, ...], own: tuple[str, ...]) -> None:
    if rods.legs != legs or rods.rods != own:
        raise ValueError(f"the model's legs are {', '.join(rods.legs)}, those of this machine {', '.join(legs)}")


def _check_axes(kinematics: Kinematics, axes: SerialErrors) -> None:
    known = kinematics.axes_with_errors
    for letter in sorted(axes.axes - {*known, "S"}):
        kind = "axis" if known == kinematics.axis_names else "rotary axis"
        raise ValueError(f"the model has errors of {letter}, which is no {kind} of this machine; "
                         f"it has {', '.join(known) or 'none'}")


@dataclass(frozen=True)
@arrays(tip="N 3", tip_worst="N", axis="N")
class Uncertainty:
    """Standard deviations that the covariance of a model gives at places of a path.

    Attributes:
        tip: (N, 3) mm along x, y, z of the table frame
        tip_worst: (N,) mm in the direction of greatest uncertainty
        axis: (N,) rad of the tool axis, in the direction of greatest uncertainty
    """

    tip: Floats
    tip_worst: Floats
    axis: Floats


def uncertainty(model: ErrorModel, actual: Actual, w: Floats, direction: Floats | None = None) -> Uncertainty:
    """Predicted uncertainty (one standard deviation) of tip and axis at w (N, 3 + R): J Sigma J^T, first order.

    Raises:
        ValueError: where the model has no covariance.
    """
    if model.covariance is None:
        raise ValueError("the error model has no covariance")
    tip, worst, axis = np.empty((len(w), 3)), np.empty(len(w)), np.empty(len(w))
    for first in range(0, len(w), BLOCK):
        part = slice(first, first + BLOCK)
        rows = actual.sensitivity(w[part], None if direction is None else direction[part])
        half = (rows.reshape(-1, rows.shape[2]) @ model.covariance).reshape(rows.shape)  # one product of matrices, not N
        spread = half @ np.swapaxes(rows, 1, 2)
        tip[part] = np.sqrt(np.maximum(np.diagonal(spread[:, :3, :3], axis1=1, axis2=2), 0.0))
        worst[part] = np.sqrt(np.maximum(np.linalg.eigvalsh(spread[:, :3, :3])[:, -1], 0.0))
        _, along, _ = actual.place(w[part])
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        axis[part] = np.sqrt(np.maximum(np.linalg.eigvalsh(across @ spread[:, 3:, 3:] @ across)[:, -1], 0.0))
    return Uncertainty(tip, worst, axis)
