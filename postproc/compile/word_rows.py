"""The words of a path: each block's under its own law and tool, rounded, and which of them it states."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_AXIS
from postproc.control.word_grid import WordGrid
from postproc.path.model import ARC, FEED, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, distinct, slices
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

SNAP = 2.5
"""X, Y, Z residues next to a rotary move, in units of the last decimal, that are not written"""


@dataclass(frozen=True)
@arrays(end="K J", start="K J", write="K J")
class WordRows:
    """Words (K, J) at the end and, in the same meaning, at the start of each block, rounded; `write` those it states."""

    end: Floats
    start: Floats
    write: Bools


def word_rows(path: JointPath, moves: Moves, control: Control, kinematics: Callable[[int], Kinematics],
              lengths: Callable[[int], float], grid: WordGrid, again: Ints, made_up: bool = False,
              bidirectional: Sequence[int] = (), exact: bool = False) -> WordRows:
    """The words of all blocks; `lengths` gives the gauge length of the tool of an index, `grid` says their
    decimals, `again` the blocks that state every axis, `made_up` as in `Rounding`; `bidirectional` joints
    lose motion, see `_held`; `exact` ends of CL moves keep the last decimals of their words."""
    begins = np.flatnonzero(np.diff(path.frame)) + 1
    tool = block_tools(path, moves)
    rounds = grid if made_up else None
    end = unrounded_words(path, path.q, np.arange(len(path)), tool, kinematics, lengths, rounds)
    end = grid.rounded(end)  # one behind the other: each takes as much room as the path
    end = grid.rounded(_snapped(end, path, control, grid.grain, exact))
    end = _flat(grid.rounded(_held(end, path, control, tool, grid.places, bidirectional)), path, control)
    start = np.concatenate([end[:1], end[:-1]])
    before = unrounded_words(path, path.q[begins - 1], begins, tool, kinematics, lengths, rounds)
    start[begins] = grid.rounded(before)
    return WordRows(end, start, _written(end, start, distinct(np.concatenate([begins, again])), path, control))


def block_tools(path: JointPath, moves: Moves) -> Ints:
    """(K,) tool of each block; blocks before a tool change still carry the tool that leaves, none before the first."""
    leaving = np.arange(len(path)) < path.begin[path.move]
    before = np.where(path.move > 0, moves.tool[np.maximum(path.move - 1, 0)], -1)
    return np.asarray(np.where(leaving, before, moves.tool[path.move]))


def unrounded_words(path: JointPath, q: Floats, rows: Ints, tool: Ints, kinematics: Callable[[int], Kinematics],
                    lengths: Callable[[int], float], rounds: WordGrid | None = None) -> Floats:
    """Unrounded words of joints q (K, J) under the law and with the tool of the blocks `rows` (K,).

    With `rounds` rotary words are rounded first where words are machine coordinates, and the slides are
    those that then bring the tip to its place.
    """
    words = np.empty_like(q)
    for k in groups(path.frame[rows], tool[rows]):
        index = int(tool[rows[k[0]]])
        law, kin = path.frames[int(path.frame[rows[k[0]]])].control, kinematics(index)
        for some in (k[part] for part in slices(len(k))):
            at = q[some] if rounds is None or law.law != "axes" else _made_up(q[some], law, kin, rounds)
            words[some] = law.words(at, kin, lengths(index))
    return words


def joints_of(path: JointPath, words: Floats, rows: Ints, tool: Ints, kinematics: Callable[[int], Kinematics],
              lengths: Callable[[int], float]) -> Floats:
    """Joints (N, J) that words (N, J) under the law and with the tool of the blocks `rows` (N,) mean; tool (K,)."""
    q = np.empty_like(words)
    for k in groups(path.frame[rows], tool[rows]):
        index = int(tool[rows[k[0]]])
        q[k] = path.frames[int(path.frame[rows[k[0]]])].control.joints(words[k], kinematics(index),
                                                                       lengths(index))
    return q


def with_turns(q: Floats, turns: Floats, path: JointPath, rows: Ints, tool: Ints, kinematics: Callable[[int], Kinematics],
               made_up: bool) -> Floats:
    """Joints (N, J) with the rotary joints of `turns` (N, J) that are written as q (N, J) is, by blocks `rows` (N,)."""
    result = np.where(path.frames[0].control.machine.rotary, turns, q)
    for k in groups(path.frame[rows], tool[rows]):
        law, kin = path.frames[int(path.frame[rows[k[0]]])].control, kinematics(int(tool[rows[k[0]]]))
        if law.law != "axes" or made_up:
            result[k] = kin.at_tip(kin.forward(q[k])[0], result[k], law.slides) if kin.straight_slides else q[k]
    return result


def _made_up(q: Floats, law: Control, kin: Kinematics, grid: WordGrid) -> Floats:
    """Joints with rounded rotary words and the tip of q (K, J)."""
    turned, rotary = q.copy(), law.rotary
    turned[:, rotary] = grid.rounded(q * law.unit)[:, rotary] / law.unit[rotary]
    moved = np.flatnonzero((turned != q).any(axis=1))
    turned[moved] = kin.at_tip(kin.forward(q[moved])[0], turned[moved], law.slides)
    return turned


def _snapped(words: Floats, path: JointPath, control: Control, grain: Floats, exact: bool) -> Floats:
    """Words (rounded) without tiny X, Y, Z residues next to a rotary move.

    Under inverse time LinuxCNC takes the length of X, Y, Z alone where any of them moves, so that a residue
    of rounding would set the speed of the whole block. What is left out is at most SNAP last decimals, and
    never adds up: each block is compared with the last written position. Ends of CL moves that must be `exact` keep them.
    """
    slides, rotary = control.slides, control.rotary
    if not len(rotary) or len(words) < 2:
        return words
    snap = SNAP * grain[slides]
    turning = (path.code[1:] == FEED) & (path.frame[1:] == path.frame[:-1]) & ~(exact & (path.u[1:] == 1.0))
    found = list[Ints]()
    for part in slices(len(turning)):
        before, here = words[:-1][part], words[1:][part]
        turning[part] &= (here[:, rotary] != before[:, rotary]).any(axis=1)
        step = np.abs(here[:, slides] - before[:, slides])
        found.append(part.start + 1 + np.flatnonzero(turning[part] & (step <= snap).all(axis=1) & (step > 0.0).any(axis=1)))
    rows = np.concatenate(found)
    if not len(rows):
        return words
    wanted = words.copy()
    todo = set(rows.tolist())
    for k in rows.tolist():
        while k in todo or (k < len(words) and (words[k - 1, slides] != wanted[k - 1, slides]).any()):
            todo.discard(k)
            if not turning[k - 1] or (np.abs(wanted[k, slides] - words[k - 1, slides]) > snap).any():
                break
            words[k, slides] = words[k - 1, slides]
            k += 1
            if k >= len(words):
                break
    return words


def _held(words: Floats, path: JointPath, control: Control, tool: Ints, places: Ints,
          joints: Sequence[int]) -> Floats:
    """Words (rounded) in which rotary axes among `joints` never turn back by one last decimal: the word before stays.

    An axis that loses motion would have another error there, more than the decimal is worth. What is left out never adds
    up: each block is compared with the last written position. Slides have their words from
    `postproc.correction.backlash_words`.
    """
    turning = [j for j in joints if j in control.rotary]
    if not turning:
        return words
    same = np.append(False, (np.diff(path.frame) == 0) & (np.diff(tool) == 0))
    same &= ~path.home & ~np.append(False, path.home[:-1])
    same &= np.array([frame.control.law != "tilted" for frame in path.frames])[path.frame]
    result = words.copy()
    for j in turning:
        along = np.where(same, 0.0, np.diff(path.q[:, j], prepend=path.q[:1, j]))
        counts = np.round(words[:, j] * 10.0 ** places[j])
        result[:, j] = _walked(counts, same, np.sign(along)) / 10.0 ** places[j]
    return result


def _walked(counts: Floats, same: Bools, along: Floats) -> list[float]:
    """Last decimals (K,) one after the other, those that turn back by one left out.

    `same` (K,) False where a word means another place than the one before: there `along` (K,) says which path it went.
    """
    result, travel, last = [], 0.0, 0.0
    for count, goes_on, sign in zip(counts.tolist(), same.tolist(), along.tolist(), strict=True):
        step = count - last
        if goes_on and abs(step) == 1.0 and step * travel < 0.0:
            count = last
        elif (step if goes_on else sign) != 0.0:
            travel = 1.0 if (step if goes_on else sign) > 0.0 else -1.0
        last = count
        result.append(count)
    return result


def _flat(words: Floats, path: JointPath, control: Control) -> Floats:
    """Words whose arcs do not rise in planes in which the control has no helix: rounding may part their ends."""
    goes_on = np.append(False, np.diff(path.frame) == 0)
    for law, k in path.by_control():
        for row in k[(path.code[k] == ARC) & ~np.isin(path.plane[k], law.helix_planes) & goes_on[k]].tolist():
            third = int(control.xyz[PLANE_AXIS[int(path.plane[row])]])
            words[row, third] = words[row - 1, third]
    return words


def _written(end: Floats, start: Floats, again: Ints, path: JointPath, control: Control) -> Bools:
    """Words (K, J) that a block states: those it names, else those that change; both plane words of an arc.

    The blocks `again` state all, the first under another law among them; in a tilted plane rotary axes have no words.
    """
    names = np.asarray(path.state.any(axis=1))
    first = np.zeros(len(path), dtype=bool)
    first[again] = True
    changed: Bools = (end != start) | first[:, None]
    write: Bools = np.asarray(np.where(names[:, None], path.state, changed))
    for row in np.flatnonzero(path.code == ARC).tolist():
        third = PLANE_AXIS[int(path.plane[row])]
        write[row, [c for i, c in enumerate(control.xyz) if i != third]] = True
    for law, k in path.by_control():
        if law.law == "tilted":
            write[np.ix_(k, control.rotary)] = False
    return write
