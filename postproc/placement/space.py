"""Places that the set-up allows: six coordinates, each fixed, in a range or one of a list; the part on its table.

A place is a vector (6,): x, y, z of the set-up's `point` in the table frame (mm), then turn, tilt_y, tilt_x (rad) with
R = Rz(turn) Ry(tilt_y) Rx(tilt_x).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Literal, get_args

import numpy as np

from postproc.placement.reasons import BeyondTable
from postproc.setup.model import PartPlacement, Placement
from postproc.setup.place import PlaceBox, PlacementLimits
from toolpaths.arrays import Floats, box_corners
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation, squared
from toolpaths.shapes import arrays
from toolpaths.units import DEG

PlaceName = Literal["x", "y", "z", "turn", "tilt_y", "tilt_x"]
NAMES: tuple[PlaceName, ...] = get_args(PlaceName)
ANGLES = 3
"""coordinates from this one on are angles"""
FINE = (1e-3, 1e-3, 1e-3, 1e-3 * DEG, 1e-3 * DEG, 1e-3 * DEG)
"""mm, rad: places are multiples of these, so that a set-up file states them as they are planned"""
_TURN_SEED = 15.0 * DEG
_TILT_SEEDS = 3
_MOST_ATTITUDES = 96


@dataclass(frozen=True)
class Dimension:
    """One coordinate: from `low` to `high`, or only `values` where there are any."""

    name: PlaceName
    low: float
    high: float
    values: tuple[float, ...] = ()

    @property
    def free(self) -> bool:
        """True where there is a choice."""
        return len(self.values) > 1 or (not self.values and self.high > self.low)

    @property
    def full(self) -> bool:
        """True for a whole turn."""
        return self.name in NAMES[ANGLES:] and self.high - self.low > 2.0 * np.pi - 1e-9

    def wound(self, value: float) -> float:
        """An angle by whole turns to where it lies in the range, if it does; a length as it is."""
        if self.name not in NAMES[ANGLES:]:
            return value
        middle = 0.5 * (self.low + self.high)
        return float(value - 2.0 * np.pi * np.round((value - middle) / (2.0 * np.pi)))

    def snapped(self, value: float, fine: float) -> float:
        """The nearest value that is allowed."""
        if self.values:
            return min(self.values, key=lambda other: abs(other - value))
        if not self.free:
            return self.low
        if self.full and not self.low <= value <= self.high:
            value = self.wound(value)
        return float(min(max(np.round(value / fine) * fine, self.low), self.high))

    def holds(self, value: float) -> bool:
        """True where the value is allowed."""
        if self.values:
            return any(abs(value - other) < 1e-9 for other in self.values)
        return self.low - 1e-9 <= value <= self.high + 1e-9


@dataclass(frozen=True)
@arrays(point="3", corners="8 3", now="6")
class Space:
    """All places that the set-up allows.

    Attributes:
        dims: six coordinates
        point (3,): of the part frame, placed by x, y, z
        table: box in the table frame or None
        corners (8, 3): of the part in its own frame
        now (6,): the place that [part] of the set-up says
    """

    dims: tuple[Dimension, ...]
    point: Floats
    table: PlaceBox | None
    corners: Floats
    now: Floats

    @property
    def free(self) -> list[int]:
        """Coordinates with a choice."""
        return [k for k, one in enumerate(self.dims) if one.free]

    def placement(self, place: Floats) -> Placement:
        """T_table_part of a place (6,)."""
        turn = matrix(place[ANGLES:])
        return Placement(turn, np.asarray(place[:ANGLES] - turn @ self.point))

    def snapped(self, place: Floats) -> Floats:
        """The nearest place (6,) that is allowed; fixed coordinates exactly as they are."""
        return np.array([one.snapped(float(v), fine) for one, v, fine in zip(self.dims, place, FINE, strict=True)])

    def holds(self, place: Floats) -> bool:
        """True where every coordinate is allowed and the part is on its table."""
        inside = all(one.holds(float(v)) for one, v in zip(self.dims, place, strict=True))
        return inside and not self.overhang(place)

    def overhang(self, place: Floats) -> BeyondTable | None:
        """By how much the part stands beyond its table, None where it does not."""
        if self.table is None:
            return None
        corners = self.placement(place).points(self.corners)
        over = np.stack([np.array(self.table.low) - corners.min(axis=0), corners.max(axis=0) - np.array(self.table.high)])
        worst = float(over.max())
        if worst <= 1e-6:
            return None
        return BeyondTable(worst, "xyz"[int(over.max(axis=0).argmax())])

    def room(self, angles: Floats) -> tuple[Floats, Floats]:
        """Least and greatest x, y, z (3,) of a part turned by `angles` (3,) so that it stays on its table;
        low > high where it does not fit."""
        low = np.array([min(one.values) if one.values else one.low for one in self.dims[:ANGLES]])
        high = np.array([max(one.values) if one.values else one.high for one in self.dims[:ANGLES]])
        if self.table is None:
            return low, high
        corners = (self.corners - self.point) @ matrix(angles).T
        return (np.maximum(low, np.array(self.table.low) - corners.min(axis=0)),
                np.minimum(high, np.array(self.table.high) - corners.max(axis=0)))

    def attitudes(self) -> list[Floats]:
        """Angles (3,) to begin with: all that are listed, else some over each range, the present one first."""
        seeds = [_seeds(one, float(now)) for one, now in zip(self.dims[ANGLES:], self.now[ANGLES:], strict=True)]
        every = [np.array(angles) for angles in product(*seeds)]
        step = -(-len(every) // _MOST_ATTITUDES)
        return every[::step]

    def neighbours(self, place: Floats, steps: Floats) -> Iterator[Floats]:
        """Places (6,) one step (6,) up and down each free coordinate; the next of a list where there is one."""
        for k in self.free:
            for link in (1, -1):
                other = place.copy()
                values = sorted(self.dims[k].values)
                if values:
                    at = values.index(min(values, key=lambda v: abs(v - place[k]))) + link
                    if not 0 <= at < len(values):
                        continue
                    other[k] = values[at]
                else:
                    other[k] += link * steps[k]
                other = self.snapped(other)
                if not bool((other == place).all()):
                    yield other

    def part(self, place: Floats) -> PartPlacement:
        """What [part] of a set-up says for a place; quarter turns as 0, 1, -1."""
        made = self.placement(place)
        x, y = (tuple(squared(made.rotation)[:, k].tolist()) for k in (0, 1))
        return PartPlacement(origin=tuple((np.round(made.origin, 9) + 0.0).tolist()), x_axis=x, y_axis=y)


def space_of(limits: PlacementLimits, now: Placement, extent: tuple[Floats, Floats]) -> Space:
    """The places that a set-up allows.

    Args:
        now: where [part] has it
        extent: least and greatest x, y, z (3,) of what is cut, in the part frame
    """
    point = np.array(limits.point)
    place = np.concatenate([now.points(point[None])[0], angles_of(now.rotation)])
    dims = [_dimension(name, limits, float(value)) for name, value in zip(NAMES, place, strict=True)]
    place[ANGLES:] = [one.wound(float(v)) for one, v in zip(dims[ANGLES:], place[ANGLES:], strict=True)]
    box = (np.array(limits.part.low), np.array(limits.part.high)) if limits.part else extent
    return Space(tuple(dims), point, limits.table, box_corners(*box), place)


def _dimension(name: PlaceName, limits: PlacementLimits, now: float) -> Dimension:
    angle = name in NAMES[ANGLES:]
    unit = DEG if angle else 1.0
    found = getattr(limits, name)
    if name == "turn" and limits.turns:
        values = tuple(v * DEG for v in dict.fromkeys(limits.turns))
        return Dimension(name, min(values), max(values), values)
    if found is None:
        return Dimension(name, now, now)
    low, high = found[0] * unit, found[1] * unit
    if limits.step is not None and name in "xy":
        count = int(np.floor((high - low) / limits.step + 1e-9)) + 1
        return Dimension(name, low, high, tuple((low + limits.step * np.arange(count)).tolist()))
    return Dimension(name, low, high)


def _seeds(one: Dimension, now: float) -> list[float]:
    if one.values or not one.free:
        values = list(one.values) or [one.low]
    else:
        steps = int(np.ceil((one.high - one.low) / _TURN_SEED - 1e-9)) + 1 if one.name == "turn" else _TILT_SEEDS
        values = np.linspace(one.low, one.high, max(2, steps)).tolist()[:-1 if one.full else None]
        values += [now] if one.holds(now) and all(abs(now - v) > 1e-9 for v in values) else []
    return sorted(values, key=lambda v: (abs(v - now) > 1e-9, v))


def matrix(angles: Floats) -> Floats:
    """Rz(turn) Ry(tilt_y) Rx(tilt_x) (3, 3) of angles (3,); exactly the unit matrix where all are 0."""
    turn, tilt_y, tilt_x = (rotation(np.eye(3)[k], np.array([angle]))[0] for k, angle in zip((2, 1, 0), angles, strict=True))
    return np.asarray(turn @ tilt_y @ tilt_x)


def angles_of(turned: Floats) -> Floats:
    """turn, tilt_y, tilt_x (3,) of a rotation (3, 3); where x stands upright tilt_x is 0."""
    level = float(np.hypot(turned[0, 0], turned[1, 0]))
    tilt_y = np.arctan2(-turned[2, 0], level)
    if level < 1e-9:
        return np.array([np.arctan2(-turned[0, 1], turned[1, 1]), tilt_y, 0.0])
    return np.array([np.arctan2(turned[1, 0], turned[0, 0]), tilt_y, np.arctan2(turned[2, 1], turned[2, 2])])
