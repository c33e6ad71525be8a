"""Radius or height, and rods, of three slides under a platform that translates: the best over a box within limits.

The platform's joints stand `platform` mm from its middle, slides as much farther out: what counts is the contracted model,
all joints in one point (annex C of Company 2000). Least values by differential evolution (Storn and Price) with restarts;
a limit that is exceeded counts more than any goal. Figures over the box are those of a grid with its faces, the result is
proved by boxes (`analysis/extremes.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from machines.analysis.transmission import condition_number, speed_transmission
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.over_workspace import OverWorkspace
from machines.kinematics.workspace import Workspace
from machines.layouts.choices import Goal, SlideLayout
from toolpaths.arrays import Floats
from toolpaths.shapes import arrays
from toolpaths.units import DEG

LEAN: Mapping[SlideLayout, float] = {"parallel-z": 0.0, "cone": 30.0, "star": 90.0}
"""degrees of the slides outwards from z"""
GRID, FAR = (5, 5, 3, 1), 1e3
"""places at which a candidate is looked at; what an infinite figure counts as"""
RESTARTS, ROUNDS, CROWD = 2, 40, 8
"""runs with other random numbers; generations; candidates per number"""
SIZES, RODS = (0.3, 4.0), (0.3, 5.0)
"""times the largest side of the box: radius or height, rods"""


@dataclass(frozen=True, eq=False)
@arrays(box="3")
class LayoutQuestion:
    """What is looked for.

    Attributes:
        box: (3,) mm, sides of the workspace, in the middle of the machine's frame
        platform: mm from the middle of the platform to its joints
        goal: what is to be least
        limits: largest values of what is limited (mm, mm per mm, no unit)
    """

    layout: SlideLayout
    box: Floats
    platform: float
    goal: Goal
    limits: Mapping[Goal, float] = field(default_factory=dict)


@dataclass(frozen=True)
class LayoutFound:
    """Dimensions and figures: `size` is the radius of the slides of the contracted model (star: their height), mm."""

    size: float
    rod: float
    figures: Mapping[Goal, float]

    def within(self, limits: Mapping[Goal, float]) -> bool:
        """Whether every limit is kept, to a millionth."""
        return all(self.figures[key] <= most * (1.0 + 1e-6) for key, most in limits.items())


def geometry(asked: LayoutQuestion, size: float, rod: float) -> LegGeometry:
    """The legs of a candidate."""
    angle = np.radians([0.0, 120.0, 240.0])
    out = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    lean, up, yes = LEAN[asked.layout] * DEG, np.array([0.0, 0.0, 1.0]), np.ones(3, dtype=np.bool_)
    radius, height = (0.0, size) if asked.layout == "star" else (size, 0.0)
    return LegGeometry(
        names=("X", "Y", "Z"), points=(radius + asked.platform) * out + height * up,
        directions=np.sin(lean) * out + np.cos(lean) * up, arms=np.zeros((3, 3)), lengths=np.full(3, rod),
        roots=np.ones(3), slide=yes, arm=~yes, joints=asked.platform * out, pairs=np.zeros((3, 3)), freedoms=("x", "y", "z"),
        gauge=np.zeros(3), carrier_names=(), carriers=np.zeros((0, 3)),
        workspace=Workspace(-0.5 * asked.box, 0.5 * asked.box))


def figures_of(legs: LegGeometry) -> dict[Goal, float]:
    """Over the grid; infinite where a leg does not reach."""
    drives = Drives(legs.points, legs.directions, legs.lengths, legs.roots, legs.arms, legs.slide, legs.arm)
    over = OverWorkspace(Loops(drives, legs.joints, legs.freedoms), legs.workspace)
    place, tilt = legs.workspace.grid(GRID)
    q = drives.solve(place[:, None] + legs.joints, legs.roots)
    if np.isnan(q).any():
        return {"condition": np.inf, "bulk": np.inf, "speed": np.inf, "rod": float(legs.lengths[0])}
    feet = (drives.feet(q) - legs.joints).reshape(-1, 3)
    return {"condition": float(condition_number(over, place, tilt).max()),
            "speed": float(speed_transmission(over, place, tilt).max()),
            "bulk": float(np.ptp(feet[:, :2], axis=0).max()), "rod": float(legs.lengths[0])}


def best(asked: LayoutQuestion, seed: int = 0) -> LayoutFound | None:
    """The best of all restarts; None where none keeps the limits."""
    side = float(asked.box.max())

    def cost(x: Floats) -> float:
        found = figures_of(geometry(asked, float(x[0]) * side, float(x[1]) * side))
        over = sum(max(min(found[key], FAR * side) / most - 1.0, 0.0) for key, most in asked.limits.items())
        scale = side if asked.goal in ("bulk", "rod") else 1.0
        return float(FAR * over + min(found[asked.goal] / scale, FAR))

    span = Bounds(*np.transpose([SIZES, RODS]))
    runs = [differential_evolution(cost, span, maxiter=ROUNDS, popsize=CROWD, tol=1e-8, seed=seed + k)
            for k in range(RESTARTS)]
    size, rod = (min(runs, key=lambda run: float(run.fun)).x * side).tolist()
    found = LayoutFound(size, rod, figures_of(geometry(asked, size, rod)))
    return found if np.isfinite(found.figures["condition"]) and found.within(asked.limits) else None


def front(asked: LayoutQuestion, against: Goal, points: int) -> list[LayoutFound]:
    """Machines of which none is better in both the goal and `against`: least under ever tighter limits of the other."""
    widest = best(asked)
    tight = None if widest is None else best(replace(asked, goal=against))
    if widest is None or tight is None:
        return []
    limits = np.linspace(tight.figures[against], widest.figures[against], points)[1:-1]
    between = [best(replace(asked, limits={**asked.limits, against: most})) for most in limits.tolist()]
    found = [one for one in (tight, *between, widest) if one is not None]

    def beaten(one: LayoutFound) -> bool:
        return any(all(other.figures[key] < one.figures[key] for key in (asked.goal, against)) for other in found)
    return [one for one in found if not beaten(one)]
