"""Boxes of a certificate's file: they cover its region without a gap, and are cut where they do not confirm as they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from postproc.certificate_check.balls import FloatArray


class Rejected(ValueError):
    """The certificate does not prove what it says; the message says where."""


@dataclass(frozen=True)
class StatedBox:
    """A box of the file, or a part of it: its path of halves, ends (D,), what is stated of it (S,), cuts so far."""

    path: str
    lower: FloatArray
    upper: FloatArray
    stated: FloatArray
    cuts: int = 0


def covering(stated: Mapping[str, FloatArray], spans: FloatArray, letters: str,
             place: Callable[[FloatArray], str]) -> list[StatedBox]:
    """The boxes of a region, ends `spans` (D, 2), by what is stated of each path (S,).

    Args:
        letters: of the directions, small ones; a path has the capital for an upper half
        place: the middle (D,) of a box in words

    Raises:
        Rejected: where they leave a gap, or one holds another.
    """
    boxes: list[StatedBox] = []
    todo = [StatedBox("", spans[:, 0], spans[:, 1], np.zeros(0))]
    inner = {path[:k]: letters.index(path[k].lower()) for path in stated for k in range(len(path))}
    while todo:
        box = todo.pop()
        if box.path in stated:
            if box.path in inner:
                raise Rejected(f"box {box.path or '.'} holds others")
            boxes.append(StatedBox(box.path, box.lower, box.upper, stated[box.path]))
        elif box.path in inner and inner[box.path] < len(spans):
            todo += halves(box, inner[box.path], letters)
        else:
            raise Rejected(f"no box covers {box.path or 'the region'}, round {place(0.5 * (box.lower + box.upper))}")
    if len(boxes) < len(stated):
        raise Rejected(f"{len(stated) - len(boxes)} boxes are of another division than the others")
    return boxes


def halves(box: StatedBox, i: int, letters: str) -> list[StatedBox]:
    """A box cut in direction i."""
    middle = 0.5 * (box.lower[i] + box.upper[i])
    below, above = box.upper.copy(), box.lower.copy()
    below[i] = above[i] = middle
    return [StatedBox(box.path + letters[i], box.lower, below, box.stated, box.cuts + 1),
            StatedBox(box.path + letters[i].upper(), above, box.upper, box.stated, box.cuts + 1)]
