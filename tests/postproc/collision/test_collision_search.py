"""Least distances of a moving tool from solids: closed forms, dense points, the rib between two samples."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from postproc.collision import search
from postproc.collision.bodies import Body, Scene, touches
from postproc.collision.form import CUTTER, ToolForm
from postproc.collision.revolution import around, signed, support
from postproc.collision.search import EXACT, PART, Nearest, nearest
from postproc.collision.solid import TriangleSolid, solid
from postproc.collision.swept import Swept, joined
from postproc.setup.model import Placement
from toolpaths.arrays import Floats
from toolpaths.rotations import slerp

HERE = Placement(np.eye(3), np.zeros(3))
BALL = np.array([[0.0, 8.0, 0.0, 8.0, 8.0]])
CYLINDER = np.array([[6.0, 0.0, 6.0, 40.0, 0.0]])
CONE = np.array([[0.0, 0.0, 10.0, 10.0, 0.0]])
BULL = np.array([[4.0, 2.0, 4.0, 2.0, 2.0], [6.0, 2.0, 6.0, 40.0, 0.0]])
UP = (0.0, 0.0, 1.0)


def block() -> TriangleSolid:
    """100 x 100 x 20 mm, its top at z = 10."""
    return solid(trimesh.creation.box((100.0, 100.0, 20.0)), HERE)


def travel(*tips: tuple[float, float, float], axis: tuple[float, float, float] = UP) -> Swept:
    points = np.array(tips)
    n = len(points) - 1
    return Swept(np.stack((points[:-1], points[1:]), axis=1), np.tile(np.array(axis), (n, 2, 1)),
                 np.arange(n))


@pytest.mark.parametrize("piece", [BALL, CYLINDER, BULL, CONE])
@pytest.mark.parametrize("height", [0.7, 0.0, -0.05, -1.5])
def test_over_a_plane_the_distance_is_the_height(piece: Floats, height: float) -> None:
    """A sunken point of a cone is nearer to the cone's side than to its tip."""
    z = 10.0 + height
    found = nearest(block(), travel((-40.0, -30.0, z), (40.0, -30.0, z), (40.0, 30.0, z)), piece, 1.0)
    expected = height * np.sqrt(0.5) if piece is CONE and height < 0.0 else height
    assert found.distance == pytest.approx(expected, abs=EXACT + PART * (1.0 - height))
    assert found.distance >= expected - 1e-9


def test_next_to_a_wall_the_distance_is_that_of_the_cylinder() -> None:
    found = nearest(block(), travel((60.0, -30.0, 0.0), (56.4, 30.0, 0.0)), CYLINDER, 1.0)
    assert found.distance == pytest.approx(0.4, abs=0.005) and found.place == 0
    assert found.point[0] == pytest.approx(50.0, abs=0.1) and found.point[1] == pytest.approx(30.0, abs=1.0)


def test_over_a_ball_the_distance_is_that_of_the_centres() -> None:
    ball = solid(trimesh.creation.icosphere(5, radius=30.0), HERE)
    found = nearest(ball, travel((-60.0, 5.0, 28.0), (60.0, 5.0, 28.0)), BALL, 1.0)
    expected = np.hypot(5.0, 36.0) - 38.0
    assert expected - 0.01 < found.distance < expected + 0.03  # the mesh lies inside the sphere by its chords


def test_farther_than_the_limit_is_nothing() -> None:
    assert nearest(block(), travel((0.0, 0.0, 11.5), (9.0, 0.0, 11.5)), CYLINDER, 1.0).place == -1


def test_a_thin_rib_between_two_points_of_the_way_is_found() -> None:
    """0.2 mm thick, in the middle of a rapid of 1000 mm whose ends are far from it."""
    rib = solid(trimesh.creation.box((0.2, 50.0, 40.0)), HERE)
    found = nearest(rib, travel((-500.0, 0.0, 19.0), (503.0, 0.0, 19.0)), CYLINDER, 0.5)
    assert found.distance == pytest.approx(-1.0, abs=0.02)
    assert nearest(rib, travel((-500.0, 0.0, 20.6), (503.0, 0.0, 20.6)), CYLINDER, 0.5).place == -1


