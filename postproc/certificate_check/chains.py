"""Whether a certificate of a chain of axes proves what it says: rotary positions without a gap, slides inside their travel.

For each box of rotary positions the tip's corners are carried back through the axes before the first slide, the tool forward
through the rest, and the slides follow by Cramer's rule with rounding. Boxes that do not confirm what the file states are
cut. The chain is compared with the machine file, read without the project's loader.
"""

from __future__ import annotations

import math
import re
from hashlib import sha256
from itertools import product
from typing import Any

import numpy as np

from postproc.certificate_check.balls import Ball, FloatArray, ball, cos_sin, scalar, vector
from postproc.certificate_check.boxes import Rejected, StatedBox, covering, halves
from postproc.certificate_check.check import FORM
from postproc.witness.machine import chain

LETTERS, DEEPEST, AT_ONCE = "ab", 16, 1_000
STATED = ("pole", "slides", "travel")
_LINE = re.compile(r"(\.|[abAB]{1,64}) (\S+) (\S+) (\S+)")
BallPoint = list[Ball]


def chain_confirmed(found: dict[str, Any]) -> dict[str, Any]:
    """What the certificate proves: least bounds, number of boxes.

    Raises:
        Rejected: where it does not.
    """
    if found["certificate"] != FORM or found["covers"] != "region" or found["region"]["of"] != "tip":
        raise Rejected(f"form {found['certificate']!r} of a certificate that covers {found['covers']!r} is not known here")
    margin, span = float(found["margin"]), float(found["slides_margin"])
    if not (0.0 <= margin < 1.0 and 0.0 < span <= 1.0):
        raise Rejected(f"margins of {margin:g} and {span:g} prove nothing")
    boxes = _boxes(found)
    least = np.min([box.stated for box in boxes], axis=0)
    if {name: float(v) for name, v in zip(STATED, least, strict=True)} != found["proved"]:
        raise Rejected(f"`proved` says {found['proved']}, the boxes have {least.tolist()}")
    if not (least >= [margin, span, 0.0]).all():
        raise Rejected(f"boxes state {least.tolist()}, less than the margins {margin:g}, {span:g} and 0")
    looked = _prove(found, boxes)
    region = found["region"]
    return {"region": {key: value for key, value in region.items() if key != "turns_rad"} | {
        "turns_deg": {name: np.round(np.degrees(row), 6).tolist() for name, row in region["turns_rad"].items()}},
        "boxes": len(boxes), "looked_at": looked, "margin": margin} | {
        f"{name}_at_least": float(v) for name, v in zip(STATED, least, strict=True)}


def _boxes(found: dict[str, Any]) -> list[StatedBox]:
    lines = found["boxes"]
    if sha256("\n".join(lines).encode()).hexdigest() != found["digest"]:
        raise Rejected("the boxes are not those that its digest was taken of")
    stated: dict[str, FloatArray] = {}
    for line in lines:
        read = _LINE.fullmatch(line)
        if read is None:
            raise Rejected(f"{line!r} is no box")
        path = "" if read[1] == "." else read[1]
        values = np.array([float(v) for v in read.groups()[1:]])
        if path in stated or not np.isfinite(values).all():
            raise Rejected(f"box {read[1]} is there twice, or states no numbers")
        stated[path] = values
    turning = [axis["letter"] for axis in found["chain"]["axes"] if axis["rotary"]]
    spans = np.array([found["region"]["turns_rad"][name] for name in turning], np.float64).reshape(-1, 2)
    if len(found["region"]["turns_rad"]) != len(turning) or not (np.isfinite(spans).all() and (
            spans[:, 0] <= spans[:, 1]).all()):
        raise Rejected(f"the ranges of the rotary axes {found['region']['turns_rad']} are none")
    return covering(stated, spans, LETTERS, lambda at: ", ".join(
        f"{name} {math.degrees(v):g}" for name, v in zip(turning, at, strict=True)) + " degrees")


def _prove(found: dict[str, Any], boxes: list[StatedBox]) -> int:
    todo, count = list(boxes), 0
    while todo:
        some, todo = todo[-AT_ONCE:], todo[:-AT_ONCE]
        count += len(some)
        lower, upper, stated = (np.array([getattr(box, name) for box in some]) for name in ("lower", "upper", "stated"))
        middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        radius = half * (1.0 + 1e-12) + 1e-15 * (1.0 + np.abs(middle))
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            here = _bounds(found, [ball(middle[:, k]) for k in range(middle.shape[1])], len(some))
            over = _bounds(found, [Ball(middle[:, k], radius[:, k]) for k in range(middle.shape[1])], len(some))
        for k in np.flatnonzero(~(over >= stated).all(axis=1)).tolist():
            box = some[k]
            where = ", ".join(f"{math.degrees(v):.6g}" for v in middle[k])
            if (here[k] < stated[k] * (1.0 - 1e-9) - 1e-7).any() or not len(middle[k]):
                raise Rejected(f"box {box.path or '.'} states more than there is at {where} degrees: "
                               f"{dict(zip(STATED, here[k].round(6).tolist(), strict=True))}, stated {stated[k].tolist()}")
            if box.cuts >= DEEPEST:
                raise Rejected(f"box {box.path or '.'}, round {where} degrees, is not confirmed: its bounds are too close")
            todo += halves(box, int(half[k].argmax()), LETTERS)
    return count


