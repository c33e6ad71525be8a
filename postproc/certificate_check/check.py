"""Whether a certificate proves what it says: boxes that leave no gap, and bounds that another computation confirms.

Everything is computed again from the geometry in the file, with rounding: in each box Y M = I + E for any Y near the inverse
of M in its middle, so the least singular value of M is at least (1 - |E|) / |Y|. Where that does not reach what the file
states, the box is cut, down to `DEEPEST`. The geometry is compared with the machine file, read without the project's
loader. Source of the bound: perturbation of the identity (Golub and Van Loan, 2.3.4).
"""

from __future__ import annotations

import re
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.certificate_check.balls import Ball, FloatArray, ball, product, spectral
from postproc.certificate_check.boxes import Rejected, StatedBox, covering, halves
from postproc.certificate_check.held import held, pose_of
from postproc.certificate_check.legs import legs_in, moving
from postproc.certificate_check.parts import apart

BoolArray = NDArray[np.bool_]
DEEPEST, AT_ONCE = 14, 1_000
"""cuts of a box of the file; boxes at a time"""
LETTERS = "xyztn"
"""directions of halves"""
SPANS = ("x_mm", "y_mm", "z_mm", "tilt_rad", "heading_rad")
BOUNDS, GAPS = ("direct", "inverse", "held"), ("parts", "stops")
FORM, COVERS = 2, ("workspace", "region")
"""of the file that this check reads; what a certificate may be of"""
NONE_THERE = 9e5
"""a distance that is stated of parts, or stops, that a machine has not"""
_LINE = re.compile(r"(\.|[xyztnXYZTN]{1,64})((?: \S+)+)")


NO_CERTIFICATE = (KeyError, TypeError, ValueError, IndexError, AttributeError, ArithmeticError)
"""what reading a file of another form may raise"""


def confirmed(found: dict[str, Any]) -> dict[str, Any]:
    """What the certificate proves: least bounds, number of boxes.

    Raises:
        Rejected: where it does not.
    """
    try:
        margin = _margins(found)
        boxes = _boxes(found)
        least = np.min([box.stated for box in boxes], axis=0)
        if {name: float(v) for name, v in zip(_names(found), least, strict=True)} != found["proved"]:
            raise Rejected(f"`proved` says {found['proved']}, the boxes have {least.tolist()}")
        if not least[:3].min() >= margin:
            box = min(boxes, key=lambda one: float(one.stated[:3].min()))
            raise Rejected(f"box {box.path or '.'} states {box.stated[:3].min():g}, less than the margin {margin:g}")
        if len(least) > len(BOUNDS) and not least[3:].min() >= 0.0:
            box = min(boxes, key=lambda one: float(one.stated[3:].min()))
            raise Rejected(f"box {box.path or '.'} states that parts touch ({box.stated[3:].min():g})")
        _carriers(found)
        looked, region = _prove(found, boxes), _region(found["region"])
    except NO_CERTIFICATE as fault:
        if isinstance(fault, Rejected):
            raise
        raise Rejected(f"it is no certificate of this form: {type(fault).__name__}: {fault}") from fault
    return {"region": region} | {"boxes": len(boxes), "looked_at": looked, "margin": margin} | {
        f"{name}_at_least": float(v) for name, v in zip(_names(found), least, strict=True) if v < NONE_THERE}


def _names(found: dict[str, Any]) -> tuple[str, ...]:
    """What a box states: with the distances of parts where the geometry has them."""
    return BOUNDS if found["geometry"]["parts"] is None else (*BOUNDS, *GAPS)


def _region(region: dict[str, Any]) -> dict[str, Any]:
    """Of which point, and its poses, mm and degrees."""
    spans = {name: np.array(region[name], np.float64) for name in SPANS}
    return {"of": region["of"], "tool_mm": float(region["tool_mm"])} | {
        name.replace("_rad", "_deg"): (np.degrees(v) if name.endswith("_rad") else v).tolist() for name, v in spans.items()}


