"""Write bodies/: the test part as a mesh, a vise, and the set-up that names them. python samples/make_bodies.py [FOLDER]."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from cltext import Floats
from surfaces import bicubic_surface

LOW, STEPS = -25.0, 30
"""mm, bottom of the part; squares along each side of the surface"""
TABLE = -140.0
"""mm, top of the table in the table frame"""

SETUP = '''# The test part in a vise on a table, and the tool that cuts it with shank and holder: for orient and convert.
description = "test part in a vise"

[part]
origin = [-30.0, -30.0, -55.0]

[bodies]
part = "test_part.stl"
clearance = 0.5
gouge = 0.03

[bodies.table]
box = {{low = [-200.0, -200.0, -200.0], high = [200.0, 200.0, -140.0]}}

[[bodies.fixtures]]
name = "vise"
file = "vise.stl"

[[bodies.fixtures]]
name = "post"
file = "post.off"

[tools.5]
gauge_length = 140.0
flute_length = 32.0
shank = [{{diameter = 16.0, length = 13.0}}]
holder = [{{lower = 30.0, upper = 50.0, length = 40.0}}, {{diameter = 63.0, length = 60.0}}]
'''


def prism(x: Floats, y: Floats, top: Floats, low: float) -> Floats:
    """Triangles (T, 3, 3) of the solid between a grid (N, M) of heights and a plane."""
    up = np.stack((x, y, top), axis=2)
    down = np.stack((x, y, np.full_like(top, low)), axis=2)
    faces = [quads(up), quads(down[::-1])]
    for edge in (np.s_[:, 0], np.s_[-1, :], np.s_[::-1, -1], np.s_[0, ::-1]):
        faces.append(quads(np.stack((down[edge], up[edge]), axis=1)))
    return np.concatenate(faces)


def quads(grid: Floats) -> Floats:
    """Triangles (T, 3, 3) of a grid (N, M, 3), counter-clockwise seen from the side that its rows and columns turn to."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate((np.stack((a, b, c), axis=2).reshape(-1, 3, 3), np.stack((a, c, d), axis=2).reshape(-1, 3, 3)))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Floats:
    """Triangles (12, 3, 3) of a box that stands on the table; z counts from there."""
    x, y = np.meshgrid((low[0], high[0]), (low[1], high[1]), indexing="ij")
    return prism(x, y, np.full((2, 2), TABLE + high[2]), TABLE + low[2])


def stl(name: str, triangles: Floats) -> bytes:
    """Binary STL: 80 bytes, a count, and per triangle normal, corners and two bytes, in single precision."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rows = np.zeros(len(triangles), dtype=[("values", "<f4", (4, 3)), ("rest", "<u2")])
    rows["values"] = np.concatenate((normal[:, None], triangles), axis=1)
    return name.encode().ljust(80) + np.uint32(len(triangles)).tobytes() + rows.tobytes()


def off(triangles: Floats) -> bytes:
    """OFF: corners and faces as text."""
    corners, number = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    lines = ["OFF", f"{len(corners)} {len(triangles)} 0", *(" ".join(f"{v:g}" for v in p) for p in corners),
             *(" ".join(map(str, (3, *face))) for face in number.reshape(-1, 3))]
    return ("\n".join(lines) + "\n").encode()


def part() -> Floats:
    """The bicubic surface of the test part over its 60 mm square, down to LOW; in nm, as last bits differ
    between processors."""
    x, y = np.meshgrid(np.linspace(0.0, 60.0, STEPS + 1), np.linspace(0.0, 60.0, STEPS + 1), indexing="ij")
    return prism(x, y, np.round(bicubic_surface(x, y)[0][..., 2], 6), LOW)


def vise() -> Floats:
    """Two jaws at x = -30 and 30 of the table, 12 mm below the foot of the surface, on one base."""
    return np.concatenate((box((-75.0, -60.0, 20.0), (-30.0, 60.0, 72.0)), box((30.0, -60.0, 20.0), (75.0, 60.0, 72.0)),
                           box((-90.0, -60.0, 0.0), (90.0, 60.0, 19.9))))


def post() -> Floats:
    """A post next to the part that a tool leaning to +x runs into."""
    return box((80.0, -20.0, 20.0), (100.0, 20.0, 150.0))


def write(folder: Path) -> None:
    """All files of the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "test_part.stl").write_bytes(stl("bicubic test part, mm", part()))
    (folder / "vise.stl").write_bytes(stl("vise, mm", vise()))
    (folder / "post.off").write_bytes(off(post()))
    (folder / "test_part.setup.toml").write_text(SETUP.format())


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "bodies")
