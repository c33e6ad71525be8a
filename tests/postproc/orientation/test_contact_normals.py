"""Surface normals where the cutter touches the part's mesh; places found by construction."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import trimesh

from postproc.orientation.passes.surface import Surface
from postproc.setup.model import Placement
from toolpaths.arrays import Floats
from toolpaths.shape import Curves
from toolpaths.units import DEG

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def lines_of(start: Floats, end: Floats) -> Curves:
    """Straight moves with the tool along z."""
    n = len(start)
    none, up = np.zeros((n, 3)), np.tile(Z, (n, 1))
    return Curves(start, end, up, up, np.zeros(n, dtype=bool), none, none, np.zeros(n))


@cache
def sphere() -> Surface:
    """A ball of 40 mm about (5, 0, 0), as fine triangles, in a part that stands turned by 90 degrees and 100 mm up."""
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=40.0)
    mesh.apply_translation((5.0, 0.0, 0.0))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return Surface(mesh, Placement(turn, np.array([0.0, 0.0, 100.0])), 0.05)


def test_normals_from_the_part() -> None:
    """On a ball they point from its centre, (0, 5, 100) where the part stands, to that of the cutter."""
    centre = np.array([0.0, 5.0, 100.0])
    link = np.random.default_rng(5).normal(size=(40, 3)) * [1.0, 1.0, 0.3] + [0.0, 0.0, 1.0]
    link /= np.linalg.norm(link, axis=1, keepdims=True)
    tip = centre + 48.0 * link - 8.0 * Z
    at = sphere().contact(lines_of(tip[:-1], tip[:-1] + 1e-3 * X), np.arange(39), 8.0)
    assert len(at) == 78 and at.unknown == 0
    assert np.einsum("ni,ni->n", at.normal[::2], link[:-1]).min() > np.cos(1.0 * DEG)


@pytest.mark.parametrize(("off", "touches"),
                         [(0.0, True), (0.045, True), (-0.03, True), (0.08, False), (-0.08, False)])
def test_a_ball_off_the_part_has_no_normal(off: float, touches: bool) -> None:
    tip = np.array([[0.0, 5.0, 140.0 + off]])
    at = sphere().contact(lines_of(tip, tip + 1e-3 * X), np.array([1]), 8.0)
    assert (len(at), at.unknown) == ((2, 0) if touches else (0, 2))


def test_inside_the_part_there_is_no_contact() -> None:
    """A centre 8 mm under the surface is as far from it as one 8 mm above."""
    tip = np.array([[0.0, 5.0, 124.0]])
    at = sphere().contact(lines_of(tip, tip + 1e-3 * X), np.array([1]), 8.0)
    assert len(at) == 0


def test_long_moves_and_arcs_are_looked_at_between_their_ends() -> None:
    """A parallel circle of the ball, whose feed turns once round; a chord of 40 mm over a plate in steps of the radius."""
    start = np.array([[0.0, 5.0, 100.0]]) + 48.0 * np.array([[0.6, 0.0, 0.8]]) - 8.0 * Z
    middle = np.array([[0.0, 5.0, start[0, 2]]])
    arc = Curves(start, start, Z[None], Z[None], np.array([True]), middle, Z[None], np.array([2.0 * np.pi]))
    at = sphere().contact(arc, np.array([1]), 8.0)
    assert len(at) == 144 and np.ptp(np.arctan2(at.travel[:, 1], at.travel[:, 0])) > 6.0
    assert np.abs(at.normal[:, 2] - 0.8).max() < 0.01
    plate = Surface(trimesh.creation.box(extents=(100.0, 100.0, 10.0)),
                    Placement(np.eye(3), np.zeros(3)), 0.01)
    at = plate.contact(lines_of(np.array([[-20.0, 0.0, 5.0]]), np.array([[20.0, 0.0, 5.0]])),
                       np.array([1]), 8.0)
    assert len(at) == 10 and np.allclose(at.normal, Z)