def _margins(found: dict[str, Any]) -> float:
    """The margin; all that says how the rest is meant has to be what this check knows: a negative margin, or one that is no
    number, would let any bound pass."""
    if found["certificate"] != FORM or found["covers"] not in COVERS:
        raise Rejected(f"form {found['certificate']!r} of a certificate that covers {found['covers']!r} is not known here")
    if not isinstance(found["travel_proved"], bool):
        raise Rejected(f"`travel_proved` is {found['travel_proved']!r}, neither true nor false")
    margin, travel = float(found["margin"]), float(found["travel_margin"])
    if not (0.0 < margin < np.inf and 0.0 <= travel < np.inf):
        raise Rejected(f"a margin of {margin:g}, {travel:g} of the travel, proves nothing")
    return margin


def _boxes(found: dict[str, Any]) -> list[StatedBox]:
    """The boxes of the file, which must cover the region without a gap."""
    lines = found["boxes"]
    if sha256("\n".join(lines).encode()).hexdigest() != found["digest"]:
        raise Rejected("the boxes are not those that its digest was taken of")
    stated: dict[str, FloatArray] = {}
    for line in lines:
        read = _LINE.fullmatch(line)
        if read is None:
            raise Rejected(f"{line!r} is no box")
        path = "" if read[1] == "." else read[1]
        if path in stated:
            raise Rejected(f"box {read[1]} is there twice")
        stated[path] = np.array([float(v) for v in read[2].split()])
        if not np.isfinite(stated[path]).all() or len(stated[path]) != len(_names(found)):
            raise Rejected(f"{line!r} states no {len(_names(found))} numbers")
    spans = np.array([found["region"][name] for name in SPANS], np.float64)
    if not (np.isfinite(spans).all() and (spans[:, 0] <= spans[:, 1]).all()):
        raise Rejected(f"the region {spans.tolist()} is empty")
    return covering(stated, spans, LETTERS, lambda at: f"x, y, z, tilt, heading {', '.join(f'{v:g}' for v in at)} (mm, rad)")


def _prove(found: dict[str, Any], boxes: list[StatedBox]) -> int:
    """Confirm all boxes; how many were looked at, parts included."""
    shift = _shift(found["region"], found["geometry"])
    todo, count = list(boxes), 0
    while todo:
        some, todo = todo[-AT_ONCE:], todo[:-AT_ONCE]
        count += len(some)
        lower, upper, stated = (np.array([getattr(box, name) for box in some]) for name in ("lower", "upper", "stated"))
        with np.errstate(invalid="ignore", over="ignore"):  # what is not known is infinite, and confirms nothing
            good, over, worst = _looked(found, shift, lower, upper, stated)
        for k in np.flatnonzero(np.logical_not(good)):
            box = some[int(k)]
            where = ", ".join(f"{v:.6g}" for v in 0.5 * (box.lower + box.upper))
            if over[k]:
                raise Rejected(f"box {box.path or '.'} states more than there is at x, y, z, tilt, heading {where} (mm, "
                               f"rad): {over[k]}")
            if box.cuts >= DEEPEST:
                raise Rejected(f"box {box.path or '.'}, round {where} (mm, rad), is not confirmed: its bounds are too close")
            todo += halves(box, int(worst[k]), LETTERS)
    return count


def _shift(region: dict[str, Any], geometry: dict[str, Any]) -> FloatArray:
    """(3,) from the point of the region to the platform's reference point, platform level."""
    if region["of"] == "platform":
        return np.zeros(3)
    if region["of"] != "tip":
        raise Rejected(f"the region is of {region['of']!r}, neither of the tip nor of the platform")
    return np.array([0.0, 0.0, float(region["tool_mm"])]) - np.array(geometry["gauge"], np.float64)


