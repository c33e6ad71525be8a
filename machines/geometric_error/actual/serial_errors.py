"""Errors of a serial machine: six component errors per axis, location errors of its axes, errors of the spindle.

All of them, like all motions, are those of the tool's side of the axis relative to the workpiece's side,
along and about x, y, z of the machine frame, so that primed axes need no rule of their own. With the nominal
motion M_i(q_i) of axis i,

    tip = T_1 T_2 ... T_J S tip_0,   T_i = E_i M'_i,  M'_i = L_i M_i(q_i + z_i) L_i^-1   (turning axes, "fixed" frame)
                                     T_i = M'_i E_i                           (slides; turning axes, "moving" frame)

- L_i, location: moves the line of the axis (about a point of it; for a slide about its reference point) and nothing
  that the axis carries: at q = 0 it has no effect. That is what ISO 230-1 calls the axis average line.
- z_i, zero position (EX0X, EC0C ..., ISO 230-1): the axis stands so much farther along or about its own line
  than it counts, in the sense of the machine axis that it is named after; on a nutated axis too. E_i goes by the count.
- E_i, component errors: displaced, then turned about x, y, z (C 1.14), about the reference point of the axis.
  "fixed" takes their directions on the part's side of the axis, "moving" on its tool's side, as C 1.11 and
  1.14 have it: those of the bed, which ISO 230-1 and ISO 230-7 mean (the probe stands still, the artefact
      turns), are "fixed" for an
  axis that carries the tool, "moving" for one that carries the part. The reference point of a slide travels with it.
- S, spindle: displaces and turns the tool about the gauge point.

C: Oueslati 2004, with the chain of 1.11; the formula without errors is `kinematics/serial.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from machines.geometric_error.actual.lost_motion import GRAIN
from machines.geometric_error.tables.curve_banks import Bank, banks
from machines.geometric_error.tables.curves import Curve, TableCurve
from machines.geometric_error.tables.names import OWN, ErrorName, parse
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass

ErrorFrame = Literal["fixed", "moving"]


@dataclass(frozen=True, eq=False)
class Component:
    """One component error: its name (EXX ...) and how it depends on the position of its axis."""

    name: ErrorName
    curve: Curve


@dataclass(frozen=True, eq=False)
class SerialErrors:
    """The errors of one machine, mm and rad.

    Attributes:
        components: any of the six of any axis; what is not there is 0
        constants: location errors by name, EC0Y ..., those of the spindle as EA0S ...
        reference: (3,) point that the turns of an axis act about, at q = 0, by letter; default the machine
            origin for slides, the point of its line for turning axes
        frame: "fixed" (default) or "moving", by letter of turning axes
    """

    components: tuple[Component, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    reference: Mapping[str, Floats] = field(default_factory=dict)
    frame: Mapping[str, ErrorFrame] = field(default_factory=dict)

    # ---- parameters ----------------------------------------------------------------------------------------

    @property
    def names(self) -> list[str]:
        """P parameters: EXX[0] ..., ECC.cos1 ..., then the constants: EC0Y ..."""
        return [f"{c.name}{label}" for c in self.components for label in c.curve.labels()] + list(self.constants)

    @property
    def values(self) -> Floats:
        """(P,) mm and rad"""
        return np.concatenate([*(c.curve.values for c in self.components), list(self.constants.values())])

    def with_values(self, values: Floats) -> Self:
        """The same errors with other parameters (P,)."""
        sizes = np.cumsum([len(c.curve.values) for c in self.components])
        parts = np.split(np.asarray(values, dtype=np.float64), sizes)
        components = tuple(replace(c, curve=c.curve.with_values(v)) for c, v in zip(self.components, parts, strict=False))
        return replace(self, components=components,
                       constants=dict(zip(self.constants, parts[-1].tolist(), strict=True)))

    @property
    def axes(self) -> set[str]:
        """Letters that any error is of."""
        return {c.name.axis for c in self.components} | {text[-1] for text in self.constants}

    # ---- evaluation ----------------------------------------------------------------------------------------

    def torsors(self, axis: str, x: Floats, direction: Floats | float = 0.0) -> list[Floats | float]:
        """Six component errors of an axis at positions (N,), arrays (N,) or a plain 0.0."""
        result: list[Floats | float] = [0.0] * 6
        for parts, bank in self._banks.get(axis, ()):
            for part, values in zip(parts, bank.at(x, direction), strict=True):
                result[part] = result[part] + values
        return result

    @cached_property
    def _banks(self) -> dict[str, list[tuple[list[int], Bank]]]:
        """By axis: the parts of a torsor that curves of one bank are of."""
        result = {}
        for axis in {c.name.axis for c in self.components}:
            mine = [c for c in self.components if c.name.axis == axis]
            result[axis] = [([mine[k].name.part for k in numbers], bank) for numbers, bank in banks([c.curve for c in mine])]
        return result

    @cached_property
    def _positioning(self) -> dict[str, list[Curve]]:
        """By axis: what has another value by the approach direction along or about the axis."""
        found: dict[str, list[Curve]] = {}
        for c in self.components:
            if c.name.positioning and isinstance(c.curve, TableCurve) and c.curve.both:
                found.setdefault(c.name.axis, []).append(c.curve)
        return found

    def bidirectional(self, names: tuple[str, ...]) -> list[int]:
        """Numbers of the axes `names` that have any error with two approach directions."""
        found = {c.name.axis for c in self.components if isinstance(c.curve, TableCurve) and c.curve.both}
        return [j for j, name in enumerate(names) if name in found]

    def gaps(self, names: tuple[str, ...], q: Floats, joints: list[int]) -> Floats:
        """Lost motion (N, len(joints)) of some axes at q (N, J): how far their positioning error differs by
        the approach direction, and no less than the grain of words."""
        result = np.zeros((len(q), len(joints)))
        for k, j in enumerate(joints):
            for curve in self._positioning.get(names[j], ()):
                result[:, k] += curve.apart_at(q[:, j])
        least = np.array([GRAIN[1 if names[j] in ROTARY else 0] for j in joints])
        return np.asarray(np.maximum(np.abs(result), least))

    def outside(self, names: tuple[str, ...], q: Floats, margin: float = 0.0) -> Bools:
        """True (N, J) where a joint of q (N, J) stands outside what was measured of it, by more than `margin`."""
        result = np.zeros(q.shape, dtype=np.bool_)
        for component in self.components:
            j = names.index(component.name.axis)
            result[:, j] |= component.curve.outside(q[:, j], margin)
        return result

    def location(self, axis: str) -> Floats:
        """(6,) torsor of L_i of an axis, or S of the spindle."""
        result = np.zeros(6)
        for text, value in self.constants.items():
            name = parse(text)
            if name is not None and name.axis == axis and not name.zero_position:
                result[name.part] = value
        return result

    def zero_position(self, axis: str) -> float:
        """z_i of an axis, mm or rad, in the sense of the machine axis of its letter."""
        return self.constants.get(f"E{OWN[axis]}0{axis}", 0.0)
