"""Plane splines of the CL file become arcs: within a micrometre of the curve, tangent to each other, few."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from toolpaths.arrays import Floats
from toolpaths.cl.curves import SPLINE_CHORD, spline_arcs
from toolpaths.cl.read import read_bytes
from toolpaths.cl.spline_chords import spline_points
from toolpaths.toolpath import Kind, Toolpath


def curve(seed: int, points: int = 14) -> tuple[Floats, Floats]:
    """Control points (n, 3) round a circle that waves, in a plane of any slope, and inner knots with 1."""
    random = np.random.default_rng(seed)
    angle = np.linspace(0.0, random.uniform(0.5, 5.0), points)
    radius = random.uniform(2.0, 80.0) * (1.0 + random.uniform(0.0, 0.2) * np.sin(random.uniform(1.0, 5.0) * angle))
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(points)], axis=1)
    slope, _ = np.linalg.qr(random.normal(size=(3, 3)))
    inner = np.append(np.sort(random.uniform(0.05, 0.95, points - 4)), 1.0)
    return flat @ slope.T + random.normal(0.0, 50.0, 3), inner


def places(control: Floats, inner: Floats, count: int) -> Floats:
    """The curve by scipy (count, 3)."""
    knots = np.concatenate([np.zeros(4), inner, np.ones(3)])
    return np.asarray(BSpline(knots, control, 3)(np.linspace(0.0, 1.0, count)))


def path_of(control: Floats, inner: Floats) -> Toolpath:
    """As a CL file of NX."""
    words = [",".join(repr(v) for v in p) for p in control.tolist()]
    found = read_bytes(("TOOL PATH/A,TOOL,B\nUNITS/MM\nFEDRAT/MMPM,500\n" + f"GOTO/{words[0]},0,0,1\nNURBS/\nKNOT/"
                       + ",$\n".join(repr(v) for v in inner.tolist()) + "\n" + "".join(f"CNTRL/{w}\n" for w in words[1:])
                       + "END-OF-PATH\n").encode())
    return found.toolpath


@pytest.mark.covering(count=4)
@pytest.mark.parametrize("seed", range(12))
def test_arcs_are_within_a_micrometre_of_the_spline(seed: int) -> None:
    control, inner = curve(seed)
    path = path_of(control, inner)
    assert (path.arc >= 0).any() and (path.kind != Kind.RAPID).all()
    away = np.full(40_001, np.inf)
    at = places(control, inner, len(away))
    for row in range(1, len(path)):
        begin, end = path.tip[row - 1], path.tip[row]
        near = np.linalg.norm(at - 0.5 * (begin + end), axis=1) < 0.6 * np.linalg.norm(end - begin) + 0.01
        if path.arc[row] < 0:
            off = np.linalg.norm(np.cross(at[near] - begin, end - begin), axis=1) / np.linalg.norm(end - begin)
        else:
            k = path.arc[row]
            w = at[near] - path.arcs.center[k]
            height = w @ path.arcs.normal[k]
            off = np.hypot(height, np.linalg.norm(w - height[:, None] * path.arcs.normal[k], axis=1) - path.arcs.radius[k])
        away[near] = np.minimum(away[near], off)
    assert away.max() < SPLINE_CHORD
    assert np.abs(path.tip[-1] - control[-1]).max() < 1e-9


@pytest.mark.covering(count=4)
@pytest.mark.parametrize("seed", range(12))
def test_arcs_go_on_in_the_direction_in_which_the_one_before_ends(seed: int) -> None:
    control, inner = curve(seed)
    path = path_of(control, inner)
    direction = np.diff(places(control, inner, 100_001)[:2], axis=0)[0]
    direction /= np.linalg.norm(direction)
    for row in range(1, len(path)):
        k, begin, end = path.arc[row], path.tip[row - 1], path.tip[row]
        if k < 0:
            direction = (end - begin) / np.linalg.norm(end - begin)
            continue
        leaves, comes = (np.cross(path.arcs.normal[k], p - path.arcs.center[k]) / path.arcs.radius[k] for p in (begin, end))
        assert leaves @ direction > 1.0 - 1e-5
        assert path.arcs.sweep[k] < np.pi
        direction = comes


@pytest.mark.parametrize("seed", range(12))
def test_behind_a_bend_that_is_as_small_as_the_tolerance_arcs_go_on_forwards(seed: int) -> None:
    """Lines run past such a bend: the direction in which the next arc begins is not that of the arc before them."""
    random = np.random.default_rng(seed)
    control = np.append(random.normal(0.0, 1.0, (8, 2)), np.zeros((8, 1)), axis=1)
    control[4:6] = control[3] + random.normal(0.0, 1e-3, (2, 3)) * [1.0, 1.0, 0.0]
    path = path_of(control, np.array([0.2, 0.4, 0.6, 0.8, 1.0]))
    assert (path.arcs.sweep < np.pi).all()


def test_far_fewer_arcs_than_chords() -> None:
    counts = [(len(spline_arcs(control, inner, 1e-3)), len(spline_points(control, inner, 1e-3)))
              for control, inner in (curve(seed) for seed in range(12))]
    arcs, chords = np.array(counts).sum(axis=0)
    assert 3 * arcs < chords


def test_a_straight_spline_is_one_line() -> None:
    control = np.linspace([0.0, 0.0, 1.0], [30.0, 10.0, 1.0], 6)
    assert [arc for _, _, _, arc in spline_arcs(control, np.array([0.3, 0.6, 1.0]), 1e-3)] == [()]


@pytest.mark.parametrize("change", ["corner", "space", "turns back"])
def test_what_no_arcs_fit_is_followed_by_chords(change: str) -> None:
    control, inner = curve(3, 9)
    if change == "corner":
        inner = np.array([0.2, 0.5, 0.5, 0.5, 0.7, 1.0])
    elif change == "space":
        control[4] += np.linalg.svd(control - control[0])[2][2]
    else:
        control[4:] = control[3]
        control[-1] = control[0]
    assert spline_arcs(control, inner, 1e-3) == []
    path = path_of(control, inner)
    assert (path.arc < 0).all() and len(path) > 2