def test_the_normal_is_where_the_body_reaches_farthest() -> None:
    """f(p) = n . p - h(n), and no other direction gives more: the bound that everything rests on."""
    rng = np.random.default_rng(3)
    for piece in (BALL[0], CYLINDER[0], CONE[0], BULL[0], np.array([7.0, 3.0, 2.0, 30.0, 1.5])):
        rho, z = rng.uniform(0.0, 30.0, 400), rng.uniform(-20.0, 60.0, 400)
        distance, radial, axial = signed(piece, rho, z)
        assert np.allclose(radial * rho + axial * z - support(piece, axial), distance, atol=1e-9)
        for angle in np.linspace(0.0, np.pi, 181):
            other = np.sin(angle) * rho + np.cos(angle) * z - support(piece, np.full(400, np.cos(angle)))
            assert (other <= distance + 1e-9).all()


def test_planes_part_triangle_and_turning_tool_wherever_it_stands() -> None:
    """The bound of a cell, for any direction, against many moments of a tool that turns by up to 70 degrees."""
    rng = np.random.default_rng(4)
    moments = np.linspace(0.0, 1.0, 41)
    over = 0
    for _ in range(60):
        a, b, n = rng.normal(size=(3, 3))
        a /= np.linalg.norm(a)
        b = a + rng.uniform(0.1, 1.0) * b / np.linalg.norm(b)
        b /= np.linalg.norm(b)
        n = a + b + 0.5 * n / np.linalg.norm(n)
        n /= np.linalg.norm(n)
        tips, corners = rng.uniform(-5.0, 5.0, (1, 2, 3)), rng.uniform(-30.0, 30.0, (1, 3, 3))
        piece = np.array([rng.uniform(0.0, 9.0), rng.uniform(0.0, 9.0), rng.uniform(0.0, 9.0), rng.uniform(10.0, 90.0), 1.0])
        cell = search._Cells(corners, n[None], tips, np.stack((a, b))[None], np.zeros(1, dtype=np.int64))
        turning = slerp(np.repeat(a[None], 41, axis=0), np.repeat(b[None], 41, axis=0), moments)
        reach = (tips[0, 0] + moments[:, None] * (tips[0, 1] - tips[0, 0])) @ n + support(piece, turning @ n)
        true = float((corners[0] @ n).min() - reach.max())
        assert float(cell.apart(n[None], piece)[0]) <= true + 1e-9
        over += reach.max() > max(reach[0], reach[-1]) + 0.1
    assert over > 10  # in these the tool reaches farthest on the path, not at its ends


def test_random_tools_that_turn_agree_with_dense_points() -> None:
    """Independent: points all over the mesh, at many moments."""
    rng = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(2, radius=30.0)
    body, points = solid(mesh, HERE), dense(mesh, 6)
    for _ in range(12):
        (r0, r1), z0 = rng.uniform(0.0, 12.0, 2), rng.uniform(0.0, 10.0)
        piece = np.array([[r0, z0, r1, z0 + rng.uniform(0.5, 40.0), rng.uniform(0.0, 4.0)]])
        a, b = rng.normal(size=(2, 3))
        a /= np.linalg.norm(a)
        b = a + 0.6 * b / np.linalg.norm(b)
        b /= np.linalg.norm(b)
        p, q = rng.uniform(-60.0, 60.0, (2, 3))
        moving = Swept(np.array([[p, q]]), np.array([[a, b]]), np.zeros(1, dtype=np.int64))
        found = nearest(body, moving, piece, 3.0)
        seen = min(float(around(piece[0], points - (p + u * (q - p)), np.repeat(slerp(a[None], b[None], np.array([u])),
                                                                              len(points), axis=0))[0].min())
                   for u in np.linspace(0.0, 1.0, 40))
        assert found.distance <= min(seen, 3.0) + EXACT + PART * max(3.0 - seen, 0.0)
        assert found.distance >= min(seen - 1.5, 3.0)


