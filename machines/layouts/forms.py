"""Where the slides of a layout stand, as a function of few numbers: the families of annex C of Company 2000.

All of the contracted model, platform joints in one point E: slides through points P along unit vectors u, and which of the
two solutions of each rod is built (the text's families along x need the other one in the middle). Numbers are parts of the
largest side of the box. A slide along z next to two along x stands outside the box.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from machines.layouts.choices import SlideLayout
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

ANGLES = np.radians([0.0, 120.0, 240.0])
OUT = np.stack([np.cos(ANGLES), np.sin(ANGLES), 0.0 * ANGLES], axis=1)
X, Y, Z = np.eye(3)
RODS = (0.3, 5.0)
"""times the largest side of the box"""


@dataclass(frozen=True, eq=False)
@arrays(points="3 3", directions="3 3", roots="3")
class PlacedSlides:
    """Points (3, 3) mm and directions (3, 3) of the slides, roots (3,)."""

    points: Floats
    directions: Floats
    roots: Floats


@dataclass(frozen=True)
class LayoutForm:
    """A family: names of its numbers with their ranges, the slides at numbers (mm), and about which axis it is alike
    thrice."""

    numbers: Mapping[str, tuple[float, float]]
    place: Callable[..., PlacedSlides]
    ring: float | None = None
    """degrees that the slides of a ring lean outwards from z, None of those that are none"""


def _leaning(lean: float) -> Callable[..., PlacedSlides]:
    u = np.sin(lean * DEG) * OUT + np.cos(lean * DEG) * Z
    return lambda radius: PlacedSlides(radius * OUT, u, np.ones(3))


def _star(height: float) -> PlacedSlides:
    return PlacedSlides(np.tile(height * Z, (3, 1)), OUT, np.ones(3))


def _parallel_x(y1: float, y2: float, y3: float, z1: float, z2: float, z3: float) -> PlacedSlides:
    points = np.array([[0.0, -y1, z1], [0.0, y2, z2], [0.0, y3, z3]])
    return PlacedSlides(points, np.tile(X, (3, 1)), np.array([1.0, -1.0, 1.0]))


def _coplanar(half: float, middle: float, height: float) -> PlacedSlides:
    return _parallel_x(half, middle, half, height, height, height)


def _perpendicular(ay: float, az: float, bx: float, bz: float, cx: float, cy: float) -> PlacedSlides:
    return PlacedSlides(np.array([[0.0, ay, az], [bx, 0.0, bz], [cx, cy, 0.0]]), np.eye(3), np.ones(3))


def _hybrid(half: float, height: float, behind: float) -> PlacedSlides:
    points = np.array([[0.0, -half, height], [0.0, half, height], [-behind, 0.0, 0.0]])
    return PlacedSlides(points, np.stack([X, X, Z]), np.ones(3))


_SIDE, _OFF, _UP = (0.2, 3.0), (-2.0, 2.0), (0.4, 3.0)
FORMS: Mapping[SlideLayout, LayoutForm] = {
    "parallel-z": LayoutForm({"radius": (0.3, 4.0)}, _leaning(0.0), 0.0),
    "cone": LayoutForm({"radius": (0.3, 4.0)}, _leaning(30.0), 30.0),
    "star": LayoutForm({"height": (0.3, 4.0)}, _star, 90.0),
    "parallel-x": LayoutForm({"y1": _SIDE, "y2": (-1.5, 1.5), "y3": _SIDE, "z1": _UP, "z2": _UP, "z3": _UP}, _parallel_x),
    "coplanar": LayoutForm({"half": _SIDE, "middle": (-1.0, 1.0), "height": _UP}, _coplanar),
    "perpendicular": LayoutForm(dict.fromkeys(("ay", "az", "bx", "bz", "cx", "cy"), _OFF), _perpendicular),
    "hybrid": LayoutForm({"half": _SIDE, "height": (0.0, 3.0), "behind": (0.5, 3.0)}, _hybrid),
}
