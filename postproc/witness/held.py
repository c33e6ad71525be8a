"""What holds a platform besides its rods, from a machine file: hinges at the feet of legs, passive legs through a joint."""

from __future__ import annotations

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
    axis of the joint) (4, 3) each, platform level."""

    hinges: tuple[Array, ...] = ()
    passive: tuple[Array, ...] = ()

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
        for point, joint, line, hinge in self.passive:
            own = _turned(platform, joint - back)
            apart = point - gauge - own
            first = unit(np.cross(line, hinge))
            for square in (first, np.cross(line, first)):
                side = _turned(platform, square[None])
                found.append(((apart * side).sum(axis=1),
                              (apart * np.cross(axis, side)).sum(axis=1) - (np.cross(axis, own) * side).sum(axis=1)))
            inner = _turned(platform, first[None])
            found.append((ARM * inner @ hinge, ARM * np.cross(axis, inner) @ hinge))
        return found


def _turned(platform: Array, v: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", platform, np.broadcast_to(v, (len(platform), 3))))


def held(kinematics: dict[str, Any], legs: dict[str, dict[str, Any]]) -> HeldPlatform:
    """Of a table `[kinematics]` and the tables of its legs by letter."""
    return HeldPlatform(
        tuple(np.array([unit(np.array(leg["hinge"], np.float64)), leg["point"], leg["joint"]]) for leg in legs.values()
              if leg.get("hinge")),
        tuple(np.array([one["point"], one.get("joint", (0.0, 0.0, 0.0)), unit(np.array(one.get("line", (0.0, 0.0, 1.0)))),
                        unit(np.array(one["hinge"], np.float64))]) for one in kinematics.get("passive", {}).values()))