def random_case(rng: np.random.Generator) -> tuple[Swept, Floats]:
    """A way of five turning pieces, and a tool of two frusta."""
    tips = rng.uniform(-50.0, 50.0, (6, 3))
    axes = np.array([0.0, 0.0, 1.0]) + rng.uniform(-0.6, 0.6, (6, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    moving = Swept(np.stack((tips[:-1], tips[1:]), axis=1), np.stack((axes[:-1], axes[1:]), axis=1),
                   np.arange(5))
    r0, r1, r2 = rng.uniform(1.0, 10.0, 3)
    return moving, np.array([[r0, r0, r0, r0, r0], [r1, 10.0, r2, 60.0, 0.0]])


@pytest.mark.slow  # make numeric runs it; numpy's search next to dense points is held below
@pytest.mark.numeric
def test_compiled_loops_find_what_numpy_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    mesh = trimesh.creation.icosphere(2, radius=12.0)
    near = 0
    for _ in range(30):
        moving, pieces = random_case(rng)
        body = solid(mesh.copy().apply_translation(rng.uniform(-60.0, 60.0, 3)), HERE)
        found: list[Nearest] = []
        for fast in (True, False):
            monkeypatch.setattr(search, "wanted", lambda *_, fast=fast: fast)
            found.append(nearest(body, moving, pieces, 2.0))
        assert found[0].distance == pytest.approx(found[1].distance,
                                                  abs=EXACT + 2.0 * PART * (2.0 - found[0].distance))
        assert (found[0].place < 0) == (found[1].place < 0)
        near += found[0].place >= 0
    assert 5 < near < 25


def test_a_point_is_inside_or_not() -> None:
    ball = solid(trimesh.creation.icosphere(3, radius=30.0), HERE)
    rng = np.random.default_rng(2)
    for point in rng.uniform(-40.0, 40.0, (60, 3)):
        if not 29.5 < np.linalg.norm(point) < 30.0:
            assert ball.holds(point) == (np.linalg.norm(point) < 30.0)


def dense(mesh: trimesh.Trimesh, parts: int) -> Floats:
    """Points on all triangles."""
    i, j = np.meshgrid(np.arange(parts + 1), np.arange(parts + 1), indexing="ij")
    u, v = (i[i + j <= parts] / parts)[:, None, None], (j[i + j <= parts] / parts)[:, None, None]
    a, b, c = np.moveaxis(np.asarray(mesh.triangles), 1, 0)
    return np.asarray(((1.0 - u - v) * a + u * b + v * c).reshape(-1, 3))


def test_a_stretch_that_begins_inside_a_body_is_found() -> None:
    """The first one passes far next to the body, the second one is in it altogether."""
    scene = Scene((Body("fixture a", solid(trimesh.creation.box((300.0, 300.0, 300.0)), HERE)),), 1.0, 0.02)
    form = ToolForm(1, CYLINDER, np.array([CUTTER]))
    outside, inside = travel((400.0, 0.0, 0.0), (500.0, 0.0, 0.0)), travel((0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    assert not touches(scene, form, outside)
    found = touches(scene, form, joined([outside, Swept(inside.tip, inside.axis, inside.row + 7)]))
    assert [(touch.distance, touch.place) for touch in found] == [(-np.inf, 7)]


def test_the_collision_manager_agrees_where_tools_stand_clear() -> None:
    """Independent: fcl between the mesh and the tool as a polyhedron of 400 sides, standing still."""
    rng = np.random.default_rng(11)
    mesh = trimesh.creation.icosphere(2, radius=20.0)
    manager = trimesh.collision.CollisionManager()
    manager.add_object("ball", mesh)
    body, seen = solid(mesh, HERE), 0
    for _ in range(20):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        tip = rng.uniform(-45.0, 45.0, 3)
        r0, r1, high = rng.uniform(1.0, 10.0, 3)
        outline = [[0.0, 0.0], [r0, 0.0], [r1, 4.0 * high], [0.0, 4.0 * high]]
        tool = trimesh.creation.revolve(outline, sections=400)
        turn = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], axis)
        turn[:3, 3] = tip
        expected = manager.min_distance_single(tool, transform=turn)
        if expected > 0.0:
            standing = Swept(np.tile(tip, (1, 2, 1)), np.tile(axis, (1, 2, 1)), np.zeros(1, dtype=np.int64))
            found = nearest(body, standing, np.array([[r0, 0.0, r1, 4.0 * high, 0.0]]), expected + 0.3)
            assert found.distance == pytest.approx(expected, abs=0.01)
            seen += 1
    assert seen > 8
