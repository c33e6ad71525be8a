"""Columns of numbers as few bytes: whole steps of a stated size, their differences, byte by byte, deflated."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from toolpaths.arrays import Floats, Ints, shared
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LEVEL = 6
"""of deflate"""
NO_VALUE = -(2**31)
"""whole number that stands for NaN"""


@dataclass(frozen=True)
@arrays(values="P")
class Column:
    """A figure at P points: `values` (P,) in its unit, NaN where there is none, kept to whole multiples of `step`."""

    name: str
    values: Floats
    step: float
    unit: str = ""


def packed(columns: Sequence[Column]) -> tuple[bytes, list[dict[str, Any]]]:
    """The columns deflated one behind the other, and what is needed to read them: name, unit, step, count, planes.

    A value v is the whole number round(v / step), NaN is NO_VALUE. A column holds the differences d of neighbours (the
    first from 0), modulo 2^32, as 2 d of d >= 0 and -2 d - 1 of d < 0; of these all lowest bytes stand first, then all
    second bytes, as many planes as the greatest needs.
    """
    parts, heads = list[bytes](), list[dict[str, Any]]()
    for one in columns:
        zigzag = _zigzag(_whole(one.values, one.step))
        planes = max(1, (int(zigzag.max(initial=0)).bit_length() + 7) // 8)
        spread = zigzag.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :planes]
        parts.append(np.ascontiguousarray(spread.T).tobytes())
        heads.append({"name": one.name, "unit": one.unit, "step": one.step, "count": len(one.values), "planes": planes})
    return zlib.compress(b"".join(parts), LEVEL), heads


def unpacked(data: bytes, heads: Sequence[dict[str, Any]]) -> dict[str, Floats]:
    """The columns of `packed` by their names, as a reader of the JSON gets them."""
    plain, at, found = np.frombuffer(zlib.decompress(data), dtype=np.uint8), 0, dict[str, Floats]()
    for head in heads:
        count, planes = int(head["count"]), int(head["planes"])
        zigzag = np.zeros((count, 4), dtype=np.uint8)
        zigzag[:, :planes] = plain[at:at + count * planes].reshape(planes, count).T
        at += count * planes
        numbers = zigzag.view("<u4")[:, 0]
        steps = (numbers >> 1).astype(np.int64) ^ -(numbers & 1).astype(np.int64)
        whole = np.cumsum(steps).astype(np.int32).astype(np.int64)
        found[head["name"]] = shared(np.where(whole == NO_VALUE, np.nan, whole * float(head["step"])))
    return found


def text_of(data: bytes) -> str:
    """Bytes as the page and the JSON hold them."""
    return base64.b64encode(data).decode("ascii")


def _whole(values: Floats, step: float) -> Ints:
    """Whole multiples of the step; what a whole number of 32 bits cannot hold is no value."""
    scaled = np.round(np.asarray(values, dtype=np.float64) / step)
    held = np.isfinite(scaled) & (np.abs(scaled) < 2.0**31)
    return np.where(held, np.where(held, scaled, 0.0), NO_VALUE).astype(np.int64)


def _zigzag(whole: Ints) -> Ints:
    """Differences of neighbours modulo 2^32 as whole numbers from 0, small where the difference is."""
    steps = np.diff(whole, prepend=0).astype(np.int64)
    steps = (steps + 2**31) % 2**32 - 2**31
    return np.asarray(np.where(steps >= 0, 2 * steps, -2 * steps - 1), dtype=np.int64)
