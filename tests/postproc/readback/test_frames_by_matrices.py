"""Frames of SINUMERIK against homogeneous matrices that share nothing with the reader: ends, centres and sense of arcs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.postproc.readback.test_macros import SINUMERIK
from tests.postproc.reader_kit import ORIGIN, SIEMENS, good
from toolpaths.arrays import Floats

ORDER = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
Rng = np.random.Generator


def turn(axis: int, degrees: float) -> Floats:
    """4 x 4 about one axis, by Rodrigues."""
    k = np.cross(np.eye(3), np.eye(3)[axis])
    a, made = np.radians(degrees), np.eye(4)
    made[:3, :3] = np.eye(3) + np.sin(a) * k + (1.0 - np.cos(a)) * k @ k
    return made


def stated(v: Floats | list[float]) -> str:
    return " ".join(f"{a}{x:.4f}" for a, x in zip("XYZ", v, strict=True))


def step(rng: Rng, normal: int, solid: bool) -> tuple[str, Floats]:
    """A frame without its A, and its matrix; `solid`: turned about all axes, scaled unequally at the end alone."""
    kind, made = int(rng.integers(4)), np.eye(4)
    if kind == 0:
        v = rng.uniform(-20.0, 20.0, 3).round(4)
        made[:3, 3] = v
        return f"TRANS {stated(v)}", made
    if kind == 1 and solid:
        v = rng.uniform(-80.0, 80.0, 3).round(4)
        return f"ROT {stated(v)}", turn(2, v[2]) @ turn(1, v[1]) @ turn(0, v[0])
    if kind == 1:
        angle = round(float(rng.uniform(-180.0, 180.0)), 3)
        return f"ROT RPL={angle}", turn(normal, angle)
    if kind == 2:
        size = round(float(rng.uniform(0.5, 2.0)), 3)
        return f"SCALE X{size} Y{size} Z{size}", np.diag([size, size, size, 1.0])
    axis = int(rng.integers(3))
    made[axis, axis] = -1.0
    return f"MIRROR {'XYZ'[axis]}0", made


def frames(rng: Rng, normal: int, solid: bool, now: Floats) -> tuple[str, Floats]:
    text, made = step(rng, normal, solid)
    return (f"A{text}", now @ made) if rng.random() < 0.7 else (text, made)


@pytest.mark.parametrize("seed", [1, 2])
def test_lines_in_chains_of_frames(seed: int) -> None:
    rng, now = np.random.default_rng(seed), np.eye(4)
    rows, ends = list[str](), list[Floats]()
    for _ in range(60):
        text, now = frames(rng, 2, True, now)
        p = rng.uniform(-50.0, 50.0, 3).round(4)
        rows += [text, f"G0 {stated(p)}"]
        ends.append((now @ [*p, 1.0])[:3])
        j = int(rng.integers(3))
        p[j] += 3.5
        rows.append(f"{'XYZ'[j]}={p[j]:.4f}" if rng.random() < 0.5 else f"G91 {'XYZ'[j]}3.5\nG90")
        ends.append((now @ [*p, 1.0])[:3])
    motion = good(SIEMENS, SINUMERIK + "\n".join(rows) + "\nM30\n")
    made = motion.end[1:, :3] - np.array(ORIGIN)
    moved = np.r_[True, np.abs(np.diff(made, axis=0)).max(axis=1) > 0]
    np.testing.assert_allclose(made[moved], np.array(ends), atol=1e-6)


def arc(rng: Rng, plane: int) -> tuple[list[str], Floats]:
    """Rows of an arc in the program's coordinates; its first, middle and last point."""
    i, j, n = ORDER[plane]
    c, r = rng.uniform(-20.0, 20.0, 3), rng.uniform(5.0, 20.0)
    first, sweep = rng.uniform(0.0, 2.0 * np.pi), rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 5.5)
    points = np.tile(c, (3, 1))
    for k in range(3):
        a = first + sweep * k / 2.0
        points[k, i], points[k, j] = c[i] + r * np.cos(a), c[j] + r * np.sin(a)
    code, axes, letters = 3 if sweep > 0 else 2, "XYZ", "IJK"
    how = int(rng.integers(3))
    centre = f"CR={r if abs(sweep) < np.pi else -r:.7f}" if how == 0 else " ".join(
        f"{letters[k]}{c[k] - points[0, k]:.7f}" if how == 1 else f"{letters[k]}=AC({c[k]:.7f})" for k in (i, j))
    words = [" ".join(f"{axes[k]}{p[k]:.7f}" for k in (i, j, n)) for p in points[[0, 2]]]
    return [f"G1 F100 {words[0]}", f"G{code} {words[1]} {centre}"], points


def middle(start: Floats, end: Floats, centre: Floats, ccw: bool, plane: int) -> Floats:
    """Half-way along an arc that is read back."""
    i, j, _ = ORDER[plane]
    a, b = (np.arctan2(p[j] - centre[j], p[i] - centre[i]) for p in (start, end))
    sweep = (b - a) % (2.0 * np.pi) if ccw else -((a - b) % (2.0 * np.pi))
    r, made = np.hypot(start[i] - centre[i], start[j] - centre[j]), start.copy()
    made[i], made[j] = centre[i] + r * np.cos(a + sweep / 2.0), centre[j] + r * np.sin(a + sweep / 2.0)
    return made


@pytest.mark.parametrize("plane", [17, 18, 19])
def test_arcs_in_chains_of_frames(plane: int) -> None:
    rng, now = np.random.default_rng(plane), np.eye(4)
    rows, expected = [f"G{plane}"], list[Floats]()
    for _ in range(40):
        text, now = frames(rng, ORDER[plane][2], False, now)
        made, points = arc(rng, plane)
        rows += [text, *made]
        expected.append((now @ np.c_[points, np.ones(3)].T).T[:, :3])
    motion = good(SIEMENS, SINUMERIK + "\n".join(rows) + "\nM30\n")
    at = np.flatnonzero(motion.code == 2)
    assert len(at) == 40
    for k, points in zip(at, expected, strict=True):
        work = np.array(ORIGIN)
        start, end = motion.end[k - 1, :3] - work, motion.end[k, :3] - work
        half = middle(start, end, motion.center[k] - work, bool(motion.ccw[k]), plane)
        np.testing.assert_allclose([start, half, end], points, atol=1e-4)


def test_a_full_circle_behind_a_mirror_is_taken_in_the_other_sense() -> None:
    """Its block has no axis word: the code of motion in force is that of the program."""
    motion = good(SIEMENS, SINUMERIK + "G1 F100 X10\nG3 X0 Y10 I-10\nMIRROR Y0\nJ-10\nMIRROR\nJ-10\nM30\n")
    assert motion.ccw[motion.code == 2].tolist() == [True, False, True]
