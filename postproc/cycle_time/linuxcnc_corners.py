"""Where two segments of LinuxCNC's planner meet: stop, tangent passage, blend arc or overlap of two ramps.

Described from the source of LinuxCNC 2.9 (src/emc/tp/tp.c: `tpSetupTangent`, `tpChooseBestBlend`,
`tpComputeBlendVelocity`; src/emc/tp/blendmath.c: `blendParamKinematics`, `blendComputeParameters`, the
post-processing of lines and arcs). Every corner is worked out by itself: a blend takes at most half of a
line, so that what it may take at one end does not depend on the other end.
"""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.linuxcnc_segments import NORMAL_SHARE, PlannerSegments, clamped, plane_limit
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

KINK = 0.1
"""share of the acceleration that a corner passed as if tangent may take ([TRAJ] ARC_BLEND_KINK_RATIO)"""
SHARP = (2.0 * np.pi / 180.0) ** 2
"""|u1 + u2|^2 below which a corner turns back"""
QUARTER = 0.25
"""of a segment's length is the tolerance where the program sets none"""


@dataclass(frozen=True)
@arrays(straight="N", back="N", speed="N", load="N", tangent="N", kinked="N")
class Corners:
    """The N - 1 places where segment i runs into i + 1.

    Attributes:
        straight (N-1,): only X, Y, Z move and neither side has to stop: tangents count
        speed (N-1,): at which it may be passed as if tangent, inf where that is no question
        load (N-1,): share of the acceleration that passing takes, up to KINK
        tangent (N-1,): passed as tangent; kinked (N-1,): not without a blend
    """

    straight: Bools
    back: Bools
    speed: Floats
    load: Floats
    tangent: Bools
    kinked: Bools


def corners(s: PlannerSegments, free: Bools, cycle: float) -> Corners:
    """How tangent each place is; `free` (N-1,) is False where the segment before has to stop in any case."""
    last, first = s.shape.last[:-1], s.shape.first[1:]
    straight = free & ~s.shape.turns[:-1] & ~s.shape.turns[1:]
    back = straight & (((last + first) ** 2).sum(axis=1) < SHARP)
    target = np.minimum(s.asked, clamped(s.length, s.most, cycle))
    speed = np.minimum(target[:-1], target[1:])
    push = (speed / cycle + s.acceleration[1:])[:, None] * np.abs(first - last)
    here = s.blocks.axes.xyz >= 0
    bounds = np.where(here, s.blocks.axes.acceleration[s.blocks.axes.xyz], np.inf)
    load = (push / bounds).max(axis=1) * np.where(s.blocks.arc[:-1] | s.blocks.arc[1:], 2.0, 1.0)
    straight &= ~back
    tangent = straight & (load < KINK)
    kinked = straight & ~tangent
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.where(tangent, speed, np.where(kinked, speed * KINK / load, np.inf))
    return Corners(straight, back, speed, np.where(straight, np.minimum(load, KINK), 0.0), tangent, kinked)


@dataclass(frozen=True)
@arrays(good="K", trim="K 2", length="K", asked="K", most="K", acceleration="K")
class BlendArcs:
    """Blend arcs at K corners: `trim` (K, 2) mm taken from both sides, `length`, `asked` and `most` speed,
    `acceleration`; `good` where there is an arc at all."""

    good: Bools
    trim: Floats
    length: Floats
    asked: Floats
    most: Floats
    acceleration: Floats


@dataclass(frozen=True)
@arrays(arc="K", arm="K", lean="K 3", ease="K", center="K 3", radius="K", convex="K", most="K")
class _Side:
    """One side of K corners. `arm`: length that may be taken; `lean`: direction of the secant that stands for
    a convex arc; `ease`: rad by which it closes the corner; center, radius, convex, most: of arcs."""

    arc: Bools
    arm: Floats
    lean: Floats
    ease: Floats
    center: Floats
    radius: Floats
    convex: Bools
    most: Floats


