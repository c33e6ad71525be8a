"""A box of tips proved to be in reach of a chain of axes, with its rotary axes anywhere in a range.

For fixed rotary axes the slides are affine in the tip, so that the corners of the box hold the most of each. A box here is
one of rotary positions, halved until intervals of the turns show all slides inside their travel. With the tip carried back
through the rotary axes before the first slide to u, and the tool brought forward to t from behind,

    M q = u - t,   M the slides' directions, turned by rotary axes between them.

Two things are singular: the tool along the rotary axis nearest the part (`pole`: the sine of the angle between them), and
slides that span no space (`slides`: |det M|). Source: product of exponentials, as `kinematics/serial.py`.
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import Literal

import numpy as np

from machines.certificate.spans import Span, crossed, dotted, joined, spanned, turned_by
from machines.kinematics.chain import Joint
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MOST, AT_ONCE, DEEPEST = 400_000, 4_000, 60
"""boxes that a search may look at; at a time; halvings of one"""
HALVES = "ab", "AB"
"""letters of the path to a box: lower and upper half of the first and the second rotary axis in the chain"""
CHAIN_NAMES: tuple[Literal["pole", "slides", "travel"], ...] = ("pole", "slides", "travel")
"""what the bounds of a box are of: no unit, no unit, mm"""
NO_SLIDES = 0.01
"""least |det M| that is proved"""
ChainShortfall = Literal["", "travel", "pole", "slides", "undecided"]


@dataclass(frozen=True, eq=False)
@arrays(tool_axis="3", travel="3 2")
class ChainOfAxes:
    """Three slides and up to two rotary axes from the workpiece to the tool, and the travel of the slides in chain order,
    mm."""

    joints: tuple[Joint, ...]
    tool_axis: Floats
    tool: float
    travel: Floats

    @cached_property
    def turns(self) -> tuple[Joint, ...]:
        """Rotary axes in chain order."""
        return tuple(joint for joint in self.joints if joint.rotary)

    @cached_property
    def slides(self) -> tuple[Joint, ...]:
        """Slides in chain order."""
        return tuple(joint for joint in self.joints if not joint.rotary)

    def reached(self, tips: Floats, angles: Span) -> tuple[Span, Span, Span]:
        """(q (N, 3, P) mm, sine of the pole's angle (N,), |det M| (N,)) of tips (P, 3) at boxes of angles (N, R)."""
        cos_sin = {joint.name: turned_by(angles[:, k]) for k, joint in enumerate(self.turns)}
        first = next(k for k, joint in enumerate(self.joints) if not joint.rotary)
        n = len(angles.lo)
        u = spanned(np.broadcast_to(tips.T, (n, *tips.T.shape)))
        for joint in self.joints[:first]:
            c, s = cos_sin[joint.name]
            u = _turned(u - joint.point[:, None], joint.direction, c, -s) + joint.point[:, None]
        t, carried = spanned(np.broadcast_to((-self.tool * self.tool_axis)[:, None], (n, 3, 1))), list[Span]()
        for joint in reversed(self.joints[first:]):
            if joint.rotary:
                c, s = cos_sin[joint.name]
                t = _turned(t - joint.point[:, None], joint.direction, c, s) + joint.point[:, None]
                carried = [_turned(v, joint.direction, c, s) for v in carried]
            else:
                carried.insert(0, spanned(np.broadcast_to(joint.direction[:, None], (n, 3, 1))))
        matrix = joined(carried, 2)
        return _solved(matrix, u - t), self._pole(cos_sin, n), _size(matrix)

    def rates(self, slides: Floats, angles: Span) -> Span:
        """J (N, 6, J): rates of tip and tool axis in the table frame per joint, in chain order, slides at (3,) mm, boxes of
        angles (N, R): a rotary axis w moves the tip by w x (tip - point), the axis by w x axis, both turned by what is
        before it.
        """
        n, at = len(angles.lo), dict(zip((joint.name for joint in self.slides), slides.tolist(), strict=True))
        cos_sin = {joint.name: turned_by(angles[:, k]) for k, joint in enumerate(self.turns)}

        def fixed(v: Floats) -> Span:
            return spanned(np.broadcast_to(v[:, None], (n, 3, 1)))
        tip, axis, none = fixed(-self.tool * self.tool_axis), fixed(self.tool_axis), fixed(np.zeros(3))
        found = list[tuple[Span, Span]]()
        for joint in reversed(self.joints):
            w = joint.direction
            if joint.rotary:
                c, s = cos_sin[joint.name]
                tip, axis = _turned(tip - joint.point[:, None], w, c, s), _turned(axis, w, c, s)
                found = [(_turned(v, w, c, s), _turned(d, w, c, s)) for v, d in found]
                found.insert(0, (_across(w, tip), _across(w, axis)))
                tip = tip + joint.point[:, None]
            else:
                tip = tip + (at[joint.name] * w)[:, None]
                found.insert(0, (fixed(w), none))
        return joined([joined([v, d], 1) for v, d in found], 2)

    def _pole(self, cos_sin: dict[str, tuple[Span, Span]], n: int) -> Span:
        """Sine of the angle between the tool and the rotary axis nearest the part; 1 without one."""
        if not self.turns:
            return spanned(np.ones(n))
        tool = spanned(np.broadcast_to(self.tool_axis[:, None], (n, 3, 1)))
        for joint in reversed(self.turns[1:]):
            tool = _turned(tool, joint.direction, *cos_sin[joint.name])
        cosine = dotted(tool[:, :, 0], spanned(self.turns[0].direction))
        most = np.minimum(np.maximum(np.abs(cosine.lo), np.abs(cosine.hi)), 1.0)
        across = np.where((cosine.lo <= 0.0) & (cosine.hi >= 0.0), 0.0, np.minimum(np.abs(cosine.lo), np.abs(cosine.hi)))
        return Span(np.sqrt(1.0 - most**2), np.sqrt(1.0 - np.minimum(across, 1.0) ** 2))


def _turned(v: Span, along: Floats, c: Span, s: Span) -> Span:
    """v (N, 3, P) turned about the unit vector `along` by angles of cosine and sine (N,) (Rodrigues)."""
    over = np.array([[0.0, -along[2], along[1]], [along[2], 0.0, -along[0]], [-along[1], along[0], 0.0]])
    rows = Span(np.swapaxes(v.lo, 1, 2), np.swapaxes(v.hi, 1, 2))
    still, aside, flat = rows.by(np.outer(along, along)), rows.by(over), rows.by(-over @ over)
    turned = still + aside * s[:, None, None] + flat * c[:, None, None]
    return Span(np.swapaxes(turned.lo, 1, 2), np.swapaxes(turned.hi, 1, 2))


def _across(w: Floats, v: Span) -> Span:
    """w x v of v (N, 3, 1)."""
    over = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    return v[:, :, 0].by(over)[:, :, None]


def _solved(matrix: Span, gap: Span) -> Span:
    """q (N, 3, P) with M q = gap: with Y near the inverse of M, q = Y gap + (I - Y M) q, whose size is bounded first."""
    middle = matrix.middle
    bad = np.abs(np.linalg.det(middle)) < NO_SLIDES
    inverse = np.linalg.inv(np.where(bad[:, None, None], np.eye(3), middle))
    first = _times(inverse, gap)
    off = spanned(np.eye(3)) - _times(inverse, matrix)
    rest = np.maximum(np.abs(off.lo), np.abs(off.hi))
    share = rest.sum(axis=2).max(axis=1)
    large = np.maximum(np.abs(first.lo), np.abs(first.hi)).max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(((share < 1.0) & ~bad)[:, None], large / (1.0 - share)[:, None], np.inf)
        spread = np.where(rest.sum(axis=2)[:, :, None] > 0.0, rest.sum(axis=2)[:, :, None] * most[:, None], 0.0)
    spread = np.where(bad[:, None, None], np.inf, spread)
    return Span(first.lo - spread, first.hi + spread)


def _times(fixed: Floats, of: Span) -> Span:
    """Matrices (N, 3, 3) times spans (N, 3, P)."""
    middle, radius = fixed @ of.middle, np.abs(fixed) @ of.radius
    return Span(middle - radius, middle + radius)


def _size(matrix: Span) -> Span:
    """|det M| (N,)."""
    a, b, c = (matrix[:, :, k] for k in range(3))
    value = dotted(a, crossed(b, c))
    sure = (value.lo > 0.0) | (value.hi < 0.0)
    low, high = np.abs(value.lo), np.abs(value.hi)
    return Span(np.where(sure, np.minimum(low, high), 0.0), np.maximum(low, high))


@dataclass(frozen=True, eq=False)
@arrays(lower="3", upper="3", turns="R 2")
class AskedOfChain:
    """Tips between `lower` and `upper` (3,) mm in the table frame, rotary axes in `turns` (R, 2) rad; least sine of the
    pole."""

    chain: ChainOfAxes
    lower: Floats
    upper: Floats
    turns: Floats
    margin: float

    @cached_property
    def corners(self) -> Floats:
        """(8, 3) mm"""
        return np.stack(np.meshgrid(*zip(self.lower, self.upper, strict=True)), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
@arrays(bounds="N 3", tip="3", turned="R")
class ProvedChain:
    """Boxes of rotary positions by the path of halves to each, with bounds (N, 3) of CHAIN_NAMES; or what is short, and
    where."""

    paths: tuple[str, ...]
    bounds: Floats
    tried: int
    lack: ChainShortfall = ""
    tip: Floats = field(default_factory=lambda: np.zeros(3))
    turned: Floats = field(default_factory=lambda: np.zeros(0))
    value: float = 0.0
    slide: str = ""


def looked(asked: AskedOfChain, angles: Span) -> tuple[Floats, Floats]:
    """(bounds (N, 3) of CHAIN_NAMES, travel left (N, 3, P) mm at each slide and corner) over boxes of angles (N, R)."""
    q, pole, slides = asked.chain.reached(asked.corners, angles)
    low, high = asked.chain.travel[:, 0][:, None], asked.chain.travel[:, 1][:, None]
    left = np.nan_to_num(np.minimum(q.lo - low, high - q.hi), nan=-np.inf, posinf=np.inf)
    return np.stack([pole.lo, slides.lo, left.min(axis=(1, 2))], axis=1), left


def prove_chain(asked: AskedOfChain) -> ProvedChain:
    """The boxes, or the tip and the rotary positions that stand against it."""
    todo = [("", asked.turns[:, 0], asked.turns[:, 1])]
    paths, bounds, tried = list[str](), list[Floats](), 0
    due = np.array([asked.margin, NO_SLIDES, 0.0])
    while todo:
        some, todo = todo[-AT_ONCE:], todo[:-AT_ONCE]
        box = Span(np.array([lower for _, lower, _ in some]), np.array([upper for _, _, upper in some]))
        tried += len(some)
        at, left = looked(asked, spanned(box.middle))
        if (short := _short(asked, box, at, left, due, tried)) is not None:
            return short
        found, _ = looked(asked, box)
        good: Bools = np.asarray((found >= due).all(axis=1))
        paths += [some[k][0] for k in np.flatnonzero(good)]
        bounds.append(found[good])
        rest = [some[k] for k in np.flatnonzero(~good)]
        if rest and (tried > MOST or len(rest[0][0]) > DEEPEST or not len(asked.turns)):
            middle = 0.5 * (rest[0][1] + rest[0][2])
            return ProvedChain((), np.zeros((0, 3)), tried, "undecided", asked.corners[0], middle)
        todo += [half for one in rest for half in _halves(one)]
    order = sorted(range(len(paths)), key=lambda k: paths[k])
    return ProvedChain(tuple(paths[k] for k in order), np.concatenate(bounds)[order], tried)


def _short(asked: AskedOfChain, box: Span, at: Floats, left: Floats, due: Floats, tried: int) -> ProvedChain | None:
    """What is short in the middle of a box, the worst of them."""
    lack = at - due
    column = next((j for j in (2, 1, 0) if lack[:, j].min() < 0.0), None)
    if column is None:
        return None
    k = int(lack[:, column].argmin())
    slide, corner = np.unravel_index(int(left[k].argmin()), left[k].shape)
    return ProvedChain((), np.zeros((0, 3)), tried, CHAIN_NAMES[column], asked.corners[int(corner)], box.middle[k],
                       float(at[k, column]), asked.chain.slides[int(slide)].name)


def _halves(box: tuple[str, Floats, Floats]) -> list[tuple[str, Floats, Floats]]:
    """Across the wider range."""
    path, lower, upper = box
    i = int((upper - lower).argmax())
    middle = 0.5 * (lower[i] + upper[i])
    below, above = upper.copy(), lower.copy()
    below[i] = above[i] = middle
    return [(path + HALVES[0][i], lower, below), (path + HALVES[1][i], above, upper)]
