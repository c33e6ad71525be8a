"""Boxes of poses halved until each is proved: every leg reaches, inside its travel, and no singular position is near.

What is proved of a box: each leg has its solution, stands inside the travel of its drive, the
cosine between rod and drive and the least singular values of the platform's matrices stay above a margin, and where that is
asked for no two parts touch and no joint comes to its stop. A box is halved
across the number of the pose that adds most to the bound. Where the pose in its middle falls short itself, that place is
the answer.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Literal

import numpy as np

from machines.certificate.clearances import Gaps, PartsOfLegs, gaps
from machines.certificate.enclosure import columns, enclosed, least_singular, set_rows
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, spanned
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MOST, AT_ONCE, DEEPEST = 300_000, 2_000, 48
"""boxes that a search may look at; at a time; halvings of one"""
FARTHEST = 1e6
"""mm, rad: a bound that is stated of what cannot touch"""
LOOKS = 1_000
"""random poses that are looked at first"""
HALVES = "xyztn", "XYZTN"
"""letters of the path to a box: lower and upper half across x, y, z, tilt, heading"""
NAMES: tuple[Literal["direct", "inverse", "held"], ...] = ("direct", "inverse", "held")
"""what the margins are of"""
GAPS: tuple[Literal["parts", "stops"], ...] = ("parts", "stops")
"""what distances are of: mm, rad"""
Shortfall = Literal["", "reach", "travel", "direct", "inverse", "held", "parts", "stops", "undecided"]


@dataclass(frozen=True, eq=False)
@arrays(lower="5", upper="5", travel="K 2", endless="K", carrier_travel="M 2")
class AskedProof:
    """What is to be proved.

    Attributes:
        lower, upper: (5,) poses, mm and rad
        travel: (K, 2) of the drives, infinite where none is to be kept
        carrier_travel: (M, 2) mm, likewise
        endless: (K,) angles, which may be counted whole turns apart
        margin: free of units, of the distances from singular positions
        travel_margin: mm, rad of arms
        parts: what is held apart, None where nothing is
        most: boxes looked at before the search is given up
    """

    poses: PosesOfBoxes
    lower: Floats
    upper: Floats
    travel: Floats
    carrier_travel: Floats
    endless: Bools
    margin: float
    travel_margin: float = 0.0
    parts: PartsOfLegs | None = None
    most: int = MOST


@dataclass(frozen=True, eq=False)
@arrays(bounds="N M", place="5")
class ProvedBoxes:
    """Boxes that cover the region, by the path of halves to each, with what is proved of it; `place` where it is not.

    Attributes:
        bounds: (N, 3) of NAMES, (N, 5) with GAPS where parts are held apart
        lack: what is short, "" of a proof; at the pose `place` (5,) it is `value`
        tried: boxes looked at
        open: of an undecided search, what was not proved of the last boxes
        pair: which of `clearances.pair_names` is too near, of parts
    """

    paths: tuple[str, ...]
    bounds: Floats
    tried: int
    lack: Shortfall = ""
    place: Floats = field(default_factory=lambda: np.zeros(5))
    value: float = 0.0
    open: Shortfall = ""
    pair: int = 0


@dataclass(frozen=True, eq=False)
@arrays(bounds="N 3", at="N 3", share="N 5", inside="N", travel_at="N", reaches="N", reaches_at="N")
class Looked:
    """N boxes: bounds over them and values in their middles, of NAMES; whether they are inside the travel, and reach."""

    bounds: Floats
    at: Floats
    share: Floats
    inside: Bools
    travel_at: Floats
    reaches: Bools
    reaches_at: Bools
    apart: Gaps | None = None

    def proved(self, margin: float) -> Bools:
        """True (N,) of boxes of which all is proved."""
        good = self.inside & self.reaches & (self.bounds >= margin).all(axis=1)
        return np.asarray(good if self.apart is None else good & (self.apart.gap >= 0.0).all(axis=1))

    def lacks(self, margin: float) -> Shortfall:
        """What is not proved of the first box of which something is not."""
        k = int(np.flatnonzero(~self.proved(margin))[0])
        if (self.bounds[k] < margin).any():
            return NAMES[int(self.bounds[k].argmin())]
        return "travel" if not self.inside[k] or self.apart is None else GAPS[int(self.apart.gap[k].argmin())]

    @property
    def whole(self) -> Floats:
        """(N, 3) or (N, 5): all bounds; a machine without such parts is as far from touching as can be written."""
        return self.bounds if self.apart is None else np.column_stack([self.bounds, np.minimum(self.apart.gap, FARTHEST)])


def look(asked: AskedProof, pose: Span) -> Looked:
    """Bounds over boxes of poses (N, 5)."""
    legs = asked.poses.legs
    here = enclosed(asked.poses, spanned(pose.middle))
    over = enclosed(asked.poses, pose)
    reaches, reaches_at = (np.asarray((one.under.lo > 0.0).all(axis=1), dtype=np.bool_) for one in (over, here))
    free, held = columns(legs)
    count = set_rows(legs)
    half = pose.radius
    direct = least_singular(here.matrix.lo[:, :count][:, :, free], over.change[:, :, :count][:, :, :, free], half)
    whole = least_singular(here.matrix.lo[:, :, held], over.change[:, :, :, held], half)
    cosine = np.where(reaches, np.nan_to_num(over.cosine.lo, nan=-np.inf).min(axis=1), -np.inf)
    bounds = np.stack([np.where(reaches, direct[0], -np.inf), cosine, np.where(reaches, whole[0], -np.inf)], axis=1)
    at = np.stack([direct[1], here.cosine.lo.min(axis=1), whole[1]], axis=1)
    spread = half * over_ends(asked, pose)
    share = np.where(np.isfinite(direct[2]) & np.isfinite(whole[2]), direct[2] + whole[2] + 1e-3 * spread, spread)
    left, left_at = _travel_left(asked, here.q, over.q)
    if (carried := asked.poses.carriers(pose)) is not None and len(legs.carriers):
        carried_at = asked.poses.carriers(spanned(pose.middle))
        assert carried_at is not None
        own, own_at = (_carriers_left(asked, one) for one in (carried, carried_at))
        left, left_at = np.minimum(left, own), np.minimum(left_at, own_at)
    apart = None
    if asked.parts is not None:
        apart = gaps(asked.poses, asked.parts, pose, here, over)
        only = (bounds >= asked.margin).all(axis=1) & (apart.gap < 0.0).any(axis=1) & np.isfinite(apart.share).all(axis=1)
        share = np.where((only & (apart.share.sum(axis=1) > 0.0))[:, None], apart.share, share)
    return Looked(bounds, at, share, left >= asked.travel_margin, left_at, reaches, reaches_at, apart)


def over_ends(asked: AskedProof, pose: Span) -> Floats:
    """(N, 5) mm that the platform joints move at most, per number of the pose, relative to the longest rod."""
    _, by, _, _ = asked.poses.ends(pose)
    if asked.poses.follows is not None:  # where nothing is proved of a box, as in its middle
        _, at, _, _ = asked.poses.ends(spanned(pose.middle))
        known = np.isfinite(by.lo) & np.isfinite(by.hi)
        by = Span(*(np.where(known, end, np.nan_to_num(rest)) for end, rest in ((by.lo, at.lo), (by.hi, at.hi))))
    most = np.sqrt((np.maximum(np.abs(by.lo), np.abs(by.hi)) ** 2).sum(axis=3)).max(axis=2)
    return np.asarray(most / (asked.poses.legs.lengths.max() or asked.poses.legs.lever), dtype=np.float64)


def _travel_left(asked: AskedProof, here: Span, over: Span) -> tuple[Floats, Floats]:
    """(N,) least distance of a drive from its ends of travel over boxes and in their middles; angles whole turns apart."""
    low, high = asked.travel.T
    turns = np.where(asked.endless & np.isfinite(low), np.floor((here.lo - low) / (2.0 * np.pi)) * 2.0 * np.pi, 0.0)
    left = np.minimum(over.lo - turns - low, high - over.hi + turns).min(axis=1)
    left_at = np.minimum(here.lo - turns - low, high - here.lo + turns).min(axis=1)
    return np.nan_to_num(left, nan=-np.inf), np.nan_to_num(left_at, nan=-np.inf)


def _carriers_left(asked: AskedProof, over: Span) -> Floats:
    """(N,) least distance of a carrier from its ends of travel."""
    low, high = asked.carrier_travel.T
    return np.asarray(np.nan_to_num(np.minimum(over.lo - low, high - over.hi).min(axis=1), nan=-np.inf))


def prove(asked: AskedProof) -> ProvedBoxes:
    """The boxes, or the place that stands against it."""
    if (short := _carried(asked)) is not None:
        return short
    if (short := _short(asked, first := spanned(_looks(asked)), look(asked, first), len(first.lo))) is not None:
        return short
    todo = [("", asked.lower, asked.upper)]
    paths, bounds, tried = list[str](), list[Floats](), 0
    open_: Shortfall = ""
    while todo:
        if tried > asked.most or len(todo[-1][0]) > DEEPEST:
            _, lower, upper = todo[-1]
            return replace(_nothing(tried, "undecided", 0.5 * (lower + upper), float(asked.margin)), open=open_)
        some, todo = todo[-AT_ONCE:], todo[:-AT_ONCE]
        pose = Span(np.array([lower for _, lower, _ in some]), np.array([upper for _, _, upper in some]))
        found = look(asked, pose)
        tried += len(some)
        if (short := _short(asked, pose, found, tried)) is not None:
            return short
        good = found.proved(asked.margin)
        open_ = open_ if good.all() else found.lacks(asked.margin)
        paths += [some[k][0] for k in np.flatnonzero(good)]
        bounds.append(found.whole[good])
        todo += [half for k in np.flatnonzero(~good) for half in _halves(some[k], found.share[k], pose.radius[k])]
    order = sorted(range(len(paths)), key=lambda k: paths[k])
    return ProvedBoxes(tuple(paths[k] for k in order), np.concatenate(bounds)[order], tried)


def _looks(asked: AskedProof) -> Floats:
    """Poses (N, 5) that are looked at first, since most that falls short shows there: corners, and random ones."""
    corners = np.stack(np.meshgrid(*zip(asked.lower, asked.upper, strict=True)), axis=-1).reshape(-1, 5)
    return np.concatenate([corners, np.random.default_rng(0).uniform(asked.lower, asked.upper, (LOOKS, 5))])


def _carried(asked: AskedProof) -> ProvedBoxes | None:
    """A corner of the region where a carrier would be outside its travel; what it does is linear in the pose."""
    if asked.poses.legs.carried_twice or asked.poses.follows is not None:
        return None
    shift = asked.poses.from_point
    corners = np.stack(np.meshgrid(*zip(asked.lower[:3], asked.upper[:3], strict=True)), axis=-1).reshape(-1, 3)
    carried = (corners + shift) @ asked.poses.split[1].T
    left = np.minimum(carried - asked.carrier_travel[:, 0], asked.carrier_travel[:, 1] - carried).min(axis=1, initial=np.inf)
    k = int(left.argmin())
    return None if left[k] >= 0.0 else _nothing(1, "travel", np.append(corners[k], [0.0, 0.0]), float(left[k]))


def _short(asked: AskedProof, pose: Span, found: Looked, tried: int) -> ProvedBoxes | None:
    """The pose in the middle of a box that is short of what is asked for, the worst of them."""
    bad = np.flatnonzero(~found.reaches_at)
    if len(bad):
        return _nothing(tried, "reach", pose.middle[bad[0]], float("nan"))
    if (worst := int(found.travel_at.argmin()), float(found.travel_at.min()))[1] < asked.travel_margin:
        return _nothing(tried, "travel", pose.middle[worst], float(found.travel_at[worst]))
    at = found.at
    if float(at.min()) < asked.margin:
        row, column = np.unravel_index(int(at.argmin()), at.shape)
        return _nothing(tried, NAMES[int(column)], pose.middle[row], float(at[row, column]))
    apart = found.apart
    if apart is not None and float(apart.at.min()) < 0.0:
        row, column = np.unravel_index(int(apart.at.argmin()), apart.at.shape)
        return replace(_nothing(tried, GAPS[int(column)], pose.middle[row], float(apart.at[row, column])),
                       pair=int(apart.worst[row]))
    return None


def _nothing(tried: int, lack: Shortfall, place: Floats, value: float) -> ProvedBoxes:
    return ProvedBoxes((), np.zeros((0, 3)), tried, lack, place, value)


def _halves(box: tuple[str, Floats, Floats], share: Floats, half: Floats) -> list[tuple[str, Floats, Floats]]:
    path, lower, upper = box
    i = int(np.where(half > 0.0, share, -1.0).argmax())
    middle = 0.5 * (lower[i] + upper[i])
    below, above = upper.copy(), lower.copy()
    below[i] = above[i] = middle
    return [(path + HALVES[0][i], lower, below), (path + HALVES[1][i], above, upper)]