def blends(s: PlannerSegments, at: Ints, cycle: float) -> BlendArcs:
    """The blend arc of each corner `at` (K,) by line or arc on either side."""
    u1, u2 = s.shape.last[at], s.shape.first[at + 1]
    half = np.arccos(np.clip(-(u1 * u2).sum(axis=1), -1.0, 1.0)) / 2.0
    good = (np.pi / 2.0 - half >= 1e-6) & (half >= 1e-6)
    binormal = _unit(np.cross(u1, u2))
    point = s.blocks.xyz[at + 1]
    one, two = _side(s, at, half, point, u1, u2, True), _side(s, at + 1, half, point, u1, u2, False)
    theta = half - np.maximum(one.ease, two.ease)
    good &= ~(one.arc & two.arc) | (theta >= np.pi / 12.0)
    for side, rows in ((one, at), (two, at + 1)):
        plane = np.minimum(((s.blocks.normal[rows] - binormal) ** 2).sum(axis=1),
                           ((s.blocks.normal[rows] + binormal) ** 2).sum(axis=1)) < 1e-12
        good &= ~side.arc | (plane & (np.abs(s.shape.climb[rows]) < 1e-3))
    radius, planned, asked, acceleration, tolerance = _sizes(s, at, one, two, theta, binormal, cycle)
    reach = radius / np.tan(np.maximum(theta, 1e-9))
    trim, length = np.stack([reach, reach], axis=1), radius * (np.pi - 2.0 * theta)
    good &= (radius >= 1e-12) & (length >= 1e-6)
    curved = np.flatnonzero(one.arc | two.arc)
    if len(curved):
        _fit(curved, u1, u2, binormal, point, one, two, radius, tolerance, trim, length, good)
    return BlendArcs(good, trim, length, asked, planned, acceleration)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300))


def _side(s: PlannerSegments, rows: Ints, half: Floats, point: Floats, u1: Floats, u2: Floats,
          before: bool) -> _Side:
    """The segments `rows` (K,) as the side before or behind the corner."""
    arc, center = s.blocks.arc[rows], s.blocks.center[rows]
    spoke = point - center
    radius = np.linalg.norm(spoke, axis=1)
    inward = (spoke * (u2 if before else u1)).sum(axis=1)
    convex = arc & ((inward < 0.0) if before else (inward >= 0.0))
    most = np.minimum(s.blocks.sweep[rows] * (2.0 / 3.0 if before else 1.0 / 3.0),
                      np.where(convex, half, np.pi / 2.0))
    arm = np.where(arc, np.where(convex, np.sin(most / 4.0), most) * radius, s.length[rows] / 2.0)
    angle = (-most if before else most)[:, None] / 2.0
    middle = center + np.cos(angle) * spoke + np.sin(angle) * np.cross(s.blocks.normal[rows], spoke)
    secant = _unit(point - middle if before else middle - point)
    lean = np.where(convex[:, None], secant, u1 if before else u2)
    return _Side(arc, arm, lean, np.where(convex, most / 4.0, 0.0), center, radius, convex, most)


def _sizes(s: PlannerSegments, at: Ints, one: _Side, two: _Side, theta: Floats, binormal: Floats,
           cycle: float) -> tuple[Floats, ...]:
    """(radius, planned speed, asked speed, acceleration, tolerance) of the blends, all (K,)."""
    axes = s.blocks.axes
    most = clamped(s.length, s.most, cycle)
    wanted = np.minimum(s.asked, most)
    acceleration, planar = plane_limit(binormal, axes, axes.acceleration), plane_limit(binormal, axes, axes.velocity)
    quarter = QUARTER * np.minimum(s.length[at], s.length[at + 1])
    tolerance = np.minimum(np.minimum(s.blocks.tolerance[at], s.blocks.tolerance[at + 1]), quarter)
    turn = np.pi - 2.0 * theta
    asked = np.maximum(wanted[at], wanted[at + 1])
    altitude = np.where(one.arc | two.arc, 0.0, _altitude(most[at], most[at + 1], turn, one.lean, two.lean))
    goal = np.minimum(asked, np.maximum(altitude, planar))
    by_tolerance = np.cos(theta) * tolerance / np.maximum(1.0 - np.sin(theta), 1e-300)
    travel = np.minimum(np.minimum(one.arm, two.arm), by_tolerance)
    largest = np.tan(theta) * travel
    planned = np.minimum(np.sqrt(NORMAL_SHARE * acceleration * largest), goal)
    ramp = 0.5 * acceleration
    seconds = np.minimum(np.sqrt(2.0 * ramp * travel), planned) / ramp
    by_time = np.minimum(seconds * planned / np.maximum(turn, 1e-300), largest)
    return np.maximum(planned**2 / (NORMAL_SHARE * acceleration), by_time), planned, asked, acceleration, tolerance


def _altitude(most1: Floats, most2: Floats, turn: Floats, u1: Floats, u2: Floats) -> Floats:
    """Height of the triangle of both largest velocities over the line that joins their ends."""
    flat = np.cos(np.minimum(turn, 0.49 * np.pi))
    v1, v2 = np.minimum(most1, most2 / flat), np.minimum(most2, most1 / flat)
    base = np.linalg.norm(u2 * v2[:, None] - u1 * v1[:, None], axis=1)
    return np.asarray(v1 * v2 * np.sin(turn) / np.maximum(base, 1e-300))


