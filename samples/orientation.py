"""Samples for the choice of orientations: passes of the bicubic test part at a feed that never binds, and five parts."""

from __future__ import annotations

import numpy as np
from cltext import UP, Cutter, Floats, NxFile, Triple
from surfaces import Sample, ball_centers

PLANES = np.array([0.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0])
FEED = 60000.0
"""mm/min"""


def test_part() -> Sample:
    """Planes Xp of the ball centre, y from 0 to 60, one direction; each pass begins and ends in a rapid."""
    nx = NxFile(("Passes Xp = 0, 10, 15, 20, 30, 45, 60 of the test part of Grandguillaume, Lavernhe, Tournier (2017),",
                 "ball cutter 16 mm, no feed that binds: what limits is the machine."), decimals=6)
    nx.operation("PASSES", Cutter(5, "BALL16", 16, 8, rpm=9000))
    x, y = np.meshgrid(PLANES, np.arange(61.0), indexing="ij")
    for tip in ball_centers(x, y, 8.0) - [0.0, 0.0, 8.0]:
        nx.rapid((tip[0, 0], 0, 30))
        nx.rapid(tuple(tip[0]))
        nx.feed(FEED)
        nx.go(tip[1:])
        nx.rapid((tip[-1, 0], 60, 30))
    nx.end()
    return nx.text(), nx.expected()


BALL = Cutter(5, "BALL10", 10, 5, rpm=18000)
CUT, APPROACH = 15000.0, 5000.0
"""mm/min of the five parts"""


def strip(nx: NxFile, contact: Floats, normal: Floats, axis: Triple) -> None:
    """A pass of the ball over contacts (N, 3) with normals (N, 3), in and out by 3 mm along the axis, which stands."""
    up = np.asarray(axis, float)
    tip = contact + 0.5 * BALL.diameter * (normal - up)
    nx.rapid(tip[0] + 3.0 * up, axis)
    nx.feed(APPROACH)
    nx.go(tip[:1])
    nx.feed(CUT)
    nx.go(tip[1:])
    nx.feed(APPROACH)
    nx.go([tip[-1] + 3.0 * up])


def started(title: str) -> NxFile:
    """A file with one operation of the ball cutter open."""
    nx = NxFile((title, "Ball cutter 10 mm, passes with a standing axis; for the choice of orientations."), decimals=5)
    nx.operation("STRIPS", BALL)
    return nx


def fan(count: int = 36, length: float = 90.0) -> Sample:
    """Level strips from one point to all sides of half a turn: no orientation is good for all."""
    nx = started("Fan of straight strips over half a turn.")
    for k, angle in enumerate(np.linspace(0.0, np.pi, count, endpoint=False)):
        travel = np.array([np.cos(angle), np.sin(angle), 0.0])
        ends = np.outer([8.0, length], travel)
        strip(nx, ends[:: -1 if k % 2 else 1], np.tile(UP, (2, 1)), UP)
    nx.end()
    return nx.text(), nx.expected()


def walls(levels: int = 12, half: tuple[float, float] = (60.0, 35.0), slope: float = 75.0) -> Sample:
    """Four walls of a pocket that lean by 15 degrees, level by level: strips along x and y in turn."""
    nx = started("Walls of a pocket, level by level, strips along x and y in turn.")
    lean = np.radians(slope)
    for depth in np.linspace(2.0, 20.0, levels):
        inset = depth / np.tan(lean)
        for side in range(4):
            travel, inward = np.roll([1.0, 0.0], side % 2), np.roll([0.0, 1.0], side % 2) * (1.0 if side < 2 else -1.0)
            along, across = half[side % 2] - 8.0, half[1 - side % 2] - inset
            ends = np.array([np.append(s * along * travel - across * inward, -depth) for s in (-1.0, 1.0)])
            normal = np.append(np.sin(lean) * inward, np.cos(lean))
            strip(nx, ends[:: -1 if side >= 2 else 1], np.tile(normal, (2, 1)), UP)
    nx.end()
    return nx.text(), nx.expected()


def blade_strips(count: int = 40, length: float = 140.0) -> Sample:
    """Strips along a twisted blade 40 mm wide, zig-zag, 30 degrees to x."""
    nx = started("Strips along a twisted blade, zig-zag, 30 degrees to x.")
    u = np.linspace(-0.5, 0.5, 71) * length
    turn = np.array([[np.cos(np.pi / 6), -np.sin(np.pi / 6)], [np.sin(np.pi / 6), np.cos(np.pi / 6)]])
    for k, v in enumerate(np.linspace(-20.0, 20.0, count)):
        twist, dtwist = 0.3 * u / length, 0.3 / length
        z = 15.0 - 0.002 * u**2 - 0.006 * v**2 + v * np.sin(twist)
        slope = np.stack((-0.004 * u + v * np.cos(twist) * dtwist, -0.012 * v + np.sin(twist)))
        normal = np.column_stack((*(-turn @ slope), np.ones(len(u))))
        contact = np.column_stack((*(turn @ np.stack((u, np.full(len(u), v)))), z))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        strip(nx, contact[:: -1 if k % 2 else 1], normal[:: -1 if k % 2 else 1], UP)
    nx.end()
    return nx.text(), nx.expected()


def dome(count: int = 24, radius: float = 60.0) -> Sample:
    """Strips over the top of a dome, each 15 degrees further round."""
    nx = started("Strips over the top of a dome, each further round.")
    polar = np.radians(np.linspace(-50.0, 50.0, 61))
    for k, angle in enumerate(np.linspace(0.0, np.pi, count, endpoint=False)):
        normal = np.column_stack((np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)))
        normal = normal[:: -1 if k % 2 else 1]
        strip(nx, radius * (normal - [0.0, 0.0, 1.0]), normal, UP)
    nx.end()
    return nx.text(), nx.expected()


def faces(count: int = 16, half: float = 30.0) -> Sample:
    """Top and four faces at 40 degrees, each with strips of its own axis and direction."""
    nx = started("Top and four faces at 40 degrees, strips of one axis on each.")
    lean = np.radians(40.0)
    for face in range(5):
        turn = 0.5 * np.pi * face
        away = np.array([np.cos(turn), np.sin(turn), 0.0])
        normal = np.sin(lean) * away + np.cos(lean) * np.array(UP) if face < 4 else np.array(UP)
        level = np.array([-np.sin(turn), np.cos(turn), 0.0])
        slope = np.cross(level, normal)
        middle = (1.3 if face < 4 else 0.0) * half * away
        for k, v in enumerate(np.linspace(-15.0, 15.0, count)):
            ends = np.array([middle + v * slope + s * half * level for s in (-1.0, 1.0)])
            strip(nx, ends[:: -1 if k % 2 else 1], np.tile(normal, (2, 1)), normal)
    nx.end()
    return nx.text(), nx.expected()


PARTS = {"fan": fan, "walls": walls, "blade strips": blade_strips, "dome": dome, "faces": faces}
"""the five parts of tests/benchmarks/bench_orientation.py; no files are kept of them"""


def surface(count: int = 500) -> Sample:
    """The bicubic part in `count` strips, zig-zag: a real surface of many passes."""
    nx = started("Bicubic test part in narrow strips, zig-zag.")
    x, y = np.meshgrid(np.linspace(0.0, 60.0, count), np.arange(61.0), indexing="ij")
    for k, tip in enumerate(ball_centers(x, y, 5.0) - [0.0, 0.0, 5.0]):
        travel = tip[:: -1 if k % 2 else 1]
        strip(nx, travel, np.tile(UP, (len(travel), 1)), UP)
    nx.end()
    return nx.text(), nx.expected()
