"""Holes of canned cycles: one correction for all blocks of a hole, so that it stays one, where that is near enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.corrected.arcs import LOOSE
from postproc.corrected.work import Work
from postproc.moves import Moves
from postproc.path import FEED, Path
from toolpaths.arrays import Bools, Floats, Ints

SAME = 1e-6
"""mm: places nearer than this are one"""


def whole_holes(path: Path, nominal: Path, moves: Moves, work: Work, allowed: float) -> tuple[Path, Bools]:
    """The path with holes corrected as a whole, and the blocks (K,) of those, which stay undivided.

    Across the tool every block of a hole is corrected as its bottom is, along the tool as the mean of the bottoms of the
    holes that follow each other. Holes that this takes farther than LOOSE times `allowed` mm from where they belong keep the
    corrections of their blocks and are written out.
    """
    hole = np.where(np.isnan(path.u) | path.home, -1, moves.hole[path.move])
    runs = np.flatnonzero(np.concatenate([[True], np.diff(hole) != 0]))
    whole, q = np.zeros(len(path), dtype=bool), path.q.copy()
    for rows in _sequences(path, hole, runs, work):
        _correct_sequence(path, nominal, rows, work, allowed, q, whole)
    return replace(path, q=q), whole


def _sequences(path: Path, hole: Ints, runs: Ints, work: Work) -> list[list[Ints]]:
    """Holes (their block numbers) that follow each other with one tool in one frame at one orientation."""
    found: list[list[Ints]] = []
    for first, last in zip(runs, np.append(runs[1:], len(hole)), strict=True):
        rows = np.arange(first, last)
        if hole[first] < 0 or first == 0 or not (path.code[rows] == FEED).any() or not _one_place(path, rows, work):
            continue
        joined = found and found[-1][-1][-1] == first - 1 and _one_place(path, np.array([first - 1, first]), work)
        found[-1].append(rows) if joined else found.append([rows])
    return found


def _one_place(path: Path, rows: Ints, work: Work) -> bool:
    """True where blocks share frame, tool and rotary axes."""
    turns = path.q[rows][:, work.rotary]
    return bool((path.frame[rows] == path.frame[rows[0]]).all() and (work.tools[rows] == work.tools[rows[0]]).all()
                and (turns == turns[0]).all())


def _correct_sequence(path: Path, nominal: Path, holes: list[Ints], work: Work, allowed: float, q: Floats,
                      whole: Bools) -> None:
    """Put the joints of the holes that stay whole into `q`, and mark them in `whole`."""
    first = int(holes[0][0])
    kin = work.kinematics(int(work.tools[first]))
    new, old = (p.frames[int(p.frame[first])].control for p in (path, nominal))
    xyz = new.xyz
    bottoms = []
    for rows in holes:
        wanted, got = old.words(nominal.q[rows], kin, 0.0), new.words(path.q[rows], kin, 0.0)
        deepest = int(np.argmin(np.where(path.code[rows] == FEED, wanted[:, xyz[2]], np.inf)))
        bottoms.append((got - wanted)[deepest, xyz])
    along = float(np.mean([d[2] for d in bottoms]))
    for rows, d in zip(holes, bottoms, strict=True):
        rows = _with_lead(nominal, rows, old.words(nominal.q[[rows[0] - 1, rows[0]]], kin, 0.0)[:, xyz], path, work)
        words = new.words(path.q[rows], kin, 0.0)
        words[:, xyz] = old.words(nominal.q[rows], kin, 0.0)[:, xyz] + [d[0], d[1], along]
        joints = new.joints(words, kin, 0.0)
        if (work.off(nominal.q[rows], joints, rows, work.way[rows]) <= LOOSE * allowed).all():
            q[rows], whole[rows] = joints, True


def _with_lead(nominal: Path, rows: Ints, ends: Floats, path: Path, work: Work) -> Ints:
    """The blocks of a hole, with the one before it where that comes down on the same line (ends (2, 3) of both)."""
    lead = rows[0] - 1
    same = np.abs(ends[1, :2] - ends[0, :2]).max() < SAME and not nominal.home[lead] and lead > 0
    if same and path.code[lead] != FEED and _one_place(path, np.array([lead, rows[0]]), work):
        return np.concatenate([[lead], rows])
    return rows