def _fit(k: Ints, u1: Floats, u2: Floats, binormal: Floats, point: Floats, one: _Side, two: _Side, radius: Floats,
         tolerance: Floats, trim: Floats, length: Floats, good: Bools) -> None:
    """Corners `k` with an arc on either side: the circle of `radius` that touches both, nearest to the corner."""
    r = radius[k]
    locus1 = _locus(k, one, u1, binormal, point, r)
    locus2 = _locus(k, two, u2, binormal, point, r)
    center, found = _meet(locus1, locus2, point[k], binormal[k])
    away = np.linalg.norm(center - point[k], axis=1)
    taken = [_taken(k, side, u, point, center, before) for side, u, before in ((one, u1, True), (two, u2, False))]
    fits = found & (away - r <= tolerance[k])
    for side, amount in ((one, taken[0]), (two, taken[1])):
        fits &= ~side.arc[k] | (amount <= side.most[k])
    ends = [_touch(k, side, u, point, center, r) for side, u in ((one, u1), (two, u2))]
    angle = np.arccos(np.clip((_unit(ends[0] - center) * _unit(ends[1] - center)).sum(axis=1), -1.0, 1.0))
    for column, side in enumerate((one, two)):
        trim[k, column] = taken[column] * np.where(side.arc[k], side.radius[k], 1.0)
    length[k] = r * angle
    good[k] &= fits & (length[k] >= 1e-6)


Locus = tuple[Bools, Floats, Floats, Floats]
"""(is a circle, point on the line or centre (K, 3), direction of the line (K, 3), radius of the circle (K,))"""


def _locus(k: Ints, side: _Side, u: Floats, binormal: Floats, point: Floats, r: Floats) -> Locus:
    """Where centres of circles of radius r that touch a side lie: a parallel line, or a circle about the arc's centre."""
    inward = _unit(np.cross(binormal[k], u[k]))
    shifted = point[k] + r[:, None] * inward
    arc = side.arc[k]
    return (arc, np.where(arc[:, None], side.center[k], shifted), u[k],
            side.radius[k] + np.where(side.convex[k], -r, r))


def _meet(a: Locus, b: Locus, point: Floats, binormal: Floats) -> tuple[Floats, Bools]:
    """The common point of two loci nearest to the corner (K, 3), and where there is one."""
    line_first = ~a[0]
    origin = np.where(line_first[:, None], a[1], b[1])
    direction = np.where(line_first[:, None], a[2], b[2])
    both = a[0] & b[0]
    between = _unit(b[1] - a[1])
    apart = np.linalg.norm(b[1] - a[1], axis=1)
    along = (a[3] ** 2 - b[3] ** 2 + apart**2) / np.maximum(2.0 * apart, 1e-300)
    across = _unit(np.cross(binormal, between))
    origin = np.where(both[:, None], a[1] + along[:, None] * between, origin)
    direction = np.where(both[:, None], across, direction)
    circle = np.where(line_first[:, None], b[1], a[1])
    radius = np.where(line_first, b[3], a[3])
    middle = ((circle - origin) * direction).sum(axis=1)
    height2 = radius**2 - ((circle - origin) ** 2).sum(axis=1) + middle**2
    root = np.sqrt(np.maximum(height2, 0.0))
    options = [origin + (middle + sign * root)[:, None] * direction for sign in (1.0, -1.0)]
    near = [((option - point) ** 2).sum(axis=1) for option in options]
    return np.asarray(np.where((near[0] <= near[1])[:, None], options[0], options[1])), height2 >= 0.0


def _taken(k: Ints, side: _Side, u: Floats, point: Floats, center: Floats, before: bool) -> Floats:
    """(K,) what the blend takes of a side: mm of a line, rad of an arc."""
    along = np.abs(((center - point[k]) * u[k]).sum(axis=1))
    angle = np.arccos(np.clip((_unit(point[k] - side.center[k]) * _unit(center - side.center[k])).sum(axis=1), -1.0, 1.0))
    return np.asarray(np.where(side.arc[k], angle, along))


def _touch(k: Ints, side: _Side, u: Floats, point: Floats, center: Floats, r: Floats) -> Floats:
    """(K, 3) where the blend touches a side."""
    on_line = point[k] + ((center - point[k]) * u[k]).sum(axis=1)[:, None] * u[k]
    on_arc = side.center[k] + side.radius[k][:, None] * _unit(center - side.center[k])
    return np.asarray(np.where(side.arc[k][:, None], on_arc, on_line))
