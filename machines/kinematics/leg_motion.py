"""Legs and platform in motion: places, rates and accelerations of both ends of every leg, as plain arrays."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(direction="3", point="3")
class RotaryNext:
    """A rotary axis next to a platform: its joint, its line, in the level platform, or in the machine frame of a table."""

    name: str
    at: int
    direction: Floats
    point: Floats
    at_spindle: bool


@dataclass(frozen=True, eq=False)
@arrays(legs_at="K", points="K 3", directions="K 3", lengths="K", arm="K", stretches="K", carriers_at="M", carriers="M 3",
        gauge="3")
class LegParts:
    """What moves of a machine on K legs, mm.

    Attributes:
        legs_at: (K,) joints of the legs
        points: (K, 3) foot at q = 0, of an arm a point of its axis
        directions: (K, 3) unit vectors of slides, axes of arms
        lengths: (K,) of the rods, of a leg of changing length at q = 0
        arm, stretches: (K,) legs on an arm, legs of changing length; the others are on slides
        carriers_at: (M,) joints of the slides that carry legs and platform, or the part
        carriers: (M, 3) unit vectors, how each moves the tool seen from the part
        gauge: (3,) mm from the reference point of the level platform to the gauge point, all axes at 0
        axes: the rotary axes next to the platform, from the bed to the part, then from the platform to the spindle
    """

    legs_at: Ints
    points: Floats
    directions: Floats
    lengths: Floats
    arm: Bools
    stretches: Bools
    carriers_at: Ints
    carriers: Floats
    gauge: Floats
    axes: tuple[RotaryNext, ...] = ()


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", turn="N 3 3", twist="N 6", acceleration="N 6", rates="N 6 K", arms="N K 3", feet="N K 3",
        foot_rates="N K 3", foot_accelerations="N K 3", end_rates="N K 3", end_accelerations="N K 3", moved="N K 3",
        rods="N K 3", spans="N K", span_rates="N K", span_accelerations="N K")
class LegMotion:
    """N states of a platform on K legs, seen from its carriers.

    Attributes:
        place, turn: C and R of the platform
        twist, acceleration: (v, omega) and (a, alpha) of the platform at C
        rates: the twist per rate of each leg's joint, II-17 of Company 2000
        arms: from C to what turns with the platform at the end of each leg: its joint, or the hinge of its bar
        feet, foot_rates, foot_accelerations: A of each leg
        end_rates, end_accelerations: of B, its other end
        moved: A' per joint rate
        rods: AB, mm
        spans, span_rates, span_accelerations: l
    """

    place: Floats
    turn: Floats
    twist: Floats
    acceleration: Floats
    rates: Floats
    arms: Floats
    feet: Floats
    foot_rates: Floats
    foot_accelerations: Floats
    end_rates: Floats
    end_accelerations: Floats
    moved: Floats
    rods: Floats
    spans: Floats
    span_rates: Floats
    span_accelerations: Floats

    @property
    def along(self) -> Floats:
        """(N, K, 3) e = AB / l."""
        return np.asarray(self.rods / self.spans[:, :, None], dtype=np.float64)
