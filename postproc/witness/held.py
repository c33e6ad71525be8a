"""What holds a platform besides its rods, from a machine file: hinges at the feet of legs, passive legs through a joint;
bars whose rods have errors, which turn about their hinges until those are nearest to their lengths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.text import Array

ARM = 100.0
"""mm by which a turn that is held counts"""


@dataclass(frozen=True)
class HeldPlatform:
    """Hinges (normal, foot, platform joint) (3, 3) each; passive legs (joint of the bed, a point of the leg, its line, outer
    and inner axis of the joint) (5, 3) each, platform level; rad by which those axes are off a right angle."""

    hinges: tuple[Array, ...] = ()
    passive: tuple[Array, ...] = ()
    square: tuple[float, ...] = ()

    @property
    def any(self) -> bool:
        """True where something is held."""
        return bool(self.hinges or self.passive)

    def misses(self, gauge: Array, back: Array, platform: Array, axis: Array) -> list[tuple[Array, Array]]:
        """(mm (N,) by which it is missed, how that changes as the platform turns about the tool axis) of each thing held.

        Of gauge points (N, 3) that stand at `back` (N or 1, 3) on platforms (N, 3, 3), tool axes (N, 3).
        """
        found = []
        for normal, foot, joint in self.hinges:
            own = _turned(platform, joint - back)
            found.append(((gauge + own - foot) @ normal, np.cross(axis, own) @ normal))
        for (point, joint, line, hinge, first), square in zip(self.passive, self.square, strict=True):
            own = _turned(platform, joint - back)
            apart = point - gauge - own
            for across in (first, np.cross(line, first)):
                side = _turned(platform, across[None])
                found.append(((apart * side).sum(axis=1),
                              (apart * np.cross(axis, side)).sum(axis=1) - (np.cross(axis, own) * side).sum(axis=1)))
            inner = _turned(platform, first[None])
            found.append((ARM * (inner @ hinge - np.sin(square)), ARM * np.cross(axis, inner) @ hinge))
        return found


def _turned(platform: Array, v: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", platform, np.broadcast_to(v, (len(platform), 3))))


def held(kinematics: dict[str, Any], legs: dict[str, dict[str, Any]]) -> HeldPlatform:
    """Of a table `[kinematics]` and the tables of its legs by letter."""
    passive = kinematics.get("passive", {}).values()
    return HeldPlatform(
        tuple(np.array([unit(np.array(leg["hinge"], np.float64)), leg["point"], leg["joint"]]) for leg in legs.values()
              if leg.get("hinge")), tuple(map(_passive, passive)), (0.0,) * len(passive))


def _passive(one: dict[str, Any]) -> Array:
    line, hinge = unit(np.array(one.get("line", (0.0, 0.0, 1.0)))), unit(np.array(one["hinge"], np.float64))
    return np.array([one["point"], one.get("joint", (0.0, 0.0, 0.0)), line, hinge, unit(np.cross(line, hinge))])


def wrongly_held(nominal: HeldPlatform, names: list[str], given: dict[str, Any], mm: float,
                 turned: Callable[[Any], Array]) -> HeldPlatform:
    """Passive legs with the errors of a model's `[passive]` tables by their `names`; hinges of legs go with their rods.

    Args:
        turned: (3, 3) of three turns about x, y, z in the unit of the file
    """
    passive, square = [], []
    for name, (point, joint, line, hinge, first) in zip(names, nominal.passive, strict=True):
        own = given.get(name, {})
        turn, near = turned(own.get("line_turn", (0.0, 0.0, 0.0))), joint - (joint @ line) * line
        near = near + mm * np.array(own.get("joint", (0.0, 0.0, 0.0)))
        point = point + mm * np.array(own.get("point", (0.0, 0.0, 0.0)))
        hinge = turned(own.get("hinge_turn", (0.0, 0.0, 0.0))) @ hinge
        passive.append(np.array([point, near, turn @ line, hinge, turn @ first]))
        square.append(float(turned((0.0, 0.0, own.get("square", 0.0)))[1, 0]))
    return HeldPlatform((), tuple(passive), tuple(np.arcsin(square)))


@dataclass(frozen=True)
class Bars:
    """Of each rod its bar (-1 none), the hinge's line on the platform, its joint from the hinge, turned with the line."""

    of: Array
    lines: Array
    joints: Array

    def start(self, platform: Array) -> Array:
        """(R, N) rad at which bars keep their direction on platforms (N, 3, 3)."""
        skew = np.stack([platform[:, j, i] - platform[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        return np.asarray(-np.arctan2(self.lines @ skew.T, np.trace(platform, axis1=1, axis2=2) - 1.0))

    def ends(self, rod: int, platform: Array, swing: Array) -> tuple[Array, Array]:
        """((N, 3) mm from the hinge to the joint of a rod, the same per rad) of bars turned by `swing` (N,)."""
        line, joint = self.lines[rod], self.joints[rod]
        along, side = (line @ joint) * line, np.cross(line, joint)
        turned = along + np.cos(swing)[:, None] * (joint - along) + np.sin(swing)[:, None] * side
        moved = np.cos(swing)[:, None] * side - np.sin(swing)[:, None] * (joint - along)
        return np.einsum("nij,nj->ni", platform, turned), np.einsum("nij,nj->ni", platform, moved)

    def freed(self, off: Array, slope: Array, swung: Array) -> tuple[Array, Array, Array, Array]:
        """(off and slope (R, N) less what the bars take up by turning, rad by which they turn for that (R, N) each)."""
        by_off, by_slope = np.zeros(off.shape), np.zeros(off.shape)
        for bar in set(self.of[self.of >= 0].tolist()):
            rows = self.of == bar
            steep = np.maximum((swung[rows] ** 2).sum(axis=0), 1e-300)
            by_off[rows] = (swung[rows] * off[rows]).sum(axis=0) / steep
            by_slope[rows] = (swung[rows] * slope[rows]).sum(axis=0) / steep
        return off - swung * by_off, slope - swung * by_slope, by_off, by_slope