def _looked(found: dict[str, Any], shift: FloatArray, lower: FloatArray, upper: FloatArray,
            stated: FloatArray) -> tuple[FloatArray, list[str], FloatArray]:
    """(confirmed (N,), what speaks against a box, number of the pose to cut (N,))."""
    geometry = found["geometry"]
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    radius = half * (1.0 + 1e-12) + 1e-12 * np.abs(middle)
    numbers = [ball(middle[:, i]) for i in range(5)], [Ball(middle[:, i], radius[:, i]) for i in range(5)]
    poses = pose_of(geometry, shift, numbers[0]), pose_of(geometry, shift, numbers[1])
    here, over = (legs_in(geometry, shift, pose) for pose in poses)
    count, free, every = _counted(geometry, here.rows)
    matrix, rates = _matrix(here.rows), [_matrix([row[i] for row in over.rates]) for i in range(5)]
    direct = _least(matrix[:, :count][:, :, free], [rate[:, :count][:, :, free] for rate in rates], radius)
    whole = _least(matrix[:, :, every], [rate[:, :, every] for rate in rates], radius)
    cosine = np.min([one.least() for one in over.cosine], axis=0)
    reaches = np.all([one.least() > 0.0 for one in over.under], axis=0)
    good = reaches & (direct[0] >= stated[:, 0]) & (cosine >= stated[:, 1]) & (whole[0] >= stated[:, 2])
    inside, outside = _travel(found, here.q, over.q)
    at = np.stack([direct[1], np.min([one.most() for one in here.cosine], axis=0), whole[1]], axis=1)
    least_known = half if poses[1].standing is None else poses[1].standing.moved
    share = np.where(np.isfinite(direct[2] + whole[2]), direct[2] + whole[2], least_known)
    if poses[1].standing is not None and poses[0].standing is not None and found["travel_proved"] is True:
        within, beyond = _carriers_here(geometry, poses[0].standing.carried, poses[1].standing.carried)
        inside, outside = inside & within, outside | beyond
        share = np.where((good & ~within)[:, None], poses[1].standing.moved, share)
    if geometry["parts"] is not None:
        gap, gap_at, moved = apart(geometry, shift, poses, here, over, half)
        only = good & (gap < stated[:, 3:]).any(axis=1) & (moved.sum(axis=1) > 0.0)
        share = np.where(only[:, None], moved, share)
        good, at = good & (gap >= stated[:, 3:]).all(axis=1), np.column_stack([at, gap_at])
    against = [_against(at[k], stated[k], bool(outside[k]), bool(np.any([one.most()[k] < 0.0 for one in here.under])))
               for k in range(len(lower))]
    return good & inside, against, np.where(half > 0.0, share, -1.0).argmax(axis=1)


def _counted(geometry: dict[str, Any], rows: list[list[Ball]]) -> tuple[int, list[int], list[int]]:
    """(rows that set the platform's freedoms, columns of these, columns of all motions that must be held)."""
    if held(geometry):
        count, free = len(geometry["legs"]) + len(geometry["bed"]) + len(geometry["platform"]), list(range(6))
    else:
        count, free = len(geometry["legs"]), ["xyzabc".index(letter) for letter in geometry["freedoms"]]
    every = [0, 1, 2, 3, 4, 5] if "z" in geometry["freedoms"] else [0, 1, 5]
    every += range(6, len(rows[0]))
    return count, free, every if len(rows) >= len(every) else free  # else the file states too few rods to hold more


def _carriers_here(geometry: dict[str, Any], here: list[Ball], over: list[Ball]) -> tuple[BoolArray, BoolArray]:
    """(inside their travel everywhere (N,), outside in the middle (N,)) of carriers that take up what follows; 1 of none."""
    n = len(here[0].m) if here else 1
    inside, outside = np.ones(n, bool), np.zeros(n, bool)
    for one, at, q in zip(geometry["carriers"], here, over, strict=True):
        low, high = (sign * np.inf if end is None else float(end) for sign, end in zip((-1, 1), one["travel"], strict=True))
        inside &= (q.least() >= low) & (q.most() <= high)
        outside |= (at.most() < low - 1e-9) | (at.least() > high + 1e-9)
    return inside, outside


