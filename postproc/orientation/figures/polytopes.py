"""Polytopes of a pass in space: the box turned against the mean direction, and the orders of motion next to each other."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from machines.polytope import Polytope
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import binding, direction_of, polytopes, reaches
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.passes import PassContext
from toolpaths.arrays import Floats, Ints

Axes3D = Any
"""of mplot3d, which states no types"""
SCALE = {"velocity": 1.0, "acceleration": 1e-3, "jerk": 1e-3, "feed": 1.0}
SHOWN = {"velocity": "mm/s", "acceleration": "m/s²", "jerk": "m/s³", "feed": "mm/s"}
"""units of the drawings"""
COLOURS = {"velocity": "#3f8f4f", "acceleration": "#d08a3c", "jerk": "#1f5f8b", "feed": "#777777"}
RAY, PALE = "#c2453a", "#888888"
APART = 4.0
"""times the mean speed of the order that binds, beyond which another order is only named"""


def box_panel(place: Axes3D, tried: PassSearch, work: PassContext) -> None:
    """The polytope of the order that binds, under the CL's axis and the best one, and its reach along the mean direction."""
    slowest = binding(reaches(tried.own)) or binding(reaches(tried.best))
    if slowest is None:
        _nothing(place, "no polytope: the pass cannot be run, has no direction,\nor the machine states no limits")
        return
    order, size = slowest.order, 0.0
    alone = [(tried.own, COLOURS[order], RAY, "CL axis, best")]
    both = [(tried.own, PALE, PALE, "CL axis"), (tried.best, COLOURS[order], RAY, "best")]
    for made, colour, ray, name in both if tried.best is not tried.own else alone:
        shape = next((shape for known, shape in polytopes(made).items() if known == order), None)
        if shape is None:
            continue
        corners = _corners(shape, work) * SCALE[order]
        rate = float(shape.reach(direction_of(made.one.longest)[0])[0]) * SCALE[order]
        _solid(place, corners, colour, made is tried.best, f"{name}: {short(rate)} {SHOWN[order]}")
        _ray(place, rate * _direction(made, work), ray)
        size = max(size, float(np.abs(corners).max(initial=0.0)), rate)
    _finish(place, size, f"{order} polytope [{SHOWN[order]}], frame of the part;\nlines: reach along the mean direction",
            tried, work)


def order_panel(place: Axes3D, tried: PassSearch, work: PassContext) -> None:
    """Velocity, acceleration and jerk polytopes under the best axis.

    Each is scaled so that it ends the mean direction at the mean speed which this order alone would allow from rest to rest
    over the length of the pass: the smallest along the direction binds.
    """
    made = tried.best
    found = {one.order: one for one in reaches(made)}
    slowest = binding(tuple(found.values()))
    if slowest is None:
        _nothing(place, "no orders to compare")
        return
    _, length = direction_of(made.one.longest)
    size, shapes = 0.0, dict[str, Polytope](polytopes(made).items())
    for order, one in found.items():
        speed, far = length / one.seconds, slowest.seconds > APART * one.seconds
        corners = np.zeros((0, 3)) if far else _corners(shapes[order], work) * (speed / one.rate)
        _solid(place, corners, COLOURS[order], one is slowest, f"{order}: {short(speed)} mm/s"
               + (", beyond the drawing" if far else ""))
        if not far:
            place.scatter(*(speed * _direction(made, work))[:, None], color=COLOURS[order], s=28)
            size = max(size, float(np.abs(corners).max(initial=0.0)), speed)
    _ray(place, 1.05 * size * _direction(made, work), RAY, marked=False)
    _finish(place, size, f"orders under the best axis, as mean speeds [mm/s] over {length:.0f} mm;\n"
            f"the innermost along the mean direction binds: {slowest.order}", tried, work)


def short(value: float) -> str:
    """Three digits, no exponent."""
    return f"{float(f'{value:.3g}'):.12g}"


def _corners(shape: Polytope, work: PassContext) -> Floats:
    """Vertices (V, 3) in the frame of the part; none where it is not bounded."""
    try:
        found = shape.vertices()
    except ValueError:
        return np.zeros((0, 3))
    return work.placement.inverse().directions(found)


def _direction(made: Candidate, work: PassContext) -> Floats:
    return np.asarray(work.placement.inverse().directions(direction_of(made.one.longest)[0][None])[0])


def _ray(place: Axes3D, end: Floats, colour: str, marked: bool = True) -> None:
    place.plot(*np.stack([np.zeros(3), end]).T, color=colour, linewidth=1.8, marker="o", markevery=[1] if marked else [],
               markersize=5.0)


def _solid(place: Axes3D, corners: Floats, colour: str, filled: bool, label: str) -> None:
    """A convex solid by its edges and, if filled, its faces."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]  # no stubs

    faces, edges = hull(corners)
    if filled and len(faces):
        place.add_collection3d(Poly3DCollection(list(corners[faces]), facecolors=colour, alpha=0.12, linewidths=0.0))
    lines = list(corners[edges]) if len(edges) else [np.zeros((2, 3))]
    place.add_collection3d(Line3DCollection(lines, colors=colour, linewidths=1.4 if filled else 0.9, label=label))


def hull(corners: Floats) -> tuple[Ints, Ints]:
    """Triangles (F, 3) of the convex hull of corners (V, 3), and its edges (E, 2), where faces meet at an
    angle; none where the corners lie in a plane."""
    try:
        found = ConvexHull(corners) if len(corners) > 3 else None
    except QhullError:
        found = None
    if found is None:
        return np.zeros((0, 3), dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    sides: dict[tuple[int, int], list[Floats]] = {}
    for face, plane in zip(found.simplices.tolist(), found.equations, strict=True):
        for k in range(3):
            a, b = sorted((face[k], face[k - 1]))
            sides.setdefault((a, b), []).append(plane[:3])
    edges = [pair for pair, normals in sorted(sides.items()) if len(normals) == 2 and normals[0] @ normals[1] < 1.0 - 1e-6]
    return found.simplices.astype(np.int64), np.array(edges, dtype=np.int64).reshape(-1, 2)


def _finish(place: Axes3D, size: float, title: str, tried: PassSearch, work: PassContext) -> None:
    """Equal axes, a view across the mean direction, labels."""
    limit = (-size, size)
    place.set(xlim=limit, ylim=limit, zlim=limit, xlabel="x", ylabel="y", zlabel="z")
    place.set_box_aspect((1.0, 1.0, 1.0), zoom=1.15)
    travel = _direction(tried.own, work)
    place.view_init(elev=24.0, azim=float(np.degrees(np.arctan2(travel[1], travel[0]))) - 62.0)
    for axis in (place.xaxis, place.yaxis, place.zaxis):
        axis.labelpad = -4.0
        axis.get_major_locator().set_params(nbins=5)
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    place.tick_params(labelsize="x-small", pad=0)
    place.set_title(title, fontsize="small")
    place.legend(loc="upper left", bbox_to_anchor=(-0.12, 1.0), fontsize="x-small", frameon=False)


def _nothing(place: Axes3D, why: str) -> None:
    place.set_axis_off()
    place.text2D(0.5, 0.5, why, ha="center", fontsize="small", transform=place.transAxes)
