"""Draw the picture of the README: the blade sample and what the axes of one machine do for it (plain SVG).

    python samples/make_picture.py [OUT.svg]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import machines
import postproc
import toolpaths
from postproc.setup.model import load_setup

HERE = Path(__file__).parent
WIDTH, HEIGHT, LEFT = 960, 420, 440


def polyline(points: np.ndarray, colour: str, width: float) -> str:
    """One line through points (N, 2), in picture coordinates."""
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}"/>'


def isometric(p: np.ndarray) -> np.ndarray:
    """Points (N, 3) seen from the front right, (N, 2) with y downwards."""
    turn = np.radians(35.0)
    x = np.cos(turn) * p[:, 0] - np.sin(turn) * p[:, 1]
    depth = np.sin(turn) * p[:, 0] + np.cos(turn) * p[:, 1]
    return np.stack([x, -0.85 * p[:, 2] + 0.45 * depth], axis=1)


def fitted(points: np.ndarray, box: tuple[float, float, float, float], keep: bool) -> np.ndarray:
    """Points scaled into the box (x, y, width, height), with one scale for both directions if `keep`."""
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-9)
    scale = np.array(box[2:]) / size
    if keep:
        scale = np.full(2, scale.min())
    return np.array(box[:2]) + (points - low) * scale + 0.5 * (np.array(box[2:]) - size * scale)


def scene(path: toolpaths.toolpath.Toolpath) -> list[str]:
    """The path with some tool axes."""
    rows = np.flatnonzero(path.kind != 0)
    tip = path.tip[rows]
    ends = np.concatenate([tip, tip + 14.0 * path.axis[rows]])
    flat = fitted(isometric(ends), (20.0, 50.0, LEFT - 40.0, HEIGHT - 80.0), True)
    tips, tops = flat[:len(tip)], flat[len(tip):]
    ticks = [polyline(np.stack([tips[k], tops[k]]), "#d08a3c", 0.8) for k in range(0, len(tip), 12)]
    return [*ticks, polyline(tips, "#1f5f8b", 0.9)]


def charts(result: postproc.PostResult) -> list[str]:
    """Each axis over the blocks."""
    cutting = np.flatnonzero(result.program.code > 0)
    words = result.program.words[cutting]
    parts = []
    height = (HEIGHT - 80.0) / words.shape[1]
    for j, letter in enumerate(result.program.letters):
        top = 50.0 + j * height
        line = np.stack([np.arange(len(words)), -words[:, j]], axis=1)[::4]
        parts.append(f'<rect x="{LEFT + 40}" y="{top + 4}" width="{WIDTH - LEFT - 150}" height="{height - 8}" '
                     'fill="#f4f6f8"/>')
        parts.append(polyline(fitted(line, (LEFT + 44, top + 8, WIDTH - LEFT - 158, height - 16), False), "#1f5f8b", 1.0))
        unit = "°" if letter in "ABC" else " mm"
        low, high = words[:, j].min(), words[:, j].max()
        parts.append(f'<text x="{LEFT + 14}" y="{top + height / 2 + 5}" font-weight="bold">{letter}</text>')
        parts.append(f'<text x="{WIDTH - 102}" y="{top + 20}" font-size="11">{high:.1f}{unit}</text>')
        parts.append(f'<text x="{WIDTH - 102}" y="{top + height - 9}" font-size="11">{low:.1f}{unit}</text>')
    return parts


def picture() -> str:
    """The whole SVG."""
    path, found = toolpaths.read(HERE / "blade.cls")
    machine = machines.load("mikron-ucp710")
    setup, _ = load_setup(HERE / "tools.setup.toml")
    result = postproc.convert(path, machine, "linuxcnc", setup=setup, diagnostics=found)
    worst = result.comparison.worst_tip
    title = [f'<text x="20" y="28" font-size="14">CL file: {len(path)} points, tool axis all round the blade</text>',
             f'<text x="{LEFT + 14}" y="28" font-size="14">G-code for {machine.name}: {len(result.program)} blocks, '
             'read back: '
             f'tip within {1000 * worst:.1f} µm</text>']
    body = "\n".join([*title, *scene(path), *charts(result)])
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
            f'font-size="14" fill="#222">\n<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>\n{body}\n</svg>\n')


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "blade.svg"
    target.write_text(picture(), encoding="utf-8")