def _against(at: FloatArray, stated: FloatArray, outside: bool, short: bool) -> str:
    if short:
        return "a leg does not reach"
    if outside:
        return "a drive is outside its travel"
    less = [f"{name} is {value:.4g}, stated {due:g}" for name, value, due in zip(
        (*BOUNDS, *GAPS)[:len(at)], at, stated, strict=True) if value < due * (1.0 - 1e-9) - 1e-9]
    return "; ".join(less)


def _matrix(rows: list[list[Ball]]) -> Ball:
    """(N, R, 6)"""
    return Ball(np.stack([np.stack([one.m for one in row], axis=-1) for row in rows], axis=1),
                np.stack([np.stack([one.r for one in row], axis=-1) for row in rows], axis=1))


def _least(matrix: Ball, rates: list[Ball], half: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(lower bound of the least singular value over boxes, its value in the middles, share of each number of the pose)."""
    fine = np.asarray(np.isfinite(matrix.m).all(axis=(1, 2)) & np.isfinite(matrix.r).all(axis=(1, 2)))
    rows = np.where(fine[:, None, None], matrix.m, 0.0)
    near = np.linalg.pinv(rows)
    off = product(near, Ball(rows, np.where(fine[:, None, None], matrix.r, 0.0)))
    off = Ball(off.m - np.eye(rows.shape[2]), off.r)
    some = half > 0.0
    share = np.stack([np.where(some[:, i], spectral(product(near, rate)), 0.0) for i, rate in enumerate(rates)], axis=1)
    share = np.where(some, np.nan_to_num(share, nan=np.inf, posinf=np.inf) * np.where(some, half, 1.0), 0.0)
    size = np.linalg.norm(near, ord=2, axis=(1, 2)) * (1.0 + 1e-10)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bound = np.where(fine & (size > 0.0), (1.0 - spectral(off) - share.sum(axis=1)) / size * (1.0 - 1e-12), -np.inf)
    at = np.where(fine, np.linalg.svd(rows, compute_uv=False)[:, -1], np.inf)
    return bound, at, share


def _travel(found: dict[str, Any], here: list[Ball], over: list[Ball]) -> tuple[BoolArray, BoolArray]:
    """(inside the travel everywhere (N,), outside in the middle (N,)); angles may be counted whole turns apart."""
    inside, outside = np.ones(len(here[0].m), bool), np.zeros(len(here[0].m), bool)
    margin = float(found["travel_margin"])
    if found["travel_proved"] is not True:
        return inside, outside
    for leg, at, q in zip(found["geometry"]["legs"], here, over, strict=True):
        low, high = (sign * np.inf if end is None else float(end) for sign, end in zip((-1, 1), leg["travel"], strict=True))
        turns = 2.0 * np.pi * np.floor((at.m - low) / (2.0 * np.pi)) if leg["drive"] == "arm" and np.isfinite(low) else 0.0
        inside &= (q.least() - turns >= low + margin) & (q.most() - turns <= high - margin)
        outside |= (at.m - turns < low + margin - 1e-9) | (at.m - turns > high - margin + 1e-9)
    return inside, outside


def _carriers(found: dict[str, Any]) -> None:
    """Carriers inside their travel over the whole region; what they do is linear in it."""
    if found["travel_proved"] is not True or not found["geometry"]["carriers"] \
            or set(found["geometry"]["freedoms"]) >= set("xyz") or held(found["geometry"]):  # seen from them; box by box
        return
    share, shift = moving(found["geometry"])[1], _shift(found["region"], found["geometry"])
    spans = np.array([found["region"][name] for name in SPANS[:3]], np.float64) + shift[:, None]
    corners = np.stack(np.meshgrid(*spans), axis=-1).reshape(-1, 3) @ share.T
    for one, low, high in zip(found["geometry"]["carriers"], corners.min(axis=0), corners.max(axis=0), strict=True):
        least, most = one["travel"]
        if (least is not None and low < least - 1e-9) or (most is not None and high > most + 1e-9):
            raise Rejected(f"carrier {one['letter']} goes from {low:g} to {high:g} mm, outside its travel")
