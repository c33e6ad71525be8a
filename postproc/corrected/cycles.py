"""Holes of canned cycles: one correction for all blocks of a hole, so that it stays one, where that is near enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.corrected.arcs import LOOSE
from postproc.corrected.work import ALONE, Work
from postproc.moves import Moves
from postproc.path import FEED, Path
from toolpaths.arrays import Floats, Ints

SAME = 1e-6
"""mm: places nearer than this are one"""


def whole_holes(path: Path, nominal: Path, moves: Moves, work: Work, allowed: float) -> tuple[Path, Ints]:
    """The path with holes corrected as a whole, and the hole (K,) that each block is of, ALONE for those of none.

    Every block of a hole is corrected as its bottom is, but for the levels above the plane that drilling begins at: along
    the tool these get the correction of the block that the tool comes from to the first of the holes that follow each
    other. So distances from plane to bottom, and with them the pecks, stay as they are. Holes that this takes farther than
    LOOSE times `allowed` mm from where they belong keep the corrections of their blocks and are written out.
    """
    hole = np.where(np.isnan(path.u) | path.home, -1, moves.hole[path.move])
    runs = np.flatnonzero(np.concatenate([[True], np.diff(hole) != 0]))
    whole, q = np.full(len(path), ALONE), path.q.copy()
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
                      whole: Ints) -> None:
    """Put the joints of the holes that stay whole into `q`, and mark them in `whole`."""
    lead = int(holes[0][0]) - 1
    kin = work.kinematics(int(work.tools[lead + 1]))
    new, old = (p.frames[int(p.frame[lead + 1])].control for p in (path, nominal))
    xyz, z = new.xyz, new.xyz[2]
    came = float((new.words(path.q[[lead]], kin, 0.0) - old.words(nominal.q[[lead]], kin, 0.0))[0, z])
    for rows in holes:
        wanted, got = old.words(nominal.q[rows], kin, 0.0)[:, xyz], new.words(path.q[rows], kin, 0.0)
        feeds = np.flatnonzero(path.code[rows] == FEED)
        if np.ptp(wanted[max(int(feeds[0]) - 1, 0):, :2], axis=0).max() > SAME:
            continue  # not along Z of the words: no control drills it by itself
        bottom = int(feeds[np.argmin(wanted[feeds, 2])])
        plane = wanted[max(int(feeds[0]) - 1, 0), 2]
        off = got[bottom, xyz] - wanted[bottom]
        got[:, xyz] = wanted + off
        got[:, z] = wanted[:, 2] + np.where(wanted[:, 2] <= plane + SAME, off[2], came)
        joints, way = new.joints(got, kin, 0.0), np.tile(work.way[rows[bottom]], (len(rows), 1))
        if (work.off(nominal.q[rows], joints, rows, way) <= LOOSE * allowed).all():
            q[rows], whole[rows] = joints, rows[0]
