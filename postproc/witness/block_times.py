"""How long blocks take by their F words: the length that a feed refers to, by the rule of the control, over the feed."""

from __future__ import annotations

from typing import Literal

import numpy as np

from postproc.witness.evidence import ExecutedBlocks
from postproc.witness.text import Array

_STILL = 1e-7
"""mm or degrees by which a word that stands still may differ"""
_SHORT = 0.2
"""rad below which an arc is as long as its chord, but for the second power of its angle"""
_CHUNK = 20_000
_KINDS = ("XYZ", "UVW", "ABC")


def seconds_of(e: ExecutedBlocks, length: Array, unit: Array) -> Array:
    """(E,) s of every block at the feed in force, which refers to `length` (E,) in `unit` (E,); meaningless for rapids."""
    share = np.where(np.isfinite(e.sweep), np.abs(e.sweep), 1.0) if e.by_angle else 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(60.0 * np.where(e.inverse, share, length / unit) / e.feed)


def lengths_of(e: ExecutedBlocks) -> tuple[Array, Array]:
    """(E,) mm or degrees of every block that its feed per minute refers to, (E,) the unit of the feed: 25.4 for inch.

    Per minute the feed is that of the tip where X, Y, Z are the tip; of machine coordinates by `rule`: "all" the
    root of the squares of all words, "geometry" X, Y, Z before all others, else X, Y, Z before U, V, W before
    A, B, C. In inverse time a block takes 1/F minutes, an arc its angle over F where the control has it so.
    """
    length, unit = np.empty(len(e)), np.ones(len(e))
    for first in range(0, len(e), _CHUNK):
        rows = np.arange(first, min(first + _CHUNK, len(e)))
        step = e.steps(rows)
        linear = (np.abs(step[:, [name not in "ABC" for name in e.words]]) > _STILL).any(axis=1)
        unit[rows] = np.where(linear, e.unit[rows], 1.0)
        if e.degree_is_inch:
            step = step * np.where([name in "ABC" for name in e.words], unit[rows, None], 1.0)
        length[rows] = np.where(e.by_tip[rows], _first_of(np.where(np.abs(step) > _STILL, step, 0.0), e.words, _KINDS),
                                _by_rule(step, e.words, e.rule))
    arcs = np.flatnonzero((e.code == 2) & np.isfinite(e.sweep))
    if len(arcs):
        length[arcs], unit[arcs] = _arc_lengths(e, arcs), e.unit[arcs]
    return length, unit


def _by_rule(step: Array, letters: tuple[str, ...], rule: Literal["xyz-first", "geometry", "all"]) -> Array:
    if rule == "all":
        return np.asarray(np.sqrt(np.einsum("ni,ni->n", step, step)))
    rest = "".join(name for name in letters if name not in "XYZ")
    return _first_of(step, letters, ("XYZ", rest) if rule == "geometry" else _KINDS)


def _first_of(step: Array, letters: tuple[str, ...], kinds: tuple[str, ...]) -> Array:
    """(K,) length over the first of the groups of letters that moves at all."""
    result = np.zeros(len(step))
    for group in reversed(kinds):
        part = step[:, [name in group for name in letters]]
        size = np.sqrt(np.einsum("ni,ni->n", part, part))
        result = np.where(size > 0.0, size, result)
    return result


def _arc_lengths(e: ExecutedBlocks, rows: Array) -> Array:
    """(K,) mm along arcs and helices, by three places of each: the path to the middle says the radius."""
    start, middle, end = (e.poses_at(rows, np.full(len(rows), t))[0] for t in (0.0, 0.5, 1.0))
    angle = np.abs(e.sweep[rows])
    chord = end - start
    bow = middle - 0.5 * (start + end)
    whole, high = np.sqrt(np.einsum("ni,ni->n", chord, chord)), np.sqrt(np.einsum("ni,ni->n", bow, bow))
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = high / (1.0 - np.cos(0.5 * angle))
        rise = np.sqrt(np.maximum(whole**2 - (2.0 * radius * np.sin(0.5 * angle)) ** 2, 0.0))
        flat = whole * np.where(angle > 0.0, 0.5 * angle / np.sin(0.5 * np.where(angle > 0.0, angle, 1.0)), 1.0)
    return np.asarray(np.where(angle < _SHORT, flat, np.hypot(radius * angle, rise)))
