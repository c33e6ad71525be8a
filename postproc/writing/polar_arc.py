"""Arcs by pole and angle, as controls have them that take no end point: the last decimals that end nearest."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

REACH = 3
"""last decimals that the pole may be moved by, in either direction"""
NEAR = 0.25
"""of a last decimal: ends as near as this are as good as any, the pole nearest to the centre is then taken"""


@dataclass(frozen=True)
@arrays(pole="2", end="2")
class PolarArc:
    """An arc in its plane: `pole` (2,) mm and `angle` in degrees as they are written, the `end` (2,) that they lead to."""

    pole: Floats
    angle: float
    end: Floats


def polar_arc(start: Floats, end: Floats, centre: Floats, turn: float, grain: float,
              angle_grain: float) -> PolarArc:
    """The arc from `start` about a pole near `centre` that ends nearest to `end` (2,), mm.

    The control keeps the distance of the start from the pole (Klartext Programming 34059x, CP). So the end is
    off along the radius by the difference of the pole's distances from both ends, and along the arc by what
    the angle is rounded by. A pole one last decimal farther changes the one by up to two, the other by steps
    that do not fit those of the angle: some pole around the centre is better than the one that the centre is
        rounded to. The end is off by hypot(grain, radius *
    angle_grain / 2) at most (`helix_bound`).

    Args:
        turn: degrees of the arc without rounding, negative for clockwise
        grain, angle_grain: last decimals of the pole in mm, of the angle in degrees
    """
    steps = np.arange(-REACH, REACH + 1)
    adjacent = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    poles = (np.round(centre / grain) + adjacent) * grain
    first, last = start - poles, end - poles
    begin = np.arctan2(first[:, 1], first[:, 0])
    wanted = (np.arctan2(last[:, 1], last[:, 0]) - begin) / DEG
    angles = np.round((turn + np.mod(wanted - turn + 180.0, 360.0) - 180.0) / angle_grain) * angle_grain
    stops = begin + angles * DEG
    ends = poles + np.linalg.norm(first, axis=1)[:, None] * np.stack([np.cos(stops), np.sin(stops)], axis=1)
    off, away = (np.linalg.norm(points - place, axis=1) for points, place in ((ends, end), (poles, centre)))
    best = int(np.lexsort((away, np.maximum(off, NEAR * grain)))[0])
    return PolarArc(poles[best], float(angles[best]), ends[best])
