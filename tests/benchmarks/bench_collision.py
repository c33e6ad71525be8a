"""Figures of collisions: python tests/benchmarks/bench_collision.py.

Seconds of the processor: candidates of 61 passes next to part, vise, post and table of samples/bodies, by compiled loops, by
numpy, and by trimesh's collision manager at the points of the path only; a whole program with and without
bodies; a cutter on a fine mesh.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.collision import search
from postproc.collision.solid import solid
from postproc.collision.swept import Swept
from postproc.orientation.passes.pass_bodies import PassBodies, pass_bodies
from postproc.orientation.passes.passes import work_of
from postproc.setup.model import Placement, load_setup
from toolpaths.arrays import Floats

SAMPLES = Path(__file__).parents[2] / "samples"
SETUP = SAMPLES / "bodies" / "test_part.setup.toml"
EACH = 20


def seconds(run: Callable[[], object]) -> float:
    begun = time.process_time()
    run()
    return time.process_time() - begun


def passes() -> PassBodies:
    setup, _ = load_setup(SETUP)
    path, _ = toolpaths.read(SAMPLES / "bicubic.cls")
    assert setup is not None
    work, _ = work_of(path, machines.load("mikron-ucp710"), setup, Options(setup=str(SETUP)))
    assert work is not None
    bodies, _ = pass_bodies(work, str(SETUP))
    assert bodies is not None
    return bodies


def axes(count: int) -> Floats:
    """Within 50 degrees of z, fixed seed."""
    rng = np.random.default_rng(0)
    tilt, heading = rng.uniform(0.0, np.radians(50.0), count), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack((np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)), axis=1)


def candidates(bodies: PassBodies) -> None:
    """Milliseconds of one candidate."""
    all_axes = axes(EACH * len(bodies.work.passes)).reshape(-1, EACH, 3)
    wanted = search.wanted
    bodies.touching(bodies.work.passes[0], all_axes[0, 0])
    for name, fast, every in (("compiled", True, 1), ("numpy", False, 10)):
        search.wanted = lambda *_, fast=fast: fast
        bodies.touching(bodies.work.passes[0], all_axes[0, 0])
        chosen = list(zip(bodies.work.passes, all_axes, strict=True))[::every]
        touched = 0
        begun = time.process_time()
        for one, some in chosen:
            touched += sum(bool(bodies.touching(one, axis)) for axis in some)
        count = EACH * len(chosen)
        each = 1e3 * (time.process_time() - begun) / count
        print(f"{name}: {each:.1f} ms a candidate ({count} candidates, {touched} touch)")
    search.wanted = wanted
    print(f"collision manager, at the points of the path only: {1e3 * by_manager(bodies, all_axes):.1f} ms a candidate")


def by_manager(bodies: PassBodies, all_axes: Floats) -> float:
    """Seconds of a candidate whose poses are compared with fcl, the tool as a polyhedron of 48 sides."""
    manager = trimesh.collision.CollisionManager()
    for body in bodies.bodies.bodies:
        corners = body.solid.corners.reshape(-1, 3)
        manager.add_object(body.name, trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3)))
    tool = trimesh.util.concatenate([trimesh.creation.revolve([[0, z0], [r0 + c, z0], [r1 + c, z1 + 1e-3], [0, z1 + 1e-3]])
                                     for r0, z0, r1, z1, c in bodies.forms[bodies.work.passes[0].tool].pieces])
    begun, count = time.process_time(), 0
    for one, some in list(zip(bodies.work.passes, all_axes, strict=True))[::20]:
        for axis in some[:4]:
            turn = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], axis)
            for tip in one.tip + one.shift(axis):
                turn[:3, 3] = tip
                manager.min_distance_single(tool, transform=turn)
            count += 1
    return (time.process_time() - begun) / count


def programs() -> None:
    """Seconds of a conversion."""
    path, _ = toolpaths.read(SAMPLES / "bicubic.cls")
    setup, _ = load_setup(SETUP)
    assert setup is not None
    bare = setup.model_copy(update={"bodies": None})
    machine = machines.load("mikron-ucp710")
    options = Options(setup=str(SETUP))
    without = min(seconds(lambda: postproc.convert(path, machine, setup=bare, options=options)) for _ in range(3))
    adjacent = min(seconds(lambda: postproc.convert(path, machine, setup=setup, options=options)) for _ in range(3))
    print(f"bicubic.cls, {len(path)} points: {without:.2f} s without bodies, {adjacent:.2f} s with")


def fine(count: int = 400, rows: int = 300) -> None:
    """A ball of 8 mm that follows a wavy surface of 2 count^2 triangles in rows of 300 points, contact all along."""
    x, y = np.meshgrid(np.linspace(0.0, 60.0, count + 1), np.linspace(0.0, 60.0, count + 1), indexing="ij")
    z = 2.0 * np.sin(x / 9.0) * np.cos(y / 9.0)
    grid = np.stack((x, y, z), axis=2)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    faces = np.concatenate((np.stack((a, b, c), axis=2).reshape(-1, 3, 3), np.stack((a, c, d), axis=2).reshape(-1, 3, 3)))
    surface = trimesh.Trimesh(faces.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), process=False)
    body = solid(surface, Placement(np.eye(3), np.zeros(3)))
    u, v = np.meshgrid(np.linspace(8.0, 52.0, rows), np.linspace(8.0, 52.0, 300), indexing="ij")
    zx, zy = 2.0 / 9.0 * np.cos(u / 9.0) * np.cos(v / 9.0), -2.0 / 9.0 * np.sin(u / 9.0) * np.sin(v / 9.0)
    normal = np.stack((-zx, -zy, np.ones_like(u)), axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    at = np.stack((u, v, 2.0 * np.sin(u / 9.0) * np.cos(v / 9.0)), axis=2) + 8.0 * normal - [0.0, 0.0, 8.0]
    tips = np.stack((at[:, :-1], at[:, 1:]), axis=2).reshape(-1, 2, 3)
    travel = Swept(tips, np.tile(np.array([0.0, 0.0, 1.0]), (len(tips), 2, 1)), np.arange(len(tips)))
    pieces = np.array([[0.0, 8.0, 0.0, 8.0, 8.0], [8.0, 8.0, 8.0, 30.0, 0.0]])
    taken = seconds(lambda: search.nearest(body, travel, pieces, -0.02))
    print(f"{len(travel)} pieces of a path on {len(body)} triangles, in contact: {taken:.1f} s")


if __name__ == "__main__":
    some = passes()
    candidates(some)
    programs()
    fine()
    sys.exit(0)
