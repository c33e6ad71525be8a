"""Places of three slides, and rods, under a platform that translates: the best over a box within limits.

The platform's joints stand `platform` mm from its middle, slides as much farther out: what counts is the contracted model,
all joints in one point (annex C of Company 2000). Least values by differential evolution (Storn and Price) with restarts;
a limit that is exceeded counts more than any goal. Figures over the box are those of a grid with its faces, the result is
proved by boxes (`analysis/extremes.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize

from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.workspace import Workspace
from machines.layouts.choices import Goal, SlideLayout
from machines.layouts.forms import FORMS, RODS, PlacedSlides
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import unit
from toolpaths.shapes import arrays

GRID, FAR = (5, 5, 3), 1e3
"""places at which a candidate is looked at; what an infinite figure counts as"""
RESTARTS, ROUNDS, CROWD = 2, 60, 10
"""runs with other random numbers; generations; candidates per number"""
UP = np.array([0.0, 0.0, 1.0])


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

    @property
    def side(self) -> float:
        """mm, the largest."""
        return float(self.box.max())


@dataclass(frozen=True)
class LayoutFound:
    """Numbers of the layout (mm, contracted model; names as in `forms.py`), rods mm, and figures."""

    numbers: Mapping[str, float]
    rod: float
    figures: Mapping[Goal, float]

    def within(self, limits: Mapping[Goal, float]) -> bool:
        """Whether every limit is kept, to a millionth."""
        return all(self.figures[key] <= most * (1.0 + 1e-6) for key, most in limits.items())


def slides_of(asked: LayoutQuestion, numbers: Mapping[str, float]) -> PlacedSlides:
    """The slides of the contracted model."""
    return FORMS[asked.layout].place(**numbers)


def contracted(slides: PlacedSlides, rod: float, place: Floats) -> tuple[Floats, Floats]:
    """(rods (N, 3, 3) mm from slide to platform, positions q (N, 3) mm) at places (N, 3); NaN where one does not reach."""
    w = place[:, None] - slides.points
    along = (w * slides.directions).sum(axis=2)
    under = rod**2 - ((w**2).sum(axis=2) - along**2)
    with np.errstate(invalid="ignore"):
        half = slides.roots * np.sqrt(under)
    q = along + half
    return w - q[:, :, None] * slides.directions, q


def box_grid(asked: LayoutQuestion) -> Floats:
    """(N, 3) mm: the places at which a candidate is looked at, faces and corners included."""
    return np.stack(np.meshgrid(*(np.linspace(-0.5 * v, 0.5 * v, n) for v, n in zip(asked.box, GRID, strict=True)),
                                indexing="ij"), axis=-1).reshape(-1, 3)


def figures_of(asked: LayoutQuestion, numbers: Mapping[str, float], rod: float) -> dict[Goal, float]:
    """Over the grid; infinite where a leg does not reach. N = Jq^-1 Jx has rows r / (r.u) (II-17, III.6)."""
    slides = slides_of(asked, numbers)
    rods, q = contracted(slides, rod, box_grid(asked))
    if np.isnan(q).any():
        return {"condition": np.inf, "bulk": np.inf, "width": np.inf, "speed": np.inf, "rod": rod}
    gain = (rods * slides.directions).sum(axis=2, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(gain != 0.0, rods / gain, np.inf)
    finite = bool(np.isfinite(rates).all())
    values = np.linalg.svd(np.where(np.isfinite(rates), rates, 0.0), compute_uv=False)
    across = extents(slides, q)[:2]
    with np.errstate(divide="ignore"):
        condition = float((values[:, 0] / values[:, -1]).max()) if finite and values[:, -1].min() > 0.0 else np.inf
    jumps = float(np.linalg.det(rods).min()) * float(np.linalg.det(rods).max()) <= 0.0
    return {"condition": np.inf if jumps else condition, "bulk": float(across.max()), "width": float(across.min()),
            "speed": float(np.linalg.norm(rates, axis=2).max()) if finite else np.inf, "rod": rod}


def extents(slides: PlacedSlides, q: Floats) -> Floats:
    """(3,) mm along x, y, z of where the carriages of the contracted model come (table III-5: `Encombrement`)."""
    feet = slides.points + q[:, :, None] * slides.directions
    return np.asarray(np.ptp(feet.reshape(-1, 3), axis=0), dtype=np.float64)


def best(asked: LayoutQuestion, seed: int = 0) -> LayoutFound | None:
    """The best of all restarts; None where none keeps the limits."""
    form, side = FORMS[asked.layout], asked.side

    def numbers_of(x: Floats) -> tuple[dict[str, float], float]:
        return dict(zip(form.numbers, (side * x[:-1]).tolist(), strict=True)), float(side * x[-1])

    def cost(x: Floats) -> float:
        found = figures_of(asked, *numbers_of(x))
        over = sum(max(min(found[key], FAR * side) / most - 1.0, 0.0) for key, most in asked.limits.items())
        scale = side if asked.goal in ("bulk", "width", "rod") else 1.0
        return float(FAR * over + min(found[asked.goal] / scale, FAR))

    span = np.array([*form.numbers.values(), RODS])
    bounds = Bounds(span[:, 0], span[:, 1])
    runs = [differential_evolution(cost, bounds, maxiter=ROUNDS, popsize=CROWD, tol=1e-8, seed=seed + k, polish=False)
            for k in range(RESTARTS)]
    top = min(runs, key=lambda run: float(run.fun))
    start = np.asarray(top.x, dtype=np.float64)
    polished = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options={"maxiter": 200 * len(span)})
    numbers, rod = numbers_of(polished.x if polished.fun <= top.fun else start)
    found = LayoutFound(numbers, rod, figures_of(asked, numbers, rod))
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


def platform_joints(asked: LayoutQuestion, slides: PlacedSlides, rod: float) -> Floats:
    """(3, 3) mm: joints of a platform that can be built, each on the side of its slide in the middle of the box."""
    rods, _ = contracted(slides, rod, np.zeros((1, 3)))
    flat = -rods[0] * [1.0, 1.0, 0.0]
    flat = np.where(np.linalg.norm(flat, axis=1, keepdims=True) > 1e-6 * rod, flat, np.array([1.0, 0.0, 0.0]))
    return np.asarray(asked.platform * unit(flat), dtype=np.float64)


def geometry(asked: LayoutQuestion, numbers: Mapping[str, float], rod: float) -> LegGeometry:
    """The legs of a candidate, its platform of full size."""
    slides, yes = slides_of(asked, numbers), np.ones(3, dtype=np.bool_)
    joints = platform_joints(asked, slides, rod)
    return LegGeometry(
        names=("X", "Y", "Z"), points=slides.points + joints, directions=slides.directions, arms=np.zeros((3, 3)),
        lengths=np.full(3, rod), roots=slides.roots, slide=yes, arm=~yes, joints=joints,
        pairs=2.0 * np.cross(UP, joints), freedoms=("x", "y", "z"), gauge=np.zeros(3), carrier_names=(),
        carriers=np.zeros((0, 3)), workspace=Workspace(-0.5 * asked.box, 0.5 * asked.box))