def _bounds(found: dict[str, Any], angles: list[Ball], n: int) -> FloatArray:
    """(N, 3) lower bounds of STATED with the rotary axes in balls (N,) each."""
    axes, tool = found["chain"]["axes"], float(found["region"]["tool_mm"])
    direction = np.array(found["chain"]["tool_axis"], np.float64)
    turning = dict(zip([k for k, axis in enumerate(axes) if axis["rotary"]], [cos_sin(angle) for angle in angles],
                       strict=True))
    first = min(k for k, axis in enumerate(axes) if not axis["rotary"])
    end, directions = [_known(-tool * v, n) for v in direction], dict[int, BallPoint]()
    for k in range(len(axes) - 1, first - 1, -1):
        axis = axes[k]
        if axis["rotary"]:
            end = _about(axis, turning[k], end)
            directions = {i: _turned(axis["direction"], turning[k], along) for i, along in directions.items()}
        else:
            directions[k] = [_known(v, n) for v in axis["direction"]]
    slides = sorted(directions)
    a, b, c = (directions[k] for k in slides)
    sides = (vector(b, c), vector(c, a), vector(a, b))
    volume = scalar(a, sides[0])
    left = np.full(n, np.inf)
    for corner in product(*(found["region"][f"{name}_mm"] for name in "xyz")):
        tip = [_known(float(v), n) for v in corner]
        for k in range(first):
            c_s = turning[k]
            tip = _about(axes[k], (c_s[0], -c_s[1]), tip)
        gap = [x - y for x, y in zip(tip, end, strict=True)]
        for k, side in zip(slides, sides, strict=True):
            q = scalar(gap, side) * volume.inverse()
            for sign, stop in zip((1.0, -1.0), axes[k]["travel"], strict=True):
                if stop is not None:
                    room = ((q - float(stop)) * sign).least()
                    left = np.minimum(left, np.where(np.isfinite(room), room, -np.inf))
    size = np.maximum(np.where(volume.m > 0.0, volume.least(), -volume.most()), 0.0)
    return np.stack([_pole(axes, turning, direction, n), size, left], axis=1)


def _pole(axes: list[dict[str, Any]], turning: dict[int, tuple[Ball, Ball]], tool: FloatArray, n: int) -> FloatArray:
    """Lower bound of the sine between the tool and the rotary axis nearest the part, by the size of their vector product."""
    if not turning:
        return np.ones(n)
    first, *others = sorted(turning)
    along = [_known(v, n) for v in tool]
    for k in reversed(others):
        along = _turned(axes[k]["direction"], turning[k], along)
    across = vector([_known(v, n) for v in axes[first]["direction"]], along)
    square = scalar(across, across).least()
    by_cosine = 1.0 - (np.abs((c := scalar([_known(v, n) for v in axes[first]["direction"]], along)).m) + c.r) ** 2 - 1e-12
    return np.sqrt(np.maximum(np.where(np.isfinite(square), np.maximum(square, by_cosine), 0.0), 0.0)) * (1.0 - 1e-12)


def _known(value: float, n: int) -> Ball:
    return ball(np.full(n, float(value)))


def _turned(along: Any, angle: tuple[Ball, Ball], v: BallPoint) -> BallPoint:
    """About a unit vector: v + sin (u x v) + (1 - cos) u x (u x v)."""
    u = [_known(float(x), len(v[0].m)) for x in along]
    once = vector(u, v)
    twice, left = vector(u, once), ball(np.ones_like(v[0].m)) - angle[0]
    return [x + angle[1] * y + left * z for x, y, z in zip(v, once, twice, strict=True)]


def _about(axis: dict[str, Any], angle: tuple[Ball, Ball], v: BallPoint) -> BallPoint:
    """A point turned about the line of an axis."""
    place = [float(x) for x in axis["point"]]
    moved = _turned(axis["direction"], angle, [x - p for x, p in zip(v, place, strict=True)])
    return [x + p for x, p in zip(moved, place, strict=True)]


def about_chain(found: dict[str, Any], table: dict[str, Any]) -> None:
    """Compare the chain with a machine file's merged values.

    Raises:
        Rejected: where it is another machine's.
    """
    own, stated = chain(table), found["chain"]
    if [axis["letter"] for axis in stated["axes"]] != list(own.letters):
        raise Rejected(f"it has axes {[axis['letter'] for axis in stated['axes']]}, the machine file {list(own.letters)}")
    if not np.allclose(own.tool, stated["tool_axis"], rtol=0.0, atol=1e-9):
        raise Rejected(f"its tool axis is {stated['tool_axis']}, in the machine file {own.tool.tolist()}")
    for axis in stated["axes"]:
        name = axis["letter"]
        if axis["rotary"] is not (name in "ABC") or not np.allclose(own.direction[name], axis["direction"], rtol=0.0,
                                                                    atol=1e-9):
            raise Rejected(f"axis {name} turns or moves otherwise in the machine file")
        if axis["rotary"] and not np.allclose(own.point[name], axis["point"], rtol=1e-9, atol=1e-9):
            raise Rejected(f"the line of {name} goes through {axis['point']}, in the machine file "
                           f"{own.point[name].tolist()}")
        _travel(name, axis, table, found["region"])


def _travel(name: str, axis: dict[str, Any], table: dict[str, Any], region: dict[str, Any]) -> None:
    """The travel of a slide, and the range of a rotary axis inside its own."""
    travel = table["axes"][name].get("travel", "unlimited")
    ends = [None, None] if isinstance(travel, str) else [float(v) for v in travel]
    if not axis["rotary"]:
        if axis["travel"] != ends:
            raise Rejected(f"the travel of {name} is {axis['travel']}, in the machine file {ends}")
        return
    low, high = np.degrees(region["turns_rad"][name]).tolist()
    if ends[0] is not None and ends[1] is not None and not (ends[0] - 1e-9 <= low <= high <= ends[1] + 1e-9):
        raise Rejected(f"{name} from {low:g} to {high:g} degrees is outside its travel {ends}")
