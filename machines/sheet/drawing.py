"""A drawing of a machine from three sides: linear axes with their travel, rotary axes with lines, senses and pivots."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.sax.saxutils import escape

import numpy as np

from machines.kinematics.chain import Joint
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.drawing import printed

SIZE, EDGE = 420.0, 60.0
"""of one view, and of the blank around it, in units of the picture"""
VIEWS = (("seen from the front", 0, 2, 1), ("seen from the right", 1, 2, 0), ("seen from above", 0, 1, 2))
"""name, axes to the right and up, axis along the line of sight"""
_COLOURS = {"X": "#c0392b", "Y": "#27813c", "Z": "#2456a6"}
_TURNS = "#7d3c98"


def drawing(machine: Machine) -> str:
    """The picture as SVG text: travel as boxes of the gauge point, pivots as crosses with their coordinates."""
    width, height = 2 * SIZE + 3 * EDGE, 2 * SIZE + 4 * EDGE
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
             f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="13">',
             f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>']
    for k, (name, right, up, along) in enumerate(VIEWS):
        x, y = EDGE + (k % 2) * (SIZE + EDGE), 1.5 * EDGE + (k // 2) * (SIZE + EDGE)
        parts.append(f'<g transform="translate({x:.0f} {y:.0f})">')
        parts += _view(machine, name, right, up, along)
        parts.append("</g>")
    parts += _words(machine, EDGE + SIZE + EDGE, 1.5 * EDGE + SIZE + EDGE)
    return "\n".join([*parts, _text(EDGE, EDGE * 0.6, machine.description, 16.0), "</svg>"]) + "\n"


def _view(machine: Machine, name: str, right: int, up: int, along: int) -> Iterator[str]:
    """One view: the box of travel, machine zero, rotary axes."""
    low, high = _box(machine)
    joints = [joint for joint in machine.kinematics.chain if joint.rotary]
    points = np.array([low, high, np.zeros(3), *(joint.point for joint in joints)])
    least, most = points.min(axis=0) - 30.0, points.max(axis=0) + 30.0
    scale = SIZE / float(max((most - least)[[right, up]]))

    def at(point: Floats) -> tuple[float, float]:
        return (float(point[right] - least[right]) * scale, SIZE - float(point[up] - least[up]) * scale)

    yield _text(0, -8, name)
    (x0, y1), (x1, y0) = at(low), at(high)
    yield (f'<rect x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" height="{y1 - y0:.1f}" fill="#eef2f7" stroke="#8899aa" '
           'stroke-dasharray="6 4"/>')
    zero = at(np.zeros(3))
    for axis, (dx, dy) in ((right, (1, 0)), (up, (0, -1))):
        letter = "XYZ"[axis]
        end = (zero[0] + 45 * dx, zero[1] + 45 * dy)
        yield _arrow(zero, end, _COLOURS[letter])
        yield _text(end[0] + 4, end[1] + 4, f"{letter}+", colour=_COLOURS[letter])
    for joint in joints:
        yield from _turning(joint, at(joint.point), right, up, along, f"{joint.name}'" in machine.structure.split())


def _turning(joint: Joint, at: tuple[float, float], right: int, up: int, along: int, table: bool) -> Iterator[str]:
    """A rotary axis: its pivot, and its line where that lies in the view or its sense where one looks along it.

    The sense drawn is that in which the table, or the head, is seen to turn for plus.
    """
    x, y = at
    yield f'<path d="M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12" stroke="{_TURNS}" stroke-width="2"/>'
    moved = joint.direction * (-1.0 if table else 1.0)
    toward = float(moved[along]) * (-1.0 if along == 1 else 1.0)
    if abs(toward) > 0.5:
        sweep = 0 if toward > 0 else 1
        top = y - 26 if sweep == 0 else y + 26
        yield (f'<path d="M{x + 26:.1f} {y:.1f}A26 26 0 0 {sweep} {x:.1f} {top:.1f}" fill="none" stroke="{_TURNS}" '
               'stroke-width="2" marker-end="url(#tip)"/>')
        yield _text(x + 30, y - 16, f"{joint.name}+", colour=_TURNS)
        return
    dx, dy = float(joint.direction[right]), -float(joint.direction[up])
    length = math.hypot(dx, dy) or 1.0
    dx, dy = 60 * dx / length, 60 * dy / length
    yield (f'<path d="M{x - dx:.1f} {y - dy:.1f}L{x + dx:.1f} {y + dy:.1f}" stroke="{_TURNS}" stroke-width="2" '
           'stroke-dasharray="12 3 3 3"/>')
    yield _text(x + dx + 4, y + dy - 4, joint.name, colour=_TURNS)


def _words(machine: Machine, x: float, y: float) -> Iterator[str]:
    """Numbers next to the views."""
    lines = ["machine coordinates, mm; all axes at 0", f"structure {machine.structure}", ""]
    for j, name in enumerate(machine.axis_names):
        unit = (180.0 / math.pi, "deg") if machine.rotary[j] else (1.0, "mm")
        low, high = machine.limits.lower[j] * unit[0], machine.limits.upper[j] * unit[0]
        travel = f"{low:g} to {high:g} {unit[1]}" if np.isfinite(low) else "no ends"
        lines.append(f"{name}: {travel}, {machine.limits.velocity[j] * unit[0]:g} {unit[1]}/s")
    for joint in machine.kinematics.chain:
        if joint.rotary:
            point = ", ".join(f"{v:g}" for v in joint.point)
            part = "table" if f"{joint.name}'" in machine.structure.split() else "head"
            lines.append(f"{joint.name} ({part}): through ({point})")
    lines.append("round arrows: how table or head is seen to turn for plus")
    yield ('<defs><marker id="tip" markerWidth="8" markerHeight="8" refX="6" refY="3" orient="auto">'
           f'<path d="M0 0L7 3L0 6z" fill="{_TURNS}"/></marker></defs>')
    for k, line in enumerate(lines):
        yield _text(x, y + 20.0 * k, line)


def _box(machine: Machine) -> tuple[Floats, Floats]:
    """Least and greatest place of the gauge point, mm."""
    low, high = np.zeros(3), np.zeros(3)
    for joint in machine.kinematics.chain:
        if not joint.rotary:
            j = machine.axis_names.index(joint.name)
            ends = np.outer([machine.limits.lower[j], machine.limits.upper[j]], joint.direction)
            low, high = low + ends.min(axis=0), high + ends.max(axis=0)
    return low, high


def _arrow(begin: tuple[float, float], end: tuple[float, float], colour: str) -> str:
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    length = math.hypot(dx, dy) or 1.0
    ux, uy = 7.0 * dx / length, 7.0 * dy / length
    (x, y), barbs = end, ((-ux - uy / 2, -uy + ux / 2), (-ux + uy / 2, -uy - ux / 2))
    tip = "".join(f"M{x + a:.1f} {y + b:.1f}L{x:.1f} {y:.1f}" for a, b in barbs)
    return (f'<path d="M{begin[0]:.1f} {begin[1]:.1f}L{x:.1f} {y:.1f}{tip}" fill="none" stroke="{colour}" '
            'stroke-width="2"/>')


def _text(x: float, y: float, words: str, size: float = 13.0, colour: str = "#222") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" fill="{colour}">{escape(printed(words))}</text>'
